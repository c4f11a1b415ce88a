"""A line whose running surface was measured: its FMU carries the profile, and strips ride on it."""

from __future__ import annotations

import re
import zipfile

import numpy as np
import pytest

from fmus.builder.fmu_build import build
from fmus.builder.recipe import BuildError, fingerprint, recipe
from fmus.builder.watched_places import watched_places
from master.fmu import fmu_provision
from models.library.catalogue import load_lumped
from models.library.definition_copy import CopyError, profile_of_copy
from models.pantograph.lumped.lumped_part import LumpedPantographPart
from tests.fmus.support import Instance
from tests.models.rigid_line import SPEED, amplitude, pressing, write_rigid_line

SHORT, HEIGHT, PRINTED = 2.0, 0.5e-3, 10.40


@pytest.fixture(scope="module")
def line(tmp_path_factory):
    return write_rigid_line(tmp_path_factory.mktemp("line"), 14, SHORT, HEIGHT)


@pytest.fixture(scope="module")
def fmu(line, tmp_path_factory):
    return build(recipe(str(line)), tmp_path_factory.mktemp("fmu"))


def test_the_fmu_carries_the_profile_wherever_it_lay(line, fmu, tmp_path):
    with zipfile.ZipFile(fmu) as file:
        carried = file.read("resources/running_surface.csv")
    assert carried == (line.parent / "wave.csv").read_bytes()
    (tmp_path / "lines").mkdir()
    moved = tmp_path / "lines" / "rigid.toml"
    moved.write_text(line.read_text().replace('"wave.csv"', '"../measured/wave.csv"'))
    (tmp_path / "measured").mkdir()
    (tmp_path / "measured" / "wave.csv").write_bytes(carried)
    assert recipe(str(moved)).resources == {"running_surface.csv": carried}


def test_another_profile_makes_another_fmu(line, fmu, tmp_path):
    path, profile = tmp_path / "rigid.toml", tmp_path / "wave.csv"
    path.write_text(line.read_text())
    profile.write_bytes((line.parent / "wave.csv").read_bytes())
    assert fingerprint(recipe(str(path))) == fmu_provision.stored_guid(fmu)
    assert profile in watched_places([], [], [path])
    profile.write_text(profile.read_text().replace(",0.5", ",0.4", 1))
    assert fingerprint(recipe(str(path))) != fmu_provision.stored_guid(fmu)
    profile.unlink()
    said = f"{path}: running_surface.profile: {profile} cannot be read"
    with pytest.raises(BuildError, match=re.escape(said)):
        recipe(str(path))


def test_a_copy_of_a_definition_takes_the_profile_along(line, tmp_path):
    copy = tmp_path / "copy.toml"
    copy.write_text(line.read_text())
    target, data = profile_of_copy(line, copy)
    assert (target, data) == (tmp_path / "wave.csv", (line.parent / "wave.csv").read_bytes())
    target.write_bytes(data)
    assert profile_of_copy(line, copy) is None
    (tmp_path / "wave.csv").write_text("position,height\n0,0\n1,0\n")
    with pytest.raises(CopyError, match=r"wave\.csv is there already, and is not .*wave\.csv, the running surface of"):
        profile_of_copy(line, copy)


def test_a_pantograph_presses_on_it_as_on_a_rigid_wave(fmu):
    """Steps of 1 ms, each part with what the other had at the beginning."""
    instance, train, base = Instance(fmu), LumpedPantographPart(pressing(load_lumped("CX"))), np.zeros(2)
    names = [f"pantograph[1].{end}.{v}{axis}" for end in "AB" for v in ("", "v") for axis in "xyz"]
    places = [instance.references[name] for name in names]
    seen = [instance.references[f"pantograph[1].contact.{name}"] for name in ("force", "x", "y", "z")]
    train.initialise(0.0, 0.0, np.zeros(3), base)
    instance.initialise(**dict(zip(names, train.strip.ravel().tolist(), strict=True)))
    forces, (force, *point) = [], instance.slave.getReal(seen)
    for n in range(1500):
        instance.slave.setReal(places, train.strip.ravel().tolist())
        instance.step(1e-3 * n)
        train.step(force, np.array(point), base, 1e-3)
        force, *point = instance.slave.getReal(seen)
        forces.append(force)
    assert amplitude(forces, 1e-3, SHORT, 12) == pytest.approx(PRINTED, rel=1e-2)
    assert not [text for text in instance.warnings if "running surface" in text]
    assert point[0] == pytest.approx(1.5 * SPEED, abs=1e-6)
    instance.free()

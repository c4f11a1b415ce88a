"""Builds: the same from the same sources, apart from other builds, and at home anywhere."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from fmus.__main__ import main
from fmus.builder.fmu_build import build
from fmus.builder.recipe import REPOSITORY, BuildError, recipe
from models.library.search_path import LIBRARY
from tests.fmus.support import Instance, toy_recipe, toy_variant

_BUILD_ELSEWHERE = """
import sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
from tests.fmus.support import toy_recipe
from fmus.builder.fmu_build import build
build(toy_recipe(), Path(sys.argv[2]))
"""

_RUN_ALONE = """
import json, sys, fmpy
sys.path = [p for p in sys.path if p not in ("", sys.argv[2])]
result = fmpy.simulate_fmu(sys.argv[1], stop_time=0.01, step_size=1e-3, output_interval=1e-3,
    start_values={"stiffness": 250.0}, output=["mass[2].z"])
ours = sorted(m for m in sys.modules if m.partition(".")[0] in ("models", "fmus", "pythonfmu", "toy"))
print(json.dumps([float(result["mass[2].z"][-1]), ours]))
"""


def test_same_bytes_from_other_folders_processes_and_hash_seeds_at_once(toy_fmu, tmp_path):
    """Both build the same file, which is whole whichever ends last."""
    command = [sys.executable, "-c", _BUILD_ELSEWHERE, str(REPOSITORY), str(tmp_path / "out")]
    environments = ({**os.environ, "PYTHONHASHSEED": seed, "TZ": "Asia/Tokyo"} for seed in ("77", "1"))
    running = [subprocess.Popen(command, cwd=tmp_path, env=environment) for environment in environments]
    assert [process.wait() for process in running] == [0, 0]
    assert [p.name for p in (tmp_path / "out").iterdir()] == ["Toy.fmu"]
    assert (tmp_path / "out" / "Toy.fmu").read_bytes() == toy_fmu.read_bytes()


def test_two_builds_in_one_process_do_not_mix(toy_fmu, tmp_path, instantiate):
    other = build(toy_recipe(toy_variant(tmp_path, "GAIN = 1.0", "GAIN = 2.0")), tmp_path)
    first, second, again = instantiate(), instantiate(other), instantiate()
    for instance in (first, second, again):
        instance.initialise(force=5.0)
    assert first["spring[1].force"] == again["spring[1].force"] == pytest.approx(5.0)
    assert second["spring[1].force"] == pytest.approx(20.0)


def test_second_instance_outlives_the_first_ones_folder(toy_fmu):
    first = Instance(toy_fmu)
    second = Instance(toy_fmu)
    first.initialise()
    first.free()
    second.initialise(force=1.0)
    assert second["spring[1].force"] == pytest.approx(1.0)
    second.free()


def test_runs_alone_anywhere(toy_fmu, tmp_path, instantiate):

    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    command = [sys.executable, "-I", "-c", _RUN_ALONE, str(toy_fmu), str(REPOSITORY)]
    done = subprocess.run(command, cwd=tmp_path, env=environment, check=True, capture_output=True, text=True)
    value, shared = json.loads(done.stdout.splitlines()[-1])
    assert shared == []
    reference = instantiate()
    reference.initialise(stiffness=250.0)
    for n in range(10):
        reference.step(n * 1e-3)
    assert value == pytest.approx(reference["mass[2].z"], rel=1e-12)


def test_archive_holds_what_is_needed_and_no_more(toy_fmu, instantiate):
    guid = instantiate().description.guid.replace("-", "")[:12]
    with zipfile.ZipFile(toy_fmu) as package:
        names = set(package.namelist())
        definition = package.read("resources/definition.toml")
    private = {n.removeprefix(f"resources/openpanto_{guid}/") for n in names if f"openpanto_{guid}/" in n}
    assert definition == (Path(__file__).parents[1] / "toy" / "toy.toml").read_bytes()
    assert {"__init__.py", "models/definition_files/field_schema.py", "toy/law.py", "fmus/slave/adapter.py"} <= private
    assert not {"models/contact_law.py", "fmus/builder/fmu_build.py", "pythonfmu/builder.py", "conftest.py"} & private
    assert {"binaries/linux64/Toy.so", "binaries/win64/Toy.dll"} <= names
    assert not any("__pycache__" in n for n in names)


@pytest.mark.parametrize(
    ("old", "new", "file", "text"),
    [
        ("GAIN = 1.0", "import rich\nGAIN = 1.0", "law.py", "imports rich"),
        ("GAIN = 1.0", "GAIN = ", "law.py", "syntax"),
        ('"N/m"', '"kg"', "toy.toml", "unit 'kg' where a unit of 'N/m' is needed"),
        ("mass =", "mess =", "toy.toml", "mess: unknown key"),
    ],
)
def test_what_cannot_be_built_is_said(tmp_path, old, new, file, text):
    with pytest.raises(BuildError, match=text):
        build(toy_recipe(toy_variant(tmp_path, old, new, file)), tmp_path / "out")
    assert not list((tmp_path / "out").glob("*"))


def test_what_is_wrong_in_a_file_of_ones_own_is_said_once_and_of_that_file(tmp_path, capfd):
    path = tmp_path / "Mine.TOML"
    path.write_text('type = "lumped"\n')
    assert main(["build", str(path), "--out", str(tmp_path / "out")]) == 1
    said = capfd.readouterr().err
    assert said.startswith(f"error: Pantograph_Mine cannot be built: {path}: stage: ")
    assert said.count("stage: ") == 1
    assert "definition.toml" not in said


def test_a_reader_that_has_had_enough_is_no_error():
    script = "import sys; from fmus.__main__ import main; sys.exit(main(['list']))"
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-u", "-c", script]
    done = subprocess.run(command, stdout=writer, stderr=subprocess.PIPE, cwd=REPOSITORY, text=True, check=False)
    os.close(writer)
    assert (done.returncode, done.stderr) == (1, "")


def test_a_pantograph_that_cannot_stand_as_it_says_is_not_built(tmp_path):
    text = (LIBRARY / "pantographs" / "generic_multibody_cam.toml").read_text(encoding="utf-8")
    own = tmp_path / "folded.toml"
    own.write_text(text.replace("\nbase_height", '\nstart_height = [4.4, "m", "test"]\nbase_height'), encoding="utf-8")
    told = r"folded\.toml: start_height = 4\.4 m is beyond the stop 'arm_stops': .* goes from 4\.456 to 6\.224 m"
    with pytest.raises(BuildError, match=told):
        build(recipe(str(own)), tmp_path)

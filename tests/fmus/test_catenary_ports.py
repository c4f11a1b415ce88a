"""Ports of a line."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from fmus.build import build, recipe
from tests.fmus.support import Instance, names_of, run

pytest.importorskip("models.catenary.part")


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(recipe("Catenary_LN2_P2"), tmp_path_factory.mktemp("fmu"))


@pytest.fixture
def instance(fmu: Path) -> Iterator[Instance]:
    made = Instance(fmu)
    yield made
    made.free()


def test_has_the_ports_of_two_pantographs(fmu, instance):
    assert fmu.name == "Catenary_LN2_P2.fmu"
    assert names_of(instance, "input") == [
        f"pantograph[{p}].{end}.{axis}"
        for p in (1, 2)
        for end in "AB"
        for axis in ("x", "y", "z", "vx", "vy", "vz")
    ]
    outputs = names_of(instance, "output")
    assert outputs[:2] == ["pantograph[1].contact.force", "pantograph[2].contact.force"]
    assert {f"pantograph[2].contact.{axis}" for axis in "xyz"} <= set(outputs)
    assert not any("section" in name for name in outputs)
    uplifts = [n for n in outputs if n.startswith("support")]
    assert uplifts[0] == "support[1].uplift"
    assert len(outputs) == 8 + len(uplifts)


def test_a_strip_that_is_not_connected_touches_nothing(instance):
    instance.initialise()
    for n in range(5):
        instance.step(n * 1e-3)
    assert instance.get(["pantograph[1].contact.force", "pantograph[2].contact.force"]) == [0.0, 0.0]


def test_geometry_is_that_of_a_line(instance):
    instance.initialise()
    assert 4.0 < instance["support[3].z"] < 7.0
    assert instance["support[3].messenger_wire.z"] > instance["support[3].z"]
    assert instance["dropper[9].upper.z"] > instance["dropper[9].lower.z"]
    assert instance["dropper[9].length"] > 0.0
    assert instance["dropper[9].force"] > 0.0


def test_only_the_touched_port_feels_the_wire(instance):
    instance.initialise()
    rows = run(instance, range(40), ["pantograph[1].contact.force", "pantograph[2].contact.force"])
    assert rows[-1][0] > 0.0
    assert rows[-1][1] == 0.0

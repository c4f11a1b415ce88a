"""Ports of a pantograph."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from fmus.build import build, recipe
from tests.fmus.support import Instance, names_of


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(recipe("Pantograph_CX"), tmp_path_factory.mktemp("fmu"))


@pytest.fixture
def instance(fmu: Path) -> Iterator[Instance]:
    made = Instance(fmu)
    yield made
    made.free()


def test_has_the_ports_of_a_pantograph(instance):
    inputs = ["contact.force", "contact.x", "contact.y", "contact.z", "base.z", "base.vz"]
    assert names_of(instance, "input") == inputs
    strip = [f"{end}.{axis}" for end in "AB" for axis in ("x", "y", "z", "vx", "vy", "vz")]
    outputs = names_of(instance, "output")
    assert outputs[:12] == strip
    assert {"mass[1].z", "mass[3].az"} <= set(outputs)


def test_speed_and_start_position_move_the_strip(instance):
    instance.initialise(start=2.0, speed=50.0, start_position=10.0)
    assert instance.get(["A.x", "B.x", "A.vx"]) == [10.0, 10.0, 50.0]
    instance.step(2.0, 1e-2)
    assert instance["A.x"] == pytest.approx(10.5)
    assert instance["A.y"] > instance["B.y"]

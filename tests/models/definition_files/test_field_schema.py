"""Declared fields: read, listed as parameters, changed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import pytest

from models.definition_files import field_schema
from models.definition_files.field_schema import count, direction, named, part, quantity, text, vector
from models.definition_files.parameter import ParameterError
from models.definition_files.toml_reader import DefinitionError, Quantity, Table


@dataclass(frozen=True)
class Spring:
    name: str
    stiffness: float = quantity("N/m", "{name}: stiffness", default=0.0, minimum=0.0, maximum=1e6)
    carries: int = count("{name}: whether it carries", default=0, maximum=1)

    def problems(self) -> Iterator[tuple[str, str]]:
        if self.carries and self.stiffness == 0.0:
            yield "stiffness", "must be greater than 0"


@dataclass(frozen=True)
class Stop:
    name: str
    axis: tuple[float, float, float] = direction()
    longest: float | None = quantity("m", "{name}: length", default=None, minimum=0.0, maximum=2.0)


@dataclass(frozen=True)
class Fineness:
    elements: int = count("elements", default=6, minimum=1, maximum=9)


@dataclass(frozen=True)
class Body:
    name: str
    inertia: tuple[float, ...] = vector("kg.m2", "inertia of {name}", labels=("xx", "yy", "zz"), minimum=0.0)


@dataclass(frozen=True, kw_only=True)
class Machine:
    speed: float = quantity("m/s", "speed", minimum=0.0, maximum=100.0)
    law: str = text(default="linear", choices=("linear", "cubic"))
    mesh: Fineness = part(Fineness, default=Fineness())
    brake: Fineness | None = part(Fineness, default=None)
    bodies: tuple[Body, ...] = named("body", Body)
    forces: tuple[Spring | Stop, ...] = named("force", {"spring": Spring, "stop": Stop})
    provenance: Mapping[str, Quantity] = field(default_factory=dict)


def _data():
    return {
        "speed": [36.0, "km/h", "a table"],
        "body": {"arm": {"inertia": [[1.0, 2.0, 3.0], "kg.m2", "a drawing"]}},
        "force": {
            "lift": {"kind": "spring", "stiffness": [2.0, "kN/m", "a test"], "carries": 1},
            "end": {"kind": "stop", "axis": [[0.0, 3.0, 4.0], "1", "a drawing"]},
        },
    }


def _read(data):
    table = Table.from_dict(data)
    machine = field_schema.read(Machine, table, provenance=table.provenance)
    table.finish()
    return machine


def test_what_is_declared_is_read():
    machine = _read(_data())
    assert machine.speed == 10.0
    assert machine.law == "linear"
    assert (machine.mesh, machine.brake) == (Fineness(), None)
    assert machine.bodies == (Body("arm", (1.0, 2.0, 3.0)),)
    assert machine.forces == (Spring("lift", 2000.0, 1), Stop("end", (0.0, 0.6, 0.8)))


def test_parameters_are_those_of_what_there_is_in_the_order_of_the_fields():
    machine = _read(_data())
    listed = {p.name: p for p in field_schema.parameters(machine, machine.provenance)}
    assert list(listed) == [
        "speed",
        "mesh.elements",
        "body.arm.inertia.xx",
        "body.arm.inertia.yy",
        "body.arm.inertia.zz",
        "force.lift.stiffness",
        "force.lift.carries",
    ]
    assert listed["body.arm.inertia.yy"].value == 2.0
    assert listed["body.arm.inertia.yy"].source == "a drawing"
    assert listed["body.arm.inertia.yy"].description == "inertia of arm, yy"
    assert listed["force.lift.stiffness"].description == "lift: stiffness"
    assert listed["mesh.elements"].source == "choice: default"


def test_a_number_of_an_element_can_be_changed_and_nothing_else_changes():
    machine = _read(_data())
    changed = field_schema.with_values(machine, {"body.arm.inertia.zz": 5.0, "force.lift.stiffness": 7.0, "speed": 1})
    assert changed.bodies[0].inertia == (1.0, 2.0, 5.0)
    assert changed.forces == (Spring("lift", 7.0, 1), machine.forces[1])
    assert changed.speed == 1.0
    assert field_schema.with_values(machine, {}) == machine


@pytest.mark.parametrize(
    "name", ["body.leg.inertia.xx", "body.arm.inertia.w", "body.arm", "body[1].inertia.xx", "brake.elements", "x", ""]
)
def test_there_is_no_other_name(name):
    with pytest.raises(ParameterError, match="there is none of this name"):
        field_schema.with_values(_read(_data()), {name: 1.0})


@pytest.mark.parametrize("name", ["body.arm.inertia", "law", "mesh", "force.end.axis"])
def test_what_is_not_one_number_cannot_be_set(name):
    with pytest.raises(ParameterError, match=r"there is none of this name|not a number that can be set"):
        field_schema.with_values(_read(_data()), {name: 1.0})


def test_values_that_do_not_fit_together_are_refused_when_all_are_in():
    machine = _read(_data())
    with pytest.raises(ParameterError, match=r"force.lift.stiffness: must be greater than 0"):
        field_schema.with_values(machine, {"force.lift.stiffness": 0.0})
    changed = field_schema.with_values(machine, {"force.lift.stiffness": 0.0, "force.lift.carries": 0})
    assert changed.forces[0] == Spring("lift", 0.0, 0)


def test_every_mistake_is_reported_with_its_key():
    data = _data()
    data["law"] = "square"
    data["body"]["leg 2"] = {}
    data["force"]["end"]["axis"] = [[0.0, 0.0, 0.0], "1", "a drawing"]
    data["force"]["lift"]["stiffness"] = [0.0, "N/m", "a test"]
    data["force"]["odd"] = {"kind": "string", "length": 3}
    with pytest.raises(DefinitionError) as raised:
        _read(data)
    assert [(p.key, p.text.split(":")[0].split(" (")[0].split(";")[0]) for p in raised.value.problems] == [
        ("law", "'square' is none of linear, cubic"),
        ("body.leg 2", "a name is made of letters, digits, '_' and '-'"),
        ("body.leg 2.inertia", "is missing"),
        ("force.lift.stiffness", "must be greater than 0"),
        ("force.end.axis", "the axis has no direction"),
        ("force.odd.kind", "'string' is none of spring, stop"),
    ]

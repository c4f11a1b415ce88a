"""Small mechanisms for the tests, written as definition files are."""

from __future__ import annotations

import copy
import tomllib
from pathlib import Path
from typing import Any

import numpy as np

import models
from models.definition_files.toml_reader import Table
from models.pantograph.multibody.mechanism import Mechanism
from models.pantograph.multibody.mechanism_definition import MechanismDefinition
from models.pantograph.multibody.mechanism_reading import load_mechanism, read_mechanism

LIBRARY = Path(models.__file__).parent / "library" / "pantographs"


def q(value: Any, unit: str) -> list[Any]:
    return [value, unit, "test"]


def body(mass: float, inertia: Any, position: Any, euler: Any = (0.0, 0.0, 0.0)) -> dict[str, Any]:
    return {
        "mass": q(mass, "kg"),
        "inertia": q(list(inertia), "kg.m2"),
        "position": q(list(position), "m"),
        "euler": q(list(euler), "1"),
    }


def joint(kind: str, i: str, j: str, **vectors: Any) -> dict[str, Any]:
    table: dict[str, Any] = {"kind": kind, "body_i": i, "body_j": j}
    for key, value in vectors.items():
        table[key] = q(list(value), "1" if key.startswith("axis") else "m")
    return table


def mechanism_data(
    bodies: dict[str, Any], joints: dict[str, Any], forces: dict[str, Any] | None = None
) -> dict[str, Any]:
    roof = {"roof": {"kind": "prescribed_motion", "body_j": "base"}}
    base = {"base": body(1.0, (1.0, 1.0, 1.0), (0.0, 0.0, 0.0))}
    return {
        "name": "test",
        "type": "multibody",
        "body": base | bodies,
        "joint": roof | joints,
        "force": forces or {},
    }


def mechanism_from(data: dict[str, Any]) -> MechanismDefinition:
    return read_mechanism(Table.from_dict(data))


def mechanism(*args: Any, **changes: Any) -> Mechanism:
    return Mechanism(mechanism_from(mechanism_data(*args) | changes))


def library_data(name: str) -> dict[str, Any]:
    return copy.deepcopy(tomllib.loads((LIBRARY / f"{name}.toml").read_text(encoding="utf-8")))


def library(name: str) -> MechanismDefinition:
    return load_mechanism(LIBRARY / f"{name}.toml")


def pendulum_data(euler: Any = (0.0, 0.0, 0.0)) -> dict[str, Any]:
    """A rod of 1 m that hangs along +x of its body from a hinge about y."""
    angle = 2.0 * np.arcsin(euler[1])
    centre = (0.5 * np.cos(angle), 0.0, -0.5 * np.sin(angle))
    return mechanism_data(
        {"rod": body(2.0, (0.01, 0.2, 0.2), centre, euler)},
        {
            "hinge": joint(
                "revolute", "base", "rod",
                point_i=(0, 0, 0), point_j=(-0.5, 0, 0), axis_i=(0, 1, 0), axis_j=(0, 1, 0),
            )
        },
    )  # fmt: skip


def one_of_each_joint() -> dict[str, Any]:
    """A chain, askew in space, with every kind of joint; independent and closed as written only by projection."""
    bodies = {
        f"b{k}": body(1.0 + k, (0.1 * k, 0.2, 0.3), (0.4 * k, 0.1 * k, 0.05 * k * k), (0.1 * k, -0.05 * k, 0.03 * k))
        for k in range(1, 9)
    }
    p = {"point_i": (0.2, 0.05, 0.1), "point_j": (-0.2, -0.05, 0.02)}
    joints = {
        "revolute": joint("revolute", "base", "b1", axis_i=(0.1, 1, 0.2), axis_j=(0, 1, 0), **p),
        "spherical": joint("spherical", "b1", "b2", **p),
        "prismatic": joint("prismatic", "b2", "b3", axis_i=(1, 0.3, 0.2), **p),
        "universal": joint("universal", "b3", "b4", axis_i=(1, 0, 0), axis_j=(0, 1, 0.1), **p),
        "fixed": joint("fixed", "b4", "b5", **p),
        "revolute_prismatic": joint("revolute_prismatic", "b5", "b6", axis_i=(1, 0, 0), axis_j=(0, 0, 1), **p),
        "ball": joint("spherical", "b6", "b7", **p),
        "lock": joint("perpendicular", "b6", "b7", axis_i=(0, 1, 0), axis_j=(0, 0, 1)),
        "other_ball": joint("spherical", "b7", "b8", **p),
    }
    return mechanism_data(bodies, joints)

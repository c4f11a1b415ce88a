"""Two masses on springs, pushed by a force; and definitions of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

import models.definition_files.si_units as units
import toy.law
from models.arrays import FloatArray, Snapshot
from models.definition_files import field_schema
from models.definition_files.field_schema import count, quantity
from models.definition_files.parameter import Parameter
from models.definition_files.toml_reader import Quantity, Table

assert units.SI["m"] == ("m", 1.0)


@dataclass(frozen=True, kw_only=True)
class ToyDefinition:
    name: str
    mass: float = quantity("kg", "mass", positive=True)
    stiffness: float = quantity("N/m", "stiffness", minimum=1.0, maximum=1e6)
    substeps: int = count("internal steps", default=3, minimum=1, maximum=100)
    masses: int = count("number of masses", default=2, minimum=1, maximum=3)
    provenance: Mapping[str, Quantity] = field(default_factory=dict, repr=False, compare=False)

    def parameters(self) -> tuple[Parameter, ...]:
        return tuple(field_schema.parameters(self, self.provenance))

    def with_values(self, values: Mapping[str, float]) -> ToyDefinition:
        return field_schema.with_values(self, values)


def load(path: Path) -> ToyDefinition:
    table = Table.load(path)
    definition = field_schema.read(ToyDefinition, table, name=table.text("name"))
    definition = replace(definition, provenance=table.provenance)
    table.finish()
    return definition


class ToyPart:
    """Masses that start at rest where a force holds them."""

    built = 0

    def __init__(self, definition: ToyDefinition) -> None:
        self.definition = definition
        self.time = 0.0

    def initialise(self, time: float, force: FloatArray) -> None:
        ToyPart.built += 1
        self.time = time
        self.x = np.full(self.definition.masses, force[0] / self.definition.stiffness) * toy.law.GAIN
        self.v = np.zeros_like(self.x)
        self.slack = np.zeros(3, dtype=bool)

    def step(self, force: FloatArray, step: float) -> None:
        if force[0] > 1e6:
            raise ValueError("the mass slipped by 3 % of its way: 100%")
        if force[0] > 1e5:
            raise KeyboardInterrupt
        h = step / self.definition.substeps
        for _ in range(self.definition.substeps):
            pull = toy.law.force(self.x, self.definition.stiffness)
            self.v = self.v + h * (force[0] + np.arange(self.x.size) - pull) / self.definition.mass
            self.x = self.x + h * self.v
        self.slack = np.array([True, False, self.x[0] > 0.0])
        self.time = self.time + step

    @property
    def observed(self) -> tuple[tuple[str, str, str], ...]:
        return tuple((f"mass[{i}].z", "m", f"displacement of mass {i}") for i in (1, 2))

    @property
    def spring_force(self) -> FloatArray:
        return toy.law.force(self.x, self.definition.stiffness)

    @property
    def rest(self) -> FloatArray:
        return np.array([self.definition.mass * 9.81 / self.definition.stiffness])

    def snapshot(self) -> Snapshot:
        return {"x": self.x, "v": self.v, "slack": self.slack, "time": np.array(self.time)}

    def restore(self, snapshot: Snapshot) -> None:
        self.x, self.v = snapshot["x"].copy(), snapshot["v"].copy()  # type: ignore[assignment]
        self.slack = snapshot["slack"].copy()
        self.time = float(snapshot["time"])

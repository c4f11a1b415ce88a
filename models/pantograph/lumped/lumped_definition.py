"""What every pantograph has: a collector strip, an operating state; and the lumped-mass definition."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from models.definition_files import field_schema
from models.definition_files.field_schema import count, monitoring, quantity
from models.definition_files.parameter import Parameter
from models.definition_files.toml_reader import Quantity, Table


@dataclass(frozen=True, kw_only=True)
class Operation:
    """How a pantograph runs: speed, start, raising, collector strip.

    The names are the same for every kind of pantograph.
    """

    speed: float = quantity("m/s", "speed along the track", default=300.0 / 3.6, minimum=0.0, maximum=170.0)
    start_position: float = quantity("m", "position along the track at time 0", default=0.0, minimum=-1e7, maximum=1e7)
    reference_height: float = quantity(
        "m",
        "height of the strip at time 0, where the springs carry the weights",
        default=5.02,
        minimum=2.0,
        maximum=10.0,
    )
    raise_start: float = quantity("s", "when the uplift begins to act", default=0.0, minimum=0.0, maximum=1e4)
    raise_duration: float = quantity(
        "s", "time over which the uplift grows to its value", default=0.1, minimum=0.0, maximum=100.0
    )
    strip_length: float = quantity("m", "working length of the collector strip", default=1.45, minimum=0.1, maximum=4.0)
    strip_offset: float = quantity(
        "m", "lateral position of the strip's middle", default=0.0, minimum=-2.0, maximum=2.0
    )
    extrapolation_order: int = count(
        "order of the extrapolation of the contact force inside a step: 0 held, 1 linear, 2 quadratic",
        default=2, minimum=0, maximum=2,
    )  # fmt: skip
    monitor_energy: int = monitoring()
    # At least a thousandth of the usual one: a run in shorter steps would never end.
    time_step: float = quantity("s", "longest internal time step", default=1e-3, minimum=1e-6, maximum=0.1)

    def raised(self, time: float) -> float:
        """Return the share of the uplift that acts at ``time``: 0 before raising, a ramp, then 1."""
        if time < self.raise_start:
            return 0.0
        if self.raise_duration == 0.0:
            return 1.0
        return min(1.0, (time - self.raise_start) / self.raise_duration)


@dataclass(frozen=True)
class Stage:
    """One stage of a lumped model: a mass on a spring-damper to the stage below."""

    mass: float = quantity("kg", "mass", positive=True, minimum=1e-3, maximum=1e3)
    stiffness: float = quantity("N/m", "stiffness to the stage below", minimum=0.0, maximum=1e9)
    damping: float = quantity("N.s/m", "damping to the stage below", minimum=0.0, maximum=1e6)


@dataclass(frozen=True, kw_only=True)
class LumpedDefinition(Operation):
    """A lumped-mass pantograph [1]_.

    Attributes
    ----------
    stage : tuple of Stage
        Bottom to top; the strip is the last mass.
    static_force : float
        Net uplift on the lowest mass at the reference height [N].

    References
    ----------
    .. [1] P. Antunes (2012), equations 2.12 to 2.19.
    """

    name: str
    title: str
    stage: tuple[Stage, ...]
    static_force: float = quantity(
        "N", "static uplift on the lowest mass at the reference height", minimum=0.0, maximum=5e3
    )
    provenance: Mapping[str, Quantity] = field(default_factory=dict, repr=False, compare=False)

    def parameters(self) -> tuple[Parameter, ...]:
        """Return every tunable number."""
        return tuple(field_schema.parameters(self, self.provenance))

    def with_values(self, values: Mapping[str, float]) -> LumpedDefinition:
        """Return a copy with some parameters changed; raises ``ParameterError``."""
        return field_schema.with_values(self, values)


def load_lumped(path: Path) -> LumpedDefinition:
    """Read a lumped pantograph's definition file; raises ``DefinitionError`` with every mistake."""
    return read_lumped(Table.load(path))


def read_lumped(table: Table) -> LumpedDefinition:
    """Read a lumped pantograph's definition from a parsed table; raises ``DefinitionError``."""
    table.text("type", choices=("lumped",))
    stages = tuple(field_schema.read(Stage, t) for t in table.tables("stage"))
    if not stages:
        table.problem("stage", "a lumped pantograph needs at least one [[stage]]")
    definition = field_schema.read(
        LumpedDefinition,
        table,
        name=table.text("name"),
        title=table.text("title", default=""),
        stage=stages,
        provenance=table.provenance,
    )
    table.finish()
    return definition

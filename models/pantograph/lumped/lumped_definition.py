"""A lumped-mass pantograph as defined: masses on springs and dampers, one above the other."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from models.definition_files import field_schema
from models.definition_files.field_schema import count, quantity, series, text
from models.definition_files.parameter import Parameter
from models.definition_files.toml_reader import Quantity, Table
from models.pantograph.operation import Operation


@dataclass(frozen=True)
class Stage:
    """One stage of a lumped model: a mass on a spring-damper to the stage below."""

    mass: float = quantity("kg", "mass", positive=True, minimum=1e-3, maximum=1e3)
    stiffness: float = quantity("N/m", "stiffness to the stage below", minimum=0.0, maximum=1e9)
    damping: float = quantity("N.s/m", "damping to the stage below", minimum=0.0, maximum=1e6)
    friction: float = quantity("N", "dry friction against the stage below", default=0.0, minimum=0.0, maximum=1e4)
    friction_slip: float = quantity(
        "m", "displacement at which the dry friction slips", default=1e-4, minimum=1e-6, maximum=0.1
    )


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

    name: str = text()
    title: str = text(default="")
    stage: tuple[Stage, ...]
    static_force: float = quantity(
        "N", "static uplift on the lowest mass at the reference height", minimum=0.0, maximum=5e3
    )
    follow_height: int = count(
        "whether the lowest spring hangs on a reference that follows the working height: 0 on the roof, 1 following",
        default=0,
        maximum=1,
    )
    reference_time: float = quantity(
        "s", "time constant of the reference that follows the height", default=0.5, minimum=0.05, maximum=100.0
    )
    base_height: float | None = quantity(
        "m", "height of the base above the rails, about which the roof's roll turns the strip", default=None,
        minimum=0.5, maximum=9.0,
    )  # fmt: skip
    aerodynamic_share: tuple[float, ...] = series(
        "1", "share of the aerodynamic uplift that acts on each stage", default=(), minimum=0.0, maximum=1.0
    )
    lowest_height: float | None = quantity(
        "m",
        "height of the strip at which the lowest mass, at rest, is at its lower stop",
        default=None,
        minimum=0.1,
        maximum=10.0,
    )
    highest_height: float | None = quantity(
        "m",
        "height of the strip at which the lowest mass, at rest, is at its upper stop",
        default=None,
        minimum=0.1,
        maximum=10.0,
    )
    stop_stiffness: float = quantity("N/m", "stiffness of the stops", default=1e5, minimum=1.0, maximum=1e8)
    stop_damping: float = quantity("N.s/m", "damping of the stops", default=500.0, minimum=0.0, maximum=1e6)
    start_height: float | None = quantity(
        "m",
        "height of the strip at time 0, where that is not the reference height",
        default=None,
        minimum=0.1,
        maximum=10.0,
    )
    provenance: Mapping[str, Quantity] = field(default_factory=dict, repr=False, compare=False)

    def problems(self) -> Iterator[tuple[str, str]]:
        """Yield what is wrong with the direction, the shares of the air's force, and heights."""
        yield from super().problems()
        share, stages = self.aerodynamic_share, len(self.stage)
        if share and len(share) != stages:
            yield "aerodynamic_share", f"has {len(share)} values for {stages} stages"
        elif share and abs(sum(share) - 1.0) > 1e-9:
            yield "aerodynamic_share", f"sums to {sum(share):.6g}, not to 1"
        yield from self._height_problems()

    def _height_problems(self) -> Iterator[tuple[str, str]]:
        low, high = self.range
        if math.isnan(low) or math.isnan(high):
            return  # told where it is read
        if low >= high:
            yield "highest_height", f"{high:g} m is not above the lowest_height of {low:g} m"
            return
        for key in ("reference_height", "start_height"):
            height = getattr(self, key)
            if height is None:
                continue
            if height < low:
                yield key, f"{height:g} m is below the lowest_height of {low:g} m"
            elif height > high:
                yield key, f"{height:g} m is above the highest_height of {high:g} m"

    @property
    def range(self) -> tuple[float, float]:
        """Heights of the strip between the stops [m], infinite without one."""
        low, high = self.lowest_height, self.highest_height
        return -math.inf if low is None else low, math.inf if high is None else high

    @property
    def rise(self) -> float:
        """How far above the reference height the strip starts [m]."""
        return 0.0 if self.start_height is None else self.start_height - self.reference_height

    @property
    def air_shares(self) -> tuple[float, ...]:
        """Share of the aerodynamic uplift on each stage, all on the lowest unless the definition says otherwise."""
        return self.aerodynamic_share or (1.0, *[0.0] * (len(self.stage) - 1))

    def parameters(self) -> tuple[Parameter, ...]:
        """Return every tunable number."""
        return self.tunable(field_schema.parameters(self, self.provenance))

    def with_values(self, values: Mapping[str, float]) -> LumpedDefinition:
        """Return a copy with some parameters changed; raises ``ParameterError``."""
        self.refuse_idle(values)
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
    definition = field_schema.read(LumpedDefinition, table, stage=stages, provenance=table.provenance)
    definition.check_speed(table)
    table.finish()
    return definition

"""A lumped-mass pantograph as defined: masses on springs and dampers, one above the other."""

from __future__ import annotations

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
    provenance: Mapping[str, Quantity] = field(default_factory=dict, repr=False, compare=False)

    def problems(self) -> Iterator[tuple[str, str]]:
        """Yield what is wrong with the direction and the shares of the air's force."""
        yield from super().problems()
        share, stages = self.aerodynamic_share, len(self.stage)
        if share and len(share) != stages:
            yield "aerodynamic_share", f"has {len(share)} values for {stages} stages"
        elif share and abs(sum(share) - 1.0) > 1e-9:
            yield "aerodynamic_share", f"sums to {sum(share):.6g}, not to 1"

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

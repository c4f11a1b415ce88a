"""Forces over the speed, as a norm asks for them or as they were measured: `norms/contact_force.toml`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

from models.arrays import FloatArray
from models.definition_files.field_schema import quantity, read, text
from models.definition_files.toml_reader import Table
from models.library.search_path import LIBRARY


@dataclass(frozen=True, kw_only=True)
class ForceLaw:
    """A force over the speed: a polynomial of second degree.

    Attributes
    ----------
    name : str
    constant, per_speed, per_square : float
        [N, N.s/m, N.s2/m2]
    """

    name: str = text(filled=True)
    constant: float = quantity("N", "constant part")
    per_speed: float = quantity("N.s/m", "part that goes with the speed", default=0.0)
    per_square: float = quantity("N.s2/m2", "part that goes with its square")

    def at(self, speed: FloatArray) -> FloatArray:
        """Return the force at speeds [m/s], of the same shape [N]."""
        return self.constant + speed * (self.per_speed + speed * self.per_square)


@cache
def force_laws() -> tuple[ForceLaw, ...]:
    """Return the target of the norm, then the published uplift."""
    whole = Table.load(LIBRARY / "norms" / "contact_force.toml")
    laws = tuple(read(ForceLaw, table) for table in whole.tables("law"))
    whole.finish()
    return laws

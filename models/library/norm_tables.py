"""Limits by norms, read from `norms/*.toml`: gradients of the contact wire, loads of supports, clearances."""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass

from models.catenary.statics.lateral_limits import LateralNorm
from models.definition_files.field_schema import quantity, read, series, text
from models.definition_files.toml_reader import Table
from models.library.search_path import LIBRARY


@dataclass(frozen=True, kw_only=True)
class GradientLimits:
    """How steep a contact wire may be by the speed of the line, in one norm."""

    name: str = text()
    speeds: tuple[float, ...] = series("m/s", "speed up to which a row holds", minimum=0.0)
    gradients: tuple[float, ...] = series("1", "largest gradient in a row", minimum=0.0, maximum=1.0)
    faster: float = quantity("1", "largest gradient beyond the last row", minimum=0.0, maximum=1.0)
    change: float = quantity("1", "of the gradient, what its change at a support may be", minimum=0.0, maximum=2.0)

    def at(self, speed: float) -> float:
        """Return the largest gradient at a speed [m/s]; between rows that of the next faster one.

        Examples
        --------
        >>> limits = GradientLimits(name="n", speeds=(20.0, 30.0), gradients=(0.02, 0.01), faster=0.0, change=0.5)
        >>> limits.at(20.0), limits.at(21.0), limits.at(31.0)
        (0.02, 0.01, 0.0)
        """
        # A speed in km/h is the row's own up to rounding.
        row = bisect_left(self.speeds, speed * (1.0 - 1e-9))
        return self.gradients[row] if row < len(self.speeds) else self.faster


@dataclass(frozen=True, kw_only=True)
class SupportLimits:
    """Loads of steady arms, lengths of droppers."""

    largest_lateral: float = quantity("N", "lateral load of a standard arm", positive=True)
    largest_with_proof: float = quantity("N", "lateral load of an arm with a proof", positive=True)
    smallest_lateral: float = quantity("N", "lateral load below which an arm comes loose", positive=True)
    shortest_dropper: float = quantity("m", "length of a dropper", positive=True)
    largest_loss: float = quantity("1", "loss of tension over that of the design", positive=True)


@dataclass(frozen=True, kw_only=True)
class Clearances:
    """Distances between live wires and what stands over them."""

    at_rest: float = quantity("m", "distance of wires at rest", positive=True)
    lifted: float = quantity("m", "distance of wires that a pantograph lifts", positive=True)


def norm_sources(name: str) -> dict[str, str]:
    """Return where the numbers of a file of norms are from, by key; of tables where their first list is, by name.

    Examples
    --------
    >>> norm_sources("supports")["shortest_dropper"], norm_sources("gradient")["IFE 6.3"]
    ('ADIF: length of a dropper', 'Orden TMA/135/2023, IFE 6.3')
    """
    whole = Table.load(LIBRARY / "norms" / f"{name}.toml").data
    found = {key: entry[2] for key, entry in whole.items() if isinstance(entry, list) and isinstance(entry[-1], str)}
    return found | {table["name"]: table["speeds"][2] for table in whole.get("table", [])}


def clearances() -> Clearances:
    """Return the distances that are wanted under structures."""
    whole = Table.load(LIBRARY / "norms" / "clearance.toml")
    found = read(Clearances, whole)
    whole.finish()
    return found


def gradient_limits() -> tuple[GradientLimits, ...]:
    """Return the limits of gradients of every norm."""
    whole = Table.load(LIBRARY / "norms" / "gradient.toml")
    found = tuple(read(GradientLimits, table) for table in whole.tables("table"))
    whole.finish()
    return found


def lateral_norm() -> LateralNorm:
    """Return the numbers of the permissible lateral deviation."""
    whole = Table.load(LIBRARY / "norms" / "lateral.toml")
    found = read(LateralNorm, whole)
    whole.finish()
    return found


def support_limits() -> SupportLimits:
    """Return the limits of arms and droppers."""
    whole = Table.load(LIBRARY / "norms" / "supports.toml")
    found = read(SupportLimits, whole)
    whole.finish()
    return found

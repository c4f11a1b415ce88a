"""Spans and radii in the wind: the rows of the tables of ``spans``, and its figure."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from models.arrays import FloatArray
from models.catenary.definition.line_definition import CatenaryDefinition
from models.interface.line_spans import SpanTable
from models.library.norm_tables import lateral_norm

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Radii that stand at the figure's axis, as far as it reaches [m].
_TICKS: Final = (100, 150, 200, 300, 500, 700, 1000, 1500, 2000, 3000, 5000, 7000, 10000, 20000, 50000)


def warnings(definition: CatenaryDefinition, found: SpanTable) -> Iterator[str]:
    """Yield what the tables of a line leave out."""
    cant = 0.0 if definition.track is None else max(map(abs, definition.track.cant), default=0.0)
    if found.head and cant > (free := lateral_norm().free_cant):
        yield (
            f"the limits of the head are those of curves with up to {1e3 * free:g} mm of cant; this line's track has "
            f"{1e3 * cant:g} mm, where less is permissible: see what 'statics --wind --head' finds, or give --limit"
        )
    if definition.auxiliary_wire is not None:
        yield (
            "the contact wire of a compound line goes with its auxiliary wire, which the string of these tables knows "
            "nothing of: they may be too favourable; see what 'statics --wind' finds with the mesh"
        )


def figure(found: SpanTable) -> Figure:
    """Smallest radius over the length of the span, a line for each pair of staggers."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import NullFormatter

    drawn = Figure(figsize=(8.0, 4.5), layout="constrained")
    axes = drawn.subplots()
    for values, name in zip(found.smallest_radius, found.names, strict=True):
        axes.plot(found.lengths, values, "o-", markersize=3, label=f"stagger {name}")
    axes.set_yscale("log")
    known = found.smallest_radius[np.isfinite(found.smallest_radius)]
    if known.size:
        low, high = axes.get_ylim()
        shown = [tick for tick in _TICKS if low <= tick <= high]
        axes.set_yticks(shown, [f"{tick}" for tick in shown])
        axes.yaxis.set_minor_formatter(NullFormatter())
    axes.grid(visible=True, which="major", linewidth=0.3)
    axes.set_xlabel("length of the span [m]")
    axes.set_ylabel("smallest radius [m]")
    axes.set_title(heading(found), loc="left", fontsize=9)
    axes.legend(fontsize=8, frameon=False)
    return drawn


def heading(found: SpanTable) -> str:
    """Return for what the tables hold."""
    return f"{found.pressure:.2f} Pa, {found.force:.3f} N/m on {found.tension:g} N, limit {permissible(found)}"


def permissible(found: SpanTable) -> str:
    """Return how far the wire may be from the middle of the track, as text."""
    return f"{found.limit:.3f} m on straight track" if found.head else f"{found.limit:g} m"


def span_heads(found: SpanTable, before: str = "") -> tuple[str, ...]:
    """Return the heads of the table of largest spans; of a head's limit, which the curve lowers, the last."""
    return "radius [m]", *(before + name for name in found.names), *(["limit [m]"] if found.head else [])


def span_rows(found: SpanTable) -> list[Sequence[str]]:
    """Return the rows of the table of largest spans."""
    limits = [f"{limit:.3f}" for limit in found.limits]
    lines = rows(found.radii, found.largest_span, 2)
    return [(*row, limit) for row, limit in zip(lines, limits, strict=True)] if found.head else lines


def rows(first: Sequence[float], columns: FloatArray, digits: int) -> list[Sequence[str]]:
    """Return the rows of a table whose columns belong to pairs of staggers, shape (n_staggers, n)."""

    def cell(value: float) -> str:
        return "none" if math.isnan(value) else "any" if math.isinf(value) else f"{value:.{digits}f}"

    heads = ["straight" if math.isinf(value) else f"{value:g}" for value in first]
    return [(head, *map(cell, row)) for head, row in zip(heads, columns.T.tolist(), strict=True)]

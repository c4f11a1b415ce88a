"""Plots of a line as built, droppers and heights. Every function returns a Matplotlib figure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from models.arrays import BoolArray, FloatArray
from models.layout.as_built.as_built_outcome import AsBuiltOutcome

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: What a row of a figure shows of the line [m], and most of its rows.
_ROW: Final = 700.0
_MOST_ROWS: Final = 24
_BESIDE: Final = 20.0
#: Heights that are drawn one by one; more of them are a picture.
_MANY: Final = 4000
_PASSED, _LONG, _SHORT, _GREY = "#5b8f6b", "#b3261e", "#1f5fa8", "#9aa0a6"


def errors(found: AsBuiltOutcome) -> Figure:
    """Error of every dropper as a bar, coloured by the tolerance."""
    b, mm = found.built, 1e3
    kinds = (
        ("passed", _PASSED, b.is_measured & ~found.is_beyond),
        ("failed, too long", _LONG, found.is_beyond & (b.error > 0.0)),
        ("failed, too short", _SHORT, found.is_beyond & (b.error < 0.0)),
    )
    width = 0.7 * float(np.median(np.diff(np.unique(b.x)))) if len(b.x) > 1 else 3.0
    figure, panels = _rows(b.x)
    for axes in panels:
        here = _shown(axes, b.x)
        for label, colour, chosen in kinds:
            bars = here & chosen
            axes.bar(b.x[bars], mm * b.error[bars], width=width, color=colour, label=label)
        slack, missing = here & b.is_slack & b.is_measured, here & ~b.is_measured
        axes.plot(b.x[slack], mm * b.error[slack], "v", color="black", markersize=4, label="slack: at least")
        axes.plot(b.x[missing], np.zeros(missing.sum()), "x", color=_GREY, markersize=4, label="not measured")
        for limit in (-found.tolerance, found.tolerance):
            axes.axhline(mm * limit, color="black", linewidth=0.6, linestyle="--")
        axes.axhline(0.0, color="black", linewidth=0.6)
        axes.set_ylabel("as fitted less\ndesigned [mm]")
    _legend(panels[0])
    return figure


def heights(found: AsBuiltOutcome) -> Figure:
    """Heights over those of the design: measured, as built and expected, with the droppers that change."""
    b, mm = found.built, 1e3
    figure, panels = _rows(b.x)
    before, after, change = mm * found.before, mm * found.after, found.change
    limits = _limits(before, after, [mm * d.value[d.is_measured] for d in b.deviations if d])
    bottom = limits[0] + 0.04 * (limits[1] - limits[0])
    of = b.design.shape.mesh.section[b.design.shape.mesh.droppers[b.droppers, 0]]
    x, measured = (np.concatenate([getattr(d, name) for d in b.deviations if d]) for name in ("x", "deviation"))
    for axes in panels:
        dots, here = _shown(axes, x), _shown(axes, b.x)
        axes.plot(
            x[dots], mm * measured[dots], ".", color=_GREY, markersize=1.5, zorder=0, label="measured",
            rasterized=len(x) > _MANY,
        )  # fmt: skip
        for section in np.unique(of):
            own = here & (of == section)
            axes.plot(b.x[own], before[own], color=_LONG, linewidth=1.0, label="" if section else "as built")
            text = "" if section else "expected after changes"
            axes.plot(b.x[own], after[own], color=_PASSED, linewidth=1.4, label=text)
        for sign, marker, label in ((1.0, "v", "dropper to lengthen"), (-1.0, "^", "to shorten")):
            chosen = here & (sign * change > 0.0)
            axes.plot(b.x[chosen], np.full(chosen.sum(), bottom), marker, color="black", markersize=3.5, label=label)
        axes.axhline(0.0, color="black", linewidth=0.6)
        axes.set_ylim(*limits)
        axes.set_ylabel("height over\nthe design [mm]")
    _legend(panels[0])
    return figure


def _shown(axes: Axes, x: FloatArray) -> BoolArray:
    """Return which places a row of a figure shows, and a little beyond, so that lines reach its edges."""
    low, high = axes.get_xlim()
    return np.asarray((x > low - _BESIDE) & (x < high + _BESIDE))


def _limits(before: FloatArray, after: FloatArray, measured: Sequence[FloatArray]) -> tuple[float, float]:
    values = np.concatenate([before, after, [-2.0, 2.0], *measured])
    low, high = float(values.min()), float(values.max())
    return low - 0.25 * (high - low), high + 0.1 * (high - low)


def _rows(x: FloatArray) -> tuple[Figure, list[Axes]]:
    """Return a figure with the line in rows, one below the other."""
    from matplotlib.figure import Figure

    start, end = float(x.min()) - 5.0, float(x.max()) + 5.0
    count = min(_MOST_ROWS, max(1, int(np.ceil((end - start) / _ROW))))
    figure = Figure(figsize=(9.0, 0.9 + 2.3 * count), layout="constrained")
    panels = list(figure.subplots(count, 1, squeeze=False, sharey=True)[:, 0])
    edges = np.linspace(start, end, count + 1)
    for axes, a, b in zip(panels, edges, edges[1:], strict=False):
        axes.set_xlim(a, b)
        axes.grid(visible=True, linewidth=0.3)
    panels[-1].set_xlabel("position along the track of the design [m]")
    return figure, panels


def _legend(axes: Axes) -> None:
    axes.legend(fontsize=8, ncols=3, frameon=False, loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2)

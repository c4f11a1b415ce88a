"""The renderer for files: charts in a Matplotlib figure, one below the other. It writes nothing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from master.report.charts.chart import (
    Axis,
    Band,
    Bars,
    Cells,
    Chart,
    Curve,
    Dash,
    Envelope,
    Level,
    Points,
    Ticks,
    fill,
    ink_on,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_WIDTH: Final = 9.0
#: Pixels on a page that correspond to an inch in a file.
_PIXELS: Final = 125.0
#: Width available to a legend, and what a row, a letter and the line before a name need [points].
_LEGEND_WIDTH, _LEGEND_ROW, _LETTER, _LINE = 610.0, 13.0, 3.8, 44.0
_GRID: Final = "#e3e5e8"
#: Curves are thinner on paper than on a screen.
_THINNER: Final = 0.65
_PATTERNS: Final[dict[Dash, Any]] = {
    "solid": "-",
    "dash": (0, (5, 2)),
    "dot": (0, (1, 1.3)),
    "dashdot": (0, (5, 2, 1, 2)),
    "longdash": (0, (9, 3)),
    "longdashdot": (0, (9, 3, 1, 3)),
}
_HATCHES: Final = ("", "//", "xx", "--", "..", "++")
_SYMBOLS: Final = {"circle": "o", "x": "x", "triangle-up": "^"}


def static_figure(charts: Sequence[Chart]) -> Figure:
    """Return one figure of all charts, each with its title, its legend and its axes."""
    from matplotlib.figure import Figure  # takes longer than all else that a command imports

    heights = [chart.height / _PIXELS + 0.4 for chart in charts]
    figure = Figure(figsize=(_WIDTH, sum(heights)), layout="constrained")
    rows = figure.subplots(len(charts), 1, squeeze=False, height_ratios=heights)[:, 0]
    for axes, chart in zip(rows, charts, strict=True):
        _draw_chart(axes, chart)
    return figure


def _draw_chart(axes: Any, chart: Chart) -> None:
    axes.grid(axis="y", color=_GRID, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    bars = [part for part in chart.parts if isinstance(part, Bars)]
    for number, each in enumerate(bars):
        _draw_bars(axes, each, number, len(bars))
    for part in chart.parts:
        if not isinstance(part, Bars):
            _DRAWN[type(part)](axes, part)
    _scale(axes, "x", chart.x)
    _scale(axes, "y", chart.y)
    axes.set_title(chart.title, loc="left", fontsize=10, pad=6.0 + _LEGEND_ROW * _draw_legend(axes))


def _draw_legend(axes: Any) -> int:
    """Draw the legend above the axes if there is more than one name, and return its number of rows."""
    _, labels = axes.get_legend_handles_labels()
    if len(labels) < 2:
        return 0
    columns = max(1, int(_LEGEND_WIDTH / (_LINE + _LETTER * max(map(len, labels)))))
    place = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "borderaxespad": 0.2}
    axes.legend(ncols=columns, frameon=False, fontsize=8, **place)
    return -(-len(labels) // columns)


def _scale(axes: Any, which: str, axis: Axis) -> None:
    axes.set(**{f"{which}label": axis.label})
    if axis.is_logarithmic:
        axes.set(**{f"{which}scale": "log"})
    if axis.ticks:
        words = axis.words or [f"{tick:g}" for tick in axis.ticks]
        axes.set(**{f"{which}ticks": axis.ticks, f"{which}ticklabels": words})
    if axis.limits is not None:
        axes.set(**{f"{which}lim": axis.limits})


def _draw_curve(axes: Any, curve: Curve) -> None:
    if curve.is_shown:
        style = {"color": curve.stroke.colour, "linestyle": _PATTERNS[curve.stroke.dash]}
        mark = {"marker": "o", "markersize": 3.0} if curve.has_marks else {}
        axes.plot(*curve.points, **mark, linewidth=_THINNER * curve.stroke.width, label=curve.name, **style)


def _draw_points(axes: Any, points: Points) -> None:
    style = {"color": points.colour, "marker": _SYMBOLS[points.symbol], "markersize": _THINNER * points.size}
    axes.plot(points.x, points.y, linestyle="none", label=points.name, **style)


def _draw_ticks(axes: Any, ticks: Ticks) -> None:
    style = {"color": ticks.colour, "linewidth": 0.6, "linestyle": _PATTERNS[ticks.dash], "label": ticks.name}
    axes.vlines(ticks.x, 0.0, ticks.share, transform=axes.get_xaxis_transform(), **style)


def _draw_band(axes: Any, band: Band) -> None:
    look = {"color": band.colour, "alpha": 1.5 * band.opacity, "linewidth": 0, "zorder": 0.5}
    axes.axvspan(band.start, band.end, label="interval of interest", **look)


def _draw_level(axes: Any, level: Level) -> None:
    style = {"color": level.colour, "linewidth": 0.8, "linestyle": "--"}
    if level.is_upright:
        axes.axvline(level.at, **style)
        place = {"rotation": 90, "ha": "right", "va": "top", "transform": axes.get_xaxis_transform()}
        axes.text(level.at, 0.98, level.text, fontsize=8, **place)
    else:
        axes.axhline(level.at, **style)
        axes.text(0.0, level.at, f" {level.text}", fontsize=8, va="bottom", transform=axes.get_yaxis_transform())


def _draw_bars(axes: Any, bars: Bars, number: int, count: int) -> None:
    """Draw one set of bars beside the others of the chart."""
    is_named = isinstance(bars.x, tuple)
    x = np.arange(float(len(bars.x))) if is_named else np.asarray(bars.x)
    gap = float(np.diff(np.unique(x)).min()) if len(np.unique(x)) > 1 else 1.0
    width = (bars.width or 0.9 * gap) / count
    colour, hatching = fill(bars.index)
    look: dict[str, Any] = {"color": colour, "hatch": _HATCHES[hatching], "edgecolor": "white", "linewidth": 0.3}
    places = x + (number - 0.5 * (count - 1)) * width
    if bars.interval is not None:
        look["yerr" if not bars.is_lying else "xerr"] = (bars.y - bars.interval[0], bars.interval[1] - bars.y)
        look["error_kw"] = {"linewidth": 0.8, "capsize": 2.5}
    (axes.barh if bars.is_lying else axes.bar)(places, bars.y, width, label=bars.name, **look)
    if is_named:
        axes.set(**{"yticks" if bars.is_lying else "xticks": x})
        axes.set(**{"yticklabels" if bars.is_lying else "xticklabels": bars.x})


def _draw_envelope(axes: Any, envelope: Envelope) -> None:
    look = {"color": envelope.colour, "alpha": envelope.opacity, "linewidth": 0}
    axes.fill_between(envelope.x, envelope.low, envelope.high, label=envelope.name, **look)


def _draw_cells(axes: Any, cells: Cells) -> None:
    axes.grid(visible=False)
    for (row, column), colour in np.ndenumerate(np.array(cells.colours, dtype=object)):
        if colour:
            look = {"facecolor": colour, "edgecolor": ink_on(colour), "linewidth": 0.0}
            hatch = "//" if cells.hatched[row, column] else ""
            axes.bar(column, 1.0, 1.0, row - 0.5, hatch=hatch, **look)
            box = {"facecolor": colour, "edgecolor": "none", "pad": 1.0}
            place = {"ha": "center", "va": "center", "fontsize": 8, "bbox": box}
            axes.text(column, row, cells.words[row][column], color=ink_on(colour), **place)


_DRAWN: Final[dict[type, Callable[[Any, Any], None]]] = {
    Curve: _draw_curve, Points: _draw_points, Ticks: _draw_ticks, Band: _draw_band, Level: _draw_level,
    Envelope: _draw_envelope, Cells: _draw_cells,
}  # fmt: skip

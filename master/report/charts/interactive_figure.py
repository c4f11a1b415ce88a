"""The renderer for pages: charts as dictionaries for plotly.js. Colours of paper, ink and grid are left to the page."""

from __future__ import annotations

import html
from collections.abc import Callable
from typing import Any, Final

import numpy as np

from master.report.charts.chart import (
    Axis,
    Band,
    Bars,
    Cells,
    Chart,
    Curve,
    Envelope,
    Level,
    Part,
    Points,
    Stroke,
    Ticks,
    fill,
    gapped,
    ink_on,
)
from master.report.charts.sample_packing import packed

Trace = dict[str, Any]

_PATTERNS: Final = ("", "/", "x", "-", ".", "+")
#: An invisible second ordinate from 0 to 1, to which the ticks belong.
_SHARES: Final = {"overlaying": "y", "range": [0, 1], "visible": False, "fixedrange": True}


def interactive_figure(chart: Chart) -> dict[str, Any]:
    """Return ``data`` and ``layout`` of a chart for plotly.js."""
    shapes = [_shape(part) for part in chart.parts if isinstance(part, Band | Level)]
    data = [trace for part in chart.parts if not isinstance(part, Band | Level) for trace in _traces(part)]
    layout: dict[str, Any] = {"xaxis": _axis(chart.x), "yaxis": _axis(chart.y), "shapes": shapes}
    if any(isinstance(part, Ticks) for part in chart.parts):
        layout["yaxis2"] = _SHARES
    if any(isinstance(bars, Bars) and bars.width is None and not isinstance(bars.x, tuple) for bars in chart.parts):
        layout["bargap"] = 0.04
    if any(isinstance(part, Cells) for part in chart.parts):
        layout |= {"barmode": "overlay", "bargap": 0}
    if chart.group:
        layout["meta"] = {"sync": chart.group}
    return {"data": data, "layout": layout}


def _traces(part: Part) -> list[Trace]:
    return _cells(part) if isinstance(part, Cells) else [_TRACES[type(part)](part)]


def _axis(axis: Axis) -> dict[str, Any]:
    found: dict[str, Any] = {"title": {"text": _plain(axis.label)}}
    if axis.limits is not None:
        found["range"] = np.log10(axis.limits).tolist() if axis.is_logarithmic else list(axis.limits)
    if axis.is_logarithmic:
        found |= {"type": "log", "exponentformat": "power"}
    if axis.ticks:
        found["tickvals"] = list(axis.ticks)
    if axis.words:
        found["ticktext"] = [_plain(word) for word in axis.words]
    return found


def _plain(text: str) -> str:
    """Return text that plotly.js shows as it is: it takes a few elements of HTML for what they are."""
    return html.escape(text, quote=False).replace("\n", "<br>")


def _curve(curve: Curve) -> Trace:
    trace = _lines(curve.name, *curve.points, curve.stroke)
    if curve.has_marks:
        trace |= {"mode": "lines+markers", "marker": {"size": 6}}
    if curve.is_whole:
        trace["hoverinfo"] = "skip"
    return trace if curve.is_shown else {**trace, "visible": "legendonly"}


def _ticks(ticks: Ticks) -> Trace:
    x, y = gapped(ticks.x, np.zeros(len(ticks.x)), np.full(len(ticks.x), ticks.share))
    trace = _lines(ticks.name, x, y, Stroke(ticks.colour, ticks.dash, 1.0))
    return {**trace, "yaxis": "y2", "hoverinfo": "skip", "opacity": 0.75}


def _bars(bars: Bars) -> Trace:
    colour, hatching = fill(bars.index)
    marker = {"color": colour, "pattern": {"shape": _PATTERNS[hatching], "solidity": 0.4}}
    x = [_plain(name) for name in bars.x] if isinstance(bars.x, tuple) else packed(bars.x)
    along, across = ("y", "x") if bars.is_lying else ("x", "y")
    trace: Trace = {"type": "bar", "name": _plain(bars.name), "marker": marker, along: x, across: packed(bars.y)}
    trace["width"] = bars.width
    if bars.is_lying:
        trace["orientation"] = "h"
    if bars.interval is not None:
        below, above = bars.y - bars.interval[0], bars.interval[1] - bars.y
        ends = {"type": "data", "symmetric": False, "array": packed(above), "arrayminus": packed(below)}
        trace[f"error_{across}"] = {**ends, "thickness": 1.4, "width": 4}
    said = {"text": [_plain(w) for w in bars.words], "textposition": "none", "hovertemplate": "%{text}"}
    return {**trace, **said} if bars.words else trace


def _envelope(envelope: Envelope) -> Trace:
    gap = np.array([np.nan])
    x, y = (np.concatenate([np.concatenate((o[k], gap)) for o in envelope.outlines] or [gap]) for k in (0, 1))
    trace = _lines(envelope.name, x, y, Stroke(envelope.colour, width=0.0))
    return {
        **trace,
        "fill": "toself",
        "fillcolor": _transparent(envelope.colour, envelope.opacity),
        "hoverinfo": "skip",
    }


def _cells(cells: Cells) -> list[Trace]:
    """Return cells as bars that stand on each other's place: they need no other kind of trace, and have hatching.

    The hatching lies over them, a trace for each ink: lines of one trace have one colour.
    """
    colours = {(r, c): colour for r, row in enumerate(cells.colours) for c, colour in enumerate(row) if colour}
    whole = {
        **_boxes(list(colours)),
        "marker": {"color": list(colours.values()), "line": {"width": 0}},
        "text": [_plain(cells.words[r][c]) for r, c in colours],
        "hovertext": [_plain(cells.hints[r][c]) for r, c in colours],
        "hoverinfo": "text",
        "textposition": "inside",
        "insidetextanchor": "middle",
        "textangle": 0,
        "insidetextfont": {"color": [ink_on(colour) for colour in colours.values()], "size": 12},
    }
    hatched: dict[str, list[tuple[int, int]]] = {}
    for place, colour in colours.items():
        if cells.hatched[place]:
            hatched.setdefault(ink_on(colour), []).append(place)
    return [whole, *(_hatching(places, ink) for ink, places in hatched.items())]


def _hatching(places: list[tuple[int, int]], ink: str) -> Trace:
    pattern = {"shape": "/", "size": 9, "solidity": 0.12, "fgcolor": ink, "fgopacity": 0.5, "bgcolor": "rgba(0,0,0,0)"}
    return {**_boxes(places), "marker": {"color": ink, "pattern": pattern, "line": {"width": 0}}, "hoverinfo": "skip"}


def _boxes(places: list[tuple[int, int]]) -> Trace:
    """Return bars that fill the cells at these rows and columns."""
    base = [row - 0.5 for row, _ in places]
    box = {"x": [column for _, column in places], "y": [1] * len(places), "base": base, "width": 1}
    return {"type": "bar", **box, "showlegend": False}


def _points(points: Points) -> Trace:
    marker = {"color": points.colour, "size": points.size, "symbol": points.symbol}
    trace = {"type": "scatter", "mode": "markers", "x": packed(points.x), "y": packed(points.y), "marker": marker}
    said = {"text": [_plain(word) for word in points.words]} if points.words else {}
    return {**trace, "name": _plain(points.name), **said}


def _lines(name: str, x: Any, y: Any, stroke: Stroke) -> Trace:
    line = {"color": stroke.colour, "dash": stroke.dash, "width": stroke.width}
    return {"type": "scatter", "mode": "lines", "x": packed(x), "y": packed(y), "line": line, "name": _plain(name)}


def _shape(part: Band | Level) -> dict[str, Any]:
    if isinstance(part, Band):
        box = {"type": "rect", "xref": "x", "yref": "paper", "x0": part.start, "x1": part.end, "y0": 0, "y1": 1}
        edge = {"width": 1, "color": _transparent(part.edge, 0.6)}
        return {**box, "fillcolor": _transparent(part.colour, part.opacity), "layer": "below", "line": edge}
    place: dict[str, Any] = {"xref": "paper", "yref": "y", "x0": 0, "x1": 1, "y0": part.at, "y1": part.at}
    label: dict[str, Any] = {"textposition": "start", "yanchor": "bottom"}
    if part.is_upright:
        place = {"xref": "x", "yref": "paper", "x0": part.at, "x1": part.at, "y0": 0, "y1": 1}
        label = {"textposition": "end", "textangle": -90, "xanchor": "right"}
    line = {"color": part.colour, "width": 1.2, "dash": "dash"}
    return {"type": "line", **place, "line": line, "label": {"text": part.text, "font": {"size": 11}, **label}}


def _transparent(colour: str, opacity: float) -> str:
    """Return a colour with its opacity in the notation of CSS.

    Examples
    --------
    >>> _transparent("#e6b428", 0.16)
    'rgba(230,180,40,0.16)'
    """
    red, green, blue = bytes.fromhex(colour[1:])
    return f"rgba({red},{green},{blue},{opacity})"


_TRACES: Final[dict[type, Callable[[Any], Trace]]] = {
    Curve: _curve, Ticks: _ticks, Bars: _bars, Points: _points, Envelope: _envelope
}  # fmt: skip

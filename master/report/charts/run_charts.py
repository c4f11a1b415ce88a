"""Charts of a run as plain dictionaries that plotly.js draws; nothing here knows how a page looks.

Curves are told apart by width, dash and lightness as well as by colour (Okabe and Ito's palette), so that they
survive a grey printer and colour-blind eyes.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from master.arrays import FloatArray
from master.evaluation.contact_signals import Signals, power_spectrum
from master.evaluation.en50367_limits import limits_at
from master.evaluation.filters import FILTER_REACH, stands_in
from master.evaluation.line_geometry import Uplift, aligned, by_section, indexed, met, period_of, slackness
from master.recording.recording import Recording
from master.report.charts.sample_packing import kept_samples, packed
from master.results.run_results import Results

Figure = dict[str, Any]

COLOURS: Final = ("#1f80c4", "#d55e00", "#009e73", "#cc79a7", "#b8860b", "#56b4e9")
DASHES: Final = ("solid", "dash", "dot", "dashdot", "longdash", "longdashdot")
GREY: Final = "#8a8f98"
MARK: Final = "#6b7280"
INTERVAL: Final = "rgba(230,180,40,0.16)"
#: What is said of a place on a line that closes on itself.
_IN_LAP: Final = " in its lap"
#: Points of one of many histories.
_FEW_POINTS: Final = 700
#: Droppers whose histories are drawn.
_MOST_DROPPERS: Final = 16
#: Width of the bins of the position on the strip [m] and of the force [N].
_LATERAL_BIN: Final = 0.010
#: Highest frequency of the spectrum [Hz].
_HIGHEST: Final = 100.0


@dataclass(frozen=True)
class Chart:
    """A chart and its caption.

    Attributes
    ----------
    key : str
        Identifier on the page.
    title, note : str
        Heading, and what a reader must know.
    figure : dict
        ``data`` and ``layout`` for plotly.js.
    height : int
        Pixels.
    """

    key: str
    title: str
    figure: Figure
    note: str = ""
    height: int = 380


@dataclass(frozen=True)
class Curve:
    """A line's style: number in the palette, and name in the legend."""

    index: int
    name: str
    wide: float = 1.8

    @property
    def line(self) -> dict[str, Any]:
        """Return colour, dash and width; no two of the first 36 are alike."""
        dash = DASHES[(self.index + self.index // len(COLOURS)) % len(DASHES)]
        return {"color": COLOURS[self.index % len(COLOURS)], "dash": dash, "width": self.wide}


@dataclass
class Axes:
    """Titles and extras of a chart's layout."""

    x: str
    y: str
    shapes: list[Figure] = field(default_factory=list)
    y_range: tuple[float, float] | None = None
    extra: Figure = field(default_factory=dict)

    def layout(self) -> Figure:
        """Return the layout."""
        y: Figure = {"title": {"text": self.y}}
        if self.y_range is not None:
            y["range"] = list(self.y_range)
        return {"xaxis": {"title": {"text": self.x}}, "yaxis": y, "shapes": self.shapes, **self.extra}


def run_charts(results: Results, signals: Sequence[Signals]) -> list[Chart]:
    """Return every chart that the run has the data for, in the order of the report."""
    found = [
        *force_charts(results, signals),
        histogram(signals),
        spectrum(results, signals),
        uplift_bars(results),
        uplift_history(results),
        *dropper_charts(results),
        lateral_histogram(signals),
        *(c for name, values in results.geometry.items() for c in geometry_charts(name, values)),
    ]
    return [chart for chart in found if chart is not None]


def force_charts(results: Results, signals: Sequence[Signals]) -> list[Chart]:
    """Return the contact force over track position, one chart per contact."""
    charts = [_force_chart(results, s) for s in signals]
    return [*charts, _forces_together(results, signals)] if len(signals) > 1 else charts


def _forces_together(results: Results, signals: Sequence[Signals]) -> Chart:
    traces = [
        _line(s.position, s.shown, Curve(i, s.contact.pantograph, 1.7).line, s.contact.pantograph)
        for i, s in enumerate(signals)
    ]
    limits = (min(float(s.position.min()) for s in signals), max(float(s.position.max()) for s in signals))
    axes = Axes("track position of the contact [m]", force_title(signals), interval_shape(results, limits))
    axes.extra = {"meta": {"sync": "track"}}
    return Chart("forces_together", "Contact forces together", _figure(traces, axes), "", 360)


def _force_chart(results: Results, s: Signals) -> Chart:
    shown = s.shown
    traces = [
        _line(s.position, s.raw, {"color": GREY, "width": 0.8}, "raw"),
        _line(s.position, shown, {"color": COLOURS[0], "width": 2.2}, s.filter.band),
    ]
    limits = (float(s.position.min()), float(s.position.max()))
    traces += line_marks(results, s.contact.catenary, limits)
    axes = Axes("track position of the contact [m]", "contact force [N]", interval_shape(results, limits))
    axes.y_range = force_range(s)
    marks = {"overlaying": "y", "range": [0, 1], "visible": False, "fixedrange": True}
    x_axis = {"title": {"text": axes.x}, "range": list(limits)}
    axes.extra = {"xaxis": x_axis, "yaxis2": marks, "meta": {"sync": "track"}}
    note = f"Thin grey: as computed; thick: {s.filter.short}. Shaded: interval of interest. "
    note += "Dashed: supports; ticks at the bottom: droppers."
    if not np.isfinite(shown[0]):
        note += f" The filtered force is drawn from {FILTER_REACH:g} s after the first contact on; before, it rings."
    name = f"force_{s.contact.catenary}_{s.contact.index}"
    return Chart(name, f"Contact force, {s.contact.pantograph}", {"data": traces, "layout": axes.layout()}, note, 440)


def force_title(signals: Sequence[Signals]) -> str:
    """Return the title of an axis for low-passed forces."""
    bands = ", ".join(dict.fromkeys(s.filter.band for s in signals))
    return f"contact force, {bands} [N]"


def force_range(s: Signals) -> tuple[float, float]:
    """Return limits that show the whole filtered force and the raw force of the interval [N]."""
    shown = s.shown[np.isfinite(s.shown)]
    inside = s.raw[s.inside]
    top = max(float(shown.max(initial=1.0)), float(inside.max(initial=1.0)))
    return min(0.0, float(shown.min(initial=0.0))) - 0.06 * top, 1.05 * top


def line_marks(results: Results, catenary: str, limits: tuple[float, float]) -> list[Figure]:
    """Return supports (dashed, over the whole height) and droppers (ticks at the bottom) as traces."""
    values = results.geometry.get(catenary, {})
    marks = (("support", "dash", 1.0, (0.0, 1.0)), ("dropper", "solid", 1.0, (0.0, 0.03)))
    return [
        _ticks(met(values, kind, limits), kind, dash, width, span)
        for kind, dash, width, span in marks
        if len(met(values, kind, limits))
    ]


def _ticks(x: FloatArray, name: str, dash: str, width: float, span: tuple[float, float]) -> Figure:
    """Return vertical ticks on an invisible second axis that runs from 0 to 1."""
    xs = np.repeat(x, 3)
    ys = np.tile([*span, np.nan], len(x))
    style = {"color": MARK, "width": width, "dash": dash}
    return {**_trace(xs, ys, style, name), "yaxis": "y2", "hoverinfo": "skip", "opacity": 0.75}


def interval_shape(results: Results, limits: tuple[float, float]) -> list[Figure]:
    """Return the interval that the figures come from as a shaded band, if there is one."""
    start, end = results.evaluated_interval
    if start is None and end is None:
        return []
    x0, x1 = limits[0] if start is None else start, limits[1] if end is None else end
    return [_band(x0, x1)]


def _band(x0: float, x1: float) -> Figure:
    line = {"width": 1, "color": "rgba(170,120,0,0.6)"}
    return {
        "type": "rect", "xref": "x", "yref": "paper", "x0": x0, "x1": x1, "y0": 0, "y1": 1,
        "fillcolor": INTERVAL, "line": line, "layer": "below",
    }  # fmt: skip


def histogram(signals: Sequence[Signals]) -> Chart | None:
    """Return the histogram of the filtered force in the interval."""
    chosen = [s for s in signals if np.count_nonzero(s.inside) > 1]
    if not chosen:
        return None
    cuts = [s.filtered[s.inside] for s in chosen]
    edges = common_edges(cuts)
    traces = [
        _bars(0.5 * (edges[1:] + edges[:-1]), shares(c, edges), s.contact.pantograph, i)
        for i, (s, c) in enumerate(zip(chosen, cuts, strict=True))
    ]
    axes = Axes(force_title(chosen), "share of time [%]", extra={"bargap": 0.04, "barmode": "group"})
    return Chart("histogram", "Histogram of the contact force", _figure(traces, axes), "Interval of interest.", 320)


def common_edges(values: Sequence[FloatArray], count: int = 30) -> FloatArray:
    """Return the edges of ``count`` bins that hold all values, shape (count + 1,)."""
    low, high = min(float(v.min()) for v in values), max(float(v.max()) for v in values)
    if high <= low:
        low, high = low - 0.5, high + 0.5
    return np.linspace(low, high, count + 1)


def shares(values: FloatArray, edges: FloatArray) -> FloatArray:
    """Return the share of the values in each bin [%]."""
    return 100.0 * np.histogram(values, bins=edges)[0] / max(1, len(values))


def spectrum(results: Results, signals: Sequence[Signals]) -> Chart | None:
    """Return the power spectral density of the raw force in the interval."""
    chosen = [s for s in signals if np.count_nonzero(s.inside) > 16]
    if not chosen:
        return None
    traces = [spectrum_trace(s, Curve(i, s.contact.pantograph, 1.3)) for i, s in enumerate(chosen)]
    cutoff = chosen[0].filter.cutoff
    speed, span = _speed(chosen[0]), _median_span(results, chosen[0].contact.catenary)
    axes = Axes("frequency [Hz]", "power spectral density [N\u00b2/Hz]", [_upright(cutoff, f"cut-off {cutoff:g} Hz")])
    if span:
        axes.shapes.append(_upright(speed / span, f"span passing {speed / span:.2f} Hz"))
    figure = _figure(traces, axes)
    limits = [float(np.log10(0.3)), float(np.log10(_HIGHEST))]
    figure["layout"]["xaxis"] |= {"type": "log", "range": limits, "tickvals": [0.5, 1, 2, 5, 10, 20, 50, 100]}
    figure["layout"]["yaxis"] |= {"type": "log", "exponentformat": "power"}
    note = "Force as computed (not filtered), interval of interest, one Hann window."
    return Chart("spectrum", "Spectrum of the contact force", figure, note, 360)


def spectrum_trace(s: Signals, curve: Curve) -> Figure:
    """Return the curve of one contact's spectrum."""
    frequency, density = power_spectrum(s.raw[s.inside], s.step)
    part = (frequency > 0.0) & (frequency <= _HIGHEST)
    return _line(frequency[part], density[part], curve.line, curve.name)


def _speed(s: Signals) -> float:
    where, when = s.position[s.inside], s.time[s.inside]
    return float((where[-1] - where[0]) / (when[-1] - when[0]))


def _median_span(results: Results, catenary: str) -> float | None:
    x = np.unique(indexed(results.geometry.get(catenary, {}), "support", "x"))
    return float(np.median(np.diff(x))) if len(x) > 1 else None


def _upright(x: float, text: str) -> Figure:
    label = {"text": text, "textposition": "end", "textangle": -90, "font": {"size": 11}, "xanchor": "right"}
    return {
        "type": "line", "xref": "x", "yref": "paper", "x0": x, "x1": x, "y0": 0, "y1": 1,
        "line": {"color": MARK, "width": 1, "dash": "dash"}, "label": label,
    }  # fmt: skip


def uplift_bars(results: Results) -> Chart | None:
    """Return the largest uplift of every support, where it stands."""
    uplifts = results.uplifts
    if not uplifts:
        return None
    catenaries = sorted({u.component for u in uplifts})
    traces = [uplift_trace([u for u in uplifts if u.component == c], c, i) for i, c in enumerate(catenaries)]
    most = 1e3 * limits_at(0.0, results.evaluation.limits).uplift.value
    shapes = [_level(most, f"limit {most:g} mm")]
    if not uplifts[0].period:
        shapes += interval_shape(results, _limits(uplifts))
    axes = Axes(_support_axis(uplifts), "largest uplift [mm]", shapes)
    axes.y_range = (0.0, 1.1 * max(most, *(1e3 * u.maximum for u in uplifts)))
    return Chart("uplift", "Uplift of the contact wire at the supports", _figure(traces, axes), "Whole run.", 320)


def uplift_trace(uplifts: Sequence[Uplift], name: str, index: int = 0) -> Figure:
    """Return the bars of one catenary's supports."""
    x = np.array([_place(u) for u in uplifts])
    trace = _bars(x, np.array([1e3 * u.maximum for u in uplifts]), name, index)
    gap = float(np.median(np.diff(np.unique(x)))) if len(x) > 1 else 1.0
    words = [f"support {u.support}, {u.place}: {1e3 * u.maximum:.1f} mm at {u.time:.2f} s" for u in uplifts]
    return {**trace, "width": 0.35 * gap, "text": words, "textposition": "none", "hovertemplate": "%{text}"}


def _place(u: Uplift) -> float:
    return float(u.support) if u.x is None else u.x


def _support_axis(uplifts: Sequence[Uplift]) -> str:
    if uplifts[0].x is None:
        return "support number"
    return f"track position of the support{_IN_LAP if uplifts[0].period else ''} [m]"


def _limits(uplifts: Sequence[Uplift]) -> tuple[float, float]:
    places = [_place(u) for u in uplifts]
    return min(places), max(places)


def _level(y: float, text: str) -> Figure:
    return {
        "type": "line", "xref": "paper", "yref": "y", "x0": 0, "x1": 1, "y0": y, "y1": y,
        "line": {"color": "#b3261e", "width": 1.2, "dash": "dash"},
        "label": {"text": text, "textposition": "start", "yanchor": "bottom", "font": {"size": 11}},
    }  # fmt: skip


def uplift_history(results: Results) -> Chart | None:
    """Return the uplift of the supports in the interval over time."""
    chosen = [u for u in results.uplifts if u.stands_in(results.interval)] or list(results.uplifts)
    if not chosen:
        return None
    traces = [_uplift_curve(results, u, i) for i, u in enumerate(chosen)]
    note = "Supports in the interval of interest; click a name to hide or show it."
    return Chart("uplift_history", "History of the uplift", _figure(traces, Axes("time [s]", "uplift [mm]")), note, 360)


def _uplift_curve(results: Results, u: Uplift, index: int) -> Figure:
    name = f"{u.component}.support[{u.support}].uplift"
    recording = next(r for r in results.recordings if name in r)
    label = u.place
    trace = _line(recording.time, 1e3 * recording[name], Curve(index, label, 1.4).line, label, _FEW_POINTS)
    return {**trace, "visible": True if index < 6 else "legendonly"}


def dropper_charts(results: Results) -> list[Chart]:
    """Return the range of every dropper's force, and the histories of those in the interval."""
    charts = []
    for recording in results.recordings:
        names = recording.matching("*.dropper[*].force")
        for component in sorted({n.partition(".dropper[")[0] for n in names}):
            own = [n for n in names if n.startswith(f"{component}.dropper[")]
            if len(recording.time):
                charts += _dropper_charts(results, recording, component, own)
    return charts


def _dropper_charts(results: Results, recording: Recording, component: str, names: Sequence[str]) -> list[Chart]:
    values = results.geometry.get(component, {})
    x, period = indexed(values, "dropper", "x"), period_of(values)
    place = x if len(x) == len(names) else np.arange(1.0, len(names) + 1.0)
    forces = np.column_stack([recording[n] for n in names])
    told = {f"{s.component}.{s.name}.force": 100.0 * float(np.mean(s.slack)) for s in slackness(results.recordings)}
    shares = np.array([told[n] for n in names])
    title = f"track position of the dropper{_IN_LAP if period else ''} [m]" if place is x else "dropper number"
    limits = (float(place.min()), float(place.max()))
    axes = Axes(title, "dropper force [N]", interval_shape(results, limits) if place is x and not period else [])
    note = "Bar: from least to greatest in the run; dot: at the start; cross: slack at some time (hover for its share)."
    figure = _figure(_dropper_range(place, forces, shares), axes)
    found = [Chart(f"droppers_{component}", "Dropper forces", figure, note, 360)]
    inside = [i for i, p in enumerate(place) if stands_in(float(p), results.interval, period)]
    chosen = _middle(inside or list(range(len(names))))
    curves = [_dropper_curve(recording.time, forces[:, i], f"{place[i]:.1f}", k) for k, i in enumerate(chosen)]
    found.append(_dropper_history(component, curves))
    return found


def _middle(chosen: list[int]) -> list[int]:
    first = max(0, (len(chosen) - _MOST_DROPPERS) // 2)
    return chosen[first : first + _MOST_DROPPERS]


def _dropper_range(place: FloatArray, forces: FloatArray, share: FloatArray) -> list[Figure]:
    low, high = forces.min(axis=0), forces.max(axis=0)
    xs = np.repeat(place, 3)
    ys = np.column_stack((low, high, np.full(len(place), np.nan))).ravel()
    slack = share > 0.0
    traces = [
        {**_trace(xs, ys, {"color": COLOURS[0], "width": 3}, "least to greatest"), "hoverinfo": "skip"},
        _points(place, forces[0], "at the start", {"color": MARK, "size": 5, "symbol": "circle"}),
    ]
    if slack.any():
        marker = {"color": COLOURS[1], "size": 8, "symbol": "x"}
        words = [f"slack {s:.1f} % of the time" for s in share[slack]]
        traces.append({**_points(place[slack], low[slack], "slack", marker), "text": words})
    return traces


def _dropper_history(component: str, curves: list[Figure]) -> Chart:
    middle = len(curves) // 2
    for i, curve in enumerate(curves):
        curve["visible"] = True if abs(i - middle) <= 3 else "legendonly"
    figure = _figure(curves, Axes("time [s]", "dropper force [N]", [_level(0.0, "carries nothing")]))
    note = "Droppers in the middle of the interval of interest; click a name to hide or show it."
    return Chart(f"dropper_history_{component}", "History of the dropper forces", figure, note, 400)


def _dropper_curve(time: FloatArray, force: FloatArray, name: str, index: int) -> Figure:
    return _line(time, force, Curve(index, name, 1.3).line, f"{name} m", _FEW_POINTS)


def lateral_histogram(signals: Sequence[Signals]) -> Chart | None:
    """Return how the contact is spread over the strip, which is how the strip wears."""
    traces = []
    for i, s in enumerate(signals):
        known = _known_lateral(s)
        if known.size:
            edges = np.arange(np.floor(known.min() / _LATERAL_BIN), np.ceil(known.max() / _LATERAL_BIN) + 1.5)
            edges *= _LATERAL_BIN
            centres = 0.5 * (edges[1:] + edges[:-1])
            traces.append(_bars(1e3 * centres, shares(known, edges), s.contact.pantograph, i))
    if not traces:
        return None
    axes = Axes("contact on the strip, left positive [mm]", "share of time [%]")
    axes.extra = {"bargap": 0.04, "barmode": "group"}
    note = "Interval of interest; the more even, the more evenly the strip wears."
    return Chart("lateral", "Contact on the collector strip (wear)", _figure(traces, axes), note, 320)


def _known_lateral(s: Signals) -> FloatArray:
    if s.lateral is None:
        return np.zeros(0)
    cut = s.lateral[s.inside]
    return cut[np.isfinite(cut)]


def geometry_charts(name: str, values: dict[str, float]) -> list[Chart]:
    """Return the static line in elevation and plan, its sections in one picture."""
    sections = [_static_line(section) for section in by_section(values)]
    if any(not len(supports["x"]) or not len(droppers["x"]) for droppers, supports in sections):
        return []
    title = f"Static geometry of the {name}"
    elevation = Chart(f"elevation_{name}", f"{title}: elevation", _together([_elevation(*s) for s in sections]))
    if any(np.isnan(d["lower.y"]).all() or np.isnan(s["y"]).all() for d, s in sections):
        return [elevation]
    return [elevation, Chart(f"plan_{name}", f"{title}: plan", _together([_plan(*s) for s in sections]))]


def _static_line(values: dict[str, float]) -> tuple[dict[str, FloatArray], dict[str, FloatArray]]:
    """Return positions of droppers and of supports by the name of the coordinate."""
    droppers = aligned(values, "dropper", ("x", "upper.z", "lower.z", "lower.y"))
    return droppers, aligned(values, "support", ("x", "y", "z", "messenger_wire.z"))


def _together(figures: Sequence[Figure]) -> Figure:
    """Return the sections' figures in one; the legend names a section where there are several."""
    if len(figures) == 1:
        return figures[0]
    traces = [
        {**_dashed(trace, number - 1), "name": f"{trace['name']}, section {number}"}
        for number, figure in enumerate(figures, 1)
        for trace in figure["data"]
    ]
    return {"data": traces, "layout": figures[0]["layout"]}


def _dashed(trace: Figure, index: int) -> Figure:
    """Return a section's trace in the section's dash."""
    return {**trace, "line": {**trace["line"], "dash": DASHES[index % len(DASHES)]}} if "line" in trace else trace


def _elevation(droppers: dict[str, FloatArray], supports: dict[str, FloatArray]) -> Figure:
    x, gap = droppers["x"], np.full(len(droppers["x"]), np.nan)
    ys = np.column_stack((droppers["lower.z"], droppers["upper.z"], gap)).ravel()
    traces = [{**_trace(np.repeat(x, 3), ys, {"color": GREY, "width": 1}, "droppers"), "hoverinfo": "skip"}]
    wires = (("contact wire", "lower.z", "z"), ("messenger wire", "upper.z", "messenger_wire.z"))
    for i, (label, low, high) in enumerate(wires):
        xs, zs = _merged(x, droppers[low], supports["x"], supports[high])
        traces.append(_line(xs, zs, {**Curve(i, label).line, "dash": "solid"}, label))
    if not np.isnan(supports["z"]).all():
        marker = {"color": MARK, "size": 8, "symbol": "triangle-up"}
        traces.append(_points(supports["x"], supports["z"], "support", marker))
    return _figure(traces, Axes("track position [m]", "height above rail [m]"))


def _plan(droppers: dict[str, FloatArray], supports: dict[str, FloatArray]) -> Figure:
    xs, ys = _merged(droppers["x"], droppers["lower.y"], supports["x"], supports["y"])
    traces = [
        _line(xs, 1e3 * ys, {"color": COLOURS[0], "width": 1.8}, "contact wire"),
        _points(supports["x"], 1e3 * supports["y"], "support", {"color": MARK, "size": 8, "symbol": "triangle-up"}),
    ]
    return _figure(traces, Axes("track position [m]", "lateral position, left positive [mm]"))


def _merged(x1: FloatArray, y1: FloatArray, x2: FloatArray, y2: FloatArray) -> tuple[FloatArray, FloatArray]:
    x, y = np.concatenate((x1, x2)), np.concatenate((y1, y2))
    x, y = x[np.isfinite(y)], y[np.isfinite(y)]
    order = np.argsort(x, kind="stable")
    return x[order], y[order]


def _figure(traces: Iterable[Figure], axes: Axes) -> Figure:
    return {"data": list(traces), "layout": axes.layout()}


def curve_trace(x: FloatArray, y: FloatArray, curve: Curve) -> Figure:
    """Return a decimated curve."""
    return _line(x, y, curve.line, curve.name)


def _line(x: FloatArray, y: FloatArray, style: Figure, name: str, most: int | None = None) -> Figure:
    kept = kept_samples(y) if most is None else kept_samples(y, most)
    return _trace(x[kept], y[kept], style, name)


def _trace(x: FloatArray, y: FloatArray, style: Figure, name: str) -> Figure:
    return {"type": "scatter", "mode": "lines", "x": packed(x), "y": packed(y), "line": style, "name": name}


def _points(x: FloatArray, y: FloatArray, name: str, marker: Figure) -> Figure:
    return {"type": "scatter", "mode": "markers", "x": packed(x), "y": packed(y), "marker": marker, "name": name}


def _bars(x: FloatArray, y: FloatArray, name: str, index: int) -> Figure:
    return {**grouped_bars(index, name), "x": packed(x), "y": packed(y)}


def grouped_bars(index: int, name: str) -> Figure:
    """Return bars without values, told apart by colour and hatching."""
    pattern = {"shape": ("", "/", "x", "-", ".", "+")[index % 6], "solidity": 0.4}
    return {"type": "bar", "name": name, "marker": {"color": COLOURS[index % len(COLOURS)], "pattern": pattern}}

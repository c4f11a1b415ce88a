"""Charts of the contact: its force over the track, histogram and spectrum, its height and its place on the strip."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from master.arrays import FloatArray
from master.evaluation.contact_signals import Signals, power_spectrum
from master.evaluation.filters import FILTER_REACH
from master.evaluation.line_geometry import indexed
from master.report.charts.chart import GREY, Axis, Bars, Chart, Curve, Level, Part, Stroke, stroke
from master.report.charts.line_charts import interval_band, line_marks
from master.results.run_results import Results

#: Abscissa of charts over the position of the contact.
TRACK: Final = Axis("track position of the contact", "m")
FREQUENCY: Final = Axis("frequency", "Hz", (0.3, 100.0), True, (0.5, 1, 2, 5, 10, 20, 50, 100))
DENSITY: Final = Axis("power spectral density", "N\u00b2/Hz", is_logarithmic=True)
SHARE: Final = Axis("share of time", "%")
_LATERAL_BIN: Final = 0.010  # [m]
_HIGHEST: Final = 100.0  # [Hz]
#: Pieces of a run whose ways are compared, and the share by which they differ at one speed.
_PIECES: Final = 5
_SAME_WAY: Final = 0.01


def force_charts(results: Results, signals: Sequence[Signals]) -> list[Chart]:
    """Return the contact force over track position, one chart per contact."""
    return [_force_chart(results, s) for s in signals]


def _force_chart(results: Results, s: Signals) -> Chart:
    limits = extent([s])
    note = f"Thin grey: as computed; thick: {s.filter.short}. Shaded: interval of interest. "
    note += "Dashed: supports; ticks at the bottom: droppers."
    if not np.isfinite(s.shown[0]):
        note += (
            f" The filtered force is drawn from {FILTER_REACH:g} s after the first contact; the filter rings before."
        )
    return Chart(
        key=f"force_{s.contact.catenary}_{s.contact.index}",
        title=f"Contact force, {s.contact.pantograph}",
        x=Axis(TRACK.name, TRACK.unit, limits),
        y=Axis("contact force", "N", _force_range(s)),
        parts=(
            *interval_band(results, limits),
            Curve("raw", s.position, s.raw, Stroke(GREY, width=0.8)),
            Curve(s.filter.band, s.position, s.shown, stroke(0, 2.2)),
            *line_marks(results, s.contact.catenary, limits),
        ),
        note=note,
        height=440,
        group="track",
    )


def force_over_time(signals: Sequence[Signals]) -> list[Chart]:
    """Return the low-passed forces over time if the speed of a contact changes: track and time then tell two things."""
    if not any(_changes_speed(s) for s in signals):
        return []
    parts = tuple(Curve(s.contact.pantograph, s.time, s.shown, stroke(i, 1.7)) for i, s in enumerate(signals))
    x, note = Axis("time", "s"), "The speed changes; figures are those of the interval's own mean speed."
    return [Chart("force_over_time", "Contact force over time", x, force_axis(signals), parts, note, 360)]


def _changes_speed(s: Signals) -> bool:
    """Return whether the ways of equal pieces of the time differ by more than 1 %."""
    marks = np.interp(np.linspace(s.time[0], s.time[-1], _PIECES + 1), s.time, s.position)
    ways = np.abs(np.diff(marks))
    return bool(np.ptp(ways) > _SAME_WAY * ways.max())


def extent(signals: Sequence[Signals]) -> tuple[float, float]:
    """Return the first and last track position of any contact [m]."""
    return min(float(s.position.min()) for s in signals), max(float(s.position.max()) for s in signals)


def _force_range(s: Signals) -> tuple[float, float]:
    """Return limits that show the whole filtered force and the raw force of the interval [N]."""
    shown = s.shown[np.isfinite(s.shown)]
    top = max(float(shown.max(initial=1.0)), float(s.raw[s.inside].max(initial=1.0)))
    return min(0.0, float(shown.min(initial=0.0))) - 0.06 * top, 1.05 * top


def forces_together(results: Results, signals: Sequence[Signals]) -> list[Chart]:
    """Return the low-passed forces of several contacts in one chart."""
    if len(signals) < 2:
        return []
    parts: list[Part] = [*interval_band(results, extent(signals))]
    parts += [Curve(s.contact.pantograph, s.position, s.shown, stroke(i, 1.7)) for i, s in enumerate(signals)]
    y = force_axis(signals)
    return [Chart("forces_together", "Contact forces together", TRACK, y, tuple(parts), height=360, group="track")]


def force_axis(signals: Sequence[Signals]) -> Axis:
    """Return an axis for low-passed forces."""
    return Axis(f"contact force, {', '.join(dict.fromkeys(s.filter.band for s in signals))}", "N")


def height_chart(results: Results, signals: Sequence[Signals]) -> Chart | None:
    """Return the height of the contact points over track position."""
    drawn = [(s, s.height) for s in signals if s.height is not None]
    if not drawn:
        return None
    limits = extent([s for s, _ in drawn])
    parts: list[Part] = [*interval_band(results, limits)]
    parts += [Curve(s.contact.pantograph, s.position, z, stroke(i, 1.7)) for i, (s, z) in enumerate(drawn)]
    parts += line_marks(results, drawn[0][0].contact.catenary, limits)
    x = Axis(TRACK.name, TRACK.unit, limits)
    return Chart("height", "Height of the contact", x, Axis("contact height", "m"), tuple(parts))


def histogram(signals: Sequence[Signals]) -> Chart | None:
    """Return the histogram of the filtered force in the interval."""
    chosen = [s for s in signals if np.count_nonzero(s.inside) > 1]
    if not chosen:
        return None
    parts = force_bars([(s.contact.pantograph, s.filtered[s.inside]) for s in chosen])
    y = force_axis(chosen)
    return Chart("histogram", "Histogram of the contact force", y, SHARE, parts, "Interval of interest.", 320)


def force_bars(cuts: Sequence[tuple[str, FloatArray]]) -> tuple[Bars, ...]:
    """Return histograms of named forces over the same bins."""
    edges = common_edges([force for _, force in cuts])
    middles = 0.5 * (edges[1:] + edges[:-1])
    return tuple(Bars(name, middles, shares(force, edges), i) for i, (name, force) in enumerate(cuts))


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
    cutoff = chosen[0].filter.cutoff
    parts: list[Part] = [spectrum_curve(s, s.contact.pantograph, stroke(i, 1.3)) for i, s in enumerate(chosen)]
    parts.append(Level(cutoff, f"cut-off {cutoff:g} Hz", is_upright=True))
    if span := _median_span(results, chosen[0].contact.catenary):
        passing = _speed(chosen[0]) / span
        parts.append(Level(passing, f"span passing {passing:.2f} Hz", is_upright=True))
    note = "Force as computed (not filtered), interval of interest, one Hann window."
    return Chart("spectrum", "Spectrum of the contact force", FREQUENCY, DENSITY, tuple(parts), note, 360)


def spectrum_curve(s: Signals, name: str, style: Stroke) -> Curve:
    """Return the curve of one contact's spectrum."""
    frequency, density = power_spectrum(s.raw[s.inside], s.step)
    part = (frequency > 0.0) & (frequency <= _HIGHEST)
    return Curve(name, frequency[part], density[part], style)


def _speed(s: Signals) -> float:
    where, when = s.position[s.inside], s.time[s.inside]
    return float((where[-1] - where[0]) / (when[-1] - when[0]))


def _median_span(results: Results, catenary: str) -> float | None:
    x = np.unique(indexed(results.geometry.get(catenary, {}), "support", "x"))
    return float(np.median(np.diff(x))) if len(x) > 1 else None


def lateral_histogram(signals: Sequence[Signals]) -> Chart | None:
    """Return the distribution of the contact over the strip, and so of its wear."""
    bars = []
    for i, s in enumerate(signals):
        known = _known_lateral(s)
        if known.size:
            edges = np.arange(np.floor(known.min() / _LATERAL_BIN), np.ceil(known.max() / _LATERAL_BIN) + 1.5)
            edges *= _LATERAL_BIN
            centres = 0.5 * (edges[1:] + edges[:-1])
            bars.append(Bars(s.contact.pantograph, 1e3 * centres, shares(known, edges), i))
    if not bars:
        return None
    x = Axis("contact on the strip, left positive", "mm")
    note = "Interval of interest. An even distribution means even wear of the strip."
    return Chart("lateral", "Contact on the collector strip (wear)", x, SHARE, tuple(bars), note, 320)


def _known_lateral(s: Signals) -> FloatArray:
    if s.lateral is None:
        return np.zeros(0)
    cut = s.lateral[s.inside]
    return cut[np.isfinite(cut)]

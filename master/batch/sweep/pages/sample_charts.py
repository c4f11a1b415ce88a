"""Charts and tables of samples: shares that fail a limit, distributions of figures, running estimates, force bands."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from master.arrays import FloatArray
from master.batch.sweep.pages.force_bands import MOST_RUNS, ForceBand
from master.batch.sweep.pages.grid_charts import MOST_CHARTS, evenly
from master.batch.sweep.pages.sample_statistics import QUANTILES, mean, running_mean, running_share, share
from master.batch.sweep.pages.sweep_view import Figure, SweepView, failed_limits, is_judged, values_of
from master.batch.sweep.sweep_run import Row
from master.report.charts.chart import (
    COLOURS,
    MARK,
    Axis,
    Bars,
    Chart,
    Curve,
    Envelope,
    Level,
    Part,
    Stroke,
    stroke,
)
from master.report.charts.force_charts import TRACK

#: Most groups of samples that are drawn, and that a table lists.
MOST_DRAWN: Final = 4
MOST_LISTED: Final = 60
_MOST_BINS: Final = 40
#: Height of a histogram over that of its highest bar: room for what stands at the quantiles.
_ABOVE: Final = 1.25
#: Most points of a running estimate.
_MOST_STEPS: Final = 500
#: Limits that every contact is judged by.
_ALWAYS: Final = ("mean force", "sigma / mean", "maximum force", "statistical minimum", "NQ (estimate)")
_ANY: Final = "any limit"
#: Figures of which a running mean is drawn.
_RUNNING: Final = ("sigma", "maximum", "minimum", "uplift")

Groups = dict[str, list[Row]]


def share_rows(groups: Groups) -> list[list[str]]:
    """Return the rows of the table of shares: group, limit, how many fail it of how many, share and its interval."""
    rows = []
    for name, group in list(groups.items())[:MOST_LISTED]:
        judged = [row for row in group if is_judged(row)]
        beyond = [failed_limits(row) for row in judged]
        others = dict.fromkeys(limit for found in beyond for limit in found if limit not in _ALWAYS)
        has_uplift = "uplift at supports" not in others and any(row.get("uplift [mm]") is not None for row in judged)
        limits = [*_ALWAYS, *(["uplift at supports"] if has_uplift else []), *others]
        counts = {_ANY: sum(map(bool, beyond)), **{limit: sum(limit in f for f in beyond) for limit in limits}}
        for limit, count in counts.items() if judged else ():
            e = share(count, len(judged))
            shown = (
                f"{count} of {len(judged)}",
                f"{100 * e.value:.1f} %",
                f"{100 * e.low:.1f} to {100 * e.high:.1f} %",
            )
            rows.append([*([name] if len(groups) > 1 else []), limit, *shown])
    return rows


def figure_rows(view: SweepView, groups: Groups) -> list[list[str]]:
    """Return the rows of the table of figures: group, figure, samples, mean, deviation, quantiles, extremes."""
    rows = []
    for name, group in list(groups.items())[:MOST_LISTED]:
        for f in view.figures[:MOST_CHARTS]:
            values = values_of(group, f.title)
            there = values[np.isfinite(values)]
            if len(there):
                centre = mean(values)
                half = f.shown(centre.high - centre.value)
                deviation = f.shown(float(there.std(ddof=1))) if len(there) > 1 else "-"
                quantiles = (f.shown(float(q)) for q in np.quantile(there, QUANTILES))
                ends = (f.shown(float(there.min())), f.shown(float(there.max())))
                known = f"{f.shown(centre.value)} \u00b1 {half}" if half != "-" else f.shown(centre.value)
                head = [name] if len(groups) > 1 else []
                rows.append([*head, f.title.removesuffix(" [1]"), str(len(there)), known, deviation, *quantiles, *ends])
    return rows


FIGURE_HEADS: Final = ("figure", "samples", "mean", "std. dev.", "5 %", "50 %", "95 %", "least", "greatest")


def distribution_charts(view: SweepView, groups: Groups, key: str) -> list[Chart]:
    """Return a histogram of each figure."""
    drawn = {name: groups[name] for name in evenly(list(groups), MOST_DRAWN)}
    made = (_histogram(view, f, drawn, f"{key}_{k}") for k, f in enumerate(view.figures[:MOST_CHARTS]))
    return [chart for chart in made if chart is not None]


def _histogram(view: SweepView, figure: Figure, groups: Groups, key: str) -> Chart | None:
    values = {name: values_of(rows, figure.title) for name, rows in groups.items()}
    values = {name: v[np.isfinite(v)] for name, v in values.items()}
    values = {name: v for name, v in values.items() if len(v)}
    whole = np.concatenate(list(values.values()) or [np.empty(0)])
    if len(whole) < 2 or np.ptp(whole) <= 1e-9 * np.abs(whole).max():
        return None
    edges = _edges(whole)
    parts: list[Part] = []
    for k, (name, each) in enumerate(values.items()):
        counts, _ = np.histogram(each, edges)
        shares = 100.0 * counts / len(each)
        parts.append(Bars(name or figure.name, 0.5 * (edges[1:] + edges[:-1]), shares, k))
    share = Axis("share of samples", "%")
    if len(values) == 1:
        parts += [Level(float(q), f"{100 * p:.0f} %", is_upright=True) for p, q in _quantiles(whole)]
        share = replace(
            share, limits=(0.0, _ABOVE * float(max(bars.y.max() for bars in parts if isinstance(bars, Bars))))
        )
    abscissa = Axis(figure.name, figure.unit)
    return Chart(
        key,
        figure.heading,
        abscissa,
        share,
        tuple(parts),
        _bound_note(view, figure, groups),
        height=280,
    )


def _quantiles(values: FloatArray) -> list[tuple[float, float]]:
    return list(zip(QUANTILES, np.quantile(values, QUANTILES).tolist(), strict=True))


def _bound_note(view: SweepView, figure: Figure, groups: Groups) -> str:
    """Return between which limits the figure has to lie, if they are the same for all samples."""
    bounds = {view.bounds(figure, row) for rows in groups.values() for row in rows}
    if len(bounds) != 1:
        return ""
    low, high = bounds.pop()
    texts = [f"at least {low:.4g}" * math.isfinite(low), f"at most {high:.4g}" * math.isfinite(high)]
    found = " and ".join(filter(None, texts))
    return f"Limit: {found} {figure.unit}".rstrip() + "." if found else ""


def _edges(values: FloatArray) -> FloatArray:
    """Return the edges of a histogram's bins: those of Freedman and Diaconis, but neither one nor too many."""
    low, high = float(values.min()), float(values.max())
    iqr = float(np.subtract(*np.quantile(values, (0.75, 0.25))))
    width = 2.0 * iqr / len(values) ** (1.0 / 3.0)
    count = math.ceil((high - low) / width) if width > 0.0 else 1
    return np.linspace(low, high, min(max(count, 5), _MOST_BINS) + 1)


def running_charts(view: SweepView, rows: Sequence[Row], key: str) -> list[Chart]:
    """Return how the share that fails a limit, and means, settle as samples come in, in the order of the plan."""
    made = []
    number = Axis("samples")
    judged = [row for row in rows if is_judged(row)]
    if len(judged) > 1:
        found = running_share(np.array([bool(failed_limits(row)) for row in judged]))
        parts = _settling("share that fails a limit", *(100.0 * v for v in found))
        made.append(
            Chart(f"{key}_share", "Share that fails a limit", number, Axis("share", "%", (0, 100)), parts, height=280)
        )
    for f in (f for f in view.figures if f.name in _RUNNING):
        values = values_of(rows, f.title)
        values = values[np.isfinite(values)]
        if len(values) > 2 and np.ptp(values) > 0.0:
            spread = float(values.std(ddof=1))
            limits = (float(values.mean()) - 3.0 * spread, float(values.mean()) + 3.0 * spread)
            title, axis = f"{f.heading} of the samples", Axis(f.name, f.unit, limits)
            parts = (*_spread(values), *_settling("mean", *running_mean(values)))
            made.append(Chart(f"{key}_{f.name}", title, number, axis, parts, height=300))
    return made


def _steps(count: int) -> tuple[FloatArray, FloatArray]:
    """Return after which of so many samples an estimate is drawn: places, and numbers of samples."""
    kept = np.array(evenly(range(count), _MOST_STEPS))
    return kept, kept + 1.0


def _spread(values: FloatArray) -> tuple[Part, ...]:
    """Return the 5, 50 and 95 % quantiles of the samples so far."""
    kept, count = _steps(len(values))
    low, middle, high = np.array([np.quantile(values[: k + 1], QUANTILES) for k in kept.tolist()]).T
    return (
        Envelope("5 to 95 % of the samples", count, low, high, MARK),
        Curve("median", count, middle, Stroke(MARK, "dot", 1.4)),
    )


def _settling(name: str, value: FloatArray, low: FloatArray, high: FloatArray) -> tuple[Part, ...]:
    kept, count = _steps(len(value))
    value, low, high = value[kept], low[kept], high[kept]
    interval = "95 % interval of the mean" if name == "mean" else "95 % confidence interval"
    return (Envelope(interval, count, low, high, COLOURS[0]), Curve(name, count, value, stroke(0)))


def band_chart(view: SweepView, band: ForceBand, title: str, key: str) -> Chart:
    """Return the band of the contact force over the track."""
    low, middle, high = band.quantiles
    parts: list[Part] = [
        Envelope("5 to 95 %", band.position, low, high, COLOURS[0]),
        Curve("5 %", band.position, low, stroke(0, 0.8), is_whole=True),
        Curve("95 %", band.position, high, stroke(0, 0.8), is_whole=True),
        Curve("median", band.position, middle, stroke(1)),
    ]
    most = f"; the first {MOST_RUNS}" if band.runs == MOST_RUNS else ""
    note = (
        f"Low-passed contact force of {band.runs} runs{most}, as the verdict takes it: quantiles position by position. "
        "No single run follows one of these curves."
    )
    force = Axis("contact force, low-passed", "N")
    return Chart(key, title, TRACK, force, tuple(parts), note, height=360)

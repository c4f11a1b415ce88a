"""Charts of sensitivity: linear effects of sampled parameters (a tornado), and indices of Sobol and Morris."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from master.arrays import FloatArray
from master.batch.sweep.pages.grid_charts import broken
from master.batch.sweep.pages.sample_statistics import Effects, linear_effects
from master.batch.sweep.pages.sweep_view import Figure, SweepView, SweptColumn, values_of
from master.batch.sweep.sweep_run import Row
from master.report.charts.chart import Axis, Bars, Chart, Level

#: Figures whose effects are drawn, and most parameters and sets of indices in charts.
_FIGURES: Final = ("sigma", "maximum", "minimum", "uplift")
MOST_PARAMETERS: Final = 20
MOST_INDICES: Final = 12
#: From this share of variance on a linear model is taken to describe a figure.
_DESCRIBES: Final = 0.8


def effects_of(
    view: SweepView, rows: Sequence[Row], parameters: Sequence[SweptColumn]
) -> list[tuple[Figure, Effects | None]]:
    """Return the linear effects of sampled parameters on the most important figures."""
    if not parameters:
        return []
    inputs = np.column_stack([values_of(rows, p.title) for p in parameters])
    figures = [f for name in _FIGURES for f in view.figures if f.name == name] or list(view.figures[:4])
    names = tuple(view.short_title(p.title) for p in parameters)
    return [(f, linear_effects(names, inputs, values_of(rows, f.title))) for f in figures]


def tornado(figure: Figure, effects: Effects, key: str) -> Chart:
    """Return the effects of parameters on a figure as lying bars, the greatest on top."""
    order = sorted(range(len(effects.names)), key=lambda k: -abs(effects.change[k].value))[:MOST_PARAMETERS][::-1]
    change = [effects.change[k] for k in order]
    interval = (np.array([e.low for e in change]), np.array([e.high for e in change]))
    places = np.arange(float(len(order)))
    words = tuple(f"{effects.names[k]}: {effects.change[k].value:+.3g} {figure.unit}".rstrip() for k in order)
    values = np.array([e.value for e in change])
    bars = Bars("effect", places, values, 0, 0.7, words, interval, is_lying=True)
    note = f"R\u00b2 = {effects.explained:.2f} from {effects.count} samples"
    note += "" if effects.explained >= _DESCRIBES else ": much of the figure is not linear in the parameters"
    if len(effects.names) > len(order):
        note += f"; {len(order)} of {len(effects.names)} parameters"
    axis = Axis(f"change of {figure.name}", figure.unit)
    parts = (bars, Level(0.0, "", is_upright=True))
    names = [effects.names[k] for k in order]
    return Chart(key, f"Effects on {figure.name}", axis, _names(names), parts, f"{note}.", height=_height(len(order)))


def effect_rows(found: Sequence[tuple[Figure, Effects]]) -> list[list[str]]:
    """Return the rows of the table of effects: parameter, figure, change with its interval, rank correlation."""
    rows = []
    for figure, effects in found:
        order = sorted(range(len(effects.names)), key=lambda k: -abs(effects.change[k].value))[:MOST_PARAMETERS]
        for k in order:
            e = effects.change[k]
            width = f"{e.low:+.3g} to {e.high:+.3g}"
            name = figure.title.removesuffix(" [1]")
            rows.append([effects.names[k], name, f"{e.value:+.3g}", width, f"{effects.rank_correlation[k]:+.2f}"])
    return rows


def index_chart(data: Mapping[str, Any], key: str) -> Chart:
    """Return the indices of sensitivity of one figure with their intervals, the greatest on top."""
    is_morris = str(data["method"]).lower().startswith("morris")
    names = [str(name) for name in data["parameters"]]
    last = _numbers(data["first" if is_morris else "total"])
    order = [int(k) for k in np.argsort(np.nan_to_num(last, nan=-math.inf), kind="stable")][-MOST_PARAMETERS:]
    unit = str(data.get("unit") or "").replace("1", "")
    kinds = (("first", "mu*", "sigma") if is_morris else ("first", "first order", "total"))[1:]
    places = np.arange(float(len(order)))
    parts = []
    for number, (field, name) in enumerate(zip(("first", "total"), kinds, strict=True)):
        values = _numbers(data[field])[order]
        ends = np.array([[math.nan if v is None else float(v) for v in pair] for pair in data[f"{field}_interval"]])
        ends = ends.reshape(-1, 2)[order]
        interval = (np.fmin(ends[:, 0], values), np.fmax(ends[:, 1], values))
        words = tuple(
            f"{names[k]}, {name}: {v:.3g} ({low:.3g} to {high:.3g})"
            for k, v, low, high in zip(order, values, *interval, strict=True)
        )
        parts.append(Bars(name, places, values, number, None, words, interval, is_lying=True))
    note = (
        "Morris: mu*, the mean of absolute elementary effects, and sigma, their standard deviation: large where a "
        "parameter acts non-linearly or together with others."
        if is_morris
        else "Sobol: first order, the share of the variance that a parameter explains by itself; total, with all that "
        "it does together with others."
    )
    more = f" {len(order)} of {len(names)} parameters." if len(names) > len(order) else ""
    axis = Axis("elementary effects" if is_morris else "share of variance", unit if is_morris else "")
    title = f"{str(data['method']).capitalize()} indices of {data['figure']}"
    left_out = f", {data['left_out']} left out" if data.get("left_out") else ""
    text = f"{note} Lines: 95 % bootstrap intervals; {data.get('blocks', 0)} blocks{left_out}.{more}"
    height = _height(len(order), 46)
    return Chart(key, title, axis, _names([names[k] for k in order]), tuple(parts), text, height=height)


def _numbers(values: Sequence[float | None]) -> FloatArray:
    return np.array([math.nan if v is None else float(v) for v in values], dtype=np.float64)


def _names(names: Sequence[str]) -> Axis:
    """Return an axis of names, broken into lines that leave room for the bars."""
    places = tuple(map(float, range(len(names))))
    return Axis("", limits=(-0.6, len(names) - 0.4), ticks=places, words=tuple(map(broken, names)))


def _height(count: int, each: int = 42) -> int:
    return 110 + each * count

"""Charts of the dropper forces: their range along the track, and histories."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from master.arrays import FloatArray
from master.evaluation.filters import stands_in
from master.evaluation.line_geometry import indexed, period_of, slackness
from master.recording.recording import Recording
from master.report.charts.chart import COLOURS, Axis, Chart, Curve, Level, Part, Points, Stroke, gapped, stroke
from master.report.charts.line_charts import interval_band
from master.report.charts.uplift_charts import FEW_POINTS, IN_LAP, TIME
from master.results.run_results import Results

_FORCE: Final = Axis("dropper force", "N")
#: Droppers whose histories are drawn, and how many on either side of the middle one are shown at first.
_MOST_DROPPERS: Final = 16
_SHOWN: Final = 3


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
    is_placed = len(x) == len(names)
    place = x if is_placed else np.arange(1.0, len(names) + 1.0)
    track = Axis(f"track position of the dropper{IN_LAP if period else ''}", "m")
    axis = track if is_placed else Axis("dropper number")
    limits = (float(place.min()), float(place.max()))
    parts: list[Part] = [*interval_band(results, limits)] if is_placed and not period else []
    forces = np.column_stack([recording[n] for n in names])
    slack = {f"{s.component}.{s.name}.force": 100.0 * float(np.mean(s.slack)) for s in slackness(results.recordings)}
    parts += _ranges(place, forces, np.array([slack[n] for n in names]))
    note = "Bar: minimum to maximum in the run; dot: at the start; cross: slack at some time (hover for its share)."
    inside = [i for i, p in enumerate(place) if stands_in(float(p), results.interval, period)]
    chosen = _middle(inside or list(range(len(names))))
    named = [(f"{place[i]:.1f}{' m' if is_placed else ''}", forces[:, i]) for i in chosen]
    return [
        Chart(f"droppers_{component}", "Dropper forces", axis, _FORCE, tuple(parts), note, 360),
        _history_chart(component, recording.time, named),
    ]


def _middle(chosen: list[int]) -> list[int]:
    first = max(0, (len(chosen) - _MOST_DROPPERS) // 2)
    return chosen[first : first + _MOST_DROPPERS]


def _ranges(place: FloatArray, forces: FloatArray, share: FloatArray) -> list[Part]:
    low, high = forces.min(axis=0), forces.max(axis=0)
    slack = share > 0.0
    parts: list[Part] = [
        Curve("minimum to maximum", *gapped(place, low, high), Stroke(COLOURS[0], width=3.0), is_whole=True),
        Points("at the start", place, forces[0], "circle", size=5.0),
    ]
    if slack.any():
        words = tuple(f"slack {s:.1f} % of the time" for s in share[slack])
        parts.append(Points("slack", place[slack], low[slack], "x", COLOURS[1], words=words))
    return parts


def _history_chart(component: str, time: FloatArray, named: Sequence[tuple[str, FloatArray]]) -> Chart:
    middle = len(named) // 2
    curves = (
        Curve(name, time, force, stroke(i, 1.3), is_shown=abs(i - middle) <= _SHOWN, most=FEW_POINTS)
        for i, (name, force) in enumerate(named)
    )
    key, title = f"dropper_history_{component}", "History of the dropper forces"
    note = "Droppers in the middle of the interval of interest; click a name to hide or show it."
    return Chart(key, title, TIME, _FORCE, (*curves, Level(0.0, "no load")), note, 400)

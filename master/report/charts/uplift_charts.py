"""Charts of the uplift of the contact wire at the supports."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from master.evaluation.en50367_limits import limits_at
from master.evaluation.line_geometry import Uplift
from master.report.charts.chart import Axis, Bars, Chart, Curve, Level, Part, stroke
from master.report.charts.line_charts import interval_band
from master.results.run_results import Results

#: Added to the name of a position on a line that closes on itself.
IN_LAP: Final = " in its lap"
TIME: Final = Axis("time", "s")
#: Points of a history among many, and how many histories are shown at first.
FEW_POINTS: Final = 700
_SHOWN: Final = 8


def uplift_bars(results: Results) -> Chart | None:
    """Return the largest uplift of every support at its position."""
    uplifts = results.uplifts
    if not uplifts:
        return None
    catenaries = sorted({u.component for u in uplifts})
    most = 1e3 * limits_at(0.0, results.evaluation.limits).uplift.value
    places = [_place(u) for u in uplifts]
    parts: list[Part] = [] if uplifts[0].period else [*interval_band(results, (min(places), max(places)))]
    parts += [support_bars([u for u in uplifts if u.component == c], c, i) for i, c in enumerate(catenaries)]
    parts.append(Level(most, f"limit {most:g} mm"))
    y = Axis("largest uplift", "mm", (0.0, 1.1 * max(most, *(1e3 * u.maximum for u in uplifts))))
    title = "Uplift of the contact wire at the supports"
    return Chart("uplift", title, support_axis(uplifts), y, tuple(parts), "Whole run.", 320)


def support_bars(uplifts: Sequence[Uplift], name: str, index: int = 0) -> Bars:
    """Return the bars of one catenary's supports."""
    x = np.array([_place(u) for u in uplifts])
    gap = float(np.median(np.diff(np.unique(x)))) if len(x) > 1 else 1.0
    words = tuple(f"support {u.support}, {u.place}: {1e3 * u.maximum:.1f} mm at {u.time:.2f} s" for u in uplifts)
    return Bars(name, x, np.array([1e3 * u.maximum for u in uplifts]), index, 0.35 * gap, words)


def _place(u: Uplift) -> float:
    return float(u.support) if u.x is None else u.x


def support_axis(uplifts: Sequence[Uplift]) -> Axis:
    """Return the axis of supports: the track, or their numbers if no position is recorded."""
    if uplifts[0].x is None:
        return Axis("support number")
    return Axis(f"track position of the support{IN_LAP if uplifts[0].period else ''}", "m")


def uplift_history(results: Results) -> Chart | None:
    """Return the uplift of the supports in the interval over time."""
    chosen = [u for u in results.uplifts if u.stands_in(results.interval)] or list(results.uplifts)
    if not chosen:
        return None
    every = -(-len(chosen) // _SHOWN)
    curves = (replace(_history(results, u, i), is_shown=i % every == 0) for i, u in enumerate(chosen))
    note = "Supports in the interval of interest; click a name to hide or show it."
    y = Axis("uplift", "mm")
    return Chart("uplift_history", "History of the uplift", TIME, y, tuple(curves), note, 360)


def _history(results: Results, u: Uplift, index: int) -> Curve:
    name = f"{u.component}.support[{u.support}].uplift"
    recording = next(r for r in results.recordings if name in r)
    return Curve(u.place, recording.time, 1e3 * recording[name], stroke(index, 1.4), most=FEW_POINTS)

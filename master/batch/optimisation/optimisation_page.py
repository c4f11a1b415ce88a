"""What an optimisation has found, as a page that needs no other file, and in lines for a terminal."""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from typing import Final

import numpy as np

from master.arrays import BoolArray, FloatArray
from master.batch.optimisation.optimisation_goal import BoundedParameter, shown
from master.batch.optimisation.optimisation_session import CSV, OptimisationOutcome, told
from master.batch.sweep.sweep_run import Row
from master.batch.sweep.swept_systems import SweepRun
from master.report import html_markup
from master.report.charts.chart import Axis, Chart, Curve, Points, stroke
from master.system.pantograph_motion import STATIC_FORCE

_STATUS: Final = {
    "running": "Not finished: the optimisation is still running or was killed. The runs so far follow.",
    "interrupted": "Interrupted. The runs so far follow.",
}
#: Columns that say nothing about the contact.
_NO_FIGURES: Final = ("pantograph", "remarks", "passed", "failed limits")


def verdict(outcome: OptimisationOutcome) -> str:
    """Return in a sentence what was found."""
    best, goal = outcome.best, outcome.goal
    made = f"{len(outcome.finished)} runs, {len(outcome.failures)} failed"
    if best is None:
        nearest = min(
            (goal.excess(outcome.found[r.key]) for r in outcome.finished if outcome.value(r) is not None), default=None
        )
        if nearest is None:
            why = next((f"; run {number}: {reason}" for number, reason in outcome.failures.items()), "")
            return f"no run has the figure {goal.figure} ({made}){why}"
        return (
            f"no run keeps {', '.join(c.text for c in goal.constraints)}; the nearest misses by {nearest:.1%} ({made})"
        )
    value = outcome.value(best)
    assert value is not None
    return f"{goal.text}: {told(value, goal.unit)} in run {best.number}{_change(outcome)} ({made}; {_end(outcome)})"


def _change(outcome: OptimisationOutcome) -> str:
    if outcome.start is None or outcome.improvement is None:
        return ""
    start = told(outcome.start, outcome.goal.unit)
    if outcome.best == outcome.runs[0]:
        return ", where the search began"
    word = "better" if outcome.improvement >= 0.0 else "worse"
    broken = "" if outcome.goal.keeps(outcome.found[outcome.runs[0].key]) else ", which breaks a constraint"
    return f", {abs(outcome.improvement):.1%} {word} than {start} at the start{broken}"


def _end(outcome: OptimisationOutcome) -> str:
    return outcome.ended or outcome.status


def lines(outcome: OptimisationOutcome) -> Iterator[str]:
    """Yield what was found for a terminal: figure, parameters, bounds that are active."""
    yield verdict(outcome)
    best = outcome.best
    if best is None:
        return
    for b, value in zip(outcome.bounds, outcome.point(best), strict=True):
        yield f"  {_parameter(outcome, b, value)}"
    yield f"to run it: {command(outcome, best)}"


def _parameter(outcome: OptimisationOutcome, b: BoundedParameter, value: float) -> str:
    unit = b.parameter.unit
    place = outcome.at_bounds.get(b.parameter.name)
    active = f"; at its {place} bound: a wider one may give more" if place else ""
    between = f"{b.low:g} to {shown(b.high, unit)}"
    return f"{b.parameter.name} = {shown(value, unit)} (start {shown(b.start, unit)}; bounds {between}{active})"


def command(outcome: OptimisationOutcome, run: SweepRun) -> str:
    """Return the command that makes a run by itself."""
    values = dict(outcome.changes) | {
        target: b.parameter.text(value)
        for b, value in zip(outcome.bounds, outcome.point(run), strict=True)
        for target in b.parameter.targets
    }
    for row in outcome.rows_of(run) if outcome.goal.mean_force else ():
        values[f"{row['pantograph']}.{STATIC_FORCE}"] = repr(row["static force [N]"])
    own = {b.parameter.name: v for b, v in zip(outcome.bounds, outcome.point(run), strict=True)}
    own |= {} if outcome.request.stop is None else {"stop": outcome.request.stop}
    times = [f"--{name} {own[name]!r}" for name in ("step", "stop") if name in own]
    settings = [f"--set {shlex.quote(f'{name}={value}')}" for name, value in values.items()]
    return " ".join(["openpanto run", shlex.quote(outcome.place), *settings, *times, *outcome.options])


def page(outcome: OptimisationOutcome) -> str:
    """Return the whole page."""
    title = f"{outcome.scenario}: {outcome.goal.text}"
    drawn: list[Chart] = []
    body = [f"<h1>{html_markup.text(title)}</h1>", f"<p class='note'>{html_markup.text(outcome.date)}</p>"]
    if outcome.status in _STATUS:
        body.append(f"<p class='warning'>{_STATUS[outcome.status]}</p>")
    if outcome.finished:
        body.append(f"<p>{html_markup.text(verdict(outcome))}.</p>")
    if outcome.best is not None:
        body += _found(outcome, outcome.best)
    body += html_markup.placed(list(charts(outcome)), drawn)
    if outcome.failures:
        body.append("<h2>Runs that failed</h2>")
        body.append(html_markup.table(["run", "reason"], [[str(n), r] for n, r in outcome.failures.items()], False))
    body.append(f"<p class='note'>Every run is a row of {CSV}, beside this page.</p>")
    return html_markup.document(title, body, drawn)


def _found(outcome: OptimisationOutcome, best: SweepRun) -> list[str]:
    """Return the tables of parameters and figures, start beside best."""
    rows = []
    for b, value in zip(outcome.bounds, outcome.point(best), strict=True):
        unit, place = b.parameter.unit, outcome.at_bounds.get(b.parameter.name, "")
        ends = (shown(b.low, unit), shown(b.high, unit))
        rows.append([b.parameter.name, shown(b.start, unit), shown(value, unit), *ends, place or "none"])
    heads = ["parameter", "start", "best", "lower bound", "upper bound", "at bound"]
    parts = ["<h2>Parameters</h2>", html_markup.table(heads, rows)]
    if outcome.changes:
        given = ", ".join(f"{name} = {value}" for name, value in outcome.changes.items())
        parts.append(f"<p class='note'>In all runs: {html_markup.text(given)}.</p>")
    parts += ["<h2>Figures</h2>", html_markup.table(["figure", "start", "best"], list(_figures(outcome, best)))]
    if outcome.at_bounds:
        names = ", ".join(outcome.at_bounds)
        text = f"At a bound: {names}. The best value may lie beyond it."
        parts.append(f"<p class='warning'>{html_markup.text(text)}</p>")
    return [*parts, f"<p>To run it: <code>{html_markup.text(command(outcome, best))}</code></p>"]


def _figures(outcome: OptimisationOutcome, best: SweepRun) -> Iterator[list[str]]:
    before, after = outcome.rows_of(outcome.runs[0]), outcome.rows_of(best)
    for place, row in enumerate(after):
        old: Row = before[place] if place < len(before) else {}
        name = f" ({row['pantograph']})" if len(after) > 1 and "pantograph" in row else ""
        for title, value in row.items():
            if title not in _NO_FIGURES:
                yield [f"{title}{name}".removesuffix(" [1]"), _cell(old.get(title)), _cell(value)]


def _cell(value: object) -> str:
    return f"{value:.5g}" if isinstance(value, float) else str(value or "")


def charts(outcome: OptimisationOutcome) -> Iterator[Chart]:
    """Yield the history of the search, then the figure over every parameter."""
    known = [r for r in outcome.finished if outcome.value(r) is not None]
    if not known:
        return
    values = np.array([outcome.value(r) for r in known], dtype=float)
    kept = np.array([outcome.goal.keeps(outcome.found[r.key]) for r in known])
    axis = Axis(outcome.goal.figure, "" if outcome.goal.unit == "1" else outcome.goal.unit)
    numbers = np.array([float(r.number) for r in known])
    so_far = Curve("best so far", numbers, _best_so_far(outcome, values, kept), stroke(0), is_whole=True)
    yield Chart("history", "History", Axis("run"), axis, (so_far, *_points(numbers, values, kept)))
    for k, b in enumerate(outcome.bounds):
        x = np.array([outcome.point(r)[k] for r in known])
        over = Axis(b.parameter.name, b.parameter.unit)
        title = f"{outcome.goal.figure} over {b.parameter.name}"
        yield Chart(f"over_{k}", title, over, axis, tuple(_points(x, values, kept)))


def _best_so_far(outcome: OptimisationOutcome, values: FloatArray, kept: BoolArray) -> FloatArray:
    sign = 1.0 if outcome.goal.is_least else -1.0
    best = np.minimum.accumulate(np.where(kept, sign * values, np.inf))
    return np.where(np.isfinite(best), sign * best, np.nan)


def _points(x: FloatArray, y: FloatArray, kept: BoolArray) -> Iterator[Points]:
    yield Points("run", x[kept], y[kept], "circle", stroke(1).colour)
    if not kept.all():
        yield Points("breaks a constraint", x[~kept], y[~kept], "x")

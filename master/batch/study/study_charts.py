"""Charts of a study, as dictionaries that plotly.js draws."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

from master.arrays import BoolArray, FloatArray
from master.batch.study.family import Interval
from master.batch.study.study_evaluation import Entry, section_forces
from master.batch.study.study_outcome import Done, Outcome
from master.evaluation.contact_positions import track_position
from master.evaluation.contact_signals import contact_signals
from master.evaluation.filters import settled
from master.recording.static_geometry import Geometry
from master.report.charts.run_charts import (
    Axes,
    Chart,
    Curve,
    common_edges,
    curve_trace,
    grouped_bars,
    line_marks,
    shares,
)
from master.results.run_results import Results

#: How far to both sides of a change of wires the forces are drawn [m].
_MARGIN: Final = 15.0
_FORCE: Final = "contact force, low-passed [N]"
_STATISTICS: Final = ("maximum", "minimum", "amplitude", "mean", "sigma", "statistical_minimum")
_MARKS: Final = {"yaxis2": {"overlaying": "y", "range": [0, 1], "visible": False, "fixedrange": True}}


def interval_charts(outcome: Outcome, interval: Interval, found: Sequence[Entry]) -> list[Chart]:
    """Return statistics by role, then forces and histograms of every variant of several pantographs."""
    number = outcome.family.settings.interval.index(interval) + 1
    made = [_statistics(number, role, own) for role, own in _roles(found).items()]
    for i, done in enumerate(outcome.done):
        own = [e for e in found if e.variant == done.name]
        if len(own) > 1:
            made += [_forces(f"{number}_{i}", done.results, own), _histogram(f"{number}_{i}", done.results, own)]
    return made


def _roles(found: Sequence[Entry]) -> dict[str, list[Entry]]:
    """Return, for every place in the train, its entries with those of single pantographs before them."""
    several = [e for e in found if sum(o.variant == e.variant for o in found) > 1]
    singles = [e for e in found if e not in several]
    roles = list(dict.fromkeys(e.pantograph for e in several)) or ["single"]
    return {role: [*singles, *(e for e in several if e.pantograph == role)] for role in roles}


def _statistics(number: int, role: str, found: Sequence[Entry]) -> Chart:
    names = [s.replace("_", " ") for s in _STATISTICS]
    traces = [
        {**grouped_bars(i, e.variant), "x": names, "y": [getattr(e.assessment.quality, s) for s in _STATISTICS]}
        for i, e in enumerate(found)
    ]
    layout = {**Axes("", _FORCE).layout(), "barmode": "group"}
    return Chart(f"statistics_{number}_{role}", f"Statistics, {role}", {"data": traces, "layout": layout}, "", 380)


def _filtered(done: Results, e: Entry) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Return track position, low-passed force and what of it lies in the entry's interval."""
    settings = replace(done.evaluation, interval=(e.interval.start, e.interval.end))
    s = contact_signals(done.recordings[0], e.assessment.contact, settings)
    return s.position, s.filtered, s.inside & settled(s.raw, s.step)


def _forces(key: str, done: Results, own: Sequence[Entry]) -> Chart:
    traces = []
    for i, e in enumerate(own):
        position, force, inside = _filtered(done, e)
        traces.append(curve_trace(position[inside], force[inside], Curve(i, e.pantograph)))
    limits = (own[0].interval.start, own[0].interval.end)
    traces += line_marks(done, own[0].assessment.contact.catenary, limits)
    axes = Axes("track position of the contact [m]", _FORCE, extra=dict(_MARKS))
    title = f"Contact force, {own[0].variant}"
    return Chart(f"force_{key}", title, {"data": traces, "layout": axes.layout()}, "", 340)


def _histogram(key: str, done: Results, own: Sequence[Entry]) -> Chart:
    cuts = []
    for e in own:
        _, force, inside = _filtered(done, e)
        cuts.append(force[inside])
    edges = common_edges(cuts)
    middles = 0.5 * (edges[1:] + edges[:-1])
    traces = [
        {**grouped_bars(i, e.pantograph), "x": middles.tolist(), "y": shares(cut, edges).tolist()}
        for i, (e, cut) in enumerate(zip(own, cuts, strict=True))
    ]
    layout = {**Axes(_FORCE, "share of time [%]").layout(), "barmode": "group"}
    return Chart(f"histogram_{key}", f"Histogram, {own[0].variant}", {"data": traces, "layout": layout}, "", 300)


def sharing_charts(outcome: Outcome) -> list[Chart]:
    """Return the contact force wire by wire of strips between two wires, for the variants that the family names."""
    wanted = outcome.family.settings.sharing
    made: dict[str, Chart] = {}
    for done in outcome.done:
        if wanted is None or done.name not in wanted.variants:
            continue
        for interval in outcome.family.settings.interval:
            own = [e for e in outcome.entries(interval) if e.variant == done.name and e.sharing is not None]
            for e in own:
                made.setdefault(f"{done.name} {e.pantograph}", _sharing(f"sharing_{len(made)}", done.results, e))
    return list(made.values())


def _sharing(key: str, done: Results, e: Entry) -> Chart:
    recording, contact = done.recordings[0], e.assessment.contact
    forces, position = section_forces(recording, contact), track_position(recording, contact)
    assert forces is not None
    assert e.sharing is not None
    near = (position >= e.sharing.start - _MARGIN) & (position <= e.sharing.end + _MARGIN)
    traces = [
        curve_trace(position[near], forces[near, s], Curve(s, f"section {s + 1}")) for s in range(forces.shape[1])
    ]
    total = Curve(forces.shape[1], "total", 1.2)
    traces.append(curve_trace(position[near], forces[near].sum(axis=1), total))
    axes = Axes("track position of the contact [m]", "contact force, as computed [N]")
    title = f"From wire to wire, {e.variant}, {e.pantograph}"
    return Chart(key, title, {"data": traces, "layout": axes.layout()}, "", 340)


def history_charts(outcome: Outcome) -> list[Chart]:
    """Return uplift and dropper force at one place over time, for the variants that the family names."""
    wanted = outcome.family.settings.histories
    if wanted is None:
        return []
    chosen = [d for d in outcome.done if d.name in wanted.variants]
    made = (
        _history(chosen, wanted.position, _Kind("support", "uplift", "Uplift at the support", "uplift [mm]", 1e3)),
        _history(chosen, wanted.position, _Kind("dropper", "force", "Force in the dropper", "dropper force [N]")),
    )
    return [c for c in made if c is not None]


@dataclass(frozen=True)
class _Kind:
    """What a history shows: thing, variable, title, label and scale of the axis."""

    thing: str
    variable: str
    title: str
    label: str
    scale: float = 1.0


def _history(chosen: Sequence[Done], position: float, kind: _Kind) -> Chart | None:
    traces: list[dict[str, Any]] = []
    where = None
    for i, done in enumerate(chosen):
        found = _nearest(done.results.geometry, kind.thing, position)
        name = f"{found[0]}.{kind.variable}" if found is not None else ""
        recording = next((r for r in done.results.recordings if name in r), None)
        if found is None or recording is None:
            continue
        where = found[1]
        values = kind.scale * recording[name]
        traces.append(curve_trace(recording.time, values, Curve(i, done.name, 1.5)))
    if where is None:
        return None
    axes = Axes("time [s]", kind.label)
    return Chart(
        f"history_{kind.thing}", f"{kind.title} at {where:.1f} m", {"data": traces, "layout": axes.layout()}, "", 340
    )


def _nearest(geometry: Geometry, kind: str, position: float) -> tuple[str, float] | None:
    """Return the full name and place of the support or dropper that is nearest to a position."""
    found = [
        (f"{component}.{name.removesuffix('.x')}", x)
        for component, values in geometry.items()
        for name, x in values.items()
        if name.startswith(f"{kind}[") and name.endswith("].x")
    ]
    return min(found, key=lambda each: abs(each[1] - position), default=None)

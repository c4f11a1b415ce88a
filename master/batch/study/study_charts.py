"""Charts of a study: figures of its variants side by side, forces, changes of wire and histories."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from master.arrays import BoolArray, FloatArray
from master.batch.study.family import Interval
from master.batch.study.study_evaluation import StudyEntry, section_forces
from master.batch.study.study_outcome import StudyOutcome, VariantResult
from master.evaluation.contact_positions import track_position
from master.evaluation.contact_signals import contact_signals
from master.evaluation.filters import settled
from master.recording.static_geometry import Geometry
from master.report.charts.chart import Axis, Bars, Chart, Curve, stroke
from master.report.charts.force_charts import SHARE, TRACK, force_bars
from master.report.charts.line_charts import line_marks
from master.results.run_results import Results

#: How far before and after a change of wires the forces are drawn [m].
_MARGIN: Final = 15.0
_FORCE: Final = Axis("contact force, low-passed", "N")
_STATISTICS: Final = ("maximum", "minimum", "amplitude", "mean", "sigma", "statistical_minimum")


def interval_charts(outcome: StudyOutcome, interval: Interval, found: Sequence[StudyEntry]) -> list[Chart]:
    """Return statistics by place in the train, then forces and histograms of variants with several pantographs."""
    number = outcome.family.settings.interval.index(interval) + 1
    made = [_statistics(number, role, own) for role, own in _roles(found).items()]
    for i, done in enumerate(outcome.done):
        own = [e for e in found if e.variant == done.name]
        if len(own) > 1:
            made += [_forces(f"{number}_{i}", done.results, own), _histogram(f"{number}_{i}", done.results, own)]
    return made


def _roles(found: Sequence[StudyEntry]) -> dict[str, list[StudyEntry]]:
    """Return the entries by place in the train, each with those of single pantographs before them."""
    several = [e for e in found if sum(o.variant == e.variant for o in found) > 1]
    singles = [e for e in found if e not in several]
    roles = list(dict.fromkeys(e.pantograph for e in several)) or ["single"]
    return {role: [*singles, *(e for e in several if e.pantograph == role)] for role in roles}


def _statistics(number: int, role: str, found: Sequence[StudyEntry]) -> Chart:
    names = tuple(s.replace("_", " ") for s in _STATISTICS)
    bars = tuple(
        Bars(e.variant, names, np.array([getattr(e.assessment.quality, s) for s in _STATISTICS]), i)
        for i, e in enumerate(found)
    )
    return Chart(f"statistics_{number}_{role}", f"Statistics, {role}", Axis("figure"), _FORCE, bars)


def _filtered(done: Results, e: StudyEntry) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Return track position, low-passed force and which samples lie in the interval of the entry."""
    settings = replace(done.evaluation, interval=(e.interval.start, e.interval.end))
    s = contact_signals(done.recordings[0], e.assessment.contact, settings)
    return s.position, s.filtered, s.inside & settled(s.raw, s.step)


def _forces(key: str, done: Results, own: Sequence[StudyEntry]) -> Chart:
    curves = []
    for i, e in enumerate(own):
        position, force, inside = _filtered(done, e)
        curves.append(Curve(e.pantograph, position[inside], force[inside], stroke(i)))
    limits = (own[0].interval.start, own[0].interval.end)
    marks = line_marks(done, own[0].assessment.contact.catenary, limits)
    return Chart(f"force_{key}", f"Contact force, {own[0].variant}", TRACK, _FORCE, (*curves, *marks), height=340)


def _histogram(key: str, done: Results, own: Sequence[StudyEntry]) -> Chart:
    cuts = []
    for e in own:
        _, force, inside = _filtered(done, e)
        cuts.append((e.pantograph, force[inside]))
    title = f"Histogram, {own[0].variant}"
    return Chart(f"histogram_{key}", title, _FORCE, SHARE, force_bars(cuts), height=300)


def sharing_charts(outcome: StudyOutcome) -> list[Chart]:
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


def _sharing(key: str, done: Results, e: StudyEntry) -> Chart:
    recording, contact = done.recordings[0], e.assessment.contact
    forces, position = section_forces(recording, contact), track_position(recording, contact)
    assert forces is not None
    assert e.sharing is not None
    near = (position >= e.sharing.start - _MARGIN) & (position <= e.sharing.end + _MARGIN)
    count = forces.shape[1]
    curves = [Curve(f"section {s + 1}", position[near], forces[near, s], stroke(s)) for s in range(count)]
    curves.append(Curve("total", position[near], forces[near].sum(axis=1), stroke(count, 1.2)))
    title = f"From wire to wire, {e.name}"
    return Chart(key, title, TRACK, Axis("contact force, as computed", "N"), tuple(curves), height=340)


def history_charts(outcome: StudyOutcome) -> list[Chart]:
    """Return uplift and dropper force at one position over time, for the variants that the family names."""
    wanted = outcome.family.settings.histories
    if wanted is None:
        return []
    chosen = [d for d in outcome.done if d.name in wanted.variants]
    kinds = (
        _Kind("support", "uplift", "Uplift at the support", Axis("uplift", "mm"), 1e3),
        _Kind("dropper", "force", "Force in the dropper", Axis("dropper force", "N")),
    )
    made = (_history(chosen, wanted.position, kind) for kind in kinds)
    return [c for c in made if c is not None]


@dataclass(frozen=True)
class _Kind:
    """What a history shows: thing, variable, title, axis, and the factor to the unit of the axis."""

    thing: str
    variable: str
    title: str
    axis: Axis
    scale: float = 1.0


def _history(chosen: Sequence[VariantResult], position: float, kind: _Kind) -> Chart | None:
    curves = []
    where = None
    for i, done in enumerate(chosen):
        found = _nearest(done.results.geometry, kind.thing, position)
        name = f"{found[0]}.{kind.variable}" if found is not None else ""
        recording = next((r for r in done.results.recordings if name in r), None)
        if found is None or recording is None:
            continue
        where = found[1]
        curves.append(Curve(done.name, recording.time, kind.scale * recording[name], stroke(i, 1.5)))
    if where is None:
        return None
    title = f"{kind.title} at {where:.1f} m"
    return Chart(f"history_{kind.thing}", title, Axis("time", "s"), kind.axis, tuple(curves), height=340)


def _nearest(geometry: Geometry, kind: str, position: float) -> tuple[str, float] | None:
    """Return full name and position of the support or dropper nearest to a position."""
    found = [
        (f"{component}.{name.removesuffix('.x')}", x)
        for component, values in geometry.items()
        for name, x in values.items()
        if name.startswith(f"{kind}[") and name.endswith("].x")
    ]
    return min(found, key=lambda each: abs(each[1] - position), default=None)

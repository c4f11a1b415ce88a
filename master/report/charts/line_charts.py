"""The line in charts: its static geometry, and marks of supports, droppers and interval under other curves."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from master.arrays import FloatArray
from master.evaluation.line_geometry import aligned, by_section, met
from master.report.charts.chart import (
    DASHES,
    GREY,
    Axis,
    Band,
    Chart,
    Curve,
    Part,
    Points,
    Stroke,
    Ticks,
    gapped,
    stroke,
)
from master.results.run_results import Results

_TRACK: Final = Axis("track position", "m")


def line_marks(results: Results, catenary: str, limits: tuple[float, float]) -> list[Ticks]:
    """Return supports (dashed, over the whole height) and droppers (ticks at the bottom) between two places [m]."""
    values = results.geometry.get(catenary, {})
    marks = (
        Ticks("support", met(values, "support", limits), 1.0, "dash"),
        Ticks("dropper", met(values, "dropper", limits), 0.03),
    )
    return [mark for mark in marks if len(mark.x)]


def interval_band(results: Results, limits: tuple[float, float]) -> list[Band]:
    """Return the interval that the figures come from as a shaded band, if there is one."""
    start, end = results.evaluated_interval
    if start is None and end is None:
        return []
    return [Band(limits[0] if start is None else start, limits[1] if end is None else end)]


@dataclass(frozen=True)
class _Section:
    """Positions of droppers and supports of a section by the name of the coordinate [m]."""

    droppers: dict[str, FloatArray]
    supports: dict[str, FloatArray]

    @property
    def is_drawn(self) -> bool:
        return bool(len(self.supports["x"]) and len(self.droppers["x"]))

    @property
    def has_stagger(self) -> bool:
        return not (np.isnan(self.droppers["lower.y"]).all() or np.isnan(self.supports["y"]).all())

    def wire(self, at_droppers: str, at_supports: str) -> tuple[FloatArray, FloatArray]:
        """Return track position and coordinate of a wire, in the order of the track."""
        x = np.concatenate((self.droppers["x"], self.supports["x"]))
        y = np.concatenate((self.droppers[at_droppers], self.supports[at_supports]))
        order = np.argsort(x[np.isfinite(y)], kind="stable")
        return x[np.isfinite(y)][order], y[np.isfinite(y)][order]


def geometry_charts(name: str, values: dict[str, float]) -> list[Chart]:
    """Return the static line in elevation and plan, its sections in one picture."""
    sections = [
        _Section(
            aligned(section, "dropper", ("x", "upper.z", "lower.z", "lower.y")),
            aligned(section, "support", ("x", "y", "z", "messenger_wire.z")),
        )
        for section in by_section(values)
    ]
    if not all(section.is_drawn for section in sections):
        return []
    title = f"Static geometry of the {name}"
    height, lateral = Axis("height above rail", "m"), Axis("lateral position, left positive", "mm")
    elevation = _together([_elevation(s) for s in sections])
    found = [Chart(f"elevation_{name}", f"{title}: elevation", _TRACK, height, elevation)]
    if all(section.has_stagger for section in sections):
        plan = _together([_plan(s) for s in sections])
        found.append(Chart(f"plan_{name}", f"{title}: plan", _TRACK, lateral, plan))
    return found


def _together(sections: list[list[Curve | Points]]) -> tuple[Part, ...]:
    """Return the parts of all sections; where there are several, the legend names them and each has a dash."""
    if len(sections) == 1:
        return tuple(sections[0])
    return tuple(_of_section(part, number) for number, parts in enumerate(sections) for part in parts)


def _of_section(part: Curve | Points, number: int) -> Part:
    named = replace(part, name=f"{part.name}, section {number + 1}")
    if isinstance(named, Points):
        return named
    return replace(named, stroke=replace(named.stroke, dash=DASHES[number % len(DASHES)]))


def _elevation(s: _Section) -> list[Curve | Points]:
    hangers = gapped(s.droppers["x"], s.droppers["lower.z"], s.droppers["upper.z"])
    parts: list[Curve | Points] = [
        Curve("droppers", *hangers, Stroke(GREY, width=1.0), is_whole=True),
        Curve("contact wire", *s.wire("lower.z", "z"), Stroke(stroke(0).colour)),
        Curve("messenger wire", *s.wire("upper.z", "messenger_wire.z"), Stroke(stroke(1).colour)),
    ]
    if not np.isnan(s.supports["z"]).all():
        parts.append(Points("support", s.supports["x"], s.supports["z"], "triangle-up"))
    return parts


def _plan(s: _Section) -> list[Curve | Points]:
    x, y = s.wire("lower.y", "y")
    return [
        Curve("contact wire", x, 1e3 * y, stroke(0)),
        Points("support", s.supports["x"], 1e3 * s.supports["y"], "triangle-up"),
    ]

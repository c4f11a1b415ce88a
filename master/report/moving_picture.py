"""The data of a run's moving picture, from recorded and static values alone.

The uplift of the wire is recorded at the supports, its height at the contacts, and its uplift at the droppers if
``dropper[j].lower.uplift`` is among the recorded variables. Between these points the deformation is drawn
straight; the messenger wire is drawn at rest. A line that closes on itself is drawn once for every lap of the run.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from master.arrays import BoolArray, FloatArray, IntArray
from master.evaluation.contact_positions import strip_centre
from master.evaluation.contact_signals import Signals
from master.evaluation.line_geometry import by_section, indexed, laps, slackness
from master.recording.recording import Recording
from master.report.charts.sample_packing import packed, packed_integers
from master.results.run_results import Results

#: Largest number of frames, and the shortest time between two [s].
MOST_FRAMES: Final = 1500
SHORTEST_FRAME: Final = 0.005
#: Unit of packed displacements [m] and forces [N].
DISPLACEMENT_UNIT: Final = 1e-5
FORCE_UNIT: Final = 0.05
#: Largest number of laps on a line that closes on itself: each is drawn, and takes as much of the page as a line.
MOST_LAPS: Final = 50


@dataclass(frozen=True)
class Line:
    """A section of the line at rest.

    Attributes
    ----------
    wire, messenger : ndarray, shape (2, n)
        Position and height of the contact wire's and the messenger wire's points [m].
    droppers : ndarray, shape (3, n)
        Position, lower and upper height [m].
    supports : ndarray, shape (n,)
        Positions [m].
    """

    wire: FloatArray
    messenger: FloatArray
    droppers: FloatArray
    supports: FloatArray


@dataclass(frozen=True)
class Section:
    """A section of the line over n frames.

    Attributes
    ----------
    line : Line
        At rest.
    points : ndarray, shape (m,)
        Track positions of the recorded displacements [m].
    displacement : ndarray, shape (n, m)
        Displacement of the contact wire there [m].
    slack : ndarray, shape (n, n_droppers)
        Which droppers are slack.
    """

    line: Line
    points: FloatArray
    displacement: FloatArray
    slack: BoolArray


@dataclass(frozen=True)
class Rider:
    """A pantograph over n frames.

    Attributes
    ----------
    name : str
        Component.
    section : ndarray, shape (n,)
        Index of the section whose wire it runs on: the lowest one there.
    x, wire, strip, force, filtered : ndarray, shape (n,)
        Track position, the wire's and the strip's displacement from the wire at rest [m], force raw and 0-20 Hz [N]
        (NaN where there is no contact, or where the filtered force means nothing).
    """

    name: str
    section: IntArray
    x: FloatArray
    wire: FloatArray
    strip: FloatArray
    force: FloatArray
    filtered: FloatArray


@dataclass(frozen=True)
class Movie:
    """A run as frames at times ``time``, shape (n,)."""

    time: FloatArray
    sections: tuple[Section, ...]
    riders: tuple[Rider, ...]

    @property
    def everywhere(self) -> bool:
        """Whether the displacement is known at the droppers too."""
        return any(len(s.points) > len(s.line.supports) for s in self.sections)


def make_movie(results: Results, signals: Sequence[Signals]) -> Movie | None:
    """Return the moving picture, or None if geometry, uplift or contact was not recorded."""
    if not signals or signals[0].contact.point("z") not in results.recordings[0]:
        return None
    catenary, time = signals[0].contact.catenary, _frames(results.recordings[0].time)
    own = [s for s in signals if s.contact.catenary == catenary]
    way = min(float(s.position.min()) for s in own), max(float(s.position.max()) for s in own)
    values = results.geometry.get(catenary, {})
    if len(laps(values, way)) > MOST_LAPS:
        return None
    found = [_section(results, catenary, part, time, laps(values, way)) for part in by_section(values)]
    sections = tuple(s for s in found if s is not None)
    if not sections or len(sections) < len(found):
        return None
    return Movie(time, sections, tuple(_rider(results.recordings[0], s, sections, time) for s in own))


def _section(
    results: Results, catenary: str, values: Mapping[str, float], time: FloatArray, at: FloatArray
) -> Section | None:
    line = _line(values, at)
    if line is None:
        return None
    forms = {"support": "support[{}].uplift", "dropper": "dropper[{}].lower.uplift"}
    once = [h for kind, form in forms.items() for h in _histories(results, catenary, values, kind, form, time)]
    moved = [(x + offset, history) for offset in at.tolist() for x, history in once]
    moved = sorted((h for h in moved if h[1] is not None), key=lambda h: h[0])
    if not moved:
        return None
    slack = np.column_stack(_slack(results, catenary, values, time) * len(at))
    displacement = np.column_stack([h for _, h in moved if h is not None])
    return Section(line, np.array([x for x, _ in moved]), displacement, slack)


def _line(values: Mapping[str, float], at: FloatArray) -> Line | None:
    """Return a section at rest, repeated at every offset."""
    droppers = [_repeated(indexed(values, "dropper", n), at, n == "x") for n in ("x", "lower.z", "upper.z")]
    supports = [_repeated(indexed(values, "support", n), at, n == "x") for n in ("x", "z", "messenger_wire.z")]
    if not len(droppers[0]) or not len(supports[0]) or len({len(v) for v in droppers}) > 1:
        return None
    wire = _sorted((droppers[0], droppers[1]), (supports[0], supports[1]))
    messenger = _sorted((droppers[0], droppers[2]), (supports[0], supports[2]))
    return Line(wire, messenger, np.array(droppers), supports[0])


def _repeated(values: FloatArray, at: FloatArray, is_place: bool) -> FloatArray:
    """Return values repeated for every lap, shifted along the track if they are positions."""
    return (values + at[:, None] * is_place).ravel()


def _sorted(*curves: tuple[FloatArray, FloatArray]) -> FloatArray:
    points = np.hstack([np.array(c) for c in curves if len(c[0]) == len(c[1])])
    return points[:, np.argsort(points[0], kind="stable")]


def _frames(time: FloatArray) -> FloatArray:
    count = int(min(MOST_FRAMES, max(2, (time[-1] - time[0]) / SHORTEST_FRAME + 1)))
    return np.linspace(time[0], time[-1], count)


def _slack(results: Results, catenary: str, values: Mapping[str, float], time: FloatArray) -> list[BoolArray]:
    """Return when each dropper is slack; never for one of which nothing is recorded."""
    found = {s.name: s for s in slackness(results.recordings) if s.component == catenary}
    droppers = [found.get(f"dropper[{i}]") for i in _numbers(values, "dropper")]
    return [
        np.zeros(len(time), np.bool_) if s is None else np.interp(time, s.time, s.slack.astype(np.float64)) > 0.5
        for s in droppers
    ]


def _numbers(values: Mapping[str, float], kind: str) -> list[int]:
    return sorted(int(n[len(kind) + 1 : -3]) for n in values if n.startswith(f"{kind}[") and n.endswith("].x"))


def _histories(
    results: Results, catenary: str, values: Mapping[str, float], kind: str, form: str, time: FloatArray
) -> list[tuple[float, FloatArray | None]]:
    """Return position and recorded variable (None if it is not recorded) of all supports or droppers."""
    return [
        (values[f"{kind}[{i}].x"], _at(results.recordings, f"{catenary}.{form.format(i)}", time))
        for i in _numbers(values, kind)
    ]


def _at(recordings: Sequence[Recording], name: str, time: FloatArray) -> FloatArray | None:
    for recording in recordings:
        if name in recording and len(recording.time):
            return np.interp(time, recording.time, recording[name])
    return None


def _rider(recording: Recording, s: Signals, sections: Sequence[Section], time: FloatArray) -> Rider:
    frames = np.rint(np.interp(time, s.time, np.arange(len(s.time)))).astype(np.intp)
    position = s.position[frames]
    lowest = np.argmin([_height(section.line.wire, position) for section in sections], axis=0)
    rest = np.choose(lowest, [np.interp(position, *section.line.wire) for section in sections])
    touching = s.raw[frames] > 0.0
    wire = np.where(touching, recording[s.contact.point("z")][frames] - rest, np.nan)
    centre = strip_centre(recording, s.contact, "z")
    strip = wire if centre is None else np.where(touching, wire, centre[frames] - rest)
    return Rider(s.contact.pantograph, lowest, position, wire, strip, s.raw[frames], s.shown[frames])


def _height(wire: FloatArray, x: FloatArray) -> FloatArray:
    """Return the height of a wire at rest; beyond its ends it is far up."""
    beyond = np.maximum(wire[0, 0] - x, x - wire[0, -1])
    return np.interp(x, *wire) + np.where(beyond > 0.0, 100.0 + beyond, 0.0)


def as_json(movie: Movie) -> dict[str, Any]:
    """Return the moving picture for the page's script."""
    return {
        "count": len(movie.time),
        "start": float(movie.time[0]),
        "end": float(movie.time[-1]),
        "units": [DISPLACEMENT_UNIT, FORCE_UNIT],
        "sections": [_section_json(s) for s in movie.sections],
        "riders": [_rider_json(r) for r in movie.riders],
    }


def _section_json(section: Section) -> dict[str, Any]:
    line = section.line
    return {
        "wire": [_rounded(v) for v in line.wire],
        "messenger": [_rounded(v) for v in line.messenger],
        "droppers": [_rounded(v) for v in line.droppers],
        "supports": _rounded(line.supports),
        "points": _rounded(section.points),
        "displacement": packed_integers(section.displacement, DISPLACEMENT_UNIT),
        "slack": _bits(section.slack),
    }


def _rider_json(rider: Rider) -> dict[str, Any]:
    return {
        "name": rider.name,
        "section": base64.b64encode(rider.section.astype(np.uint8).tobytes()).decode("ascii"),
        "x": packed(rider.x)["bdata"],
        "strip": packed_integers(rider.strip, DISPLACEMENT_UNIT),
        "touching": _bits(np.isfinite(rider.wire)),
        "force": packed_integers(rider.force, FORCE_UNIT),
        "filtered": packed_integers(np.where(np.isfinite(rider.filtered), rider.filtered, -1600.0), FORCE_UNIT),
    }


def _bits(flags: BoolArray) -> str:
    return base64.b64encode(np.packbits(flags, axis=-1).tobytes()).decode("ascii")


def _rounded(values: FloatArray) -> list[float]:
    return np.round(values, 4).tolist()

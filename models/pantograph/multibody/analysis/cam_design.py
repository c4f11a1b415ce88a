"""The cam of a lifting element: as a table says, or found so that the strip presses alike at every height.

Without friction, what the lifting element must give at a place theta is M_0(theta) for the weights and springs alone
and F M_1(theta) for a force F on the strip, M_1 being the strip's rise per theta up to the head's tilt.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np

from models.arrays import FloatArray
from models.numerics.cubic_curve import CubicCurve
from models.pantograph.multibody.analysis.mechanism_statics import (
    ITERATIONS,
    Equilibrium,
    equilibrium_where,
    settle_springs,
)
from models.pantograph.multibody.elements.angle_elements import BodyAngle, Cam, PointDistance
from models.pantograph.multibody.last_found import LastFound
from models.pantograph.multibody.mechanism import Mechanism, MechanismError
from models.pantograph.multibody.mechanism_definition import AngleStop, BumpStop, CamTable, LiftingMoment

#: Points of a cam that is found, over the working range.
_POINTS: Final = 41
#: Step on the way to the ends of a working range that no stop gives: of angles [rad], of lengths [m].
_STEP: Final = {True: np.radians(1.0), False: 0.005}
#: Iterations within which an equilibrium a step away is found if there is one: eight at most are seen, of sixty.
_NEXT: Final = 20
#: Longest way from one equilibrium to the next [rad or m].
_STAGE: Final = 0.1
#: Rise of the strip per angle below which the arms are at a dead centre [m/rad]; per length [1].
_DEAD: Final = 0.05
#: The same, in units of where the pantograph stands, above which they are near the other dead centre, where the lifting
#: element stops and turns back while the strip still rises: what it must give grows without limit there.
_STEEP: Final = 4.0
#: Force by which a cam may be off half-way between two points [N], or one more is put there and both halves are looked
#: at, each some sixteen times closer; and how often.
_CLOSE: Final = 0.1
_ROUNDS: Final = 6
#: Force for which M_1 is found if none is set [N].
_USUAL_FORCE: Final = 100.0
#: Finding a cam takes half a second.
_found: Final = LastFound[Cam]()


def stand(mechanism: Mechanism) -> FloatArray:
    """Settle the springs and fit the cam of a pantograph; return its working configuration at rest, shape (13 n,).

    Raises
    ------
    MechanismError
        If there is no equilibrium that counts, or the cam has no range to work over.
    """
    standing = settle_springs(mechanism)
    definition = mechanism.definition
    given = getattr(definition.lifting, "cam", None)
    if isinstance(given, CamTable):
        mechanism.forces.cam = _from_table(mechanism, standing, given)
    elif definition.holds_force:
        mechanism.forces.cam = _constant_force(mechanism, standing)
    return standing


def fit_force(mechanism: Mechanism, standing: FloatArray) -> None:
    """Find what the lifting element must give for a force on the strip, where nothing says that yet.

    A lifting moment whose cam does not hold a force needs it for the uplift of the air and of a controller.
    """
    forces, lifting = mechanism.forces, mechanism.definition.lifting
    if forces.per_force is not None or mechanism.definition.holds_force or not isinstance(lifting, LiftingMoment):
        return
    cam, forces.cam = forces.cam, None
    try:
        forces.per_force = _constant_force(mechanism, standing).per_lift
    finally:
        forces.cam = cam


def working_range(mechanism: Mechanism, standing: FloatArray) -> tuple[float, float]:
    """Return the lowest and the highest place of the lifting element [rad or m].

    Between the stops of the same bodies about the same axis; where none is, as far as the statics go before another
    stop of the arm or a dead centre.
    """
    lowest, highest = _stops(mechanism)
    if lowest is None:
        lowest, _ = reach(mechanism, standing, -1.0, _STEEP)
    if highest is None:
        highest, _ = reach(mechanism, standing, 1.0, _STEEP)
    if not lowest < highest:
        raise MechanismError(f"{mechanism.definition.name}: the lifting element has no range to work over")
    return lowest, highest


def _from_table(mechanism: Mechanism, standing: FloatArray, given: CamTable) -> Cam:
    places, values = (np.array(column) for column in given.columns)
    table = CubicCurve(places, values)
    definition = mechanism.definition
    if getattr(definition, definition.lift_parameter) is None:
        return Cam(None, table)
    written = (
        0.0 if isinstance(definition.lifting, LiftingMoment) else _place(mechanism).at(mechanism.kinematics(standing))
    )
    unit = table.at(written)
    if abs(unit) <= 1e-9 * np.abs(values).max():
        raise MechanismError(
            f"{definition.name}: the cam of '{_name(mechanism)}' gives nothing as written, so that "
            f"{definition.lift_parameter} cannot scale it; leave that out"
        )
    return Cam(None, CubicCurve(places, values / unit))


def _constant_force(mechanism: Mechanism, standing: FloatArray) -> Cam:
    """Return the cam that holds the force, for a mechanism whose springs are settled and that has no cam yet."""
    return _found.of(mechanism, standing, lambda: _find_constant_force(mechanism, standing))


def _find_constant_force(mechanism: Mechanism, standing: FloatArray) -> Cam:
    places = np.linspace(*working_range(mechanism, standing), _POINTS)
    set_force = abs(mechanism.definition.lift) if mechanism.definition.holds_force else 0.0
    force = set_force or _USUAL_FORCE
    own = _held_at(mechanism, standing, places, 0.0)
    loaded = _held_at(mechanism, standing, places, force)
    points = [_Point(*point) for point in zip(places.tolist(), own, loaded, strict=True)]
    if None in _stops(mechanism):
        points = _refined(mechanism, points, force)
    return _cam_through(points, force)


class _Point(NamedTuple):
    """A place of the lifting element, and what holds the mechanism there without and with a force on the strip."""

    place: float
    own: Equilibrium
    loaded: Equilibrium


def _cam_through(points: Sequence[_Point], force: float) -> Cam:
    places = np.array([p.place for p in points])
    own, loaded = (np.array([found.lift for found in column]) for column in list(zip(*points, strict=True))[1:])
    return Cam(CubicCurve(places, own), CubicCurve(places, (loaded - own) / force))


def _refined(mechanism: Mechanism, points: list[_Point], force: float) -> list[_Point]:
    """Add points half-way between others until the force held there is right, as far as a few rounds lead.

    Towards a dead centre what the lifting element gives grows without limit, or the lever vanishes by which it does.
    """
    missed = {p.place for p in points[:-1]}  # where pieces begin whose middle is not known to be right
    for _ in range(_ROUNDS):
        cam, found, wrong = _cam_through(points, force), [], set()
        for begin, end in pairwise(points):
            if begin.place not in missed:
                continue
            place = 0.5 * (begin.place + end.place)
            own, loaded = (
                _held(mechanism, place, e.y, f, e.lift) for e, f in ((begin.own, 0.0), (begin.loaded, force))
            )
            found.append(_Point(place, own, loaded))
            if abs(cam.value(place, force) - loaded.lift) * force > _CLOSE * abs(loaded.lift - own.lift):
                wrong |= {begin.place, place}
        points, missed = sorted([*points, *found], key=lambda p: p.place), wrong
        if not missed:
            break
    return points


def _held_at(mechanism: Mechanism, standing: FloatArray, places: FloatArray, force: float) -> list[Equilibrium]:
    """Return what holds the mechanism at rising places, each found from its neighbour."""
    middle = int(np.argmin(np.abs(places - _now(mechanism, standing))))
    sides: list[list[Equilibrium]] = []
    for order in (range(middle, len(places)), range(middle - 1, -1, -1)):
        y, lift = standing, 0.0
        sides.append([])
        for k in order:
            found = _held(mechanism, float(places[k]), y, force, lift)
            y, lift = found.y, found.lift
            sides[-1].append(found)
    return [*reversed(sides[1]), *sides[0]]


def _held(
    mechanism: Mechanism, place: float, start: FloatArray, force: float, lift: float, iterations: int = ITERATIONS
) -> Equilibrium:
    where = _place(mechanism)

    def beyond(y: FloatArray) -> float:
        return where.at(mechanism.kinematics(y)) - place

    return equilibrium_where(mechanism, beyond, start, contact_force=force, lift=lift, iterations=iterations)


def strip_height_where(mechanism: Mechanism, standing: FloatArray, place: float) -> float:
    """Return the strip's height above the base where the lifting element is at a place [m], with nothing on the strip.

    Raises
    ------
    MechanismError
        If there is no equilibrium.
    """
    now, y = _now(mechanism, standing), standing
    stages = max(1, math.ceil(abs(place - now) / _STAGE))
    for k in range(1, stages + 1):
        y = _held(mechanism, now + (place - now) * k / stages, y, 0.0, 0.0).y
    return mechanism.strip_height(y)


def reach(mechanism: Mechanism, standing: FloatArray, way: float, steep: float = math.inf) -> tuple[float, float]:
    """Return the last place on a way, -1 or 1, in which statics have an answer before a stop or a dead centre.

    Parameters
    ----------
    steep : float
        It ends, too, where the strip's rise per place is so many times as large as at first.

    Returns
    -------
    place, height : float
        Of the lifting element [rad or m], of the strip's middle above the base [m].
    """
    step = way * _STEP[isinstance(mechanism.definition.lifting, LiftingMoment)]
    smallest = abs(step) / 128.0
    y, place, height = standing, _now(mechanism, standing), mechanism.strip_height(standing)
    first, stops = 0.0, _ArmStops(mechanism)
    left = stops.touched(standing)  # it is to come away from them
    while abs(step) >= smallest:
        try:
            found = _held(mechanism, place + step, y, 0.0, 0.0, _NEXT)
        except (MechanismError, np.linalg.LinAlgError):
            step *= 0.5
            continue
        if stops.touched(found.y) - left:
            step *= 0.5
            continue
        slope = (found.strip_height - height) / step
        first = first or slope
        if not _DEAD <= slope * math.copysign(1.0, first) <= steep * abs(first):
            step *= 0.5
            continue
        y, place, height = found.y, place + step, found.strip_height
    return place, height


def _stops(mechanism: Mechanism) -> tuple[float | None, float | None]:
    lifting = mechanism.definition.lifting
    lowest: float | None = None
    highest: float | None = None
    if not isinstance(lifting, LiftingMoment):
        return lowest, highest
    pair = (lifting.body_i, lifting.body_j)
    for stop in mechanism.definition.forces:
        if not isinstance(stop, AngleStop) or (stop.body_i, stop.body_j) != pair:
            continue
        if np.dot(stop.axis_i, lifting.axis_i) > 1.0 - 1e-9:
            lowest = stop.lowest if lowest is None else lowest
            highest = stop.highest if highest is None else highest
    return lowest, highest


class _ArmStops:
    """The stops of a mechanism but those of its strip's body: beyond them a cam would lift against the stop."""

    def __init__(self, mechanism: Mechanism) -> None:
        self._mechanism = mechanism
        strip = mechanism.definition.strip
        head = "" if strip is None else strip.body
        bumps = (f for f in mechanism.definition.forces if isinstance(f, BumpStop))
        self._bumps = [(f, PointDistance(f, mechanism.numbers)) for f in bumps if head not in (f.body_i, f.body_j)]

    def touched(self, y: FloatArray) -> set[str]:
        """Return the names of those that are reached in a state, shape (13 n,)."""
        kinematics = self._mechanism.kinematics(y)
        found = set(self._mechanism.forces.stops.touched(kinematics.frames))
        for stop, distance in self._bumps:
            length = distance.at(kinematics)
            if (stop.shortest is not None and length < stop.shortest) or (
                stop.longest is not None and length > stop.longest
            ):
                found.add(stop.name)
        return found


def _place(mechanism: Mechanism) -> BodyAngle | PointDistance:
    place = mechanism.forces.lift_place
    assert place is not None
    return place


def _now(mechanism: Mechanism, y: FloatArray) -> float:
    return _place(mechanism).at(mechanism.kinematics(y))


def _name(mechanism: Mechanism) -> str:
    lifting = mechanism.definition.lifting
    return "" if lifting is None else lifting.name

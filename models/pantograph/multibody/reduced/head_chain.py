"""The head: bodies that hang on the carrier one after the other, by slides and at most one hinge, as rows of numbers.

Where all coordinates are 0 the head stands as in the start of the arm. A rolling body moves rigidly by

    x -> c + R(phi) (x - c) + sigma e,    R(phi) x = u (u.x) + cos(phi) (x - u (u.x)) + sin(phi) u x x,

c a point of the hinge, u its axis; slides add up along one direction, which rolls too where the slide lies beyond the
hinge.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import numpy as np

from models.arrays import FloatArray
from models.pantograph.multibody.elements.rotations import cross
from models.pantograph.multibody.mechanism import Mechanism
from models.pantograph.multibody.mechanism_definition import (
    ActuatorForce,
    ActuatorMoment,
    AngleStop,
    BumpStop,
    Fixed,
    Force,
    LineForce,
    Prismatic,
    Revolute,
    RevolutePrismatic,
    SlideAndTurnFriction,
    SlidingFriction,
    TurningFriction,
)
from models.pantograph.multibody.reduced.reduction import Link, NotReducibleError, Reduction

_ACROSS: Final = np.array([0.0, 1.0, 0.0])
#: Largest share of its size by which a length may differ from what its row says.
_EXACT: Final = 1e-11


@dataclass(frozen=True)
class Place:
    """How a body of the head moves on the carrier.

    Attributes
    ----------
    slide : int
        Number of its displacement, -1: none.
    direction : ndarray, shape (3,)
        Of that displacement at the start.
    rolls : bool
    slides_rolled : bool
        Whether the direction rolls.
    """

    slide: int = -1
    direction: FloatArray = field(default_factory=lambda: np.zeros(3))
    rolls: bool = False
    slides_rolled: bool = False


@dataclass(frozen=True)
class HeadRows:
    """The rows of `reduced_equations`; ``bodies`` in the order of the links."""

    bodies: FloatArray
    lines: FloatArray
    slides: FloatArray
    turns: FloatArray
    strip: FloatArray
    displacements: int
    rolls: bool
    axis: FloatArray


class HeadChain:
    """The bodies of a head and the laws between them.

    Parameters
    ----------
    mechanism : Mechanism
        The whole pantograph.
    y : ndarray, shape (13 n,)
        Its state where the coordinates are 0.
    reduction : Reduction

    Raises
    ------
    NotReducibleError
        If a body moves in another way.
    """

    def __init__(self, mechanism: Mechanism, y: FloatArray, reduction: Reduction) -> None:
        self.mechanism, self.reduction = mechanism, reduction
        s = mechanism.split(y)
        self.frames = mechanism.kinematics(y).frames[:, :3].copy()
        carrier = mechanism.numbers[reduction.carrier]
        self.origins = s.r - s.r[carrier]
        self._side = float(s.r[carrier, 1])
        self.places = {reduction.carrier: Place()}
        self.pivot, self.axis = np.zeros(3), np.zeros(3)
        self.displacements = 0
        for link in reduction.head:
            self.places[link.body] = self._place(link)
        self._head = tuple(link.body for link in reduction.head)

    @property
    def rolls(self) -> bool:
        """Return whether there is a hinge."""
        return bool(self.axis.any())

    def _global(self, body: str, local: tuple[float, float, float]) -> FloatArray:
        vector: FloatArray = self.frames[self.mechanism.numbers[body]] @ np.array(local)
        return vector

    def _point(self, body: str, local: tuple[float, float, float]) -> FloatArray:
        return self.origins[self.mechanism.numbers[body]] + self._global(body, local)

    def _place(self, link: Link) -> Place:
        joint, before = link.joint, self.places[link.parent]
        if isinstance(joint, Fixed):
            return before
        if isinstance(joint, Prismatic):
            return self._slid(link, before, self._global(joint.body_i, joint.axis_i))
        if isinstance(joint, Revolute):
            return self._rolled(link, before, joint)
        assert isinstance(joint, RevolutePrismatic)
        slide = self._global(joint.body_j, joint.axis_j)
        if link.parent == joint.body_i:
            return self._slid(link, self._rolled(link, before, joint), slide)
        return self._rolled(link, self._slid(link, before, slide), joint)

    def _slid(self, link: Link, before: Place, direction: FloatArray) -> Place:
        direction = direction / np.linalg.norm(direction)
        if before.slide >= 0:
            aside = float(np.linalg.norm(cross(before.direction, direction)))
            if aside > 1e-12 or before.slides_rolled != before.rolls:
                raise NotReducibleError(f"joint '{link.joint.name}' adds a slide in another direction")
            direction = before.direction
        number, self.displacements = self.displacements, self.displacements + 1
        return Place(number, direction, before.rolls, before.rolls)

    def _rolled(self, link: Link, before: Place, joint: Revolute | RevolutePrismatic) -> Place:
        if self.rolls:
            raise NotReducibleError(f"joint '{link.joint.name}' adds a second rotation of the head")
        axis = self._global(joint.body_i, joint.axis_i)
        self.axis = axis / np.linalg.norm(axis)
        self.pivot = self._point(joint.body_i, joint.point_i)
        return Place(before.slide, before.direction, True, False)

    def _split(self, vector: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return a rolling vector's constant part, and those that go with sine and cosine."""
        along = self.axis * (self.axis @ vector)
        return along, cross(self.axis, vector), vector - along

    def direction(self, place: Place) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the parts of a displacement's direction."""
        none = np.zeros(3)
        if place.slide < 0:
            return none, none, none
        return self._split(place.direction) if place.slides_rolled else (place.direction, none, none)

    def rows(self) -> HeadRows:
        """Return all rows."""
        bodies = np.array([self._body(name) for name in self._head]).reshape(-1, 30)
        lines, slides, turns = [], [], []
        for force in self.mechanism.definition.forces:
            if isinstance(force, LineForce) and {force.body_i, force.body_j} & set(self._head):
                lines.append(self._line(force))
            elif isinstance(force, SlideAndTurnFriction):
                slides += self._slide(force.sliding)
                turns += [self._turn(force.turning)] if force.turning is not None else []
            elif isinstance(force, SlidingFriction):
                slides += self._slide(force)
            elif turn := self._turn(force):
                turns.append(turn)
        return HeadRows(
            bodies,
            np.array(lines).reshape(-1, 18),
            np.array(slides, dtype=np.float64).reshape(-1, 4),
            np.array(turns).reshape(-1, 9),
            self._strip(),
            self.displacements,
            self.rolls,
            self.axis,
        )

    def _body(self, name: str) -> list[float]:
        k, place = self.mechanism.numbers[name], self.places[name]
        none = np.zeros(3)
        centre, frame, inertia = self.origins[k], self.frames[k], self.mechanism.inertia[k]
        middle, by_sine, by_cosine = centre, none, none
        across = frame.T @ _ACROSS
        turning = [float(across @ (inertia * across)), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
        if place.rolls:
            along, by_sine, by_cosine = self._split(centre - self.pivot)
            middle = self.pivot + along
            turning = self._turning(frame, inertia)
        parts = (middle, by_sine, by_cosine, *self.direction(place))
        return [place.slide, float(place.rolls), self.mechanism.mass[k], *np.concatenate(parts), *turning]

    def _turning(self, frame: FloatArray, inertia: FloatArray) -> list[float]:
        """Return the moments of inertia about y (5), the products of y and the roll (3), and that of the roll."""
        # The y axis as the body sees it turns the other way.
        still, by_sine, by_cosine = (frame.T @ part for part in self._split(_ACROSS))
        by_sine = -by_sine
        roll = inertia * (frame.T @ self.axis)
        return [
            float(still @ (inertia * still) + by_cosine @ (inertia * by_cosine)),
            float(2.0 * still @ (inertia * by_sine)),
            float(2.0 * still @ (inertia * by_cosine)),
            float(by_sine @ (inertia * by_sine) - by_cosine @ (inertia * by_cosine)),
            float(2.0 * by_sine @ (inertia * by_cosine)),
            float(roll @ still),
            float(roll @ by_sine),
            float(roll @ by_cosine),
            float(roll @ (frame.T @ self.axis)),
        ]

    def turned(self, roll: float) -> FloatArray:
        """Return R(phi), shape (3, 3)."""
        parts = [self._split(column) for column in np.eye(3)]
        columns = [along + np.sin(roll) * s + np.cos(roll) * c for along, s, c in parts]
        return np.stack(columns, axis=1)

    def _moved(self, body: str, vector: FloatArray, roll: float, is_point: bool, shift: float) -> FloatArray:
        """Return where a point or vector of a body is after a roll and a displacement."""
        place = self.places[body]
        if place.rolls:
            turn = self.turned(roll)
            vector = self.pivot + turn @ (vector - self.pivot) if is_point else turn @ vector
        if not is_point or place.slide < 0:
            return vector
        still, by_sine, by_cosine = self.direction(place)
        return vector + shift * (still + np.sin(roll) * by_sine + np.cos(roll) * by_cosine)

    def _line(self, f: LineForce) -> list[float]:
        """Return the row of an element along a line: its length (or the square of it) follows roll and displacement.

        The seven coefficients come from more samples than there are; that all of them fit says that the form is right.
        """
        a, b = self.places[f.body_i], self.places[f.body_j]
        start, to = self._point(f.body_i, f.point_i), self._point(f.body_j, f.point_j)
        axis = None if f.direction is None else self._global(f.body_i, f.direction)
        # Evenly spread, no two alike: multiples of two irrational numbers, but for their whole parts.
        shifts = 0.4 * (np.outer(np.arange(1, 25), np.sqrt([2.0, 3.0])) % 1.0) - 0.2
        rows, values = [], []
        for roll, (one, two) in zip(np.linspace(-0.9, 0.9, 24), shifts.tolist(), strict=True):
            two = one if a.slide == b.slide else two
            d = self._moved(f.body_j, to, roll, True, two) - self._moved(f.body_i, start, roll, True, one)
            values.append(d @ (d if axis is None else self._moved(f.body_i, axis, roll, False, 0.0)))
            gap = (two if b.slide >= 0 else 0.0) - (one if a.slide >= 0 else 0.0)
            s, c = np.sin(roll), np.cos(roll)
            rows.append([1.0, s, c, gap, gap * s, gap * c, gap**2])
        system, known = np.array(rows), np.array(values)
        found = np.linalg.lstsq(system, known, rcond=1e-12)[0]
        if np.abs(system @ found - known).max() > _EXACT * max(float(np.abs(known).max()), 1e-2):
            raise NotReducibleError(f"force '{f.name}' spans motions that its length is no simple function of")
        k = self.mechanism.forces.lines.names.index(f.name)
        lines = self.mechanism.forces.lines
        law = [lines.stiffness[k], lines.free_length[k], lines.damping[k]]
        push = f.force if isinstance(f, ActuatorForce) else 0.0
        return [a.slide, b.slide, float(axis is not None), *found, *law, push, *_stop(f)]

    def _link_of(self, joint: str) -> Link | None:
        return next((link for link in self.reduction.head if link.joint.name == joint), None)

    def _slide(self, f: SlidingFriction) -> list[list[float]]:
        """Return the row of friction on a displacement, none if it is not in the head."""
        link = self._link_of(f.joint)
        if link is None:
            return []
        return [[self.places[link.parent].slide, self.places[link.body].slide, f.force, f.transition]]

    def _turn(self, f: Force) -> list[float]:
        """Return the row of a moment about the hinge, empty if the element is none in the head."""
        free = [-np.inf, np.inf, 0.0, 0.0]
        if isinstance(f, TurningFriction):
            return [0.0, 1.0, *free, f.moment, f.transition, 0.0] if self._link_of(f.joint) else []
        if not isinstance(f, AngleStop | ActuatorMoment) or not {f.body_i, f.body_j} & set(self._head):
            return []
        share = float(self._global(f.body_i, f.axis_i) @ self.axis)
        factor = share * (float(self.places[f.body_j].rolls) - float(self.places[f.body_i].rolls))
        if isinstance(f, ActuatorMoment):
            return [0.0, factor, *free, 0.0, 1.0, f.moment]
        if abs(abs(factor) - 1.0) > 1e-12:
            raise NotReducibleError(f"force '{f.name}' does not stop the angle of the head's hinge")
        stops = self.mechanism.forces.stops
        angle = stops.angles[stops.stops.index(f)]
        frames = np.zeros((len(self.frames), 9, 3))
        frames[:, :3] = self.frames
        return [angle.of(frames), factor, *_limits(f.lowest, f.highest), f.stiffness, f.damping, 0.0, 1.0, 0.0]

    def _strip(self) -> FloatArray:
        definition = self.mechanism.definition
        assert definition.strip is not None
        name, none = definition.strip.body, np.zeros(3)
        middle = self._global(name, (0.0, definition.strip_offset, definition.strip.height))
        across = self._global(name, (0.0, 1.0, 0.0))
        rolls = self.places[name].rolls
        vectors = [self._split(v) if rolls else (v, none, none) for v in (middle, across)]
        number = self._head.index(name) if name in self._head else -1
        single = [self._side, 0.5 * definition.strip_length, float(rolls)]
        return np.array([number, *np.concatenate([*vectors[0], *vectors[1]]), *single])


def _stop(f: Force) -> list[float]:
    """Return stiffness, damping and limits of a bump stop; no stiffness of what is none."""
    if not isinstance(f, BumpStop):
        return [0.0, 0.0, -np.inf, np.inf]
    return [f.stiffness, f.damping, *_limits(f.shortest, f.longest)]


def _limits(low: float | None, high: float | None) -> list[float]:
    return [-np.inf if low is None else low, np.inf if high is None else high]

"""Points of a contact wire, and how they give way to a force."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from models.arrays import FloatArray, IntArray
from models.catenary.contact_and_slack.contact_wire import Touch, WireInterval
from models.catenary.contact_and_slack.crossing import Crossing
from models.catenary.linear_motion.compliance import Columns


@dataclass(frozen=True)
class Reaction:
    """How a wire gives way about one of its intervals, within a step.

    Attributes
    ----------
    interval : WireInterval
    inverse : ndarray, shape (n_span,)
        1 / K_hat of its modes.
    yielding : ndarray, shape (n_span, e)
        How its modes follow the attachments, mu G / K_hat.
    columns : Columns
        Response to unit loads at its attachments.
    at_ends : ndarray, shape (e, e)
        The same at the attachments themselves.
    slots : ndarray of unsigned int, shape (n_span,)
        Where a compiled stepper keeps its modes.
    reached : ndarray of unsigned int, shape (n_rows,)
        Attachments' displacements that ``columns`` reach, one by one.
    """

    interval: WireInterval
    inverse: FloatArray
    yielding: FloatArray
    columns: Columns
    at_ends: FloatArray
    slots: IntArray
    reached: IntArray

    def point(self, element: int, xi: float) -> Point:
        """Return a point of the interval.

        Parameters
        ----------
        element : int
            Of the interval.
        xi : float
            Share of the way along the element.
        """
        touch = self.interval.touch(element, xi)
        load = touch.ends - touch.modal.dot(self.yielding)
        own = touch.modal.dot(touch.modal * self.inverse)
        return Point(self, touch, load, float(load.dot(self.at_ends.dot(load)) + own))


class Point(NamedTuple):
    """A point of a contact wire.

    Attributes
    ----------
    reaction : Reaction
        Of its interval.
    touch : Touch
    load : ndarray, shape (e,)
        What a unit vertical force on it does to the attachments, directly and through the modes.
    compliance : float
        How far it gives way to such a force within a step [m/N].
    """

    reaction: Reaction
    touch: Touch
    load: FloatArray
    compliance: float

    def moved_by(self, other: Point) -> float:
        """Return how far the wire is moved here by a unit force at another point [m/N]."""
        here, there = self.reaction, other.reaction
        moved = float(self.load @ (there.columns.at(here.interval.ends) @ other.load))
        if here.interval.modes == there.interval.modes:
            moved += float(self.touch.modal @ (other.touch.modal * here.inverse))
        return moved


class Meeting(NamedTuple):
    """A strip that crosses a contact wire.

    Attributes
    ----------
    crossing : Crossing
    point : Point
        Of the wire.
    rise, rate : float
        Its height above the static one and the velocity of that [m, m/s].
    """

    crossing: Crossing
    point: Point
    rise: float
    rate: float

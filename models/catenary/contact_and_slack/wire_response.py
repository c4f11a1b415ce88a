"""Points of a contact wire, and how the wire gives way to forces on them within a step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from models.arrays import FloatArray
from models.catenary.contact_and_slack.contact_wire import WireInterval
from models.catenary.linear_motion.compliance import Columns
from models.catenary.linear_motion.step_matrices import StepMatrices


@dataclass(frozen=True, eq=False)
class IntervalResponse:
    """How a wire gives way to a force on one of its intervals, within a step.

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
    """

    interval: WireInterval
    inverse: FloatArray
    yielding: FloatArray
    columns: Columns
    at_ends: FloatArray

    def point(self, element: int, xi: float) -> WirePoint:
        """Return a point of an element of the wire; ``xi`` is the share of the way along the element."""
        row, height = self.interval.lift(element, xi)
        modal, ends = self.interval.split(row)
        load, give = ends - modal.dot(self.yielding), modal * self.inverse
        return WirePoint(self, row, height, load, give, float(load.dot(self.at_ends.dot(load)) + modal.dot(give)))

    def advance(self, local: FloatArray, change: FloatArray, a1: float) -> FloatArray:
        """Let local coordinates follow their attachments to the end of a step; return them and their rates.

        Parameters
        ----------
        local : ndarray, shape (2, m)
            Coordinates and rates at the beginning, replaced.
        change : ndarray, shape (m,)
            In the step, of the modes as if the attachments were held; work space afterwards.
        a1 : float
            Of Newmark's method.
        """
        count = self.interval.count
        change[:count] -= self.yielding.dot(change[count:])
        local[0] += change
        change *= a1
        np.subtract(change, local[1], out=local[1])
        return local


def interval_response(matrices: StepMatrices, interval: WireInterval, columns: Columns) -> IntervalResponse:
    """Return how a wire gives way about an interval, from responses to unit loads at the interval's attachments."""
    inverse = matrices.inverse[interval.modes]
    yielding = inverse[:, None] * matrices.coupling_of(interval.modes, interval.ends)
    return IntervalResponse(interval, inverse, yielding, columns, columns.at(interval.ends))


class WirePoint(NamedTuple):
    """A point of a contact wire.

    Attributes
    ----------
    response : IntervalResponse
        Of its interval.
    row : ndarray, shape (m,)
        What unit local coordinates lift it by; or what a unit vertical force on it does to them.
    height : float
        Static height [m].
    load : ndarray, shape (e,)
        What a unit vertical force on it does to the attachments, directly and through the modes.
    give : ndarray, shape (n_span,)
        How far it moves the modes within a step, the attachments held.
    compliance : float
        How far it gives way to such a force within a step [m/N].
    """

    response: IntervalResponse
    row: FloatArray
    height: float
    load: FloatArray
    give: FloatArray
    compliance: float

    def moved_by(self, other: WirePoint) -> float:
        """Return how far the wire is moved here by a unit force at another point [m/N]."""
        if other is self:
            return self.compliance
        here, there = self.response, other.response
        moved = float(self.load @ (there.columns.at(here.interval.ends) @ other.load))
        if here.interval.modes == there.interval.modes:
            moved += float(here.interval.split(self.row)[0] @ other.give)
        return moved

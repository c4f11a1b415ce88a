"""Where strips meet a contact wire at the end of a step, before the forces between them are known."""

from __future__ import annotations

import numpy as np

from models.arrays import FloatArray
from models.catenary.contact_and_slack.contact_wire import ContactWire, WireInterval
from models.catenary.contact_and_slack.wire_response import Meeting
from models.catenary.linear_motion.line_motion import LineMotion
from models.catenary.step.numpy_engine import Stepper
from models.catenary.step.step_engine import ReactionOf


class FreeMotion:
    """Motion of a contact wire at the end of a step, without forces that are found inside it.

    Parameters
    ----------
    wire : ContactWire
    reaction : callable
        How the wire gives way about an interval.
    stepper : Stepper
        In the midst of a step.
    motion : LineMotion
        At the beginning of the step.
    """

    def __init__(
        self,
        wire: ContactWire,
        reaction: ReactionOf,
        stepper: Stepper,
        motion: LineMotion,
    ) -> None:
        self._wire, self._reaction, self._stepper, self._motion = wire, reaction, stepper, motion
        self._known: dict[int, FloatArray] = {}

    def meet(self, strip: FloatArray, guess: int) -> Meeting | None:
        """Return where a strip crosses the wire, walking from the element ``guess``; None if it does not.

        Parameters
        ----------
        strip : ndarray, shape (2, 2, 3)
            Ends A and B; position and velocity.
        """
        if not self._wire.is_near(strip):
            return None
        met = self._stepper.meet(self._wire, self._reaction, strip, guess, self._motion)
        return met or self._walk(strip, guess)

    def _walk(self, strip: FloatArray, guess: int) -> Meeting | None:
        found = self._wire.find(strip, lambda interval: interval.positions(self._of(interval)[0]), guess)
        if found is None:
            return None
        interval = self._wire.interval(found.element)
        point = self._reaction(interval).point(found.element - interval.first, found.xi)
        return Meeting(found, point, *self._of(interval).dot(point.touch.row).tolist())

    def _of(self, interval: WireInterval) -> FloatArray:
        """Return an interval's local coordinates and their rates, shape (2, m)."""
        found = self._known.get(interval.first)
        if found is not None:
            return found
        stepper, count = self._stepper, interval.count
        result, change = stepper.local(interval, self._motion)
        self._known[interval.first] = result
        change[:count] -= self._reaction(interval).yielding.dot(change[count:])
        displacement, velocity = result
        displacement += change
        change *= stepper.newmark.a1
        np.subtract(change, velocity, out=velocity)
        return result

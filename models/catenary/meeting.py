"""Where strips meet a contact wire at the end of a step, before the forces between them are known."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from models.catenary.compliance import Columns
from models.catenary.contact_wire import ContactWire, Crossing, Touch, WireInterval
from models.catenary.stepping import LineMotion, Stepper
from models.part import FloatArray


@dataclass(frozen=True)
class Reaction:
    """How a wire gives way about one of its intervals.

    Attributes
    ----------
    yielding : ndarray, shape (n_span, e)
        How the interval's modes follow the attachments within a step, mu G / K_hat.
    columns : Columns
        Response to unit loads at its attachments.
    at_ends : ndarray, shape (e, e)
        The same at the attachments themselves.
    """

    yielding: FloatArray
    columns: Columns
    at_ends: FloatArray

    def on_attachments(self, touch: Touch) -> FloatArray:
        """Return what a unit force on the wire does to its attachments, directly and through the modes, shape (e,)."""
        return touch.ends - touch.modal.dot(self.yielding)


class Meeting(NamedTuple):
    """A strip that crosses a contact wire.

    Attributes
    ----------
    crossing : Crossing
    touch : Touch
        The point of the wire.
    rise, rate : float
        Its height above the static one and the velocity of that [m, m/s].
    """

    crossing: Crossing
    touch: Touch
    rise: float
    rate: float


class FreeMotion:
    """Motion of a contact wire at the end of a step, without forces that are found inside it.

    Parameters
    ----------
    reaction : callable
        WireInterval -> Reaction.
    stepper : Stepper
        In the midst of a step.
    motion : LineMotion
        At the beginning of the step.
    """

    def __init__(self, reaction: Callable[[WireInterval], Reaction], stepper: Stepper, motion: LineMotion) -> None:
        self._reaction, self._stepper, self._motion = reaction, stepper, motion
        self._known: dict[int, FloatArray] = {}

    def meet(self, wire: ContactWire, strip: FloatArray, guess: int) -> Meeting | None:
        """Return where a strip crosses the wire, walking from the element ``guess``; None if it does not.

        Parameters
        ----------
        strip : ndarray, shape (2, 2, 3)
            Ends A and B; position and velocity.
        """
        return self._compiled(wire, strip, guess) or self._plain(wire, strip, guess)

    def _plain(self, wire: ContactWire, strip: FloatArray, guess: int) -> Meeting | None:
        found = wire.find(strip, lambda interval: interval.positions(self._of(interval)[0]), guess)
        if found is None:
            return None
        touch = wire.touch(found.element, found.xi)
        return Meeting(found, touch, *self._of(touch.interval).dot(touch.row).tolist())

    def _compiled(self, wire: ContactWire, strip: FloatArray, guess: int) -> Meeting | None:
        """Return the meeting if the kernels are there and it lies in the interval to begin with, as it mostly does."""
        stepper = self._stepper
        if stepper.kernels is None:
            return None
        element = wire.start(guess, 0.5 * float(strip[0, 0, 0] + strip[1, 0, 0]))
        interval = wire.interval(element)
        following, motion = self._reaction(interval).yielding, self._motion
        local, row, out = np.empty((2, interval.size)), np.empty(interval.size), np.empty(5)
        element = stepper.kernels.meet(
            strip, element - interval.first,
            interval.plan, interval.plan_static, interval.height, interval.height_static,
            interval.modes.start, interval.ends, following, stepper.newmark.a1,
            stepper.modal, stepper.attached, motion.modal, motion.attached, local, row, out,
        )  # fmt: skip
        if element < 0:
            return None
        xi, share, height, rise, rate = out.tolist()
        touch = Touch(interval, row, row[: interval.count], row[interval.count :], height)
        return Meeting(wire.crossing(strip, interval.first + element, xi, share), touch, rise, rate)

    def _of(self, interval: WireInterval) -> FloatArray:
        """Return an interval's local coordinates and their rates, shape (2, m)."""
        found = self._known.get(interval.first)
        if found is not None:
            return found
        stepper, count = self._stepper, interval.count
        change = np.concatenate((stepper.modal[interval.modes], stepper.attached.take(interval.ends)))
        change[:count] -= self._reaction(interval).yielding.dot(change[count:])
        result = self._known[interval.first] = local_motion(interval, self._motion)
        displacement, velocity = result
        displacement += change
        change *= stepper.newmark.a1
        np.subtract(change, velocity, out=velocity)
        return result


def local_motion(interval: WireInterval, motion: LineMotion) -> FloatArray:
    """Return an interval's local coordinates and their rates, shape (2, m)."""
    return np.concatenate((motion.modal[:, interval.modes], motion.attached.take(interval.ends, axis=1)), axis=1)

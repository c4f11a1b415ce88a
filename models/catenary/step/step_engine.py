"""What every step engine does: advance a line by one step, in the parts that contacts and slack come between."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from models.arrays import FloatArray
from models.catenary.contact_and_slack.contact_wire import ContactWire, WireInterval
from models.catenary.contact_and_slack.crossing import Crossing
from models.catenary.contact_and_slack.wire_response import IntervalResponse, Met, ResponseOf, WirePoint
from models.catenary.linear_motion.compliance import Columns
from models.catenary.linear_motion.line_motion import LineMotion


class AppliedForce(NamedTuple):
    """A force on a contact wire that is known before a step.

    Attributes
    ----------
    response : IntervalResponse
        Of the interval that it acts on.
    element : int
        Of the wire.
    xi : float
        Share of the way along the element.
    force : float
        Positive up [N].
    """

    response: IntervalResponse
    element: int
    xi: float
    force: float


class StepEngine(Protocol):
    """Steps of one size, and the arrays that they work in.

    The order of calls: `begin`; `meet` for every strip; `apply` and changes of ``attached`` for what acts inside the
    step and is not known before it; `finish`; `place`.
    """

    @property
    def attached(self) -> FloatArray:
        """Return the change of the attachments' displacements in this step [m], shape (n_attached,); to be added to."""

    def response(self, interval: WireInterval, columns: Columns) -> IntervalResponse:
        """Return how a wire gives way about an interval, from responses to unit loads at the interval's attachments."""

    def begin(self, motion: LineMotion, pressed: FloatArray, applied: Sequence[AppliedForce] = ()) -> None:
        """Find the changes of this step without what is found inside it.

        Parameters
        ----------
        motion : LineMotion
            At the beginning of the step.
        pressed : ndarray, shape (n_attached,)
            Known forces on the attachments, beginning plus end of the step [N]; what those on the wires do to the
            attachments at their ends is added.
        applied : sequence of AppliedForce
            Forces on the contact wires, at the beginning of the step.
        """

    def meet(
        self, wire: ContactWire, response_of: ResponseOf, strip: FloatArray, guess: int, motion: LineMotion
    ) -> Met | None:
        """Return where a strip crosses a wire at the end of the step, forces found inside the step left out.

        Parameters
        ----------
        strip : ndarray, shape (2, 2, 3)
            Ends A and B; position and velocity.
        guess : int
            Element of the wire, to begin with.
        motion : LineMotion
            At the beginning of the step.
        """

    def apply(self, point: WirePoint, force: float) -> None:
        """Add what a force on a point of a wire changes in this step; ``force`` is that at its end [N], positive up."""

    def finish(self, motion: LineMotion) -> None:
        """Let the intervals follow their attachments, and replace the motion by that at the end of the step."""

    def place(self, crossing: Crossing, point: WirePoint, motion: LineMotion, place: FloatArray) -> None:
        """Put the place of a point of a wire into ``place``, shape (3,) [m]."""

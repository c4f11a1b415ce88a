"""What every step engine does: advance a line by one step, contacts and slack droppers included."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from models.catenary.contact_and_slack.contact_wire import ContactWire
from models.catenary.contact_and_slack.dropper_law import DropperLaw
from models.catenary.definition.line_definition import Contact
from models.catenary.line_state import CatenaryState, ContactResult, StripMotion
from models.catenary.linear_motion.interval_modes import IntervalModes
from models.contact_law import ContactLaw

#: A known force on a contact wire: wire section from 0, position along the track [m], force [N], positive up.
GivenForce = tuple[int, float, float]


def no_such_wire(wires: int) -> IndexError:
    """Return the error of a force that is given on none of a line's wires."""
    return IndexError(f"a force is given on a contact wire other than 0 to {wires - 1}")


@dataclass(frozen=True)
class SteppedLine:
    """A line as its step engines take it, whatever the step size.

    Attributes
    ----------
    modes : IntervalModes
    droppers : DropperLaw
    wires : tuple of ContactWire
    law : ContactLaw
    contact : Contact
        What the law and the radii of wire and strip are taken from.
    """

    modes: IntervalModes
    droppers: DropperLaw
    wires: tuple[ContactWire, ...]
    law: ContactLaw
    contact: Contact

    @property
    def gap(self) -> float:
        """Return how far the axes of a wire and of a strip are apart when they touch [m]."""
        return self.contact.wire_radius + self.contact.strip_radius


class StepEngine(Protocol):
    """Steps of one size."""

    def step(self, state: CatenaryState, motion: StripMotion) -> ContactResult:
        """Advance the line by one step under moving strips.

        Parameters
        ----------
        state : CatenaryState
            Changed in place.
        motion : StripMotion
            Strips at the end of the step.

        Raises
        ------
        LocalSolutionError
            If slack and contact forces are not found.
        """

    def push(self, state: CatenaryState, forces: Sequence[GivenForce]) -> None:
        """Advance the line by one step under forces that are given at its end, all strips lifted off.

        Parameters
        ----------
        state : CatenaryState
            Changed in place.

        Raises
        ------
        IndexError
            If the line has no such wire; the state is then as before.
        LocalSolutionError
            If the slack droppers are not found.
        """

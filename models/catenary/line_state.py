"""What a step of the line takes and returns: its state, the strips above it, the contacts found."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields

import numpy as np

from models.arrays import FloatArray, IntArray, Snapshot
from models.catenary.linear_motion.line_motion import LineMotion


@dataclass
class CatenaryState:
    """State of a line, changed in place by a step.

    Attributes
    ----------
    motion : LineMotion
    slack : ndarray of int
        Slack droppers.
    compensation : ndarray
        What each of them lacks of the force that it would carry if it could push [N].
    element : ndarray of int, shape (n_pantographs, n_sections)
        Element of the contact wire last met.
    impact_velocity : ndarray, shape (n_pantographs, n_sections)
        Velocity at impact of closed contacts [m/s], 0 for open ones.
    loaded : ndarray of int, shape (k, 2)
        Section and element of every force on a contact wire.
    load : ndarray, shape (k, 2)
        Its place on the element, xi, and its value [N].
    """

    motion: LineMotion
    slack: IntArray
    compensation: FloatArray
    element: IntArray
    impact_velocity: FloatArray
    loaded: IntArray
    load: FloatArray

    def snapshot(self) -> Snapshot:
        """Return copies of all arrays."""
        return {name: getattr(self, name).copy() for name in self._arrays()} | self.motion.snapshot()

    def restore(self, snapshot: Snapshot) -> None:
        """Take over the arrays of a snapshot."""
        self.motion.restore(snapshot)
        for name in self._arrays():
            setattr(self, name, snapshot[name].copy())

    def _arrays(self) -> Iterator[str]:
        return (item.name for item in fields(self) if item.name != "motion")


@dataclass
class ContactResult:
    """Contacts of one step.

    Attributes
    ----------
    force : ndarray, shape (n_pantographs, n_sections)
        Contact force [N].
    point : ndarray, shape (n_pantographs, n_sections, 3)
        Point of contact on the wire, NaN where strip and wire do not cross [m].
    """

    force: FloatArray
    point: FloatArray


def empty_result(pantographs: int, sections: int) -> ContactResult:
    """Return the contacts of strips that meet nothing."""
    point = np.empty((pantographs, sections, 3))
    point.fill(np.nan)
    return ContactResult(np.zeros((pantographs, sections)), point)


@dataclass
class StripMotion:
    """Strips as they would be at the end of a step without contact force.

    Attributes
    ----------
    strip : ndarray, shape (n_pantographs, 2, 2, 3)
        End A, B; position, velocity; x, y, z.
    compliance : ndarray, shape (n_pantographs,)
        How far a strip yields within the step per unit force [m/N]; 0 for prescribed strips.
    """

    strip: FloatArray
    compliance: FloatArray

"""The motion of a line, as its state holds it."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from models.arrays import FloatArray, Snapshot
from models.catenary.linear_motion.interval_modes import IntervalModes


class Packed(Protocol):
    """The modal part of a motion in the order that a step engine works in."""

    def unpack(self, modal: FloatArray, momentum: FloatArray) -> None:
        """Put it into the arrays of a `LineMotion`."""

    def prepared(self) -> FloatArray:
        """Return what the engine has already found for the next step: its step size, then whatever it needs."""


class LineMotion:
    """Motion of a line; changed in place.

    Parameters
    ----------
    modal : ndarray, shape (2, n_modes)
        Modal amplitudes q and their rates.
    momentum : ndarray, shape (n_modes,)
        q' + G x', which acts on the intervals.
    attached : ndarray, shape (2, n_attached)
        Displacements x of the attachments [m, rad] and their velocities.

    Attributes
    ----------
    attached : ndarray
        As above.
    packed : Packed or None
        The modal part, while a step engine keeps it in its own order.
    """

    def __init__(self, modal: FloatArray, momentum: FloatArray, attached: FloatArray) -> None:
        self._modal, self._momentum, self.attached = modal, momentum, attached
        self._prepared = np.zeros(0)
        self.packed: Packed | None = None

    @classmethod
    def at_rest(cls, modes: IntervalModes) -> LineMotion:
        """Return a line that does not move."""
        n, m = modes.coupling.shape[0], len(modes.attached)
        return cls(np.zeros((2, n)), np.zeros(n), np.zeros((2, m)))

    @property
    def modal(self) -> FloatArray:
        """Return modal amplitudes and their rates as they are now; to change them, use `plain`."""
        self._unpack()
        return self._modal

    @property
    def momentum(self) -> FloatArray:
        """Return the momentum as it is now; to change it, use `plain`."""
        self._unpack()
        return self._momentum

    @property
    def prepared(self) -> FloatArray:
        """Return what a step engine has already found for the next step; empty if nothing."""
        return self._prepared if self.packed is None else self.packed.prepared()

    def plain(self) -> tuple[FloatArray, FloatArray]:
        """Return the arrays of the modal part and of the momentum for changing them: no engine keeps others by then."""
        if self.packed is not None:
            self._unpack()
            self.packed = None
        if self._prepared.size:
            self._prepared = np.zeros(0)
        return self._modal, self._momentum

    def snapshot(self) -> Snapshot:
        """Return copies of all arrays."""
        return {
            "modal": self.modal.copy(),
            "momentum": self.momentum.copy(),
            "attached": self.attached.copy(),
            "prepared": self.prepared.copy(),
        }

    def restore(self, snapshot: Snapshot) -> None:
        """Restore the arrays from a snapshot."""
        modal, momentum, attached, prepared = (
            np.array(snapshot[name], dtype=np.float64) for name in ("modal", "momentum", "attached", "prepared")
        )
        self._modal, self._momentum, self.attached, self._prepared = modal, momentum, attached, prepared
        self.packed = None

    def _unpack(self) -> None:
        if self.packed is not None:
            self.packed.unpack(self._modal, self._momentum)

"""Strips received and continued, resultants handed out: what a line exchanges at a communication point."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np

from models.arrays import FloatArray, IntArray, Snapshot
from models.catenary.line_state import ContactResult
from models.contact_law import application_point
from models.numerics.extrapolation import StripExtrapolation
from models.numerics.kernel_cache import kernels_if_wanted

if TYPE_CHECKING:  # an FMU carries what is imported, and this is never imported by its name
    from models.catenary.exchange import exchange_kernels as _  # noqa: F401

#: Read now: an FMU's folder may be gone when a second instance asks for the kernels.
_SOURCE = Path(__file__).with_name("exchange_kernels.py").read_bytes()


def output_count(pantographs: int, sections: int, supports: int) -> int:
    """Return how many values a line hands out: resultants, their points, forces per wire if several, uplifts."""
    return 4 * pantographs + (pantographs * sections if sections > 1 else 0) + supports


class StripExchange:
    """What a line exchanges at a communication point.

    Parameters
    ----------
    pantographs : int
    order : int
        Of the extrapolation of strips; see `StripExtrapolation`.
    """

    def __init__(self, pantographs: int, order: int) -> None:
        self._strips = [StripExtrapolation(order) for _ in range(pantographs)]

    def start(self, time: float, strips: FloatArray) -> None:
        """Begin with single states of the strips, shape (P, 2, 2, 3)."""
        for extrapolation, strip in zip(self._strips, strips, strict=True):
            extrapolation.start(time, strip)

    def receive(self, time: float, step: float, strips: FloatArray, end: float, out: FloatArray) -> None:
        """Take strips for a step that begins at ``time`` and write those at ``end`` into ``out``, of their shape."""
        for extrapolation, strip in zip(self._strips, strips, strict=True):
            extrapolation.receive(time, strip, step)
        self.at(end, out)

    def at(self, time: float, out: FloatArray) -> None:
        """Write the strips at ``time`` into ``out``, shape (P, 2, 2, 3)."""
        for extrapolation, strip in zip(self._strips, out, strict=True):
            extrapolation.at(time, strip)

    def publish(
        self, result: ContactResult, strips: FloatArray, attached: FloatArray, places: IntArray, outputs: FloatArray
    ) -> None:
        """Write what a line hands out into ``outputs``, see `output_count`.

        Parameters
        ----------
        strips : ndarray, shape (P, 2, 2, 3)
        attached : ndarray, shape (2, n_attached)
            Motion of the attachments.
        places : ndarray of int, shape (n_supports,)
            Which of them are the rises of the contact wire at the supports.
        """
        pantographs, sections = result.force.shape
        outputs[:pantographs] = result.force[:, 0] if sections == 1 else result.force.sum(axis=1)
        points = outputs[pantographs : 4 * pantographs].reshape(pantographs, 3)
        for place, *contact in zip(points, result.force, result.point, strips, strict=True):
            place[...] = application_point(*contact)
        if sections > 1:
            outputs[4 * pantographs : (4 + sections) * pantographs] = result.force.ravel()
        attached[0].take(places, out=outputs[len(outputs) - len(places) :], mode="clip")

    def snapshot(self) -> Snapshot:
        """Return the whole state."""
        found = (extrapolation.snapshot().items() for extrapolation in self._strips)
        return {f"{p}.{name}": value for p, items in enumerate(found) for name, value in items}

    def restore(self, snapshot: Snapshot) -> None:
        """Take over a snapshot."""
        for p, extrapolation in enumerate(self._strips):
            extrapolation.restore({n.removeprefix(f"{p}."): v for n, v in snapshot.items() if n.startswith(f"{p}.")})


class CompiledExchange(StripExchange):
    """The same in compiled kernels.

    Parameters
    ----------
    kernels : module
        `models.catenary.exchange.exchange_kernels`, compiled.
    """

    def __init__(self, pantographs: int, order: int, kernels: ModuleType) -> None:
        super().__init__(pantographs, order)
        self._order = order
        self._known = np.zeros((pantographs, kernels.WIDTH))
        self._receive, self._at, self._publish = kernels.receive, kernels.at, kernels.publish

    def start(self, time: float, strips: FloatArray) -> None:
        """See `StripExchange.start`; the kernels are loaded here, not in the first step."""
        super().start(time, strips)
        self._take()
        trial = np.array(strips, dtype=np.float64)
        self._receive(self._known.copy(), self._order, time, 1e-3, trial, time, trial.copy())
        self._at(self._known, self._order, time, trial)

    def receive(self, time: float, step: float, strips: FloatArray, end: float, out: FloatArray) -> None:
        """See `StripExchange.receive`."""
        self._receive(self._known, self._order, time, step, strips, end, out)

    def at(self, time: float, out: FloatArray) -> None:
        """See `StripExchange.at`."""
        self._at(self._known, self._order, time, out)

    def publish(
        self, result: ContactResult, strips: FloatArray, attached: FloatArray, places: IntArray, outputs: FloatArray
    ) -> None:
        """See `StripExchange.publish`."""
        self._publish(result.force, result.point, strips, attached, places, outputs)

    def snapshot(self) -> Snapshot:
        """Return the whole state."""
        for strip, (time, *motion) in zip(self._strips, self._known.tolist(), strict=True):
            strip.time = time
            strip.position, strip.velocity, strip.acceleration = motion[:6], motion[6:12], motion[12:]
        return super().snapshot()

    def restore(self, snapshot: Snapshot) -> None:
        """Take over a snapshot."""
        super().restore(snapshot)
        self._take()

    def _take(self) -> None:
        """Lay out for the kernels what the strips are known to do."""
        for own, strip in zip(self._known, self._strips, strict=True):
            own[:] = [strip.time, *strip.position, *strip.velocity, *strip.acceleration]


def make_exchange(pantographs: int, order: int) -> StripExchange:
    """Return the fastest exchange that this machine has.

    Raises
    ------
    KernelError
        If the environment asks for kernels that cannot be had, or for ones that do not exist.
    """
    kernels = kernels_if_wanted("exchange", _SOURCE)
    return StripExchange(pantographs, order) if kernels is None else CompiledExchange(pantographs, order, kernels)

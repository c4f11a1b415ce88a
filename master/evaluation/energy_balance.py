"""The energy balance of lines, pantographs and their coupling, from what was recorded of it.

A part that keeps its balance reports its error (``energy.drift``). Line and pantograph each report the work of the
strip against the contact force (``contact.work``), from the strip and the force that they themselves used inside their
steps: the difference is energy that the coupling has added. Everything is found by the names of variables, so it works
for foreign FMUs with such names too.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from master.arrays import FloatArray
from master.evaluation.contact_positions import strip_centre
from master.evaluation.run_events import Event
from master.recording.recording import Recording
from master.system.contacts import Contact

DRIFT: Final = "energy drift"
#: Largest drift of a part, as a share of the energy that has passed through it. The balance of the trapezoidal rule
#: is exact but for rounding, 1e-11; an integrator with error control leaves less than 1e-7.
PART_LIMIT: Final = 1e-6
#: Largest drift of a coupling, as a share of the energy exchanged. Inputs held over steps of 1 ms cause 3 %, which
#: raises the largest contact force by 1.7 N; 1 % corresponds to about half a newton.
COUPLING_LIMIT: Final = 1e-2
_DRIFT: Final = re.compile(r"(?P<component>.+)\.energy\.drift")


@dataclass(frozen=True)
class EnergyBalance:
    """The energy balance of a component or of a contact.

    Attributes
    ----------
    what : str
        The component, or the pantograph's component and the line's, ``pantograph - catenary``.
    drift, largest : float
        Error at the end, and its largest magnitude [J].
    passed : float
        Energy that has passed through a component, or through a contact in either direction [J].
    limit : float
        Largest admissible share of the drift in it.
    exceeded : float, optional
        When the drift first exceeded it [s].
    """

    what: str
    drift: float
    largest: float
    passed: float
    limit: float
    exceeded: float | None

    @property
    def share(self) -> float:
        """The largest drift as a share of what has passed."""
        return self.largest / self.passed if self.passed else 0.0

    @property
    def text(self) -> str:
        """The balance in words."""
        kept = "" if self.exceeded is None else f", beyond {self.limit:g} from t = {self.exceeded:.6g} s on"
        return f"drift {self.drift:.2g} J, at most {self.share:.1g} of {self.passed:.4g} J{kept}"


def find_balances(recordings: Sequence[Recording], contacts: Iterable[Contact]) -> tuple[EnergyBalance, ...]:
    """Return the recorded balances: of components, then of contacts."""
    parts = [b for r in recordings for b in _of_parts(r)]
    couplings = (_of_contact(recordings, contact) for contact in contacts)
    return (*parts, *(b for b in couplings if b is not None))


def drift_events(balances: Iterable[EnergyBalance], end: float) -> Iterator[Event]:
    """Yield an event for every balance whose drift exceeds its limit, from then to the end of the run [s]."""
    for b in balances:
        if b.exceeded is not None:
            yield Event(DRIFT, b.what, b.exceeded, end - b.exceeded, None, True)


def _of_parts(recording: Recording) -> Iterator[EnergyBalance]:
    for name in recording.names:
        match = _DRIFT.fullmatch(name)
        if match is not None and np.any(passed := _passed(recording, match["component"])):
            yield _balance(match["component"], recording, recording[name], passed, PART_LIMIT)


def _passed(recording: Recording, component: str) -> FloatArray:
    """Return the energy that has passed through a component up to each time [J], shape (n,)."""
    total = np.zeros(len(recording.time))
    for name in (f"{component}.energy.{key}" for key in ("stored", "dissipated", "work")):
        if name in recording and len(total):
            total = np.maximum(total, np.maximum.accumulate(np.abs(recording[name] - recording[name][0])))
    return total


def _of_contact(recordings: Sequence[Recording], contact: Contact) -> EnergyBalance | None:
    names = f"{contact.prefix}.work", contact.force_input.removesuffix(".force") + ".work"
    recording = next((r for r in recordings if all(n in r for n in names)), None)
    if recording is None or not len(recording.time):
        return None
    # From the first row on: a run may begin at a checkpoint, and one of the two afresh.
    line, pantograph = (recording[n] - recording[n][0] for n in names)
    passed = _exchanged(recordings[0], contact, recording.time)
    if passed is None:
        passed = np.maximum.accumulate(np.abs(line))
    if not np.any(line) or not np.any(passed):
        return None
    return _balance(f"{contact.pantograph} - {contact.catenary}", recording, line - pantograph, passed, COUPLING_LIMIT)


def _exchanged(recording: Recording, contact: Contact, times: FloatArray) -> FloatArray | None:
    """Return the accumulated magnitude of the work of the contact force up to these times [J]; None if not recorded."""
    velocity = strip_centre(recording, contact, "vz")
    if velocity is None or contact.force not in recording:
        return None
    power = np.abs(recording[contact.force] * velocity)
    means = 0.5 * (power[1:] + power[:-1]) * np.diff(recording.time)
    work: FloatArray = np.interp(times, recording.time, np.concatenate(([0.0], np.cumsum(means))))
    return work


def _balance(what: str, recording: Recording, drift: FloatArray, passed: FloatArray, limit: float) -> EnergyBalance:
    beyond = np.flatnonzero(np.abs(drift) > limit * passed[-1])
    first = float(recording.time[beyond[0]]) if beyond.size else None
    return EnergyBalance(what, float(drift[-1]), float(np.abs(drift).max()), float(passed[-1]), limit, first)

"""The force of a contact as it is evaluated and drawn: raw and low-passed, over time and track, and what counts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from master.arrays import BoolArray, FloatArray
from master.evaluation.contact_positions import lateral_position, track_position
from master.evaluation.contact_quality import Sampled
from master.evaluation.en50367_limits import LimitChoice
from master.evaluation.filters import DEFAULT, SETTLING, ForceFilter, evaluated, low_pass, settled
from master.recording.recording import Recording
from master.system.contacts import Contact

#: Units that a recorded contact force may have.
_FORCE_UNITS = ("N", "")


@dataclass(frozen=True)
class EvaluationSettings:
    """How a recording is evaluated.

    Attributes
    ----------
    filter : ForceFilter
        Low-pass of the contact force.
    interval : (float or None, float or None)
        Interval of interest along the track [m]; None where it is open (`evaluated`).
    limits : LimitChoice
        Limits that the figures are judged by.
    begin : float, optional
        When the run began [s]: a recording that begins later, in contact, continues a run and need not settle.
    """

    filter: ForceFilter = DEFAULT
    interval: tuple[float | None, float | None] = (None, None)
    limits: LimitChoice = field(default_factory=LimitChoice)
    begin: float | None = None


@dataclass(frozen=True)
class Signals:
    """Force of one contact.

    Attributes
    ----------
    contact : Contact
        The contact.
    time, position, raw, filtered : ndarray, shape (n,)
        Time [s], track position [m], contact force and its low-passed part [N].
    inside : ndarray, shape (n,)
        Which samples the figures are taken from: those in the interval of interest.
    height, lateral : ndarray, shape (n,), optional
        Height of the contact point and its position on the strip [m], NaN without contact.
    step : float
        Sampling step [s].
    filter : ForceFilter
        Low-pass of the force.
    """

    contact: Contact
    time: FloatArray
    position: FloatArray
    raw: FloatArray
    filtered: FloatArray
    inside: BoolArray
    height: FloatArray | None
    lateral: FloatArray | None
    step: float
    filter: ForceFilter

    @property
    def shown(self) -> FloatArray:
        """The filtered force from where it means something, NaN before."""
        return np.where(settled(self.raw, self.step), self.filtered, np.nan)

    @property
    def sampled(self) -> Sampled:
        """The record that the figures are made of."""
        return Sampled(self.raw, self.position, self.step, self.inside, self.height, self.lateral)


def all_signals(
    recordings: Sequence[Recording], contacts: Sequence[Contact], settings: EvaluationSettings
) -> tuple[Signals, ...]:
    """Return the signals of every contact whose force is in the first recording, that of every step."""
    recording = recordings[0] if recordings else None
    if recording is None or len(recording.time) < 2:
        return ()
    return tuple(contact_signals(recording, c, settings) for c in contacts if _has_force(recording, c))


def _has_force(recording: Recording, contact: Contact) -> bool:
    return contact.force in recording and recording.units[recording.names.index(contact.force)] in _FORCE_UNITS


def settling_of(force: FloatArray, time: FloatArray, settings: EvaluationSettings) -> float:
    """Return how long after its first contact a record has settled [s]: 0 for one that continues in contact."""
    step = float(time[-1] - time[0]) / (len(time) - 1)
    continues = settings.begin is not None and time[0] > settings.begin + 0.5 * step and force[0] > 0.0
    return 0.0 if continues else SETTLING


def contact_signals(recording: Recording, contact: Contact, settings: EvaluationSettings) -> Signals:
    """Return the signals of one contact."""
    step = float(recording.time[-1] - recording.time[0]) / (len(recording.time) - 1)
    position, force = track_position(recording, contact), recording[contact.force]
    has_height = contact.point("z") in recording
    return Signals(
        contact,
        recording.time,
        position,
        force,
        low_pass(force, step, settings.filter),
        evaluated(force, position, step, settings.interval, settling_of(force, recording.time, settings)),
        np.where(force > 0.0, recording[contact.point("z")], np.nan) if has_height else None,
        lateral_position(recording, contact),
        step,
        settings.filter,
    )


def power_spectrum(signal: FloatArray, step: float) -> tuple[FloatArray, FloatArray]:
    """Return frequencies [Hz] and the one-sided power spectral density [unit^2/Hz] of a signal less its mean.

    One Hann window over the whole signal. The density's integral over the frequency is the variance of the
    windowed signal.
    """
    n = len(signal)
    window = np.hanning(n)
    spectrum = np.fft.rfft((signal - signal.mean()) * window)
    density: FloatArray = 2.0 * step * np.abs(spectrum) ** 2 / float(np.sum(window**2))
    density[0] *= 0.5
    if n % 2 == 0:
        density[-1] *= 0.5
    return np.asarray(np.fft.rfftfreq(n, step), dtype=np.float64), density


def force_table(signals: Sequence[Signals]) -> tuple[list[str], list[FloatArray]]:
    """Return titles and columns of the low-passed forces: per contact position, force, and whether it counts (0 or 1).

    The statistics of the force where it counts are the figures of the run.
    """
    titles, columns = ["time [s]"], [signals[0].time]
    for s in signals:
        prefix = s.contact.prefix
        titles += [f"{prefix}.track_position [m]", f"{prefix}.filtered_force [N]", f"{prefix}.in_interval"]
        columns += [s.position, s.filtered, s.inside.astype(np.float64)]
    return titles, columns

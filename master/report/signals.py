"""What is drawn of a contact: its force over track position, raw and filtered, and its spectrum."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from master.arrays import BoolArray, FloatArray
from master.contacts import Contact, lateral_position, track_position
from master.quality import interval_mask, low_pass, settled
from master.results import Results


@dataclass(frozen=True)
class Signals:
    """Force of one contact.

    Attributes
    ----------
    contact : Contact
        Which.
    time, position, raw, filtered : ndarray, shape (n,)
        Time [s], track position [m], contact force and its 0-20 Hz part [N].
    inside : ndarray, shape (n,)
        Which samples lie in the interval of interest.
    lateral : ndarray, shape (n,), optional
        Position of the contact on the strip [m], NaN without contact.
    step : float
        Sampling step [s].
    """

    contact: Contact
    time: FloatArray
    position: FloatArray
    raw: FloatArray
    filtered: FloatArray
    inside: BoolArray
    lateral: FloatArray | None
    step: float

    @property
    def shown(self) -> FloatArray:
        """The filtered force from where it means something, NaN before."""
        return np.where(settled(self.raw, self.step), self.filtered, np.nan)


def all_signals(results: Results) -> tuple[Signals, ...]:
    """Return the signals of every contact whose force is recorded."""
    recording = results.recordings[0] if results.recordings else None
    if recording is None or len(recording.time) < 2:
        return ()
    return tuple(_signals(results, contact) for contact in results.contacts if contact.force in recording)


def _signals(results: Results, contact: Contact) -> Signals:
    recording = results.recordings[0]
    step = float(recording.time[-1] - recording.time[0]) / (len(recording.time) - 1)
    position, force = track_position(recording, contact), recording[contact.force]
    return Signals(
        contact,
        recording.time,
        position,
        force,
        low_pass(force, step),
        interval_mask(position, *results.interval),
        lateral_position(recording, contact),
        step,
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

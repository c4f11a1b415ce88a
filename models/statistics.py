"""The few figures of a contact force that the physics' own commands print; reports are the master's."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.part import FloatArray


@dataclass(frozen=True)
class ContactFigures:
    """Figures of the 0-20 Hz contact force in an interval [N], and the loss of contact [%]."""

    mean: float
    sigma: float
    maximum: float
    minimum: float
    loss: float


def low_pass(signal: FloatArray, step: float, cutoff: float = 20.0) -> FloatArray:
    """Return a signal without what is above ``cutoff`` [Hz], zero-phase, by FFT of the record and its mirror image."""
    mirrored = np.concatenate([signal, signal[::-1]])
    spectrum = np.fft.rfft(mirrored)
    spectrum[np.fft.rfftfreq(len(mirrored), step) > cutoff] = 0.0
    result: FloatArray = np.fft.irfft(spectrum, len(mirrored))[: len(signal)]
    return result


def contact_figures(position: FloatArray, force: FloatArray, step: float, start: float, end: float) -> ContactFigures:
    """Return the figures over an interval of the track.

    Parameters
    ----------
    position, force : ndarray, shape (n,)
        Along the track [m], unfiltered [N].
    step : float
        Sampling step [s].
    start, end : float
        Interval of interest [m].
    """
    inside = (position >= start) & (position <= end)
    filtered = low_pass(force, step)[inside]
    return ContactFigures(
        mean=float(filtered.mean()),
        sigma=float(filtered.std()),
        maximum=float(filtered.max()),
        minimum=float(filtered.min()),
        loss=100.0 * float(np.mean(force[inside] <= 0.0)),
    )

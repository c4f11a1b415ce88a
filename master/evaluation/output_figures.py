"""Figures of the outputs of runs without a pantograph, whatever the outputs mean."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from master.recording.recording import Recording


@dataclass(frozen=True)
class OutputFigures:
    """Figures of a recorded variable.

    Attributes
    ----------
    name, unit : str
    start, end, minimum, maximum, mean : float
        Figures of its samples; NaN where it has none.
    """

    name: str
    unit: str
    start: float
    end: float
    minimum: float
    maximum: float
    mean: float


def output_figures(recordings: Sequence[Recording]) -> tuple[OutputFigures, ...]:
    """Return the figures of every recorded variable, in the order of the files."""
    return tuple(f for r in recordings if len(r.time) for f in _figures(r))


def _figures(recording: Recording) -> Iterator[OutputFigures]:
    for name, unit in zip(recording.names, recording.units, strict=True):
        values = recording[name]
        ends = float(values[0]), float(values[-1])
        yield OutputFigures(name, unit, *ends, float(np.min(values)), float(np.max(values)), float(np.mean(values)))

"""A measuring run: heights of the contact wire along the track, as measured and read."""

from __future__ import annotations

from dataclasses import dataclass

from models.arrays import FloatArray
from models.definition_files.parameter import ParameterError


class AsBuiltError(ParameterError):
    """A measuring run that says nothing reliable of this line; the message says why, and what to do."""


@dataclass(frozen=True)
class MeasuredRun:
    """What was measured, in rising order of position; arrays of shape (n,), SI.

    Attributes
    ----------
    source : str
        Name of the file.
    position : ndarray
        By the vehicle's own way [m].
    height, stagger, thickness : ndarray
        Of the wire's underside, its place in plan, left positive, and what is left of its thickness [m]; NaN where
        not measured.
    structure : tuple of str
        Name of the structure that stands there; empty elsewhere.
    row : tuple of int
        Where each stands in the file, from 1; empty if it is none.
    """

    source: str
    position: FloatArray
    height: FloatArray
    stagger: FloatArray
    thickness: FloatArray
    structure: tuple[str, ...]
    row: tuple[int, ...] = ()

    @property
    def way(self) -> float:
        """Return how far it reaches [m]."""
        return float(self.position[-1] - self.position[0])

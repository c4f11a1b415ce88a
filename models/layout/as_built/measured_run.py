"""A measuring run: heights of the contact wire along the track, as measured and read, and what is worn off there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from models.arrays import FloatArray
from models.catenary.definition.line_definition import CatenaryDefinition
from models.definition_files.parameter import ParameterError

#: A wire may be made and measured thicker than its diameter by this factor.
_THICKER: Final = 1.05


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
    notes : tuple of str
        What of the file was not read.
    """

    source: str
    position: FloatArray
    height: FloatArray
    stagger: FloatArray
    thickness: FloatArray
    structure: tuple[str, ...]
    row: tuple[int, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def way(self) -> float:
        """Return how far it reaches [m]."""
        return float(self.position[-1] - self.position[0])


def worn_depth(definition: CatenaryDefinition, run: MeasuredRun) -> FloatArray:
    """Return what is worn off the wire's underside at every row, shape (n,) [m].

    Raises
    ------
    AsBuiltError
        If the thickness was measured, and the definition does not say that of a new wire, or says less.
    """
    known = np.isfinite(run.thickness)
    if not known.any():
        return np.zeros(len(run.position))
    if definition.contact_wire.diameter is None:
        raise AsBuiltError(
            f"{run.source}: the thickness says what is worn off only beside that of a new wire: give 'diameter' in "
            f"[contact_wire] of line '{definition.name}'"
        )
    if (thickest := float(run.thickness[known].max())) > _THICKER * definition.contact_wire.diameter:
        at = float(run.position[int(np.nanargmax(run.thickness))])
        raise AsBuiltError(
            f"{run.source}: at {at:.1f} m the wire was measured {1e3 * thickest:.2f} mm thick, and a new one of line "
            f"'{definition.name}' has {1e3 * definition.contact_wire.diameter:.2f} mm: check the unit, and the diameter"
        )
    thickness = np.interp(run.position, run.position[known], run.thickness[known])
    return np.asarray(definition.contact_wire.diameter - thickness)

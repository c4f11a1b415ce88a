"""Dropper lengths as fitted: those that a definition gives, and those that measured heights of the wire ask for."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from models.arrays import BoolArray, FloatArray, IntArray
from models.catenary.definition.line_definition import CatenaryDefinition
from models.catenary.shape.form_finding import EquilibriumError, StaticState, find_rest
from models.catenary.shape.line_mesh import CatenaryMesh

#: Rounds in which the droppers that carry nothing are found.
_MAX_ROUNDS: Final = 30
#: A dropper of given length that is surely slack is this much longer than designed [m].
_LOOSE: Final = 1.0
#: A dropper that carries nothing is taken to be barely taut, by so much [m]: shortening it acts at once.
_BARELY: Final = 1e-7
#: A wire that hangs lower than measured by more than this is held by its dropper [m].
_TOLERANCE: Final = 1e-6


@dataclass(frozen=True)
class FittedLengths:
    """The line with its wire at measured heights.

    Attributes
    ----------
    state : StaticState
        The line at rest with these lengths.
    length : ndarray, shape (n_droppers,)
        Unstrained [m]: what gives the measured height; as designed where none was measured. A slack one is as long as
        the distance that it spans, barely taut, and may be longer.
    is_slack : ndarray, shape (n_droppers,)
        Droppers that would have to push to hold the wire as low as it was measured.
    """

    state: StaticState
    length: FloatArray
    is_slack: BoolArray


def fitted_errors(definition: CatenaryDefinition, mesh: CatenaryMesh) -> FloatArray:
    """Return what droppers are longer than designed by [as_built] [m], shape (n_droppers,), in the mesh's order."""
    result = np.zeros(len(mesh.droppers))
    for index, section in enumerate(definition.sections):
        if section.length_errors:
            result[droppers_along(mesh, index)] = section.length_errors
    return result


def droppers_along(mesh: CatenaryMesh, section: int) -> IntArray:
    """Return the droppers of a section (hangers are none) in the order of the track."""
    lower = mesh.droppers[:, 0]
    chosen = np.flatnonzero((mesh.section[lower] == section) & ~mesh.is_hanger)
    return chosen[np.argsort(mesh.points[lower[chosen], 0], kind="stable")]


def with_errors(design: StaticState, error: FloatArray) -> StaticState:
    """Bring a designed line to rest with droppers that are longer than designed by ``error`` [m], (n_droppers,).

    Raises
    ------
    EquilibriumError
        If a dropper would have no length left, or the line no equilibrium.
    """
    length = checked_lengths(design, design.unstrained_length + error)
    return find_rest(design, replace(design.shape.mesh, given_length=length), design.shape.points)


def checked_lengths(design: StaticState, length: FloatArray) -> FloatArray:
    """Return unstrained lengths, shape (n_droppers,), if every dropper has one left; raises ``EquilibriumError``."""
    if (length <= 0.0).any():
        definition, mesh = design.shape.definition, design.shape.mesh
        worst = int(length.argmin())
        x = mesh.points[mesh.droppers[worst, 0], 0]
        raise EquilibriumError(
            f"line '{definition.name}': errors and faults leave the dropper at {x:.2f} m a length of "
            f"{length[worst]:.3g} m, of {design.unstrained_length[worst]:.3g} m in the design"
        )
    return length


def find_fitted_lengths(design: StaticState, height: FloatArray) -> FittedLengths:
    """Find the dropper lengths that hold a designed line's wire at given heights.

    Supports and registration ends are where the design has them. Droppers carry tension only: one that would have to
    push is slack, and the wire is there above the height that was given.

    Parameters
    ----------
    design : StaticState
    height : ndarray, shape (n_droppers,)
        Of the lower ends [m]; NaN: the dropper has the length of the design.

    Raises
    ------
    EquilibriumError
        If the line has no equilibrium with these heights, or it is not found which droppers are slack.
    """
    measured = np.isfinite(height)
    lower = design.shape.mesh.droppers[:, 0]
    slack = np.zeros(len(height), dtype=np.bool_)
    for _ in range(_MAX_ROUNDS):
        given = np.where(measured, np.nan, design.unstrained_length)
        given = np.where(slack, design.unstrained_length + _LOOSE, given)
        mesh = replace(design.shape.mesh, target=height, given_length=given)
        state = find_rest(design, mesh, design.shape.points)
        with np.errstate(invalid="ignore"):
            pushes = measured & ~slack & (state.dropper_force < 0.0)
            needed = slack & (state.positions[lower, 2] < height - _TOLERANCE)
        if not (pushes.any() or needed.any() or slack.any()):
            return FittedLengths(state, state.unstrained_length, slack)
        if not (pushes.any() or needed.any()):
            length = np.where(slack, state.droppers.length - _BARELY, state.unstrained_length)
            return FittedLengths(with_errors(design, length - design.unstrained_length), length, slack)
        slack = (slack | pushes) & ~needed
    raise EquilibriumError(
        f"line '{design.shape.definition.name}': it is not found which droppers are slack with the wire as measured; "
        "check the measured heights"
    )

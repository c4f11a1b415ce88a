"""A line at rest in a steady wind across it: how far its contact wire is blown, span by span."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from models.arrays import FloatArray
from models.catenary.definition.line_definition import COMPONENTS, CatenaryDefinition, Wire
from models.catenary.definition.wind_definition import Wind
from models.catenary.line_model import CatenaryModel
from models.catenary.shape.beam_elements import NODE_DOFS, beam_mass, frames, to_global
from models.catenary.shape.element_pattern import element_dofs
from models.catenary.shape.form_finding import StaticState
from models.catenary.shape.line_matrices import axial_stiffness
from models.catenary.shape.line_mesh import CatenaryMesh
from models.catenary.shape.track import mean_curvature
from models.catenary.statics.found_tension import found_tension
from models.catenary.statics.span_table import String

#: Wires that the wind blows; the drag of droppers and of stitch wires is left out.
_BLOWN = ("contact_wire", "auxiliary_wire", "messenger_wire")


@dataclass(frozen=True)
class BlowOff:
    """A section in the wind, from the left (to the right, y < 0) and from the right.

    Attributes
    ----------
    x, still, to_left, to_right : ndarray, shape (n,)
        Contact wire: place along the track, lateral place without wind and with it [m].
    offset : ndarray, shape (n_spans,)
        Largest distance from the middle of the track in a span, under either wind [m].
    blown : ndarray, shape (n_spans,)
        Movement of the wire in the middle of the span from the line between its clamps [m].
    string, string_blown : ndarray, shape (n_spans,)
        The same two of a string [m]; NaN in spans whose ends do not hold the wire in plan.
    lift : ndarray, shape (n_arms, 2)
        By how much the wire rises at the steady arms under wind to the left, to the right [m].
    arm_x : ndarray, shape (n_arms,)
        Where these are [m].
    """

    x: FloatArray
    still: FloatArray
    to_left: FloatArray
    to_right: FloatArray
    offset: FloatArray
    blown: FloatArray
    string: FloatArray
    string_blown: FloatArray
    lift: FloatArray
    arm_x: FloatArray


def blow_off(model: CatenaryModel, pressure: float, section: int = 0) -> BlowOff:
    """Return a section in the wind, found with the mesh: one solution about the line at rest, with N/L.

    Parameters
    ----------
    pressure : float
        1/2 rho V^2 G_q [Pa].
    """
    static = model.static
    mesh, definition = static.shape.mesh, static.shape.definition
    moved = _moved(static, wind_load(definition, mesh, static.shape.points, pressure))
    nodes = next(c.nodes for c in mesh.contact_chains() if c.section == section)
    x, still = static.positions[nodes, :2].T
    aside = moved[nodes, 1]
    arms = mesh.arms[mesh.section[mesh.arms[:, 1]] == section, 1]
    spans = definition.sections[section].spans
    ends = np.array([spans[0].start, *(s.end for s in spans)])
    clamps = np.interp(ends, x, aside)
    middle = 0.5 * (ends[1:] + ends[:-1])
    wind = _forces(definition, pressure)["contact_wire"]
    places = np.interp(ends, x, still)
    supports = mesh.support_nodes[mesh.section[mesh.support_nodes] == section]
    held = np.array([False, *np.isin(supports, mesh.arms[:, 1]).tolist(), False])
    if definition.sections[section].periodic:
        held = np.append(held[1:-1], held[1])
    apart = ~(held[1:] & held[:-1])
    tension = found_tension(static, "contact_wire", section, middle)
    strings = [
        _string(definition, String(T, wind), *span)
        for T, *span in zip(tension.tolist(), ends[:-1], ends[1:], places[:-1], places[1:], strict=True)
    ]
    return BlowOff(
        x=x,
        still=still,
        to_left=still + aside,
        to_right=still - aside,
        offset=np.array([_farthest(x, still, aside, a, b) for a, b in pairwise(ends)]),
        blown=np.interp(middle, x, aside) - 0.5 * (clamps[1:] + clamps[:-1]),
        string=np.where(apart, np.nan, strings),
        string_blown=np.where(apart, np.nan, wind * np.diff(ends) ** 2 / (8.0 * tension)),
        lift=np.outer(moved[arms, 2], [1.0, -1.0]),
        arm_x=mesh.points[arms, 0],
    )


def wind_load(definition: CatenaryDefinition, mesh: CatenaryMesh, points: FloatArray, pressure: float) -> FloatArray:
    """Return the consistent load of a wind to the left on the wires that it blows, shape (6 n,)."""
    per_length = np.zeros(len(mesh.beams))
    for name, force in _forces(definition, pressure).items():
        per_length[mesh.component == COMPONENTS.index(name)] = force
    start, end = mesh.beams.T
    axes, length = frames(points[start], points[end])
    # The consistent mass matrix with force in place of mass, times a field of 1 to the left.
    matrices = to_global(beam_mass(per_length, np.zeros_like(per_length), length), axes)
    field = np.zeros(2 * NODE_DOFS)
    field[[1, 1 + NODE_DOFS]] = 1.0
    load = np.zeros(NODE_DOFS * len(points))
    np.add.at(load, element_dofs(mesh.owner[mesh.beams]), matrices @ field)
    return load


def _forces(definition: CatenaryDefinition, pressure: float) -> dict[str, float]:
    """Return the wind's force per length on the wires that it blows [N/m]."""
    wind = (definition.wind or Wind()).design
    wires: dict[str, Wire | None] = {name: getattr(definition, name) for name in _BLOWN}
    return {name: wind.force(wire.width, pressure) for name, wire in wires.items() if wire is not None}


def _moved(static: StaticState, load: FloatArray) -> FloatArray:
    """Return how far nodes move under a load, droppers taut as they hang, shape (n, 6).

    Tensions stay, as weights keep them: a wire that is bowed in plan and blown further would be stretched, but draws
    wire from its ends instead.
    """
    mesh, shape = static.shape.mesh, static.shape
    aside = np.zeros(mesh.fixed.shape)
    aside[:, 1:3] = 1.0
    stretch = axial_stiffness(shape.definition, mesh, shape.points, arms=False) @ sp.diags(aside.ravel())
    taut = np.where(static.is_slack, 0.0, static.droppers.stiffness)
    K = shape.matrices.K - stretch + static.droppers.rows.T @ sp.diags(taut) @ static.droppers.rows
    if shape.definition.dynamics.geometric_stiffness:
        K = K + static.pendulum_stiffness()
    free = np.flatnonzero(~mesh.fixed.ravel())
    result = np.zeros(load.size)
    result[free] = splu(sp.csc_matrix(K)[free][:, free]).solve(load[free])
    moved: FloatArray = result.reshape(-1, NODE_DOFS)[mesh.owner]
    return moved


def _farthest(x: FloatArray, still: FloatArray, aside: FloatArray, start: float, end: float) -> float:
    """Return the largest distance from the middle of the track in a span under either wind [m]."""
    inside = (x >= start - 0.01) & (x <= end + 0.01)
    return float((np.abs(still) + np.abs(aside))[inside].max())


def _string(
    definition: CatenaryDefinition, string: String, start: float, end: float, first: float, last: float
) -> float:
    """Return the largest offset of a string in a span, of the curvature that the track has there on the average [m]."""
    kappa = 0.0 if definition.track is None else mean_curvature(definition.track, start, end)
    outward = -np.sign(kappa) or 1.0
    return string.offset(end - start, abs(kappa), outward * first, outward * last)

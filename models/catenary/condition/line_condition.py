"""From the design to the line as found: lengths and supports with errors and faults, and the equilibrium there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from models.arrays import FloatArray
from models.catenary.condition.as_found import as_found
from models.catenary.condition.faults import (
    active_faults,
    area_left,
    broken_droppers,
    hard_point_mass,
    settlements,
    slips,
    tension_left,
)
from models.catenary.condition.fitted_lengths import checked_lengths, fitted_errors
from models.catenary.condition.irregularities import dropper_length_errors, stagger_errors, support_height_errors
from models.catenary.condition.tensioning import WireTension, mast_sides, swing, tension_factors, wire_tensions
from models.catenary.definition.line_definition import CatenaryDefinition
from models.catenary.shape.form_finding import StaticState, find_rest
from models.catenary.shape.line_mesh import CatenaryMesh


def find_condition(design: StaticState) -> StaticState:
    """Return the line at rest as its definition's errors and faults leave it; the design itself if there are none.

    Raises
    ------
    EquilibriumError
        If a dropper would have no length or no place left, a wire no tension, or the line no equilibrium.
    """
    definition, designed = design.shape.definition, design.shape.mesh
    if not _differs(definition):
        return design
    raised = support_height_errors(definition.irregularity, designed) - settlements(definition)
    wires = () if definition.tensioning is None or definition.tensioning.is_design else wire_tensions(design)
    found = as_found(design)
    mesh = found.shape.mesh
    changed = replace(
        mesh,
        tension_factor=tension_factors(mesh, wires) * tension_left(definition, mesh),
        area_factor=area_left(definition, mesh),
        clamp_mass=mesh.clamp_mass + hard_point_mass(definition, mesh),
        given_length=_lengths(design),
        broken=broken_droppers(definition, designed),
        seat=mesh.seat + raised,
    )
    aside = stagger_errors(definition.irregularity, designed)
    return find_rest(found, changed, _held(found, raised, aside, wires))


def _differs(definition: CatenaryDefinition) -> bool:
    """Return whether a line has errors, faults or another temperature at all."""
    errors, tensioning = definition.irregularity, definition.tensioning
    changed = tensioning is not None and not tensioning.is_design
    changed = changed or any(any(section.length_errors) for section in definition.sections)
    sigmas = (
        errors.dropper_length_sigma,
        errors.dropper_position_sigma,
        errors.support_height_sigma,
        errors.stagger_sigma,
    )
    return bool(changed or any(sigmas) or active_faults(definition))


def _lengths(design: StaticState) -> FloatArray:
    """Return the unstrained lengths as found [m], shape (n_droppers,)."""
    definition, mesh = design.shape.definition, design.shape.mesh
    lengths = design.unstrained_length + dropper_length_errors(definition.irregularity, mesh) + slips(definition, mesh)
    return checked_lengths(design, lengths + fitted_errors(definition, mesh))


def _held(design: StaticState, raised: FloatArray, aside: FloatArray, wires: Sequence[WireTension]) -> FloatArray:
    """Return the design's points with the supports as they stand: messenger wire and registration ends, (n, 3) [m].

    Cantilevers that the contact wire has swung along the track bring the registration ends nearer to the masts.
    """
    mesh, points = design.shape.mesh, design.shape.points.copy()
    rise = np.zeros(len(points))
    rise[mesh.sprung] = raised
    rise[mesh.arms[:, 0]] = _at_arms(mesh, raised)
    points[:, 2] += rise[mesh.owner]
    points[mesh.arms[:, 0], 1] += _at_arms(mesh, aside)
    for wire in wires:
        if wire.component == "contact_wire":
            points[:, 1] += _towards_masts(design, wire)
    return points


def _towards_masts(design: StaticState, wire: WireTension) -> FloatArray:
    """Return how far registration ends of a section have come towards their masts, left positive, shape (n,) [m]."""
    definition, mesh = design.shape.definition, design.shape.mesh
    assert definition.tensioning is not None
    x = wire.ends[1:-1]
    sides = mast_sides(definition.tensioning, len(x))
    moved = swing(wire.strain * (x - wire.fixed_point), definition.tensioning.cantilever_length)
    result = np.zeros(len(mesh.points))
    end, node = mesh.arms[mesh.section[mesh.arms[:, 1]] == wire.section].T
    result[end] = np.interp(mesh.points[node, 0], x, sides * moved)
    return result


def _at_arms(mesh: CatenaryMesh, raised: FloatArray) -> FloatArray:
    """Return of what belongs to supports what belongs to those of the steady arms, shape (n_arms,)."""
    of_node = dict(zip(mesh.support_nodes.tolist(), raised.tolist(), strict=True))
    return np.array([of_node[node] for node in mesh.arms[:, 1].tolist()])

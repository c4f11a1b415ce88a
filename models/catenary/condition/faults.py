"""Faults of droppers: which of them are broken, and by how much others have slipped."""

from __future__ import annotations

import numpy as np

from models.arrays import BoolArray, FloatArray
from models.catenary.definition.condition_definition import Fault
from models.catenary.definition.line_definition import CatenaryDefinition
from models.catenary.shape.line_mesh import CatenaryMesh


def broken_droppers(definition: CatenaryDefinition, mesh: CatenaryMesh) -> BoolArray:
    """Return which droppers are broken, shape (n_droppers,)."""
    result = np.zeros(len(mesh.droppers), dtype=np.bool_)
    for fault in active_faults(definition):
        if fault.kind == "dropper_broken":
            result[_place(definition, mesh, fault)] = True
    return result


def slips(definition: CatenaryDefinition, mesh: CatenaryMesh) -> FloatArray:
    """Return how far droppers have slipped, which makes them longer [m], shape (n_droppers,)."""
    result = np.zeros(len(mesh.droppers))
    for fault in active_faults(definition):
        if fault.kind == "dropper_slipped":
            result[_place(definition, mesh, fault)] += fault.value
    return result


def active_faults(definition: CatenaryDefinition) -> tuple[Fault, ...]:
    """Return the faults that act."""
    return tuple(fault for fault in definition.fault if fault.active)


def _place(definition: CatenaryDefinition, mesh: CatenaryMesh, fault: Fault) -> int:
    """Return the place in the mesh of the dropper that a fault is of."""
    section = fault.section - 1
    x = definition.sections[section].spans[fault.span - 1].droppers[fault.dropper - 1]
    lower = mesh.droppers[:, 0]
    candidates = np.flatnonzero((mesh.section[lower] == section) & ~mesh.is_hanger)
    return int(candidates[np.abs(mesh.points[lower[candidates], 0] - x).argmin()])

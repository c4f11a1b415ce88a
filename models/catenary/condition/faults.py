"""What active faults do: to droppers and supports, counted as in the design, and to the mesh of the line as found."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeVar

import numpy as np

from models.arrays import BoolArray, FloatArray
from models.catenary.definition.fault_definition import (
    ArmLoose,
    DropperBroken,
    DropperFault,
    DropperSlipped,
    Fault,
    HardPoint,
    SupportSunk,
    TensionLoss,
    Wear,
)
from models.catenary.definition.line_definition import COMPONENTS, CatenaryDefinition
from models.catenary.shape.line_mesh import CatenaryMesh

F = TypeVar("F", bound=Fault)


def active_faults(definition: CatenaryDefinition) -> tuple[Fault, ...]:
    """Return the faults that act."""
    return tuple(fault for fault in definition.fault if fault.active)


def active_of(definition: CatenaryDefinition, kind: type[F]) -> Iterator[F]:
    """Yield the faults of a kind that act."""
    return (fault for fault in active_faults(definition) if isinstance(fault, kind))


def broken_droppers(definition: CatenaryDefinition, mesh: CatenaryMesh) -> BoolArray:
    """Return which droppers of a designed line are broken, shape (n_droppers,)."""
    result = np.zeros(len(mesh.droppers), dtype=np.bool_)
    for fault in active_of(definition, DropperBroken):
        result[_dropper(definition, mesh, fault)] = True
    return result


def slips(definition: CatenaryDefinition, mesh: CatenaryMesh) -> FloatArray:
    """Return how far droppers of a designed line have slipped, which makes them longer [m], shape (n_droppers,)."""
    result = np.zeros(len(mesh.droppers))
    for fault in active_of(definition, DropperSlipped):
        result[_dropper(definition, mesh, fault)] += fault.amount
    return result


def settlements(definition: CatenaryDefinition) -> FloatArray:
    """Return how far every support between the anchors has sunk [m], shape (n_supports,)."""
    counts = [len(section.inner_supports) for section in definition.sections]
    result = np.zeros(sum(counts))
    for fault in active_of(definition, SupportSunk):
        result[sum(counts[: fault.section - 1]) + fault.support - 1] += fault.amount
    return result


def loose_arms(definition: CatenaryDefinition, section: int) -> set[int]:
    """Return the supports of a section, from 0, whose arms have come off; the section counts from 0."""
    return {fault.support - 1 for fault in active_of(definition, ArmLoose) if fault.section - 1 == section}


def tension_left(definition: CatenaryDefinition, mesh: CatenaryMesh) -> FloatArray:
    """Return the share of its tension that is left of every beam element, shape (n_beams,)."""
    result = np.ones(len(mesh.beams))
    for fault in active_of(definition, TensionLoss):
        result[_of_wire(mesh, fault.wire, fault.section)] *= 1.0 - fault.amount
    return result


def area_left(definition: CatenaryDefinition, mesh: CatenaryMesh) -> FloatArray:
    """Return the share of its cross-section that is left of every beam element, shape (n_beams,)."""
    result = np.ones(len(mesh.beams))
    middle = mesh.points[mesh.beams, 0].mean(axis=1)
    for fault in active_of(definition, Wear):
        inside = (middle > fault.from_) & (middle < fault.to)
        result[_of_wire(mesh, "contact_wire", fault.section) & inside] *= 1.0 - fault.amount
    return result


def hard_point_mass(definition: CatenaryDefinition, mesh: CatenaryMesh) -> FloatArray:
    """Return the mass of hard points on every node [kg], shape (n,)."""
    result = np.zeros(len(mesh.points))
    for fault in active_of(definition, HardPoint):
        nodes = mesh.contact_chains()[fault.section - 1].nodes
        node = nodes[np.abs(mesh.points[nodes, 0] - fault.position).argmin()]
        result[mesh.owner[node]] += fault.amount
    return result


def marked_places(definition: CatenaryDefinition, section: int) -> list[float]:
    """Return where faults need a node of the contact wire of a section, which counts from 0 [m]."""
    worn = (x for f in active_of(definition, Wear) if f.section - 1 == section for x in (f.from_, f.to))
    return [*worn, *(f.position for f in active_of(definition, HardPoint) if f.section - 1 == section)]


def _of_wire(mesh: CatenaryMesh, component: str, section: int) -> BoolArray:
    """Return which beam elements are of a wire of a section, which counts from 1."""
    result: BoolArray = (mesh.component == COMPONENTS.index(component)) & (
        mesh.section[mesh.beams[:, 0]] == section - 1
    )
    return result


def _dropper(definition: CatenaryDefinition, mesh: CatenaryMesh, fault: DropperFault) -> int:
    """Return the place in the mesh of the dropper that a fault is of."""
    section = fault.section - 1
    x = definition.sections[section].spans[fault.span - 1].droppers[fault.dropper - 1]
    lower = mesh.droppers[:, 0]
    candidates = np.flatnonzero((mesh.section[lower] == section) & ~mesh.is_hanger)
    return int(candidates[np.abs(mesh.points[lower[candidates], 0] - x).argmin()])

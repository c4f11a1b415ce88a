"""The design on the mesh of the line as found: clamps where they are, the arms that are left, places of faults."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from models.arrays import BoolArray, FloatArray
from models.catenary.condition.faults import loose_arms, marked_places
from models.catenary.condition.irregularities import dropper_position_errors
from models.catenary.definition.line_definition import CatenaryDefinition
from models.catenary.definition.section_definition import Section
from models.catenary.shape.beam_elements import NODE_DOFS
from models.catenary.shape.dropper_set import dropper_set
from models.catenary.shape.form_finding import EquilibriumError, StaticState
from models.catenary.shape.line_mesh import CatenaryMesh, build_mesh, stitch_clamps
from models.catenary.shape.line_shape import line_shape
from models.catenary.shape.wire_intervals import attachments

#: Droppers hang at least so far from what is beside them, as in a definition [m].
_GAP: Final = 1e-3
#: A place of a fault that is nearer to a support or a dropper takes its place: shorter elements serve nothing [m].
_NEAR: Final = 0.01


def as_found(design: StaticState) -> StaticState:
    """Return a design on the mesh that the line as found has; the design itself where that is the same.

    Wires hang as designed, their new nodes on straight lines between the old ones; what is left of arms has its force.

    Raises
    ------
    EquilibriumError
        If a dropper would hang outside its span, or beyond what is beside it.
    """
    definition, mesh = design.shape.definition, design.shape.mesh
    count = range(len(definition.sections))
    loose, marks = [loose_arms(definition, i) for i in count], [marked_places(definition, i) for i in count]
    if not (definition.irregularity.dropper_position_sigma or any(loose) or any(marks)):
        return design
    sections = [_without_arms(s, gone) for s, gone in zip(_moved(definition, mesh), loose, strict=True)]
    places = {i: _apart(sections[i], marks[i]) for i in count}
    found = build_mesh(replace(definition, sections=tuple(sections)), places)
    supports = _numbers(definition, loose)
    found.clamp_mass[found.support_nodes[supports]] += definition.clamps.steady_arm  # what the arms leave
    return _on(found, design, ~np.isin(mesh.arms[:, 1], mesh.support_nodes[supports]))


def _moved(definition: CatenaryDefinition, mesh: CatenaryMesh) -> Iterator[Section]:
    """Yield the sections with their droppers and hangers where they hang, in the order of the mesh."""
    if not definition.irregularity.dropper_position_sigma:
        yield from definition.sections
        return
    errors = iter(dropper_position_errors(definition.irregularity, mesh).tolist())
    for section in definition.sections:
        hangers = [tuple(x + next(errors) for x in span.hangers) for span in section.spans]
        droppers = [tuple(x + next(errors) for x in span.droppers) for span in section.spans]
        clamps = [x for pair in stitch_clamps(definition, section) for x in pair]
        for span, *found in zip(section.spans, droppers, hangers, strict=True):
            fences = sorted({span.start, span.end, *(x for x in clamps if span.start < x < span.end)})
            _check(definition, fences, span.droppers, found[0])
            _check(definition, fences, span.hangers, found[1])
        spans = (
            replace(span, droppers=d, hangers=h) for span, d, h in zip(section.spans, droppers, hangers, strict=True)
        )
        yield replace(section, spans=tuple(spans))


def _check(
    definition: CatenaryDefinition, fences: Sequence[float], designed: Sequence[float], found: Sequence[float]
) -> None:
    """Refuse droppers that hang outside their span, or beyond a clamp of a stitch wire or a dropper beside them."""
    for k, (x, now) in enumerate(zip(designed, found, strict=True)):
        after = bisect_left(fences, x)
        low, high = fences[max(after - 1, 0)], fences[after]
        beyond = ""
        if not low + _GAP <= now <= high - _GAP:
            at = low if now < low + _GAP else high
            is_end = at in (fences[0], fences[-1])
            beyond = "outside its span" if is_end else f"past the stitch wire's clamp at {at:.2f} m"
        elif k and now - found[k - 1] < _GAP:
            beyond = f"past its neighbour, which hangs at {found[k - 1]:.2f} m"
        if beyond:
            sigma, seed = definition.irregularity.dropper_position_sigma, definition.irregularity.seed
            raise EquilibriumError(
                f"line '{definition.name}': with irregularity.dropper_position_sigma of {sigma:g} m and seed {seed} "
                f"the dropper at {x:.2f} m would hang at {now:.2f} m, {beyond}; take a smaller sigma, or another seed"
            )


def _without_arms(section: Section, loose: set[int]) -> Section:
    """Return a section without the arms of some supports, counted from 0 between the anchors."""
    first = 0 if section.periodic else 1
    supports = (
        replace(s, has_steady_arm=s.has_steady_arm and i - first not in loose) for i, s in enumerate(section.supports)
    )
    return replace(section, supports=tuple(supports)) if loose else section


def _apart(section: Section, marks: Sequence[float]) -> list[float]:
    """Return places of a contact wire that are not as good as those of its supports and droppers, or each other's."""
    there = [x for span in section.spans for x in (span.start, *span.droppers, span.end)]
    kept: list[float] = []
    for mark in marks:
        if min(abs(mark - x) for x in (*there, *kept)) > _NEAR:
            kept.append(mark)
    return kept


def _numbers(definition: CatenaryDefinition, loose: Sequence[set[int]]) -> list[int]:
    """Return the places of supports with loose arms among those of all sections."""
    before = [sum(len(s.inner_supports) for s in definition.sections[:i]) for i in range(len(loose))]
    return [first + k for first, supports in zip(before, loose, strict=True) for k in sorted(supports)]


def _on(mesh: CatenaryMesh, design: StaticState, kept: BoolArray) -> StaticState:
    """Return a design on another mesh of its wires and droppers, of whose arms some are kept."""
    before, definition = design.shape.mesh, design.shape.definition
    hung, moved = design.shape.points.copy(), design.displacement.reshape(-1, NODE_DOFS)
    # What a design keeps as displacements at its arms is that of a wire elsewhere where an arm is gone.
    free = np.isin(before.owner, before.arms[~kept, 1])
    hung[free, 1:] += moved[free, 1:3]
    points, held = mesh.points.copy(), attachments(mesh)
    for chain, old in zip(mesh.chains, before.chains, strict=True):
        x = points[chain.nodes, 0]
        y, z = (np.interp(x, hung[old.nodes, 0], hung[old.nodes, axis]) for axis in (1, 2))
        at = held[chain.nodes]
        points[chain.nodes, 1], points[chain.nodes, 2] = np.interp(x, x[at], y[at]), z
    points[mesh.arms[:, 0]] = hung[before.arms[kept, 0]]
    displacement = np.zeros((len(points), NODE_DOFS))
    displacement[mesh.arms.ravel()] = moved[before.arms[kept].ravel()]
    displacement = displacement[mesh.owner]
    positions: FloatArray = points + displacement[:, :3]
    return replace(
        design,
        shape=line_shape(definition, mesh, points),
        droppers=dropper_set(definition, mesh, positions),
        displacement=displacement.ravel(),
        arm_force=design.arm_force[kept],
    )

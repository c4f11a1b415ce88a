"""Mesh of a line: definition -> points, wires as chains of nodes, droppers, steady arms, fixed degrees of freedom.

Nodes are numbered section by section, and within a section along the track with its wires interleaved. This keeps every
matrix banded: sections do not act on each other, so their matrices are blocks on the diagonal.

One class builds a section wire by wire into a draft; as the wires refer to each other, the file stays in one piece.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from models.arrays import BoolArray, FloatArray, IntArray
from models.catenary.definition.line_definition import COMPONENTS, CatenaryDefinition
from models.catenary.definition.section_definition import Section, Span
from models.catenary.shape.support_places import SupportPlaces

#: Positions closer than this coincide [m].
_SAME = 1e-6


@dataclass(frozen=True)
class Chain:
    """A wire: its component type, its section and its nodes from end to end."""

    component: str
    section: int
    nodes: IntArray


@dataclass(frozen=True)
class CatenaryMesh:
    """Mesh of a line.

    Attributes
    ----------
    points : ndarray, shape (n, 3)
        Reference positions [m].
    beams : ndarray, shape (n_beams, 2)
        Nodes of the beam elements: wires, then steady arms.
    component : ndarray, shape (n_beams,)
        Index into ``COMPONENTS``.
    beside_stitch : ndarray, shape (n_beams,)
        True for the messenger wire between the clamps of a stitch wire, which takes over part of its tension.
    chains : tuple of Chain
        Every wire.
    droppers : ndarray, shape (n_droppers, 2)
        Lower and upper node.
    is_hanger : ndarray, shape (n_droppers,)
        True between auxiliary and messenger wire of a compound line.
    target : ndarray, shape (n_droppers,)
        Specified static height of the lower node [m].
    given_length : ndarray, shape (n_droppers,)
        Unstrained length where given instead of the height, NaN elsewhere [m].
    broken : ndarray, shape (n_droppers,)
        True where only the clamps and half of the dropper's mass are left on each wire.
    fixed : ndarray, shape (n, 6)
        Degrees of freedom held at zero.
    sprung : ndarray, shape (n_supports,)
        Nodes of the messenger wire on supports, elastic ones if the line has a ``MessengerSupport``.
    seat : ndarray, shape (n_supports,)
        Height of the supports' seats, where an elastic one is unloaded [m].
    tension_factor : ndarray, shape (n_beams,)
        Tension of a beam element over that of the definition.
    area_factor : ndarray, shape (n_beams,)
        Cross-section of a beam element over that of the definition, as of a worn wire: mass goes with it, bending
        stiffness with its square.
    clamp_mass : ndarray, shape (n,)
        Lumped mass [kg].
    support_nodes : ndarray, shape (n_supports,)
        Node of the contact wire at every support between the anchors.
    arms : ndarray, shape (n_arms, 2)
        Registration node and contact-wire node of the steady arms.
    section : ndarray, shape (n,)
        Section of every node, from 0.
    owner : ndarray, shape (n,)
        Node whose degrees of freedom a node has: the node itself, except for images where a periodic line closes. An
        image is the last node of a wire, one period beyond the first, whose motion it shares.
    adrift : ndarray, shape (k,)
        Nodes at the supports of wires that close on themselves and are not held along the track.
    """

    points: FloatArray
    beams: IntArray
    component: IntArray
    beside_stitch: BoolArray
    chains: tuple[Chain, ...]
    droppers: IntArray
    is_hanger: BoolArray
    target: FloatArray
    given_length: FloatArray
    broken: BoolArray
    fixed: BoolArray
    sprung: IntArray
    seat: FloatArray
    tension_factor: FloatArray
    area_factor: FloatArray
    clamp_mass: FloatArray
    support_nodes: IntArray
    arms: IntArray
    section: IntArray
    owner: IntArray
    adrift: IntArray

    def contact_chains(self) -> tuple[Chain, ...]:
        """Return the contact wire of every section."""
        return tuple(c for c in self.chains if c.component == "contact_wire")


@dataclass
class _Draft:
    """A mesh under construction, nodes in order of creation."""

    points: list[tuple[float, float, float]] = field(default_factory=list)
    fixed: list[tuple[bool, ...]] = field(default_factory=list)
    mass: list[float] = field(default_factory=list)
    beams: list[tuple[int, int]] = field(default_factory=list)
    component: list[int] = field(default_factory=list)
    chains: list[tuple[str, int, list[int]]] = field(default_factory=list)
    droppers: list[tuple[int, int]] = field(default_factory=list)
    is_hanger: list[bool] = field(default_factory=list)
    target: list[float] = field(default_factory=list)
    given_length: list[float] = field(default_factory=list)
    beside_stitch: list[bool] = field(default_factory=list)
    sprung: list[int] = field(default_factory=list)
    supports: list[int] = field(default_factory=list)
    arms: list[tuple[int, int]] = field(default_factory=list)
    section: list[int] = field(default_factory=list)
    owner: list[int] = field(default_factory=list)
    adrift: list[int] = field(default_factory=list)
    current: int = 0

    def node(self, x: float, y: float, z: float, held: str = "") -> int:
        self.points.append((x, y, z))
        self.fixed.append(tuple(name in held.split() for name in ("x", "y", "z", "rx", "ry", "rz")))
        self.mass.append(0.0)
        self.section.append(self.current)
        self.owner.append(len(self.owner))
        return len(self.points) - 1

    def image(self, node: int, x: float) -> int:
        """Add a node that moves as another one and has no degrees of freedom itself."""
        _, y, z = self.points[node]
        image = self.node(x, y, z, "x y z rx ry rz")
        self.owner[image] = node
        return image

    def beam(self, i: int, j: int, component: str) -> None:
        self.beams.append((i, j))
        self.component.append(COMPONENTS.index(component))
        self.beside_stitch.append(False)

    def hold(self, node: int, names: str) -> None:
        held = names.split()
        axes = ("x", "y", "z", "rx", "ry", "rz")
        self.fixed[node] = tuple(f or a in held for f, a in zip(self.fixed[node], axes, strict=True))


class _Wire:
    """A wire under construction: break points -> nodes -> look-up by position."""

    def __init__(self, draft: _Draft, component: str, section: int) -> None:
        self.draft, self.component, self.section = draft, component, section
        self.x: list[float] = []
        self.nodes: list[int] = []
        self.beams: list[int] = []

    def append(self, x: float, node: int) -> None:
        if self.nodes:
            self.beams.append(len(self.draft.beams))
            self.draft.beam(self.nodes[-1], node, self.component)
        self.x.append(x)
        self.nodes.append(node)

    def at(self, x: float) -> int:
        i = bisect_right(self.x, x + _SAME) - 1
        if abs(self.x[i] - x) > _SAME:
            raise LookupError(f"{self.component} has no node at {x:g} m")
        return self.nodes[i]

    def close(self) -> None:
        self.draft.chains.append((self.component, self.section, self.nodes))


def build_mesh(definition: CatenaryDefinition, marks: Mapping[int, Sequence[float]] | None = None) -> CatenaryMesh:
    """Return the mesh of a line, the contact wire at its specified profile, the other wires at a first guess.

    Parameters
    ----------
    marks : mapping of int to sequence of float, optional
        Section from 0 -> places where its contact wire has a node besides those at supports and droppers [m].
    """
    draft = _Draft()
    for index, section in enumerate(definition.sections):
        draft.current = index
        _SectionMesher(definition, section, index, draft).build((marks or {}).get(index, ()))
    return _numbered(draft)


def stitch_clamps(definition: CatenaryDefinition, section: Section) -> list[tuple[float, float]]:
    """Return the ends of the stitch wires of a section, one at every registered support [m]."""
    stitch = definition.stitch_wire
    if stitch is None:
        return []
    half = stitch.length / 2.0
    first, last = section.ends.working
    inner = [s.x for s in section.supports[1:-1] if first <= s.x <= last]
    return [(x - half, x + half) for x in inner]


def contact_wire_height(places: SupportPlaces, x: float) -> float:
    """Return the specified static height of the contact wire at a dropper [m].

    Straight between the heights at the supports, minus the pre-sag parabola of the span, or the measured table; plus
    the rise to the anchors.
    """
    section = places.section
    if section.measured:
        xs, zs = zip(*section.measured, strict=True)
        return float(np.interp(x, xs, zs))
    span = _span_at(section, x)
    return places.height(x) + section.ends.rise_at(x) - _pre_sag(places.definition, span, x)


def _span_at(section: Section, x: float) -> Span:
    place = bisect_right(section.spans, x, key=lambda span: span.start) - 1
    return section.spans[max(0, min(place, len(section.spans) - 1))]


def _pre_sag(definition: CatenaryDefinition, span: Span, x: float) -> float:
    depth = definition.profile.pre_sag * span.length
    start, end = span.start, span.end
    if definition.profile.pre_sag_between == "droppers" and len(span.droppers) > 1:
        start, end = span.droppers[0], span.droppers[-1]
    share = (x - start) / (end - start)
    return depth * max(0.0, 4.0 * share * (1.0 - share))


class _SectionMesher:
    """Builds one section into the draft."""

    def __init__(self, definition: CatenaryDefinition, section: Section, index: int, draft: _Draft) -> None:
        self.definition, self.section, self.index, self.draft = definition, section, index, draft
        self.elements = definition.mesh.elements_between_droppers
        self.boundaries = [section.spans[0].start, *(span.end for span in section.spans)]
        self.supports = [s.x for s in section.inner_supports]
        self.places = SupportPlaces(definition, section)
        self.droppers = [x for span in section.spans for x in span.droppers]
        self.hangers = [x for span in section.spans for x in span.hangers]
        self.lengths = _given_lengths((s.droppers, s.dropper_lengths) for s in section.spans)
        self.hanger_lengths = _given_lengths((s.hangers, s.hanger_lengths) for s in section.spans)

    def build(self, marks: Sequence[float]) -> None:
        contact = self._wire("contact_wire", [*self.boundaries, *self.droppers, *marks], self._contact_height)
        clamps = stitch_clamps(self.definition, self.section)
        hung = [x for x in self.droppers if not _inside(x, clamps)] if clamps else self.droppers
        on_messenger = self.hangers if self.definition.auxiliary_wire is not None else hung
        ends = [x for pair in clamps for x in pair]
        messenger = self._wire("messenger_wire", [*self.boundaries, *on_messenger, *ends], self._messenger_height)
        self._supports(contact, messenger)
        self._arms(contact)
        upper = dict.fromkeys(on_messenger, messenger)
        if self.definition.auxiliary_wire is not None:
            auxiliary = self._auxiliary()
            self._hang(auxiliary, dict.fromkeys(self.hangers, messenger), hanger=True)
            upper = dict.fromkeys(self.droppers, auxiliary)
        for stitch, positions in self._stitches(messenger, clamps):
            upper |= dict.fromkeys(positions, stitch)
        self._hang(contact, upper, hanger=False)

    def _wire(self, component: str, breaks: Iterable[float], height: Callable[[float], float]) -> _Wire:
        wire = _Wire(self.draft, component, self.index)
        *inner, last = _subdivide(breaks, self.elements)
        for x in inner:
            wire.append(x, self.draft.node(x, self.places.lateral(x, component), height(x)))
        if self.section.periodic:
            wire.append(last, self.draft.image(wire.nodes[0], last))
        else:
            wire.append(last, self.draft.node(last, self.places.lateral(last, component), height(last)))
            for end in (wire.nodes[0], wire.nodes[-1]):
                # Held against torsion as well: nothing else does, and a static solution needs it.
                self.draft.hold(end, "x y z rx")
        wire.close()
        return wire

    def _contact_height(self, x: float) -> float:
        return contact_wire_height(self.places, x)

    def _base_height(self, x: float) -> float:
        return self.places.height(x) + self.section.ends.rise_at(x)

    def _messenger_height(self, x: float) -> float:
        """Return the height at the supports; between them a first guess that form finding replaces."""
        span = _span_at(self.section, x)
        sag = (x - span.start) * (span.end - x) / (2.0 * self.definition.messenger_wire.tension) * 20.0
        ends = [self._base_height(span.start), self._base_height(span.end)]
        straight = float(np.interp(x, [span.start, span.end], ends))
        return straight + self.places.encumbrance(x) - sag

    def _auxiliary_height(self, x: float) -> float:
        return self._base_height(x) + (self.definition.profile.auxiliary_height or 0.0)

    def _auxiliary(self) -> _Wire:
        breaks = [*self.boundaries, *self.droppers, *self.hangers]
        wire = self._wire("auxiliary_wire", breaks, self._auxiliary_height)
        for x in self.supports:
            self.draft.hold(wire.at(x), "y rx" if self.section.periodic else "y")
        self._let_adrift(wire)
        return wire

    def _supports(self, contact: _Wire, messenger: _Wire) -> None:
        held = "y z" if self.definition.messenger_support is None else "y"
        for x in self.supports:
            self.draft.hold(messenger.at(x), held)
            self.draft.sprung.append(messenger.at(x))
            self.draft.supports.append(contact.at(x))
        self._let_adrift(messenger)

    def _let_adrift(self, wire: _Wire) -> None:
        """Note a wire with neither anchors nor steady arms, which could wander along the track."""
        if self.section.periodic:
            self.draft.adrift += [wire.at(x) for x in self.supports]

    def _arms(self, contact: _Wire) -> None:
        arm = self.definition.steady_arm
        if arm is None:
            return
        for support in self.section.supports:
            if support.has_steady_arm:
                node = contact.at(support.x)
                x, y, z = self.draft.points[node]
                length = arm.length if support.arm_length is None else support.arm_length
                angle = arm.angle if support.arm_angle is None else support.arm_angle
                y += self.places.side(support) * length * math.cos(angle)
                end = self.draft.node(x, y, z - length * math.sin(angle), "x y z")
                self.draft.beam(end, node, "steady_arm")
                self.draft.arms.append((end, node))
                self.draft.mass[node] += self.definition.clamps.steady_arm

    def _stitches(self, messenger: _Wire, clamps: Sequence[tuple[float, float]]) -> list[tuple[_Wire, list[float]]]:
        result = []
        for start, end in clamps:
            hung = [x for x in self.droppers if start < x < end]
            wire = _Wire(self.draft, "stitch_wire", self.index)
            inner = _subdivide([start, *hung, end], self.elements)[1:-1]
            ends = [self.draft.points[messenger.at(x)] for x in (start, end)]
            wire.append(start, messenger.at(start))
            for x in inner:
                y, z = (float(np.interp(x, [start, end], [p[k] for p in ends])) for k in (1, 2))
                wire.append(x, self.draft.node(x, y, z - 0.1))
            wire.append(end, messenger.at(end))
            wire.close()
            for x in (start, end):
                self.draft.mass[messenger.at(x)] += self.definition.clamps.stitch_wire
            self._relieve(messenger, start, end)
            result.append((wire, hung))
        return result

    def _relieve(self, messenger: _Wire, start: float, end: float) -> None:
        """Mark the messenger wire between the clamps of a stitch wire."""
        inside = (bisect_right(messenger.x, x + _SAME) - 1 for x in (start, end))
        for k in range(*inside):
            self.draft.beside_stitch[messenger.beams[k]] = True

    def _hang(self, lower: _Wire, upper: dict[float, _Wire], *, hanger: bool) -> None:
        height = self._auxiliary_height if hanger else self._contact_height
        lengths = self.hanger_lengths if hanger else self.lengths
        clamps = self.definition.clamps
        for x in sorted(upper):
            low, up = lower.at(x), upper[x].at(x)
            self.draft.droppers.append((low, up))
            self.draft.is_hanger.append(hanger)
            self.draft.target.append(height(x))
            self.draft.given_length.append(lengths.get(x, math.nan))
            self.draft.mass[low] += clamps.dropper_lower
            self.draft.mass[up] += clamps.dropper_upper


def _given_lengths(spans: Iterable[tuple[tuple[float, ...], tuple[float, ...]]]) -> dict[float, float]:
    """Return the given lengths by position, of the droppers that have one."""
    return {x: length for positions, lengths in spans for x, length in zip(positions, lengths, strict=False)}


def _inside(x: float, intervals: Sequence[tuple[float, float]]) -> bool:
    return any(a < x < b for a, b in intervals)


def _subdivide(breaks: Iterable[float], elements: int) -> list[float]:
    """Return node positions that divide every interval between break points into equal elements."""
    ordered = sorted(breaks)
    distinct = [x for i, x in enumerate(ordered) if i == 0 or x - ordered[i - 1] > _SAME]
    positions = [a + (b - a) * k / elements for a, b in pairwise(distinct) for k in range(elements)]
    return [*positions, distinct[-1]]


def _numbered(draft: _Draft) -> CatenaryMesh:
    points = np.array(draft.points)
    order = np.lexsort((points[:, 0], np.array(draft.section)))  # stable, by section and then along the track
    new = np.empty_like(order)
    new[order] = np.arange(len(order))
    return CatenaryMesh(
        points=points[order],
        beams=new[np.array(draft.beams)],
        component=np.array(draft.component),
        beside_stitch=np.array(draft.beside_stitch, dtype=bool),
        chains=tuple(Chain(c, s, new[np.array(nodes)]) for c, s, nodes in draft.chains),
        droppers=new[np.array(draft.droppers, dtype=np.int64).reshape(-1, 2)],
        is_hanger=np.array(draft.is_hanger, dtype=bool),
        target=np.array(draft.target),
        given_length=np.array(draft.given_length),
        broken=np.zeros(len(draft.droppers), dtype=bool),
        fixed=np.array(draft.fixed)[order],
        sprung=new[np.array(draft.sprung, dtype=np.int64)],
        seat=points[np.array(draft.sprung, dtype=np.int64), 2],
        tension_factor=np.ones(len(draft.beams)),
        area_factor=np.ones(len(draft.beams)),
        clamp_mass=np.array(draft.mass)[order],
        support_nodes=new[np.array(draft.supports, dtype=np.int64)],
        arms=new[np.array(draft.arms, dtype=np.int64).reshape(-1, 2)],
        section=np.array(draft.section, dtype=np.int64)[order],
        owner=new[np.array(draft.owner)[order]],
        adrift=new[np.array(draft.adrift, dtype=np.int64)],
    )

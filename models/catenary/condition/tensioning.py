"""Tensions of the wires over temperature: devices, friction in them, losses on the way to the fixed point.

A wire that is free to move expands from its fixed point, u = expansion (t - t_ref) (x - x_fixed). On its way to the
tensioner it swings cantilevers aside and slants droppers, whose pulls along the track its tension loses, support by
support, towards the fixed point. Counted from the fixed point, outward movement is positive.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from models.arrays import FloatArray
from models.catenary.definition.line_definition import COMPONENTS, GRAVITY, CatenaryDefinition, Wire
from models.catenary.definition.section_definition import Section
from models.catenary.definition.tensioning_definition import Tensioning
from models.catenary.shape.beam_elements import NODE_DOFS
from models.catenary.shape.form_finding import EquilibriumError, StaticState
from models.catenary.shape.line_mesh import CatenaryMesh

#: Wires with a tensioning device of their own, and what droppers and hangers hang from what.
WIRES: Final = ("contact_wire", "messenger_wire", "auxiliary_wire")
#: Lowest tension that is searched for, as a share of that of the design.
_LEAST: Final = 1e-3


@dataclass(frozen=True)
class WireTension:
    """A kind of wire of a section at some temperature.

    Attributes
    ----------
    component : str
    section : int
    ends : ndarray, shape (n_spans + 1,)
        Supports and anchors [m].
    tension : ndarray, shape (n_spans,)
        In every span [N].
    nominal, at_tensioner : float
        Tension of the design, and what the devices give [N].
    strain : float
        Movement over the distance from the fixed point.
    fixed_point : float
        [m].
    """

    component: str
    section: int
    ends: FloatArray
    tension: FloatArray
    nominal: float
    at_tensioner: float
    strain: float
    fixed_point: float

    @property
    def at_fixed_point(self) -> float:
        """Return the tension in the span of the fixed point [N]."""
        return float(self.tension[_span_of(self.ends, self.fixed_point)])

    @property
    def loss(self) -> float:
        """Return the largest change of tension between a tensioner and the rest of the wire [N]."""
        return float(np.abs(self.tension - self.at_tensioner).max())

    @property
    def movement(self) -> float:
        """Return how far the end moves outward that moves farthest [m]."""
        return self.strain * max(self.ends[-1] - self.fixed_point, self.fixed_point - self.ends[0])


def ruling_span(lengths: Sequence[float]) -> float:
    """Return sqrt(sum L^3 / sum L) [m].

    Examples
    --------
    >>> ruling_span([50.0, 50.0])
    50.0
    """
    return math.sqrt(sum(L**3 for L in lengths) / sum(lengths))


def anchored_tension(nominal: float, stiffness: float, load: float, span: float, expansion: float) -> float:
    """Return the tension of a wire between ends that hold it, or springs, from the equation of its change of state.

    T - E (w L)^2 / (24 T^2) - [T_0 - E (w L)^2 / (24 T_0^2)] + E expansion = 0

    Parameters
    ----------
    nominal : float
        T_0 [N].
    stiffness : float
        E: EA of the wire, with springs in series 1 / (1 / EA + 1 / (k L_half)) [N].
    load : float
        w, what the wire carries per length [N/m].
    span : float
        L, the ruling span [m].
    expansion : float
        Thermal strain since the reference temperature.

    Returns
    -------
    float
        [N]; NaN if nothing of the tension is left.
    """
    sagging = stiffness * (load * span) ** 2 / 24.0
    wanted = nominal - sagging / nominal**2 - stiffness * expansion

    def excess(tension: float) -> float:
        return tension - sagging / tension**2 - wanted

    tension = _LEAST * nominal
    if excess(tension) > 0.0:
        return math.nan
    # It rises, ever less steeply: from below, Newton's method goes up to the root and never beyond.
    rise = math.inf
    while rise > 1e-13 * tension:
        rise = -excess(tension) / (1.0 + 2.0 * sagging / tension**3)
        tension += rise
    return tension


def cantilever_losses(force: FloatArray, movement: FloatArray, cantilever: float) -> FloatArray:
    """Return what the tension loses at supports, F u / a [N].

    Parameters
    ----------
    force : ndarray, shape (n,)
        Lateral force, greater than 0 where the wire pulls away from the mast [N].
    movement : ndarray, shape (n,)
        Outward [m].
    cantilever : float
        a [m].
    """
    return force * movement / cantilever


def dropper_losses(weight: float, spans: FloatArray, difference: FloatArray, length: float) -> FloatArray:
    """Return what the tension of a wire below droppers loses as these slant, w L du / c [N].

    Parameters
    ----------
    weight : float
        Per length, what hangs on the droppers [N/m].
    spans, difference : ndarray, shape (n,)
        Length that belongs to a place, and how much farther the lower wire moves outward there [m].
    length : float
        Mean length of the droppers, c [m].
    """
    return weight * spans * difference / length


def swing(movement: FloatArray, cantilever: float) -> FloatArray:
    """Return how far what is held by cantilevers moves towards the masts, u^2 / (2 a) [m]."""
    return movement**2 / (2.0 * cantilever)


def mast_sides(tensioning: Tensioning, count: int) -> FloatArray:
    """Return the side of the mast at every support between the anchors, shape (count,): 1 left, -1 right."""
    sides = np.array(tensioning.mast_side)
    return np.full(count, sides[0]) if len(sides) == 1 else sides


def wire_tensions(design: StaticState) -> tuple[WireTension, ...]:
    """Return the tensions of the wires of every section of a designed line at its temperature.

    Raises
    ------
    EquilibriumError
        If a wire would have no tension left.
    """
    definition = design.shape.definition
    return tuple(wire for index, section in enumerate(definition.sections) for wire in _section(design, section, index))


def tension_factors(mesh: CatenaryMesh, wires: Sequence[WireTension]) -> FloatArray:
    """Return the tension of every beam element over that of the design, shape (n_beams,)."""
    result = np.ones(len(mesh.beams))
    middle = mesh.points[mesh.beams, 0].mean(axis=1)
    of_section = mesh.section[mesh.beams[:, 0]]
    for wire in wires:
        chosen = (mesh.component == COMPONENTS.index(wire.component)) & (of_section == wire.section)
        spans = np.searchsorted(wire.ends, middle[chosen], side="right") - 1
        result[chosen] = wire.tension[np.clip(spans, 0, len(wire.tension) - 1)] / wire.nominal
    return result


def _section(design: StaticState, section: Section, index: int) -> list[WireTension]:
    definition = design.shape.definition
    tensioning = _tensioning(definition)
    ends = np.array([section.spans[0].start, *(span.end for span in section.spans)])
    fixed = tensioning.fixed_point
    fixed_point = 0.5 * (ends[0] + ends[-1]) if fixed is None else fixed
    if not ends[0] <= fixed_point <= ends[-1]:
        raise EquilibriumError(
            f"line '{definition.name}': tensioning.fixed_point, {fixed_point:g} m, lies outside the line, "
            f"{ends[0]:g} ... {ends[-1]:g} m"
        )
    half = max(ends[-1] - fixed_point, fixed_point - ends[0])
    devices = {name: _device(design, name, section, index, half) for name in WIRES if getattr(definition, name)}
    distance = np.abs(ends[1:-1] - fixed_point)
    _check_swing(definition, {name: abs(strain) * distance.max(initial=0.0) for name, (_, strain) in devices.items()})
    lost = _losses(design, index, ends, {name: strain * distance for name, (_, strain) in devices.items()})
    return [
        WireTension(
            component=name,
            section=index,
            ends=ends,
            tension=_along(ends, fixed_point, tension, lost[name]),
            nominal=getattr(definition, name).tension,
            at_tensioner=tension,
            strain=strain,
            fixed_point=float(fixed_point),
        )
        for name, (tension, strain) in devices.items()
    ]


def _check_swing(definition: CatenaryDefinition, moved: dict[str, float]) -> None:
    """Refuse wires that move farther than cantilevers reach, by the largest movement at a support [m]."""
    tensioning = _tensioning(definition)
    for name, movement in moved.items():
        if movement >= tensioning.cantilever_length:
            raise EquilibriumError(
                f"line '{definition.name}': at {tensioning.temperature - 273.15:g} degC the {name.replace('_', ' ')} "
                f"moves by {movement:.2f} m at a support, and cantilevers are {tensioning.cantilever_length:g} m long; "
                "check cantilever_length, expansion and the length of the section"
            )


def _tensioning(definition: CatenaryDefinition) -> Tensioning:
    assert definition.tensioning is not None
    return definition.tensioning


def _device(design: StaticState, name: str, section: Section, index: int, half: float) -> tuple[float, float]:
    """Return the tension that the device of a wire gives [N], and the strain by which the wire moves outward."""
    definition = design.shape.definition
    tensioning, wire = _tensioning(definition), getattr(definition, name)
    device = tensioning.of(name)
    expansion = device.expansion * tensioning.warming
    if device.kind == "weights":
        return wire.tension * device.efficiency**tensioning.direction, expansion
    if not expansion:
        return wire.tension, 0.0
    EA = wire.youngs_modulus * wire.area
    spring = math.inf if device.stiffness is None else device.stiffness * half
    span = ruling_span([s.length for s in section.spans])
    load = _carried(design, name, wire, span, index)
    tension = anchored_tension(wire.tension, 1.0 / (1.0 / EA + 1.0 / spring), load, span, expansion)
    if math.isnan(tension):
        raise EquilibriumError(
            f"line '{definition.name}': at {tensioning.temperature - 273.15:g} degC the {name.replace('_', ' ')} has "
            "no tension left; give it weights, or another temperature"
        )
    return tension, (wire.tension - tension) / spring


def _carried(design: StaticState, name: str, wire: Wire, span: float, index: int) -> float:
    """Return what a wire carries per length by its sag [N/m]: the contact wire its pre-sag, the messenger the rest."""
    definition = design.shape.definition
    if name == "auxiliary_wire":
        return 0.0
    by_contact = 8.0 * definition.contact_wire.tension * definition.profile.pre_sag / span
    if name == "contact_wire":
        return by_contact
    mesh, up = design.shape.mesh, np.zeros(design.shape.matrices.load.size)
    up[2::NODE_DOFS] = 1.0
    of_section = np.repeat(mesh.section == index, NODE_DOFS)
    weight = GRAVITY * float((design.shape.matrices.M @ up)[of_section] @ up[of_section])
    ends = definition.sections[index].spans
    return weight / (ends[-1].end - ends[0].start) - by_contact


def _losses(design: StaticState, index: int, ends: FloatArray, moved: dict[str, FloatArray]) -> dict[str, FloatArray]:
    """Return what wires lose at the supports between the anchors on the way inward, by component [N]."""
    definition = design.shape.definition
    tensioning = _tensioning(definition)
    sides = mast_sides(tensioning, len(ends) - 2)
    belongs = 0.5 * (ends[2:] - ends[:-2])
    lost = {}
    for name, movement in moved.items():
        lateral = _lateral(design, name, index, ends[1:-1])
        lost[name] = cantilever_losses(sides * lateral, movement, tensioning.cantilever_length)
    for lower, upper, hangers in _hung(definition):
        weight, length = _hanging(design, index, ends, hangers=hangers)
        slant = dropper_losses(weight, belongs, moved[lower] - moved[upper], length)
        lost[lower] += slant
        lost[upper] -= slant
    for name in moved:
        if tensioning.of(name).kind == "fixed":
            lost[name] = np.zeros(len(ends) - 2)
    return lost


def _hung(definition: CatenaryDefinition) -> list[tuple[str, str, bool]]:
    """Return which wire hangs from which, by droppers or by hangers."""
    if definition.auxiliary_wire is None:
        return [("contact_wire", "messenger_wire", False)]
    return [("contact_wire", "auxiliary_wire", False), ("auxiliary_wire", "messenger_wire", True)]


def _hanging(design: StaticState, index: int, ends: FloatArray, *, hangers: bool) -> tuple[float, float]:
    """Return what hangs on droppers or hangers per length [N/m], and their mean length [m]."""
    mesh = design.shape.mesh
    chosen = (mesh.section[mesh.droppers[:, 0]] == index) & (mesh.is_hanger == hangers)
    if not chosen.any():
        return 0.0, 1.0
    return float(design.dropper_force[chosen].sum() / (ends[-1] - ends[0])), float(
        design.droppers.length[chosen].mean()
    )


def _lateral(design: StaticState, name: str, index: int, x: FloatArray) -> FloatArray:
    """Return the lateral force that the design's supports give a wire, to the left positive [N], shape (n,)."""
    mesh, shape = design.shape.mesh, design.shape
    if name == "contact_wire":
        end, node = mesh.arms.T
        pull = shape.points[end] - shape.points[node]
        force = design.arm_force * pull[:, 1] / np.linalg.norm(pull, axis=1)
    else:
        chain = [c.nodes for c in mesh.chains if c.component == name and c.section == index]
        node = np.concatenate(chain)
        node = node[mesh.fixed[node, 1]]
        held = shape.matrices.K @ design.displacement + shape.droppers.rows.T @ design.dropper_force
        force = (held - shape.matrices.load)[node * NODE_DOFS + 1]
    result = np.zeros(len(x))
    for at, value, section in zip(mesh.points[node, 0], force, mesh.section[node], strict=True):
        place = int(np.abs(x - at).argmin()) if len(x) else 0
        if section == index and len(x) and abs(x[place] - at) < 1e-3:
            result[place] += value
    return result


def _span_of(ends: FloatArray, x: float) -> int:
    return int(np.clip(np.searchsorted(ends, x, side="right") - 1, 0, len(ends) - 2))


def _along(ends: FloatArray, fixed_point: float, tension: float, lost: FloatArray) -> FloatArray:
    """Return the tension in every span, from both tensioners less the losses at the supports passed, (n_spans,) [N].

    Around the fixed point it is the mean of what is left from both sides: the difference is what holds the point.
    """
    before = tension - np.concatenate([[0.0], np.cumsum(lost)])
    after = tension - np.concatenate([np.cumsum(lost[::-1])[::-1], [0.0]])
    middle = 0.5 * (ends[1:] + ends[:-1])
    result = np.where(middle < fixed_point, before, after)
    at = _span_of(ends, fixed_point)
    if ends[at] < fixed_point < ends[at + 1]:
        result[at] = 0.5 * (before[at] + after[at])
    return result

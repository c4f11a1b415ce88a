"""Static analysis of a line: profile, droppers, elasticity, steady-arm loads, waves [1]_.

References
----------
.. [1] F. Kiessling, R. Puschmann, A. Schmieder, E. Schneider, Contact Lines for Electric Railways: elasticity and its
   non-uniformity, wave speed, reflection at droppers, Doppler and amplification factors.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from models.arrays import BoolArray, FloatArray
from models.catenary.contact_and_slack.contact_wire import ContactWire
from models.catenary.contact_and_slack.local_problem import LocalProblem
from models.catenary.definition.line_definition import CatenaryDefinition, Span, Wire
from models.catenary.line_model import CatenaryModel
from models.catenary.linear_motion.attachment_solver import factorised
from models.catenary.linear_motion.compliance import Compliance
from models.contact_law import CONTACT_LAWS

#: Highest speed of operation over the wave speed (EN 50119; section 2.1 of the 2012 thesis).
OPERATION_LIMIT = 0.7


@dataclass(frozen=True)
class Droppers:
    """Static state of droppers, arrays of shape (n,).

    Attributes
    ----------
    x : ndarray
        Position along the track [m].
    length : ndarray
        Unstrained length [m].
    force : ndarray
        Tension [N].
    is_hanger : ndarray of bool
        Between auxiliary and messenger wire of a compound line.
    """

    x: FloatArray
    length: FloatArray
    force: FloatArray
    is_hanger: BoolArray


@dataclass(frozen=True)
class Profile:
    """A wire in its static shape, arrays of shape (n,) [m]."""

    component: str
    x: FloatArray
    y: FloatArray
    z: FloatArray


@dataclass(frozen=True)
class Elasticity:
    """Elasticity of the contact wire along a span.

    Attributes
    ----------
    x : ndarray, shape (n,)
        Where the force pushes [m].
    value : ndarray, shape (n,)
        Uplift per force [m/N].
    force : float
        The force [N]; droppers go slack, so the elasticity depends on it.
    """

    x: FloatArray
    value: FloatArray
    force: float

    @property
    def minimum(self) -> float:
        """Return the smallest elasticity [m/N]."""
        return float(self.value.min())

    @property
    def maximum(self) -> float:
        """Return the largest elasticity [m/N]."""
        return float(self.value.max())

    @property
    def non_uniformity(self) -> float:
        """Return u = (e_max - e_min) / (e_max + e_min)."""
        return (self.maximum - self.minimum) / (self.maximum + self.minimum)


@dataclass(frozen=True)
class ArmLoads:
    """Steady arms, arrays of shape (n,).

    Attributes
    ----------
    x : ndarray
        Position along the track [m].
    lateral : ndarray
        Lateral force of the contact wire on the arm [N], positive where the arm is in tension.
    lift : ndarray
        Vertical force of the arm's tension on the contact wire [N], positive up; its weight comes on top.
    pendulum : ndarray
        What the arm resists motion across its axis with, N/l [N/m].
    """

    x: FloatArray
    lateral: FloatArray
    lift: FloatArray
    pendulum: FloatArray


@dataclass(frozen=True)
class Waves:
    """Waves in the contact wire.

    Attributes
    ----------
    speed : float
        Of the waves [m/s].
    train_speed : float
        [m/s].
    reflection : float
        r, share of a wave that comes back from a dropper.
    doppler : float
        alpha = (C - V) / (C + V).
    """

    speed: float
    train_speed: float
    reflection: float
    doppler: float

    @property
    def limit(self) -> float:
        """Return the highest speed of operation, 0.7 C [m/s]."""
        return OPERATION_LIMIT * self.speed

    @property
    def amplification(self) -> float:
        """Return r / alpha; infinite from the wave speed on."""
        return self.reflection / self.doppler if self.doppler > 0.0 else math.inf


def wave_speed(wire: Wire, length: float) -> float:
    """Return C = sqrt((F + EI (pi / L)^2) / rho) of a wire [m/s] [2.1].

    Parameters
    ----------
    wire : Wire
    length : float
        L, the span length [m].
    """
    return math.sqrt((wire.tension + wire.EI * (math.pi / length) ** 2) / wire.mass)


def contact_wire_wave_speed(definition: CatenaryDefinition) -> float:
    """Return the wave speed of a line's contact wire, taken for its longest span, where it is lowest [m/s]."""
    longest = max(span.length for section in definition.sections for span in section.spans)
    return wave_speed(definition.contact_wire, longest)


def reflection_factor(upper: Wire, contact: Wire) -> float:
    """Return r = sqrt(F_u rho_u) / (sqrt(F_u rho_u) + sqrt(F_c rho_c)) of a dropper between two wires."""
    above, below = (math.sqrt(w.tension * w.mass) for w in (upper, contact))
    return above / (above + below)


def waves(definition: CatenaryDefinition, speed: float, length: float) -> Waves:
    """Return the wave figures of a line at a train speed [m/s]; ``length`` is the span's [m].

    The droppers' upper wire is the messenger wire, in a compound line the auxiliary wire.
    """
    C = wave_speed(definition.contact_wire, length)
    upper = definition.auxiliary_wire or definition.messenger_wire
    return Waves(C, speed, reflection_factor(upper, definition.contact_wire), (C - speed) / (C + speed))


def droppers(model: CatenaryModel, start: float = -math.inf, end: float = math.inf, section: int = 0) -> Droppers:
    """Return a section's droppers between two positions of the track, in the order of the track."""
    lower = model.mesh.droppers[:, 0]
    x = model.mesh.points[lower, 0]
    chosen = np.flatnonzero((x >= start) & (x <= end) & (model.mesh.section[lower] == section))
    chosen = chosen[np.argsort(x[chosen], kind="stable")]
    static = model.static
    return Droppers(
        x[chosen], static.unstrained_length[chosen], static.dropper_force[chosen], model.mesh.is_hanger[chosen]
    )


def profiles(model: CatenaryModel, section: int = 0) -> tuple[Profile, ...]:
    """Return every wire of a section in its static shape."""
    positions = model.static.positions
    chains = [c for c in model.mesh.chains if c.section == section]
    return tuple(Profile(c.component, *positions[c.nodes].T.copy()) for c in chains)


def within(profile: Profile, span: Span) -> BoolArray:
    """Return which points of a wire lie in a span, its ends included (the wires' stretch moves points by 0.1 mm)."""
    return (profile.x >= span.start - 0.01) & (profile.x <= span.end + 0.01)


def arm_loads(model: CatenaryModel, section: int = 0) -> ArmLoads:
    """Return the loads of a section's steady arms, from their elongation."""
    mesh, static = model.mesh, model.static
    chosen = mesh.section[mesh.arms[:, 1]] == section
    end, node = mesh.arms[chosen].T
    along = static.shape.points[node] - static.shape.points[end]
    length = np.linalg.norm(along, axis=1)
    along /= length[:, None]
    tension = static.arm_force[chosen]
    return ArmLoads(
        static.positions[node, 0],
        tension * np.linalg.norm(along[:, :2], axis=1),
        -tension * along[:, 2],
        np.maximum(tension, 0.0) / length,
    )


def elasticity(model: CatenaryModel, x: FloatArray, force: float, section: int = 0) -> Elasticity:
    """Return the static elasticity of the contact wire, droppers in tension only.

    Parameters
    ----------
    x : ndarray, shape (n,)
        Positions along the track [m].
    force : float
        Vertical force, one position after the other [N].
    section : int
        Whose contact wire.

    Raises
    ------
    LocalSolutionError
        If the slack droppers under the force are not found.
    """
    response = _StaticResponse(model)
    wire = model.wires[section]
    return Elasticity(x, np.array([response.uplift(wire, float(at), force) / force for at in x]), force)


def positions_in_span(span: Span, between: int = 6) -> FloatArray:
    """Return supports, droppers and points between them, ``between`` intervals to a gap [m]."""
    breaks = [span.start, *span.droppers, span.end]
    pieces = [np.linspace(a, b, between, endpoint=False) for a, b in pairwise(breaks)]
    return np.append(np.concatenate(pieces), span.end)


class _StaticResponse:
    """The line's static compliance, its slack droppers found exactly.

    At rest modes of intervals and attachments do not act on each other.
    """

    def __init__(self, model: CatenaryModel) -> None:
        self._model = model
        factor = factorised(model.modes.K)
        self._solve = factor.solve
        columns = Compliance(factor, model.dropper_law.B, model.dropper_law.stiffness).dropper_columns
        self._columns = columns
        self._local = LocalProblem(
            unilateral=model.dropper_law.unilateral,
            dropper_columns=columns,
            velocity_factor=0.0,
            law=CONTACT_LAWS[model.definition.contact.law],
            parameters=model.definition.contact,
        )
        self._rest = model.dropper_law.B.T @ model.dropper_law.rest_compensation

    def uplift(self, wire: ContactWire, x: float, force: float) -> float:
        """Return the rise of a contact wire under a vertical force on it [m]."""
        model = self._model
        element, xi = wire.locate(x)
        interval = wire.interval(element)
        modal, ends = interval.split(interval.lift(element, xi)[0])
        load = self._rest.copy()
        load[interval.ends] += force * ends
        displacement = self._solve(load)
        elastic = model.static.elastic_force + model.dropper_law.stiffness * (model.dropper_law.B @ displacement)
        found = self._local.solve(elastic, (), np.zeros((0, 0)), np.flatnonzero(elastic < 0.0))
        for j, compensation in zip(found.slack, found.compensation, strict=True):
            column = self._columns[int(j)]
            displacement[column.rows] -= compensation * column.values[:, 0]
        inside = force * modal @ (modal / model.modes.eigenvalue[interval.modes])
        return float(ends @ displacement[interval.ends] + inside)

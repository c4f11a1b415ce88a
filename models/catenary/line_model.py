"""The line as a dynamic system: displacements from its static shape, one step at a time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from models.arrays import BoolArray, FloatArray
from models.catenary.condition.line_condition import find_condition
from models.catenary.contact_and_slack.contact_wire import ContactWire, WireInterval
from models.catenary.contact_and_slack.dropper_law import DropperLaw
from models.catenary.contact_and_slack.local_problem import (
    ContactCandidate,
    LocalForces,
    LocalProblem,
    LocalSolutionError,
)
from models.catenary.contact_and_slack.response_cache import ResponseCache
from models.catenary.definition.line_definition import CatenaryDefinition
from models.catenary.line_state import CatenaryState, ContactResult, StripMotion
from models.catenary.linear_motion.compliance import Compliance
from models.catenary.linear_motion.line_motion import LineMotion
from models.catenary.linear_motion.mode_finding import line_modes
from models.catenary.linear_motion.sparse_products import Product, inner
from models.catenary.linear_motion.step_matrices import StepMatrices
from models.catenary.shape.beam_elements import NODE_DOFS
from models.catenary.shape.form_finding import EquilibriumError, StaticState
from models.catenary.shape.kept_form import kept_form
from models.catenary.shape.line_mesh import CatenaryMesh, build_mesh
from models.catenary.shape.wire_intervals import (
    Interval,
    attachments,
    intervals,
    plan_angles,
    plan_rotation,
)
from models.catenary.step.engine_choice import make_engine
from models.catenary.step.step_engine import AppliedForce, StepEngine
from models.contact_law import CONTACT_LAWS
from models.numerics.newmark import Newmark

#: Step sizes whose factorisation is kept.
_KEPT_STEPS = 3
#: No forces on the contact wires.
_NOWHERE, _NOTHING = np.zeros((0, 2), dtype=np.int64), np.zeros((0, 2))


@dataclass(frozen=True)
class _Step:
    """What belongs to one step size; ``pull`` gives what a change of the attachments adds to the droppers' pulls."""

    engine: StepEngine
    pull: Product
    local: LocalProblem
    responses: ResponseCache


class CatenaryModel:
    """A line ready to step: static shape found, matrices in modes of intervals and displacements of attachments.

    The static shape is that of the design, or what errors of assembly and faults have made of it.

    Parameters
    ----------
    definition : CatenaryDefinition

    Raises
    ------
    EquilibriumError
        If the line has no static equilibrium of the wanted shape, or none that it could move about.
    ParameterError
        If the definition leaves out all modes of the wires.
    """

    def __init__(self, definition: CatenaryDefinition) -> None:
        self.definition = definition
        self.static: StaticState = find_condition(kept_form(definition, build_mesh(definition)))
        self.mesh: CatenaryMesh = self.static.shape.mesh
        attached = attachments(self.mesh)
        by_wire = [intervals(chain, attached) for chain in self.mesh.chains]
        self._angles = plan_angles((part for parts in by_wire for part in parts), self.static.shape.points)
        #: Coordinates of the line.
        with self._solvable("move in modes of its intervals"):
            self.modes = line_modes(self.static, [part for parts in by_wire for part in parts], self._angles)
        self.dropper_law = DropperLaw(self.static, self.modes.attached)
        self.wires = tuple(self._wires(by_wire))
        self.uplift_places = self.modes.place[self.mesh.support_nodes * NODE_DOFS + 2]
        self._law = CONTACT_LAWS[definition.contact.law]
        self._radii = definition.contact.wire_radius + definition.contact.strip_radius
        self._steps: dict[float, _Step] = {}

    def initial_state(self, pantographs: int = 1) -> CatenaryState:
        """Return the line at rest in its static shape."""
        shape, lacking = (pantographs, len(self.wires)), self.dropper_law.rest_compensation
        return CatenaryState(
            motion=LineMotion.at_rest(self.modes),
            slack=np.flatnonzero(lacking),
            compensation=lacking[lacking > 0.0],
            element=np.full(shape, -1),
            impact_velocity=np.zeros(shape),
            loaded=_NOWHERE,
            load=_NOTHING,
        )

    def rehearse(self, step: float, strips: FloatArray) -> None:
        """Take a trial step of a line at rest, so that the first real one finds everything laid out.

        Factorisation, compiled code and responses near the strips exist afterwards: a paced run must not wait for them.

        Parameters
        ----------
        step : float
            Time step [s].
        strips : ndarray, shape (n_pantographs, 2, 2, 3)
        """
        with suppress(LocalSolutionError):  # the real step will raise it, if it recurs
            self.step(self.initial_state(len(strips)), step, StripMotion(strips, np.zeros(len(strips))))

    def step(self, state: CatenaryState, step: float, motion: StripMotion) -> ContactResult:
        """Advance the line by one time step under moving strips.

        Parameters
        ----------
        state : CatenaryState
            Changed in place.
        step : float
            Time step [s].
        motion : StripMotion
            Strips at the end of the step.

        Returns
        -------
        ContactResult

        Raises
        ------
        LocalSolutionError
            If slack and contact forces are not found.
        EquilibriumError
            If the line cannot make steps of this length.
        """
        now = self._step(step)
        free_force = self._begin(now, state)
        candidates = self._candidates(now, state, motion)
        # One that was closed stays among the contacts: other forces of the step may keep it so.
        contacts = [c for c in candidates if c.penetration > 0.0 or c.impact_velocity > 0.0]
        compliance = self._strip_compliance(contacts, motion)
        forces = now.local.solve(free_force, contacts, compliance, state.slack)
        self._apply(now, contacts, forces)
        now.engine.finish(state.motion)
        self._note(state, contacts, forces)
        return self._in_lap(self._result(now, state, candidates, contacts, forces), motion.strip)

    def push(self, state: CatenaryState, step: float, forces: Sequence[tuple[int, float, float]]) -> None:
        """Advance the line by one time step under given vertical forces on its contact wires.

        Parameters
        ----------
        state : CatenaryState
            Changed in place.
        step : float
            Time step [s].
        forces : sequence of (section, x, force)
            At the end of the step: wire section from 0, position along the track [m], force [N], positive up.

        Raises
        ------
        LocalSolutionError
            If the slack droppers are not found.
        """
        now = self._step(step)
        pull = self._begin(now, state)
        placed = [(s, *self.wires[s].locate(x), force) for s, x, force in forces]
        for s, element, xi, force in placed:
            interval = self.wires[s].interval(element)
            point = now.responses.of(interval).point(element, xi)
            now.engine.apply(point, force)
            columns = point.response.columns
            pull[columns.dropper_index] += columns.dropper_force @ (force * point.load)
        found = now.local.solve(pull, (), np.zeros((0, 0)), state.slack)
        self._apply(now, (), found)
        now.engine.finish(state.motion)
        state.slack, state.compensation = found.slack, found.compensation
        state.loaded = np.array([(s, element) for s, element, _, _ in placed], dtype=np.int64).reshape(-1, 2)
        state.load = np.array([(xi, force) for _, _, xi, force in placed]).reshape(-1, 2)

    def contact_at_rest(self, state: CatenaryState, strips: FloatArray) -> ContactResult:
        """Return the contacts of strips with the line as it stands, without advancing anything.

        Parameters
        ----------
        strips : ndarray, shape (n_pantographs, 2, 2, 3)
        """
        result = self._empty_result(len(strips))

        def positions(interval: WireInterval) -> list[float]:
            return interval.positions(interval.local(state.motion)[0])

        for p, strip in enumerate(strips):
            for s, wire in enumerate(self.wires):
                found = wire.find(strip, positions, int(state.element[p, s]))
                if found is None:
                    continue
                state.element[p, s] = found.element
                interval = wire.interval(found.element)
                local, (row, height) = interval.local(state.motion), interval.lift(found.element, found.xi)
                rise, speed = local.dot(row).tolist()
                delta, rate = self._penetration(found.share, height + rise, speed, strip)
                law = self._law(delta, rate, max(rate, 0.0), self.definition.contact)
                result.force[p, s] = law.scaled(found.engagement).force
                result.point[p, s] = *interval.at(found, local[0]), height + rise
        return self._in_lap(result, strips)

    def dropper_force(self, state: CatenaryState) -> FloatArray:
        """Return what every dropper carries under its law [N], shape (n_droppers,); see `DropperLaw.force`."""
        return self.dropper_law.force(state.motion.attached, state.slack, state.compensation)

    def dropper_slack(self, state: CatenaryState) -> BoolArray:
        """Return which droppers are slack, shape (n_droppers,): by the law "elastic_only" those whose spring is."""
        slack = np.zeros(len(self.dropper_law.stiffness), dtype=np.bool_)
        slack[state.slack] = True
        return slack

    def spring_force(self, state: CatenaryState) -> FloatArray:
        """Return stiffness times elongation of every dropper [N], shape (n_droppers,): negative where too long."""
        return self.dropper_law.spring_force(state.motion.attached[0])

    def uplift(self, state: CatenaryState) -> FloatArray:
        """Return the rise of the contact wire at the supports [m], shape (n_supports,)."""
        return state.motion.attached[0].take(self.uplift_places)

    def energy(self, state: CatenaryState) -> float:
        """Return kinetic plus elastic energy from the static shape, droppers bilateral [J]."""
        m, modes = state.motion, self.modes
        (q, rate), (x, v) = m.modal, m.attached
        # q' M_q q' + 2 q' G x' = q' (2 momentum - q')
        kinetic = inner(rate, 2.0 * m.momentum - rate) + inner(v, modes.M @ v)
        return 0.5 * (kinetic + inner(modes.eigenvalue * q, q) + inner(x, modes.K @ x))

    def displacement(self, state: CatenaryState) -> FloatArray:
        """Return the displacements and rotations of all nodes from the static shape [m, rad], shape (n, 6)."""
        nodal = self.modes.nodal(state.motion.modal[0], state.motion.attached[0])
        return np.asarray(plan_rotation(self._angles) @ nodal).reshape(-1, NODE_DOFS)[self.mesh.owner]

    def set_velocity(self, state: CatenaryState, velocity: FloatArray) -> None:
        """Set the velocities of the nodes.

        Parameters
        ----------
        velocity : ndarray, shape (n, 6)
            [m/s, rad/s]; what is held stays at rest.
        """
        modes, attached = self.modes, state.motion.attached
        nodal = plan_rotation(self._angles).T @ velocity.ravel()
        modal, momentum = state.motion.plain()
        modal[1], attached[1] = modes.coordinates(nodal)
        momentum[...] = modal[1] + modes.coupling @ (modes.turn @ attached[1])

    @contextmanager
    def _solvable(self, doing: str) -> Iterator[None]:
        """Explain matrices that are not positive definite: parts of the line differ too much, or it buckles."""
        try:
            yield
        except np.linalg.LinAlgError as error:
            raise EquilibriumError(
                f"line '{self.definition.name}' cannot {doing}: {error}; check masses, tensions and stiffnesses"
            ) from error

    def _wires(self, by_wire: Sequence[Sequence[Interval]]) -> Iterator[ContactWire]:
        spans = iter(self.modes.spans)
        for chain, parts in zip(self.mesh.chains, by_wire, strict=True):
            own = [(part, next(spans)) for part in parts]
            if chain.component == "contact_wire":
                period = self.definition.sections[chain.section].period
                yield ContactWire(chain, own, self.static, self.modes, self._angles, period)

    def _step(self, step: float) -> _Step:
        found = self._steps.get(step)
        if found is None:
            found = self._new_step(step)
            if len(self._steps) >= _KEPT_STEPS:
                del self._steps[next(iter(self._steps))]
            self._steps[step] = found
        return found

    def _new_step(self, step: float) -> _Step:
        newmark = Newmark(step)
        with self._solvable(f"make steps of {step:g} s"):
            matrices = StepMatrices(self.modes, newmark)
            engine = make_engine(matrices)
        law = self.dropper_law
        by_change = law.by_change(newmark)
        compliance = Compliance(matrices.factor, law.B, by_change)
        local = LocalProblem(
            unilateral=law.unilateral,
            dropper_columns=compliance.dropper_columns,
            velocity_factor=newmark.a1,
            law=self._law,
            parameters=self.definition.contact,
        )
        responses = ResponseCache(engine.response, compliance, len(self.wires))
        return _Step(engine, Product(sp.diags(by_change) @ law.B), local, responses)

    def _begin(self, now: _Step, state: CatenaryState) -> FloatArray:
        """Find the free changes of the step; return the droppers' pulls at its end, if they could push [N]."""
        applied = []
        for (s, element), (xi, force) in zip(state.loaded.tolist(), state.load.tolist(), strict=True):
            response = now.responses.of(self.wires[s].interval(element))
            applied.append(AppliedForce(response, element, xi, force))
        pressed = self.dropper_law.known_load(state.slack, state.compensation)
        now.engine.begin(state.motion, pressed, applied)
        pull = self.dropper_law.pull(state.motion.attached)
        now.pull.add(now.engine.attached, pull)
        return pull

    def _candidates(self, now: _Step, state: CatenaryState, motion: StripMotion) -> list[ContactCandidate]:
        """Return all strips that cross a wire at the end of the step, forces found inside it left out."""
        candidates = []
        for s, wire in enumerate(self.wires):
            for p, strip in enumerate(motion.strip):
                if not wire.is_near(strip):
                    continue
                met = now.engine.meet(wire, now.responses.of, strip, int(state.element[p, s]), state.motion)
                if met is None:
                    continue
                crossing, point, rise, speed = met
                state.element[p, s] = crossing.element
                delta, rate = self._penetration(crossing.share, point.height + rise, speed, strip)
                impact = float(state.impact_velocity[p, s])
                candidates.append(ContactCandidate(p, s, crossing, point, delta, rate, impact))
                now.responses.prepare(wire.next_interval(crossing.element))
        return candidates

    def _penetration(self, share: float, height: float, rate: float, strip: FloatArray) -> tuple[float, float]:
        """Return penetration and its velocity of a strip, where a wire of some height crosses it."""
        (z_a, v_a), (z_b, v_b) = strip[:, :, 2].tolist()
        return z_a + share * (z_b - z_a) - (height - self._radii), v_a + share * (v_b - v_a) - rate

    def _strip_compliance(self, contacts: Sequence[ContactCandidate], motion: StripMotion) -> FloatArray:
        """Return how far strips give way to the contacts' forces [m/N]; two contacts of one strip share its retreat."""
        if len(contacts) == 1:
            return motion.compliance[contacts[0].pantograph].reshape(1, 1)
        owners = [c.pantograph for c in contacts]
        return np.array([[motion.compliance[i] if i == j else 0.0 for j in owners] for i in owners]).reshape(
            len(owners), len(owners)
        )

    def _apply(self, now: _Step, contacts: Sequence[ContactCandidate], forces: LocalForces) -> None:
        """Add what contact and compensation forces change within the step."""
        engine = now.engine
        for contact, force in zip(contacts, forces.contact, strict=True):
            if force != 0.0:
                engine.apply(contact.point, force)
        for j, compensation in zip(forces.slack.tolist(), forces.compensation.tolist(), strict=True):
            column = now.local.dropper_columns[j]
            engine.attached[column.rows] -= compensation * column.values[:, 0]

    def _note(self, state: CatenaryState, contacts: Sequence[ContactCandidate], forces: LocalForces) -> None:
        """Record the forces at the end of the step; the next one begins with them."""
        state.slack, state.compensation = forces.slack, forces.compensation
        state.impact_velocity[...] = 0.0
        for contact, velocity, closed in zip(contacts, forces.velocity, forces.closed, strict=True):
            if closed:
                impact = contact.impact_velocity or max(velocity, 1e-6)
                state.impact_velocity[contact.pantograph, contact.section] = impact
        state.loaded, state.load = _NOWHERE, _NOTHING
        if contacts:
            places = [c.crossing for c in contacts]
            state.loaded = np.array([(c.section, place.element) for c, place in zip(contacts, places, strict=True)])
            state.load = np.array([(place.xi, f) for place, f in zip(places, forces.contact, strict=True)])

    def _result(
        self,
        now: _Step,
        state: CatenaryState,
        candidates: Sequence[ContactCandidate],
        contacts: Sequence[ContactCandidate],
        forces: LocalForces,
    ) -> ContactResult:
        result = self._empty_result(len(state.element))
        for contact, force in zip(contacts, forces.contact, strict=True):
            result.force[contact.pantograph, contact.section] = force
        for p, s, crossing, point, *_ in candidates:
            now.engine.place(crossing, point, state.motion, result.point[p, s])
        return result

    def _in_lap(self, result: ContactResult, strips: FloatArray) -> ContactResult:
        """Move points of wires that close on themselves along with their strips, which travel on."""
        for s, wire in enumerate(self.wires):
            if wire.period:
                result.point[:, s, 0] = wire.alongside(strips[:, :, 0, 0].mean(axis=1), result.point[:, s, 0])
        return result

    def _empty_result(self, pantographs: int) -> ContactResult:
        shape = (pantographs, len(self.wires))
        return ContactResult(np.zeros(shape), np.full((*shape, 3), np.nan))

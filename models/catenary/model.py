"""The line as a dynamic system: displacements from its static shape, one step at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
import scipy.sparse as sp

from models.catenary.assembly import compression_ratio, dropper_rows, dropper_stiffness
from models.catenary.compliance import Columns, Compliance, joined
from models.catenary.contact_wire import ContactWire, Crossing, WireInterval
from models.catenary.elements import NODE_DOFS
from models.catenary.equilibrium import StaticState, find_form
from models.catenary.interval_modes import IntervalModes, interval_modes
from models.catenary.intervals import (
    Interval,
    attachments,
    intervals,
    plan_angles,
    plan_rotation,
    without_rounding,
)
from models.catenary.local_response import LocalForces, LocalProblem, OpenContact
from models.catenary.mesh import CatenaryMesh, build_mesh
from models.catenary.parameters import CatenaryDefinition
from models.catenary.stepping import LineMotion, Stepper
from models.contact import CONTACT_LAWS
from models.part import FloatArray, IntArray, Snapshot
from models.time_integration import Newmark

#: Step sizes whose factorisation is kept.
_KEPT_STEPS = 3
#: Intervals of the contact wires whose response is kept.
_KEPT_INTERVALS = 12
#: No forces on the contact wires.
_NOWHERE, _NOTHING = np.zeros((0, 2), dtype=np.int64), np.zeros((0, 2))


@dataclass
class CatenaryState:
    """State of a line, changed in place by a step.

    Attributes
    ----------
    motion : LineMotion
    slack : ndarray of int
        Slack droppers.
    compensation : ndarray
        What each of them lacks to its elastic force [N].
    element : ndarray of int, shape (n_pantographs, n_sections)
        Element of the contact wire met last.
    impact_velocity : ndarray, shape (n_pantographs, n_sections)
        Velocity at impact of the closed contacts [m/s], 0 where open.
    loaded : ndarray of int, shape (k, 2)
        Section and element of every force on a contact wire.
    load : ndarray, shape (k, 2)
        Its place on the element, xi, and its value [N].
    """

    motion: LineMotion
    slack: IntArray
    compensation: FloatArray
    element: IntArray
    impact_velocity: FloatArray
    loaded: IntArray
    load: FloatArray

    def snapshot(self) -> Snapshot:
        """Return copies of all arrays."""
        arrays = {name: value for name, value in vars(self).items() if name != "motion"}
        return {name: value.copy() for name, value in (arrays | vars(self.motion)).items()}

    def restore(self, snapshot: Snapshot) -> None:
        """Take over the arrays of a snapshot."""
        for owner in (self, self.motion):
            for name in vars(owner):
                if name != "motion":
                    setattr(owner, name, snapshot[name].copy())


@dataclass
class ContactResult:
    """Contacts of one step.

    Attributes
    ----------
    force : ndarray, shape (n_pantographs, n_sections)
        Contact force [N].
    point : ndarray, shape (n_pantographs, n_sections, 3)
        Point of contact on the wire, NaN where strip and wire do not cross [m].
    """

    force: FloatArray
    point: FloatArray


@dataclass
class StripMotion:
    """Strips at the end of a step, were there no contact force within it.

    Attributes
    ----------
    strip : ndarray, shape (n_pantographs, 2, 2, 3)
        End A, B; position, velocity; x, y, z.
    compliance : ndarray, shape (n_pantographs,)
        How far a strip gives way within the step per force [m/N]; 0 for prescribed strips.
    """

    strip: FloatArray
    compliance: FloatArray


@dataclass(frozen=True)
class _Reaction:
    """How a wire gives way about one of its intervals.

    Attributes
    ----------
    interval : WireInterval
    coupling : ndarray, shape (n_span, e)
        mu G of its modes with its attachments.
    columns : Columns
        Response to unit loads at its attachments.
    at_ends : ndarray, shape (e, e)
        The same at the attachments themselves.
    """

    interval: WireInterval
    coupling: FloatArray
    columns: Columns
    at_ends: FloatArray


@dataclass(frozen=True)
class _Step:
    """What belongs to one step size."""

    stepper: Stepper
    compliance: Compliance
    local: LocalProblem
    reactions: dict[tuple[int, int], _Reaction] = field(default_factory=dict)


class _FreeMotion:
    """Local motion of a contact wire at the end of a step, without forces that are found inside it."""

    def __init__(self, reaction: Callable[[WireInterval], _Reaction], stepper: Stepper, motion: LineMotion) -> None:
        self._reaction, self._stepper, self._motion = reaction, stepper, motion
        self._known: dict[int, FloatArray] = {}

    def __call__(self, interval: WireInterval) -> FloatArray:
        """Return its local coordinates and their rates, shape (2, m)."""
        found = self._known.get(interval.first)
        if found is None:
            found = self._known[interval.first] = self._of(interval)
        return found

    def positions(self, interval: WireInterval) -> list[float]:
        """Return the positions in plan of its nodes, x and y in turn [m]."""
        return interval.positions(self(interval)[0])

    def _of(self, interval: WireInterval) -> FloatArray:
        stepper, span = self._stepper, interval.modes
        change = np.concatenate((stepper.modal[span], stepper.attached.take(interval.ends)))
        count = span.stop - span.start
        change[:count] -= stepper.inverse[span] * (self._reaction(interval).coupling @ change[count:])
        result = local_motion(interval, self._motion)
        result[0] += change
        change *= stepper.newmark.a1
        np.subtract(change, result[1], out=result[1])
        return result


class CatenaryModel:
    """A line ready to step: static shape found, matrices in modes of intervals and displacements of attachments.

    Parameters
    ----------
    definition : CatenaryDefinition

    Raises
    ------
    EquilibriumError
        If the line has no static equilibrium of the wanted shape.
    """

    def __init__(self, definition: CatenaryDefinition) -> None:
        self.definition = definition
        self.mesh: CatenaryMesh = build_mesh(definition)
        self.static: StaticState = find_form(definition, self.mesh)
        self.dropper_stiffness = dropper_stiffness(definition, self.mesh, self.static.positions)
        #: What droppers that are slack at rest lack to their elastic force [N]; given lengths may leave some slack.
        self.rest_compensation = self.static.dropper_force - self.static.elastic_force
        self.unilateral = 1.0 - compression_ratio(definition, self.mesh)
        attached = attachments(self.mesh)
        by_wire = [intervals(chain, attached) for chain in self.mesh.chains]
        self._angles = plan_angles((part for parts in by_wire for part in parts), self.static.points)
        #: Coordinates of the line.
        self.modes = self._modes([part for parts in by_wire for part in parts])
        self.B = self._dropper_rows()
        self._rest_load = self.B.T @ self.rest_compensation
        self._stretch = self.B.T.tocsc()
        self.wires = tuple(self._wires(by_wire))
        self.uplift_places = self.modes.place[self.mesh.support_nodes * NODE_DOFS + 2]
        self._law = CONTACT_LAWS[definition.contact.law]
        self._radii = definition.contact.wire_radius + definition.contact.strip_radius
        self._steps: dict[float, _Step] = {}

    def initial_state(self, pantographs: int = 1) -> CatenaryState:
        """Return the line at rest in its static shape."""
        shape = pantographs, len(self.wires)
        return CatenaryState(
            motion=LineMotion.at_rest(self.modes),
            slack=np.flatnonzero(self.rest_compensation),
            compensation=self.rest_compensation[self.rest_compensation > 0.0],
            element=np.full(shape, -1),
            impact_velocity=np.zeros(shape),
            loaded=_NOWHERE,
            load=_NOTHING,
        )

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
        """
        now = self._step(step)
        free_force = self._begin(now, state)
        contacts, crossings = self._open_contacts(now, state, motion)
        compliance = self._strip_compliance(contacts, motion)
        forces = now.local.solve(free_force, contacts, compliance, state.slack)
        self._apply(now, contacts, forces)
        now.stepper.finish(state.motion)
        self._note(state, contacts, forces)
        return self._result(state, contacts, crossings, forces)

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
        elastic = self._begin(now, state)
        placed = [(s, *self.wires[s].locate(x), force) for s, x, force in forces]
        for s, element, xi, force in placed:
            reaction = self._reaction(now, s, self.wires[s].interval(element))
            modal, ends = self.wires[s].unit_force(element, xi)
            columns = reaction.columns
            load = force * (ends - (modal * now.stepper.inverse[reaction.interval.modes]) @ reaction.coupling)
            now.stepper.press(reaction.interval.modes, force * modal)
            now.stepper.attached[columns.rows] += columns.values @ load
            near = columns.dropper_index
            elastic[near] += self.dropper_stiffness[near] * (columns.dropper_stretch @ load)
        found = now.local.solve(elastic, (), np.zeros((0, 0)), state.slack)
        self._apply(now, (), found)
        now.stepper.finish(state.motion)
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
        motion = partial(local_motion, motion=state.motion)

        def positions(interval: WireInterval) -> list[float]:
            return interval.positions(motion(interval)[0])

        for p, strip in enumerate(strips):
            for s, wire in enumerate(self.wires):
                found = wire.find(strip, positions, int(state.element[p, s]))
                if found is None:
                    continue
                state.element[p, s] = found.element
                local = motion(wire.interval(found.element))
                delta, rate = self._penetration(wire, found, strip, local)
                law = self._law(delta, rate, max(rate, 0.0), self.definition.contact)
                result.force[p, s] = law.scaled(found.engagement).force
                result.point[p, s] = wire.point(found, local[0])
        return result

    def dropper_force(self, state: CatenaryState) -> FloatArray:
        """Return the force that every dropper carries [N], shape (n_droppers,): 0 where slack."""
        force = self.static.elastic_force + self.dropper_stiffness * (self.B @ state.motion.attached[0])
        force[state.slack] += state.compensation
        return force

    def uplift(self, state: CatenaryState) -> FloatArray:
        """Return the rise of the contact wire at the supports [m], shape (n_supports,)."""
        return state.motion.attached[0, self.uplift_places]

    def energy(self, state: CatenaryState) -> float:
        """Return kinetic plus elastic energy from the static shape, droppers bilateral [J]."""
        m, modes = state.motion, self.modes
        (q, rate), (x, v) = m.modal, m.attached
        # q' M_q q' + 2 q' G x' = q' (2 momentum - q')
        kinetic = rate @ (2.0 * m.momentum - rate) + v @ (modes.M @ v)
        return float(0.5 * (kinetic + (modes.eigenvalue * q) @ q + x @ (modes.K @ x)))

    def displacement(self, state: CatenaryState) -> FloatArray:
        """Return the displacements and rotations of all nodes from the static shape [m, rad], shape (n, 6)."""
        nodal = self.modes.nodal(state.motion.modal[0], state.motion.attached[0])
        return np.asarray(plan_rotation(self._angles) @ nodal).reshape(-1, NODE_DOFS)

    def set_velocity(self, state: CatenaryState, velocity: FloatArray) -> None:
        """Give the nodes velocities.

        Parameters
        ----------
        velocity : ndarray, shape (n, 6)
            [m/s, rad/s]; what is held stays at rest.
        """
        motion = state.motion
        nodal = plan_rotation(self._angles).T @ velocity.ravel()
        motion.modal[1], motion.attached[1] = self.modes.coordinates(nodal)
        modes = self.modes
        motion.momentum[...] = motion.modal[1] + modes.coupling @ (modes.turn @ motion.attached[1])

    def _modes(self, parts: Sequence[Interval]) -> IntervalModes:
        """Return the line's coordinates and matrices, droppers included."""
        static, Q = self.static, plan_rotation(self._angles)
        stretch = dropper_rows(self.mesh, static.positions)
        droppers = stretch.T @ sp.diags(self.dropper_stiffness) @ stretch
        damping = self.definition.damping
        C = static.matrices.C + damping.of("dropper").alpha * droppers
        K, M, C = ((Q.T @ matrix @ Q).tocsr() for matrix in (static.matrices.K + droppers, static.matrices.M, C))
        K, M, C = (without_rounding(m, np.sqrt(np.maximum(m.diagonal(), 0.0))) for m in (K, M, C))
        rates = [(damping.of(part.component).alpha, damping.of(part.component).beta) for part in parts]
        return interval_modes((K, M, C), parts, rates, self._angles, self.mesh.fixed.ravel())

    def _dropper_rows(self) -> sp.csr_matrix:
        """Return the rows of dropper elongation over the attachments' displacements, which are in global axes."""
        return dropper_rows(self.mesh, self.static.positions)[:, self.modes.attached].tocsr()

    def _wires(self, by_wire: Sequence[Sequence[Interval]]) -> Iterator[ContactWire]:
        spans = iter(self.modes.spans)
        for chain, parts in zip(self.mesh.chains, by_wire, strict=True):
            own = [(part, next(spans)) for part in parts]
            if chain.component == "contact_wire":
                yield ContactWire(chain, own, self.static, self.modes, self._angles)

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
        stepper = Stepper(self.modes, newmark)
        compliance = Compliance(stepper.factor, self.B)
        local = LocalProblem(
            measure=self.dropper_stiffness,
            unilateral=self.unilateral,
            dropper_columns=compliance.dropper_columns,
            velocity_factor=newmark.a1,
            law=self._law,
            parameters=self.definition.contact,
        )
        return _Step(stepper, compliance, local)

    def _begin(self, now: _Step, state: CatenaryState) -> FloatArray:
        """Find the free changes of the step; return the droppers' elastic forces at its end [N].

        What a dropper that is slack at rest lacks is part of the static state, so it acts at both ends of the step.
        """
        pressed = 2.0 * self._rest_load
        if state.slack.size:
            pressed -= self._stretch[:, state.slack] @ state.compensation
        load = []
        for (s, element), (xi, force) in zip(state.loaded.tolist(), state.load.tolist(), strict=True):
            interval = self.wires[s].interval(element)
            modal, ends = self.wires[s].unit_force(element, xi)
            load.append((interval.modes, force * modal))
            pressed[interval.ends] += force * ends
        now.stepper.begin(state.motion, pressed, load)
        x = state.motion.attached[0] + now.stepper.attached
        return self.static.elastic_force + self.dropper_stiffness * (self.B @ x)

    def _open_contacts(
        self, now: _Step, state: CatenaryState, motion: StripMotion
    ) -> tuple[list[OpenContact], list[tuple[int, int, Crossing]]]:
        contacts, crossings = [], []
        for s, wire in enumerate(self.wires):
            free = _FreeMotion(partial(self._reaction, now, s), now.stepper, state.motion)
            for p, strip in enumerate(motion.strip):
                found = wire.find(strip, free.positions, int(state.element[p, s]))
                if found is None:
                    continue
                crossings.append((p, s, found))
                state.element[p, s] = found.element
                delta, rate = self._penetration(wire, found, strip, free(wire.interval(found.element)))
                # One that was closed stays among the candidates: other forces of the step may keep it so.
                if delta > 0.0 or state.impact_velocity[p, s] > 0.0:
                    contacts.append(self._open_contact(now, state, (p, s), found, delta, rate))
        return contacts, crossings

    def _penetration(
        self, wire: ContactWire, found: Crossing, strip: FloatArray, local: FloatArray
    ) -> tuple[float, float]:
        """Return penetration and its velocity; ``local`` is the interval's motion, shape (2, m)."""
        rise, rate = (local @ wire.height_row(found.element, found.xi)).tolist()
        (z_a, v_a), (z_b, v_b) = strip[:, :, 2].tolist()
        height = wire.static_height(found.element, found.xi) + rise - self._radii
        return z_a + found.share * (z_b - z_a) - height, v_a + found.share * (v_b - v_a) - rate

    def _open_contact(
        self,
        now: _Step,
        state: CatenaryState,
        which: tuple[int, int],
        found: Crossing,
        penetration: float,
        velocity: float,
    ) -> OpenContact:
        p, s = which
        reaction = self._reaction(now, s, self.wires[s].interval(found.element))
        interval = reaction.interval
        modal, ends = self.wires[s].unit_force(found.element, found.xi)
        yielding = modal * now.stepper.inverse[interval.modes]
        return OpenContact(
            pantograph=p,
            section=s,
            place=(found.element, found.xi),
            penetration=penetration,
            velocity=velocity,
            impact_velocity=float(state.impact_velocity[p, s]),
            engagement=found.engagement,
            interval=interval.modes,
            modal=modal,
            yielding=yielding,
            places=interval.ends,
            load=ends - yielding @ reaction.coupling,
            columns=reaction.columns,
            at_ends=reaction.at_ends,
        )

    def _reaction(self, now: _Step, section: int, interval: WireInterval) -> _Reaction:
        """Return how a wire gives way about an interval; found once per interval that a strip visits."""
        kept = now.reactions
        found = kept.get((section, interval.first))
        if found is None:
            columns = joined([now.compliance.attachment(ends) for ends in interval.sides if ends.size])
            coupling = now.stepper.coupling(interval.modes, interval.ends)
            found = _Reaction(interval, coupling, columns, columns.at(interval.ends))
            while len(kept) >= _KEPT_INTERVALS * len(self.wires):
                del kept[next(iter(kept))]
            kept[(section, interval.first)] = found
        return found

    def _strip_compliance(self, contacts: Sequence[OpenContact], motion: StripMotion) -> FloatArray:
        """Two contacts of one strip share its retreat."""
        owners = [c.pantograph for c in contacts]
        return np.array([[motion.compliance[i] if i == j else 0.0 for j in owners] for i in owners]).reshape(
            len(owners), len(owners)
        )

    def _apply(self, now: _Step, contacts: Sequence[OpenContact], forces: LocalForces) -> None:
        """Add what contact and compensation forces change within the step."""
        stepper = now.stepper
        for contact, force in zip(contacts, forces.contact.tolist(), strict=True):
            if force != 0.0:
                stepper.press(contact.interval, force * contact.modal)
                stepper.attached[contact.columns.rows] += contact.columns.values @ (force * contact.load)
        for j, compensation in zip(forces.slack.tolist(), forces.compensation.tolist(), strict=True):
            column = now.local.dropper_columns[j]
            stepper.attached[column.rows] -= compensation * column.values[:, 0]

    def _note(self, state: CatenaryState, contacts: Sequence[OpenContact], forces: LocalForces) -> None:
        """Note the forces at the end of the step; the next one begins with them."""
        state.slack, state.compensation = forces.slack, forces.compensation
        state.impact_velocity[...] = 0.0
        for contact, velocity, closed in zip(
            contacts, forces.penetration_velocity.tolist(), forces.closed.tolist(), strict=True
        ):
            if closed:
                impact = contact.impact_velocity or max(velocity, 1e-6)
                state.impact_velocity[contact.pantograph, contact.section] = impact
        state.loaded, state.load = _NOWHERE, _NOTHING
        if contacts:
            state.loaded = np.array([(c.section, c.place[0]) for c in contacts])
            places = [c.place[1] for c in contacts]
            state.load = np.array(list(zip(places, forces.contact.tolist(), strict=True)))

    def _result(
        self,
        state: CatenaryState,
        contacts: Sequence[OpenContact],
        crossings: Sequence[tuple[int, int, Crossing]],
        forces: LocalForces,
    ) -> ContactResult:
        result = self._empty_result(len(state.element))
        for contact, force in zip(contacts, forces.contact.tolist(), strict=True):
            result.force[contact.pantograph, contact.section] = force
        for p, s, found in crossings:
            wire = self.wires[s]
            result.point[p, s] = wire.point(found, local_motion(wire.interval(found.element), state.motion)[0])
        return result

    def _empty_result(self, pantographs: int) -> ContactResult:
        shape = (pantographs, len(self.wires))
        return ContactResult(np.zeros(shape), np.full((*shape, 3), np.nan))


def local_motion(interval: WireInterval, motion: LineMotion) -> FloatArray:
    """Return an interval's local coordinates and their rates, shape (2, m)."""
    return np.concatenate((motion.modal[:, interval.modes], motion.attached.take(interval.ends, axis=1)), axis=1)

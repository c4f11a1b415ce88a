"""The line as a dynamic system: displacements from its static shape, one step at a time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp

from models.catenary.assembly import dropper_rows, dropper_stiffness
from models.catenary.compliance import Columns, EffectiveStiffness
from models.catenary.contact_wire import ContactWire, Crossing
from models.catenary.elements import NODE_DOFS
from models.catenary.equilibrium import StaticState, find_form
from models.catenary.local_response import LocalForces, LocalProblem, OpenContact
from models.catenary.mesh import CatenaryMesh, build_mesh
from models.catenary.parameters import CatenaryDefinition
from models.contact import CONTACT_LAWS
from models.part import FloatArray, IntArray, Snapshot
from models.time_integration import Newmark

#: Step sizes whose factorisation is kept.
_KEPT_STEPS = 3
#: Contact elements whose response is kept.
_KEPT_ELEMENTS = 12


@dataclass
class CatenaryState:
    """State of a line, changed in place by a step.

    Attributes
    ----------
    displacement, velocity, acceleration : ndarray, shape (n_free,)
        From the static shape [m, m/s, m/s2].
    slack : ndarray of int
        Slack droppers.
    compensation : ndarray
        What each of them lacks to its elastic force [N].
    element : ndarray of int, shape (n_pantographs, n_sections)
        Element of the contact wire met last.
    impact_velocity : ndarray, shape (n_pantographs, n_sections)
        Velocity at impact of the closed contacts [m/s], 0 where open.
    """

    displacement: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    slack: IntArray
    compensation: FloatArray
    element: IntArray
    impact_velocity: FloatArray

    def snapshot(self) -> Snapshot:
        """Return copies of all arrays."""
        return {name: value.copy() for name, value in vars(self).items()}

    def restore(self, snapshot: Snapshot) -> None:
        """Take over the arrays of a snapshot."""
        for name in vars(self):
            setattr(self, name, snapshot[name].copy())


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
class _Stepper:
    """What belongs to one step size."""

    newmark: Newmark
    stiffness: EffectiveStiffness
    local: LocalProblem
    contact_columns: dict[tuple[int, int], Columns] = field(default_factory=dict)


@dataclass
class _Work:
    """Preallocated arrays of the step."""

    inertia: FloatArray
    damping: FloatArray
    new: FloatArray


class CatenaryModel:
    """A line ready to step: static shape found, matrices reduced to the free degrees of freedom.

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
        fixed = self.mesh.fixed.copy()
        if definition.messenger_support is not None:
            fixed[self.mesh.sprung, 2] = False
        self.free = np.flatnonzero(~fixed.ravel())
        self.free_index = np.full(fixed.size, -1)
        self.free_index[self.free] = np.arange(len(self.free))
        self.B = dropper_rows(self.mesh, self.static.positions)[:, self.free]
        self.dropper_stiffness = dropper_stiffness(definition, self.mesh, self.static.positions)
        self.K, self.M, self.C = self._matrices()
        self.wires = tuple(
            ContactWire(chain, self.static, self.free_index) for chain in self.mesh.contact_chains()
        )
        self.uplift_dofs = self.free_index[self.mesh.support_nodes * NODE_DOFS + 2]
        self._steppers: dict[float, _Stepper] = {}
        n = len(self.free)
        self._work = _Work(np.empty(n), np.empty(n), np.empty(n))

    def initial_state(self, pantographs: int = 1) -> CatenaryState:
        """Return the line at rest in its static shape."""
        n, sections = len(self.free), len(self.wires)
        return CatenaryState(
            displacement=np.zeros(n),
            velocity=np.zeros(n),
            acceleration=np.zeros(n),
            slack=np.zeros(0, dtype=np.int64),
            compensation=np.zeros(0),
            element=np.full((pantographs, sections), -1),
            impact_velocity=np.zeros((pantographs, sections)),
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
        stepper = self._stepper(step)
        new = self._free_response(stepper, state)
        contacts, crossings = self._open_contacts(stepper, state, motion, new)
        compliance = self._strip_compliance(contacts, motion)
        free_force = self.static.dropper_force + self.dropper_stiffness * (self.B @ new)
        forces = stepper.local.solve(free_force, contacts, compliance, state.slack)
        _superpose(new, contacts, forces, stepper.local.dropper_columns)
        self._advance(stepper.newmark, state, new)
        return self._finish(state, contacts, crossings, forces)

    def contact_at_rest(self, state: CatenaryState, strips: FloatArray) -> ContactResult:
        """Return the contacts of strips with the line as it stands, without advancing anything.

        Parameters
        ----------
        strips : ndarray, shape (n_pantographs, 2, 2, 3)
        """
        result = self._empty_result(len(strips))
        for p, strip in enumerate(strips):
            for s, wire in enumerate(self.wires):
                found = wire.find(strip, state.displacement, int(state.element[p, s]))
                if found is None:
                    continue
                state.element[p, s] = found.element
                penetration, velocity = self._penetration(wire, found, strip, state.displacement, state.velocity)
                impact = max(velocity, 0.0)
                law = CONTACT_LAWS["continuous"](penetration, velocity, impact, self.definition.contact)
                result.force[p, s] = law.force
                result.point[p, s] = self._point(wire, found, state.displacement)
        return result

    def dropper_force(self, state: CatenaryState) -> FloatArray:
        """Return the force that every dropper carries [N], shape (n_droppers,): 0 where slack."""
        force = self.static.dropper_force + self.dropper_stiffness * (self.B @ state.displacement)
        force[state.slack] += state.compensation
        return force

    def uplift(self, state: CatenaryState) -> FloatArray:
        """Return the rise of the contact wire at the supports [m], shape (n_supports,)."""
        return state.displacement[self.uplift_dofs]

    def energy(self, state: CatenaryState) -> float:
        """Return kinetic plus elastic energy from the static shape, droppers bilateral [J]."""
        d, v = state.displacement, state.velocity
        return float(0.5 * (v @ (self.M @ v) + d @ (self.K @ d)))

    def _matrices(self) -> tuple[sp.csr_matrix, sp.csr_matrix, sp.csr_matrix]:
        matrices, free = self.static.matrices, self.free
        K, M, C = (matrix[free][:, free] for matrix in (matrices.K, matrices.M, matrices.C))
        droppers = self.B.T @ sp.diags(self.dropper_stiffness) @ self.B
        support_K, support_C = self._elastic_supports()
        K = K + droppers + support_K
        C = C + self.definition.damping.of("dropper").alpha * droppers + support_C
        return K.tocsr(), M.tocsr(), C.tocsr()

    def _elastic_supports(self) -> tuple[sp.spmatrix, sp.spmatrix]:
        diagonal = np.zeros(len(self.free))
        support = self.definition.messenger_support
        if support is None:
            return sp.diags(diagonal), sp.diags(diagonal)
        diagonal[self.free_index[self.mesh.sprung * NODE_DOFS + 2]] = 1.0
        return sp.diags(support.stiffness * diagonal), sp.diags(support.damping * diagonal)

    def _stepper(self, step: float) -> _Stepper:
        found = self._steppers.get(step)
        if found is None:
            found = self._new_stepper(step)
            if len(self._steppers) >= _KEPT_STEPS:
                del self._steppers[next(iter(self._steppers))]
            self._steppers[step] = found
        return found

    def _new_stepper(self, step: float) -> _Stepper:
        newmark = Newmark(step)
        K_hat = (self.K + newmark.a0 * self.M + newmark.a1 * self.C).tocsc()
        stiffness = EffectiveStiffness(K_hat, self.B)
        local = LocalProblem(
            measure=self.dropper_stiffness,
            unilateral=1.0 - self.definition.dropper.compression_ratio,
            dropper_columns=stiffness.dropper_columns,
            velocity_factor=newmark.a1,
            law=CONTACT_LAWS["continuous"],
            parameters=self.definition.contact,
        )
        return _Stepper(newmark, stiffness, local)

    def _free_response(self, stepper: _Stepper, state: CatenaryState) -> FloatArray:
        """Solve K_hat d = M (a0 d + a2 v + a3 a) + C (a1 d + a4 v + a5 a) [2.27]."""
        n, work = stepper.newmark, self._work
        d, v, a = state.displacement, state.velocity, state.acceleration
        np.multiply(d, n.a0, out=work.inertia)
        work.inertia += n.a2 * v
        work.inertia += n.a3 * a
        np.multiply(d, n.a1, out=work.damping)
        work.damping += n.a4 * v
        if n.a5 != 0.0:
            work.damping += n.a5 * a
        return stepper.stiffness.solve(self.M @ work.inertia + self.C @ work.damping)

    def _open_contacts(
        self, stepper: _Stepper, state: CatenaryState, motion: StripMotion, new: FloatArray
    ) -> tuple[list[OpenContact], list[tuple[int, int, Crossing | None]]]:
        contacts, crossings = [], []
        velocity = None
        for p, strip in enumerate(motion.strip):
            for s, wire in enumerate(self.wires):
                found = wire.find(strip, new, int(state.element[p, s]))
                crossings.append((p, s, found))
                if found is None:
                    continue
                state.element[p, s] = found.element
                if velocity is None:
                    velocity = self._velocity_of(stepper.newmark, state, new)
                delta, delta_dot = self._penetration(wire, found, strip, new, velocity)
                if delta > 0.0 or self._may_close(state, p, s):
                    contacts.append(self._open_contact(stepper, state, (p, s), found, delta, delta_dot))
        return contacts, crossings

    def _may_close(self, state: CatenaryState, p: int, s: int) -> bool:
        """Whether a contact open without force may close by what droppers and other contacts do."""
        return bool(state.impact_velocity[p, s] > 0.0)

    def _velocity_of(self, newmark: Newmark, state: CatenaryState, new: FloatArray) -> FloatArray:
        """Return the velocity that belongs to a new displacement."""
        result = self._work.inertia
        np.subtract(new, state.displacement, out=result)
        result *= newmark.a1
        result -= newmark.a4 * state.velocity
        if newmark.a5 != 0.0:
            result -= newmark.a5 * state.acceleration
        return result

    def _penetration(
        self, wire: ContactWire, found: Crossing, strip: FloatArray, displacement: FloatArray, velocity: FloatArray
    ) -> tuple[float, float]:
        element = wire.elements[found.element]
        powers = found.powers
        shape = powers @ element.rows
        z, z_dot = strip[0, :, 2] + found.share * (strip[1, :, 2] - strip[0, :, 2])
        radii = self.definition.contact.wire_radius + self.definition.contact.strip_radius
        height = powers @ element.static + shape @ displacement[element.dofs]
        return float(z - height + radii), float(z_dot - shape @ velocity[element.dofs])

    def _open_contact(
        self,
        stepper: _Stepper,
        state: CatenaryState,
        which: tuple[int, int],
        found: Crossing,
        penetration: float,
        velocity: float,
    ) -> OpenContact:
        p, s = which
        element = self.wires[s].elements[found.element]
        powers = found.powers
        return OpenContact(
            pantograph=p,
            section=s,
            penetration=penetration,
            velocity=velocity,
            impact_velocity=float(state.impact_velocity[p, s]),
            dofs=element.dofs,
            load=powers @ element.rows,
            weights=powers,
            columns=self._contact_columns(stepper, s, found.element),
        )

    def _contact_columns(self, stepper: _Stepper, section: int, index: int) -> Columns:
        """Return the response to an element's shape polynomials; solved once per element that a strip visits."""
        kept = stepper.contact_columns
        found = kept.get((section, index))
        if found is None:
            element = self.wires[section].elements[index]
            load = np.zeros((len(self.free), 4))
            load[element.dofs] = element.rows.T
            found = stepper.stiffness.columns(load)
            while len(kept) >= _KEPT_ELEMENTS:
                del kept[next(iter(kept))]
            kept[(section, index)] = found
        return found

    def _strip_compliance(self, contacts: Sequence[OpenContact], motion: StripMotion) -> FloatArray:
        """Two contacts of one strip share its retreat."""
        owners = np.array([c.pantograph for c in contacts], dtype=np.int64)
        same = owners[:, None] == owners[None, :]
        return np.where(same, motion.compliance[owners][:, None], 0.0) if len(contacts) else np.zeros((0, 0))

    def _advance(self, newmark: Newmark, state: CatenaryState, new: FloatArray) -> None:
        """Replace displacement, velocity and acceleration [2.23, 2.24]."""
        velocity = self._velocity_of(newmark, state, new)
        # a_n+1 = (v_n+1 - v_n) / (gamma dt) - (1 - gamma) / gamma a_n; gamma = 1/2.
        acceleration = state.acceleration
        np.negative(acceleration, out=acceleration)
        work = self._work.damping
        np.subtract(velocity, state.velocity, out=work)
        work *= 2.0 / newmark.step
        acceleration += work
        state.velocity[...] = velocity
        state.displacement[...] = new

    def _finish(
        self,
        state: CatenaryState,
        contacts: Sequence[OpenContact],
        crossings: Sequence[tuple[int, int, Crossing | None]],
        forces: LocalForces,
    ) -> ContactResult:
        result = self._empty_result(len(state.element))
        state.slack, state.compensation = forces.slack, forces.compensation
        was_closed = state.impact_velocity.copy()
        state.impact_velocity[...] = 0.0
        for contact, force, velocity, closed in zip(
            contacts, forces.contact, forces.penetration_velocity, forces.closed, strict=True
        ):
            key = contact.pantograph, contact.section
            result.force[key] = force
            if closed:
                state.impact_velocity[key] = was_closed[key] or max(float(velocity), 1e-6)
        for p, s, found in crossings:
            if found is not None:
                result.point[p, s] = self._point(self.wires[s], found, state.displacement)
        return result

    def _point(
        self, wire: ContactWire, found: Crossing, displacement: FloatArray
    ) -> FloatArray:
        element = wire.elements[found.element]
        powers = found.powers
        z = powers @ element.static + (powers @ element.rows) @ displacement[element.dofs]
        x, y = wire.plan(found, displacement)
        return np.array([x, y, float(z)])

    def _empty_result(self, pantographs: int) -> ContactResult:
        shape = (pantographs, len(self.wires))
        return ContactResult(np.zeros(shape), np.full((*shape, 3), np.nan))


def _superpose(
    new: FloatArray, contacts: Sequence[OpenContact], forces: LocalForces, dropper_columns: Sequence[Columns]
) -> None:
    """Add the response to contact and compensation forces to the free solution."""
    for contact, force in zip(contacts, forces.contact, strict=True):
        if force != 0.0:
            new[contact.columns.window] += contact.columns.values @ (force * contact.weights)
    for j, compensation in zip(forces.slack, forces.compensation, strict=True):
        column = dropper_columns[j]
        new[column.window] -= compensation * column.values[:, 0]

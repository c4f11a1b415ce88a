"""The line as a dynamic system: displacements from its static shape, one step at a time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp

from models.catenary.assembly import compression_ratio, dropper_rows, dropper_stiffness
from models.catenary.compliance import Columns, EffectiveStiffness
from models.catenary.condensation import (
    Blocks,
    attachments,
    order_by_blocks,
    plan_angles,
    plan_rotation,
    without_rounding,
)
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
    motion : ndarray, shape (2, n_free)
        Displacement from the static shape [m] and velocity [m/s].
    load : ndarray, shape (n_free,)
        Forces of the contacts and of what slack droppers lack [N].
    slack : ndarray of int
        Slack droppers.
    compensation : ndarray
        What each of them lacks to its elastic force [N].
    element : ndarray of int, shape (n_pantographs, n_sections)
        Element of the contact wire met last.
    impact_velocity : ndarray, shape (n_pantographs, n_sections)
        Velocity at impact of the closed contacts [m/s], 0 where open.
    """

    motion: FloatArray
    load: FloatArray
    slack: IntArray
    compensation: FloatArray
    element: IntArray
    impact_velocity: FloatArray

    @property
    def displacement(self) -> FloatArray:
        """Return the displacement, a view of ``motion``, shape (n_free,)."""
        return self.motion[0]

    @property
    def velocity(self) -> FloatArray:
        """Return the velocity, a view of ``motion``, shape (n_free,)."""
        return self.motion[1]

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
    """What belongs to one step size.

    Attributes
    ----------
    product : sparse, shape (n_free, 2 n_free)
        [-2 K, a2 M], what displacement and velocity contribute to the next increment.
    """

    newmark: Newmark
    product: sp.csr_matrix
    stiffness: EffectiveStiffness
    local: LocalProblem
    contact_columns: dict[tuple[int, int], Columns] = field(default_factory=dict)


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
        self._angles = plan_angles(self.mesh, self.static.points)
        self._rotation = plan_rotation(self._angles)
        rotated = self._rotated()
        self.free, self._blocks = self._numbering(*rotated[:2])
        self.free_index = np.full(self.mesh.fixed.size, -1)
        self.free_index[self.free] = np.arange(len(self.free))
        # Droppers hang on attachments, where nodal axes are the global ones.
        self.B = dropper_rows(self.mesh, self.static.positions)[:, self.free]
        self.dropper_stiffness = dropper_stiffness(definition, self.mesh, self.static.positions)
        #: What droppers that are slack at rest lack to their elastic force [N]; given lengths may leave some slack.
        self.rest_compensation = self.static.dropper_force - self.static.elastic_force
        self._rest_load = self.B.T @ self.rest_compensation
        self.unilateral = 1.0 - compression_ratio(definition, self.mesh)
        self._stretch = self.B.T.tocsc()
        self.K, self.M, self.C = self._matrices(*rotated)
        self.wires = tuple(
            ContactWire(chain, self.static, self.free_index, self._angles) for chain in self.mesh.contact_chains()
        )
        self.uplift_dofs = self.free_index[self.mesh.support_nodes * NODE_DOFS + 2]
        self._law = CONTACT_LAWS[definition.contact.law]
        self._steppers: dict[float, _Stepper] = {}
        self._work = np.empty(len(self.free))

    def initial_state(self, pantographs: int = 1) -> CatenaryState:
        """Return the line at rest in its static shape."""
        n, sections = len(self.free), len(self.wires)
        return CatenaryState(
            motion=np.zeros((2, n)),
            load=np.zeros(n),
            slack=np.flatnonzero(self.rest_compensation),
            compensation=self.rest_compensation[self.rest_compensation > 0.0],
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
        new = self._free_response(stepper, state)  # an increment until here, a displacement from here
        new += state.displacement
        contacts, crossings = self._open_contacts(stepper, state, motion, new)
        compliance = self._strip_compliance(contacts, motion)
        free_force = self.static.elastic_force + self.dropper_stiffness * (self.B @ new)
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
                dofs = wire.elements[found.element].dofs
                penetration, velocity = self._penetration(
                    wire, found, strip, state.displacement[dofs], state.velocity[dofs]
                )
                impact = max(velocity, 0.0)
                law = self._law(penetration, velocity, impact, self.definition.contact)
                result.force[p, s] = law.scaled(found.engagement).force
                result.point[p, s] = self._point(wire, found, state.displacement)
        return result

    def dropper_force(self, state: CatenaryState) -> FloatArray:
        """Return the force that every dropper carries [N], shape (n_droppers,): 0 where slack."""
        force = self.static.elastic_force + self.dropper_stiffness * (self.B @ state.displacement)
        force[state.slack] += state.compensation
        return force

    def uplift(self, state: CatenaryState) -> FloatArray:
        """Return the rise of the contact wire at the supports [m], shape (n_supports,)."""
        return state.displacement[self.uplift_dofs]

    def energy(self, state: CatenaryState) -> float:
        """Return kinetic plus elastic energy from the static shape, droppers bilateral [J]."""
        d, v = state.displacement, state.velocity
        return float(0.5 * (v @ (self.M @ v) + d @ (self.K @ d)))

    def _rotated(self) -> tuple[sp.csr_matrix, sp.csr_matrix, sp.csr_matrix]:
        """Return K, M and C of beams and supports in nodal axes, over all degrees of freedom."""
        matrices, Q = self.static.matrices, self._rotation
        K, M, C = ((Q.T @ matrix @ Q).tocsr() for matrix in (matrices.K, matrices.M, matrices.C))
        stiff, heavy = np.sqrt(K.diagonal()), np.sqrt(M.diagonal())
        damped = np.sqrt(np.maximum(C.diagonal(), 0.0))
        return without_rounding(K, stiff), without_rounding(M, heavy), without_rounding(C, damped)

    def _numbering(self, K: sp.csr_matrix, M: sp.csr_matrix) -> tuple[IntArray, Blocks]:
        """Return the free degrees of freedom, those inside the intervals first, block by block."""
        free = np.flatnonzero(~self.mesh.fixed.ravel())
        inner = np.repeat(~attachments(self.mesh), NODE_DOFS)[free]
        order, blocks = order_by_blocks((abs(K) + abs(M))[free][:, free], inner)
        return free[order], blocks

    def _matrices(
        self, *rotated: sp.csr_matrix
    ) -> tuple[sp.csr_matrix, sp.csr_matrix, sp.csr_matrix]:
        """Return K, M and C over the numbered degrees of freedom, droppers included."""
        K, M, C = (matrix[self.free][:, self.free] for matrix in rotated)
        droppers = self.B.T @ sp.diags(self.dropper_stiffness) @ self.B
        K = K + droppers
        C = C + self.definition.damping.of("dropper").alpha * droppers
        return K.tocsr(), M.tocsr(), C.tocsr()

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
        K_hat = (self.K + newmark.a0 * self.M + newmark.a1 * self.C).tocsr()
        stiffness = EffectiveStiffness(K_hat, self.B, self._blocks)
        local = LocalProblem(
            measure=self.dropper_stiffness,
            unilateral=self.unilateral,
            dropper_columns=stiffness.dropper_columns,
            velocity_factor=newmark.a1,
            law=self._law,
            parameters=self.definition.contact,
        )
        product = sp.hstack([-2.0 * self.K, newmark.a2 * self.M], format="csr")
        return _Stepper(newmark, product, stiffness, local)

    def _free_response(self, stepper: _Stepper, state: CatenaryState) -> FloatArray:
        """Return the increment of displacement without forces of contacts and slack droppers at the step's end.

        The trapezoidal rule in increments: with a0 ... a5 of [2.28], M a_n = f_n - C v_n - K d_n and
        gamma = 1/2, beta = 1/4, the step [2.25-2.27] is K_hat (d_n+1 - d_n) = f_n + f_n+1 - 2 K d_n + a2 M v_n: the
        damping matrix drops out of the right-hand side, and accelerations are not needed.

        What a dropper that is slack at rest lacks is part of the static state, so it is added here once.
        """
        right = stepper.product @ state.motion.ravel()
        right += state.load
        right += self._rest_load
        return stepper.stiffness.solve(right)

    def _open_contacts(
        self, stepper: _Stepper, state: CatenaryState, motion: StripMotion, new: FloatArray
    ) -> tuple[list[OpenContact], list[tuple[int, int, Crossing | None]]]:
        contacts, crossings = [], []
        for p, strip in enumerate(motion.strip):
            for s, wire in enumerate(self.wires):
                found = wire.find(strip, new, int(state.element[p, s]))
                crossings.append((p, s, found))
                if found is None:
                    continue
                state.element[p, s] = found.element
                dofs = wire.elements[found.element].dofs
                velocity = stepper.newmark.a1 * (new[dofs] - state.displacement[dofs]) - state.velocity[dofs]
                delta, delta_dot = self._penetration(wire, found, strip, new[dofs], velocity)
                # One that was closed stays among the candidates: other forces of the step may keep it so.
                if delta > 0.0 or state.impact_velocity[p, s] > 0.0:
                    contacts.append(self._open_contact(stepper, state, (p, s), found, delta, delta_dot))
        return contacts, crossings

    def _penetration(
        self, wire: ContactWire, found: Crossing, strip: FloatArray, displacement: FloatArray, velocity: FloatArray
    ) -> tuple[float, float]:
        """Return penetration and its velocity; ``displacement`` and ``velocity`` are those of the element."""
        element = wire.elements[found.element]
        powers = found.powers
        shape = powers @ element.rows
        z, z_dot = strip[0, :, 2] + found.share * (strip[1, :, 2] - strip[0, :, 2])
        radii = self.definition.contact.wire_radius + self.definition.contact.strip_radius
        height = powers @ element.static + shape @ displacement
        return float(z - height + radii), float(z_dot - shape @ velocity)

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
            engagement=found.engagement,
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
        """Replace displacement and velocity [2.21, 2.22]."""
        change = self._work
        np.subtract(new, state.displacement, out=change)
        change *= newmark.a1
        np.subtract(change, state.velocity, out=state.velocity)
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
        self._load(state, contacts, forces)
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

    def _load(self, state: CatenaryState, contacts: Sequence[OpenContact], forces: LocalForces) -> None:
        """Note the forces at the end of the step; the next one begins with them."""
        state.load[...] = self._rest_load
        for contact, force in zip(contacts, forces.contact, strict=True):
            state.load[contact.dofs] += force * contact.load
        if forces.slack.size:
            state.load -= self._stretch[:, forces.slack] @ forces.compensation

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
            new[contact.columns.index] += contact.columns.values @ (force * contact.weights)
    for j, compensation in zip(forces.slack, forces.compensation, strict=True):
        column = dropper_columns[j]
        new[column.index] -= compensation * column.values[:, 0]

"""The line as a dynamic system: displacements from its static shape, one step at a time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress

import numpy as np

from models.arrays import BoolArray, FloatArray
from models.catenary.condition.line_condition import find_condition
from models.catenary.condition.running_surface import running_surfaces
from models.catenary.contact_and_slack.contact_wire import ContactWire, WireInterval, put_in_lap
from models.catenary.contact_and_slack.dropper_law import DropperLaw
from models.catenary.contact_and_slack.local_problem import LocalSolutionError
from models.catenary.definition.line_definition import CatenaryDefinition
from models.catenary.line_state import CatenaryState, ContactResult, StripMotion, empty_result
from models.catenary.linear_motion.line_motion import LineMotion
from models.catenary.linear_motion.mode_finding import line_modes
from models.catenary.linear_motion.sparse_products import inner
from models.catenary.shape.beam_elements import NODE_DOFS
from models.catenary.shape.form_finding import EquilibriumError, StaticState
from models.catenary.shape.kept_form import kept_form
from models.catenary.shape.line_mesh import CatenaryMesh, build_mesh
from models.catenary.shape.wire_intervals import Interval, attachments, intervals, plan_angles, plan_rotation
from models.catenary.step.engine_choice import make_engine
from models.catenary.step.step_engine import GivenForce, StepEngine, SteppedLine
from models.contact_law import CONTACT_LAWS
from models.numerics.newmark import Newmark

#: Step sizes whose factorisation is kept.
_KEPT_STEPS = 3


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
        law = CONTACT_LAWS[definition.contact.law]
        self._line = SteppedLine(self.modes, self.dropper_law, self.wires, law, definition.contact)
        self._engines: dict[float, StepEngine] = {}

    def initial_state(self, pantographs: int = 1) -> CatenaryState:
        """Return the line at rest in its static shape."""
        shape, lacking = (pantographs, len(self.wires)), self.dropper_law.rest_compensation
        return CatenaryState(
            motion=LineMotion.at_rest(self.modes),
            slack=np.flatnonzero(lacking),
            compensation=lacking[lacking > 0.0],
            element=np.full(shape, -1),
            impact_velocity=np.zeros(shape),
            loaded=np.zeros((0, 2), dtype=np.int64),
            load=np.zeros((0, 2)),
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
        return self._engine(step).step(state, motion)

    def push(self, state: CatenaryState, step: float, forces: Sequence[GivenForce]) -> None:
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
        IndexError
            If the line has no such wire.
        LocalSolutionError
            If the slack droppers are not found.
        """
        self._engine(step).push(state, forces)

    def contact_at_rest(self, state: CatenaryState, strips: FloatArray) -> ContactResult:
        """Return the contacts of strips with the line as it stands, without advancing anything.

        Parameters
        ----------
        strips : ndarray, shape (n_pantographs, 2, 2, 3)
        """
        result = empty_result(len(strips), len(self.wires))

        def positions(interval: WireInterval) -> list[float]:
            return interval.positions(interval.local(state.motion)[0])

        for p, strip in enumerate(strips.tolist()):
            for s, wire in enumerate(self.wires):
                found = wire.find(strip, positions, int(state.element[p, s]))
                if found is None:
                    continue
                state.element[p, s] = found.element
                interval = wire.interval(found.element)
                local, (row, height) = interval.local(state.motion), interval.lift(found.element, found.xi)
                rise, speed = local.dot(row).tolist()
                delta, rate = wire.penetration(found.share, height + rise, speed, strip, self._line.gap)
                law = self._line.law(delta, rate, max(rate, 0.0), self.definition.contact)
                result.force[p, s] = law.scaled(found.engagement).force
                result.point[p, s] = *interval.at(found, local[0]), height + rise
        put_in_lap(self.wires, result.point, strips)
        return result

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
        spans, surfaces = iter(self.modes.spans), running_surfaces(self.definition)
        for chain, parts in zip(self.mesh.chains, by_wire, strict=True):
            own = [(part, next(spans)) for part in parts]
            if chain.component == "contact_wire":
                period = self.definition.sections[chain.section].period
                surface = surfaces[chain.section]
                yield ContactWire(chain, own, self.static, self.modes, self._angles, period, surface)

    def _engine(self, step: float) -> StepEngine:
        found = self._engines.get(step)
        if found is None:
            with self._solvable(f"make steps of {step:g} s"):
                found = make_engine(self._line, Newmark(step))
            if len(self._engines) >= _KEPT_STEPS:
                del self._engines[next(iter(self._engines))]
            self._engines[step] = found
        return found

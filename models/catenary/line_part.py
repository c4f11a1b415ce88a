"""A line between communication points: strips in, contact forces out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.arrays import FloatArray, IntArray, Snapshot
from models.catenary.definition.line_definition import CatenaryDefinition
from models.catenary.exchange.strip_exchange import StripExchange, make_exchange, output_count
from models.catenary.line_energy import LineBalance
from models.catenary.line_model import CatenaryModel
from models.catenary.line_state import CatenaryState, ContactResult, StripMotion
from models.catenary.shape.line_mesh import CatenaryMesh, build_mesh
from models.catenary.statics.elasticity import elasticity
from models.catenary.statics.nominal_height import NominalHeight
from models.catenary.statics.wire_waves import contact_wire_wave_speed
from models.catenary.strip_checks import WireAtRest, check_strips, start_warning
from models.numerics.energy_ledger import NO_BALANCE
from models.numerics.newmark import steps_within

#: Force for which a line's elasticity is given [N].
_PUSH = 100.0


@dataclass(frozen=True)
class Site:
    """A support or dropper: its name, place along the track [m] and section, from 1.

    Names count from 1 within a section, and say the section where there are several.
    """

    name: str
    x: float
    section: int


@dataclass(frozen=True)
class LineGeometry:
    """Static geometry of a line, arrays over its supports and its droppers [m].

    Attributes
    ----------
    support_x, support_y, support_z : ndarray, shape (n_supports,)
        Contact wire at the supports.
    support_messenger_z : ndarray, shape (n_supports,)
    dropper_x, dropper_lower_y, dropper_lower_z, dropper_upper_z : ndarray, shape (n_droppers,)
    dropper_length : ndarray, shape (n_droppers,)
        Unstrained length.
    support_section, dropper_section : ndarray, shape (n_supports,), (n_droppers,)
        Number of the section, from 1.
    """

    support_x: FloatArray
    support_y: FloatArray
    support_z: FloatArray
    support_messenger_z: FloatArray
    dropper_x: FloatArray
    dropper_lower_y: FloatArray
    dropper_lower_z: FloatArray
    dropper_upper_z: FloatArray
    dropper_length: FloatArray
    support_section: FloatArray
    dropper_section: FloatArray


class CatenaryPart:
    """An overhead contact line: receives where strips are, returns the contact forces.

    Parameters
    ----------
    definition : CatenaryDefinition
    pantographs : int
        Number of pantograph ports.

    Attributes
    ----------
    outputs : ndarray, shape (n,)
        The four that follow, one after the other, the forces per wire only if there are several.
    contact_force : ndarray, shape (P,)
        Resultant force on the strip [N].
    contact_point : ndarray, shape (P, 3)
        Its point of application; without contact the place where the strip crosses the wire, or the strip's middle [m].
    section_force : ndarray, shape (P, n_sections)
        Force per wire [N].
    support_uplift : ndarray, shape (n_supports,)
        Rise of the contact wire at the supports [m].
    """

    def __init__(self, definition: CatenaryDefinition, pantographs: int = 1) -> None:
        self.definition = definition
        mesh = build_mesh(definition)
        self.section_count = len(definition.sections)
        self.supports = _sites(mesh, mesh.support_nodes)
        self.droppers = _sites(mesh, mesh.droppers[:, 0])
        self.time = 0.0
        P, S, supports = pantographs, self.section_count, len(self.supports)
        self.outputs = np.zeros(output_count(P, S, supports))
        self.contact_force = self.outputs[:P]
        self.contact_point = self.outputs[P : 4 * P].reshape(P, 3)
        forces = self.outputs[4 * P : (4 + S) * P] if S > 1 else self.contact_force
        self.section_force = forces.reshape(P, S)
        self.support_uplift = self.outputs[len(self.outputs) - supports :]
        self._exchange: StripExchange | None = None
        self._motion = StripMotion(np.zeros((pantographs, 2, 2, 3)), np.zeros(pantographs))
        self._model: CatenaryModel | None = None
        self._state: CatenaryState | None = None
        self._balance: LineBalance | None = None
        self._nominal: NominalHeight | None = None

    @property
    def model(self) -> CatenaryModel:
        """Return the line, built (form finding, matrices) when first needed.

        Raises
        ------
        EquilibriumError
            If the line has no static equilibrium of the wanted shape.
        """
        if self._model is None:
            self._model = CatenaryModel(self.definition)
        return self._model

    @property
    def state(self) -> CatenaryState:
        """Return the line's state; at rest before the first initialisation."""
        if self._state is None:
            self._state = self.model.initial_state(len(self.contact_force))
        return self._state

    @property
    def exchange(self) -> StripExchange:
        """Return what continues the strips and hands out the resultants; made when first needed."""
        if self._exchange is None:
            self._exchange = make_exchange(len(self.contact_force), self.definition.extrapolation_order)
        return self._exchange

    @property
    def dropper_force(self) -> FloatArray:
        """Return what every dropper carries under its law [N], shape (n_droppers,)."""
        return self.model.dropper_force(self.state)

    @property
    def dropper_slack(self) -> FloatArray:
        """Return 1 for every dropper that is slack by its law, 0 for the others, shape (n_droppers,)."""
        return self.model.dropper_slack(self.state).astype(np.float64)

    @property
    def energy(self) -> FloatArray:
        """Return the values of `energy_ledger.BALANCE` [J], shape (4,); 0 if the balance is not kept."""
        return NO_BALANCE if self._balance is None else self._balance.balance(self.state)

    @property
    def contact_work(self) -> FloatArray:
        """Return the work of the strips against the contacts [J], shape (P,); 0 if the balance is not kept."""
        return np.zeros(len(self.contact_force)) if self._balance is None else self._balance.contact_work

    @property
    def nominal(self) -> FloatArray:
        """Return the wire's nominal height under the strips [m], then its rate for them [m/s], shape (2 P,)."""
        if self._nominal is None:
            self._nominal = NominalHeight(self.definition)
        return self._nominal.under(self._motion.strip)

    @property
    def geometry(self) -> LineGeometry:
        """Return the static geometry."""
        mesh, static = self.model.mesh, self.model.static
        support = static.positions[mesh.support_nodes]
        lower, upper = (static.positions[mesh.droppers[:, k]] for k in (0, 1))
        return LineGeometry(
            support[:, 0].copy(),
            support[:, 1].copy(),
            support[:, 2].copy(),
            static.positions[mesh.sprung, 2],
            lower[:, 0].copy(),
            lower[:, 1].copy(),
            lower[:, 2].copy(),
            upper[:, 2].copy(),
            static.unstrained_length,
            (mesh.section[mesh.support_nodes] + 1).astype(np.float64),
            (mesh.section[mesh.droppers[:, 0]] + 1).astype(np.float64),
        )

    @property
    def period(self) -> FloatArray:
        """Return the length after which a line that closes on itself repeats [m], shape (1,); 0 if it does not."""
        return np.array([max(section.period for section in self.definition.sections)])

    @property
    def contact_wire_wave_speed(self) -> FloatArray:
        """Return the speed of waves in the contact wire, taken for the longest span [m/s], shape (1,)."""
        return np.array([contact_wire_wave_speed(self.definition)])

    @property
    def elasticity(self) -> FloatArray:
        """Return the static elasticity at mid-span and at the support before it [m/N], shape (2,).

        Under 100 N, in the span in the middle of the first section.
        """
        spans = self.definition.sections[0].spans
        span = spans[len(spans) // 2]
        return elasticity(self.model, np.array([(span.start + span.end) / 2.0, span.start]), _PUSH).value

    @property
    def contact_wire_ends(self) -> FloatArray:
        """Return where the contact wires begin and end along the track [m], shape (2,)."""
        ends = [wire.ends for wire in self.model.wires]
        return np.array([min(first for first, _ in ends), max(last for _, last in ends)])

    def check_strips(self, strips: FloatArray) -> None:
        """Refuse strips that the line, just initialised with them, cannot be meant for; raises ``ParameterError``.

        Parameters
        ----------
        strips : ndarray, shape (P, 2, 2, 3)
        """
        check_strips(wires_at_rest(self.model), strips, self.contact_force)

    def start_warning(self, strips: FloatArray) -> str:
        """Return which of the strips begins inside the wire, empty if none does; shape as of `check_strips`."""
        return start_warning(wires_at_rest(self.model), strips, self.contact_force)

    def initialise(self, time: float, strips: FloatArray) -> None:
        """Bring the line to rest at ``time`` and find the contacts of the strips with it.

        Parameters
        ----------
        strips : ndarray, shape (P, 2, 2, 3)
            Pantograph; end A, B; position, velocity; x, y, z.
        """
        self.time = time
        self._state = self.model.initial_state(len(self.contact_force))
        self.model.rehearse(self.definition.time_step, strips)
        self.exchange.start(time, strips)
        contacts = self.model.contact_at_rest(self._state, strips)
        self._motion.strip[...] = strips
        self._balance = LineBalance(self.model, strips, contacts) if self.definition.monitor_energy else None
        self._publish(strips, contacts)

    def step(self, strips: FloatArray, step: float) -> None:
        """Advance by ``step`` [s] under strips received for its beginning (or its end, if they have stepped already).

        Parameters
        ----------
        strips : ndarray, shape (P, 2, 2, 3)
        """
        count = steps_within(step, self.definition.time_step)
        start, h = self.time, step / count
        state, motion, exchange = self.state, self._motion, self.exchange
        advance = (self._balance or self.model).step
        exchange.receive(start, step, strips, start + h, motion.strip)
        result = advance(state, h, motion)
        for k in range(2, count + 1):
            exchange.at(start + k * h, motion.strip)
            result = advance(state, h, motion)
        self.time = start + step
        self._publish(motion.strip, result)

    def snapshot(self) -> Snapshot:
        """Return the whole state, bit for bit."""
        result: Snapshot = {"time": np.array([self.time])}
        result |= {f"line.{name}": value for name, value in self.state.snapshot().items()}
        result |= self.exchange.snapshot()
        if self._balance is not None:
            result |= self._balance.snapshot()
        outputs = ("contact_force", "contact_point", "section_force", "support_uplift")
        return result | {name: getattr(self, name).copy() for name in outputs}

    def restore(self, snapshot: Snapshot) -> None:
        """Restore a snapshot."""
        self.time = float(snapshot["time"][0])
        self.state.restore({n.removeprefix("line."): v for n, v in snapshot.items() if n.startswith("line.")})
        self.exchange.restore(snapshot)
        if self._balance is not None:
            self._balance.restore(snapshot)
        for name in ("contact_force", "contact_point", "section_force", "support_uplift"):
            getattr(self, name)[...] = snapshot[name]

    def _publish(self, strips: FloatArray, result: ContactResult) -> None:
        attached, places = self.state.motion.attached, self.model.uplift_places
        self.exchange.publish(result, strips, attached, places, self.outputs)


def wires_at_rest(model: CatenaryModel) -> tuple[WireAtRest, ...]:
    """Return the static shape of the contact wires, section by section."""
    positions, chains = model.static.positions, model.mesh.chains
    of_wire = (chain for chain in chains if chain.component == "contact_wire")
    sections = model.definition.sections
    return tuple(
        WireAtRest(positions[chain.nodes], section.ends.working)
        for chain, section in zip(of_wire, sections, strict=True)
    )


def _sites(mesh: CatenaryMesh, nodes: IntArray) -> tuple[Site, ...]:
    sections = mesh.section[nodes]
    several = bool(mesh.section.any())
    found, counts = [], dict.fromkeys(sections.tolist(), 0)
    for x, section in zip(mesh.points[nodes, 0].tolist(), sections.tolist(), strict=True):
        counts[section] += 1
        name = f"{counts[section]} of section {section + 1}" if several else str(counts[section])
        found.append(Site(name, x, section + 1))
    return tuple(found)

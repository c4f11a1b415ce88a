"""Monolithic coupling of a line with lumped pantographs: one system, one step, no communication.

The reference for the co-simulation: the same equations and the same time integration, but contact force, line and
pantographs are solved together at the end of every step.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from models.arrays import BoolArray, FloatArray
from models.catenary.line_model import CatenaryModel
from models.catenary.line_state import ContactResult, StripMotion
from models.catenary.statics.nominal_height import NominalHeight
from models.contact_law import application_point
from models.coupled.held_coupling import HeldCoupling
from models.pantograph.lumped.held_forces import held_forces
from models.pantograph.lumped.lumped_definition import LumpedDefinition
from models.pantograph.lumped.lumped_model import LumpedModel, LumpedState

#: Ways for stops and friction to be that are tried in a step.
_TRIALS: Final = 12


@dataclass(frozen=True)
class CoupledRecord:
    """The record of a coupled run: one row per time, the start included.

    Attributes
    ----------
    time : ndarray, shape (n,)
    position : ndarray, shape (n, P)
        Of the strips along the track [m].
    contact_force : ndarray, shape (n, P)
        Resultants [N].
    contact_point : ndarray, shape (n, P, 3)
        Where the resultants act [m]; without contact as `application_point` says; NaN at the start.
    section_force : ndarray, shape (n, P, n_sections)
        Per wire [N].
    strip_height : ndarray, shape (n, P)
        [m].
    uplift : ndarray, shape (n, n_supports)
        [m].
    dropper_force : ndarray, shape (n, n_droppers)
        What they carry under their law [N].
    dropper_slack : ndarray of bool, shape (n, n_droppers)
        Which ones are slack.
    """

    time: FloatArray
    position: FloatArray
    contact_force: FloatArray
    contact_point: FloatArray
    section_force: FloatArray
    strip_height: FloatArray
    uplift: FloatArray
    dropper_force: FloatArray
    dropper_slack: BoolArray


class CoupledModel:
    """A line and its pantographs as one system.

    Parameters
    ----------
    line : CatenaryModel
    pantographs : sequence of LumpedDefinition
        Each with its own ``start_position``.

    Raises
    ------
    ParameterError
        If the speed of one is not constant.
    """

    def __init__(self, line: CatenaryModel, pantographs: Sequence[LumpedDefinition]) -> None:
        for pantograph in pantographs:
            pantograph.refuse_varying_speed("this run")
        self.line = line
        self.pantographs = [LumpedModel(p) for p in pantographs]
        self.line_state = line.initial_state(len(self.pantographs))
        self.states: list[LumpedState] = [
            p.initial_state(p.load(0.0, np.zeros(2)) + _air(p.definition)) for p in self.pantographs
        ]
        pairs = zip(self.pantographs, self.states, strict=True)
        self._held = [HeldCoupling(p, s) if len(held_forces(p.definition)) else None for p, s in pairs]
        self._nominal = NominalHeight(line.definition)
        self.time = 0.0

    def step(self, step: float, end: float) -> tuple[FloatArray, FloatArray]:
        """Advance by ``step`` to the time ``end``.

        Returns
        -------
        force : ndarray, shape (P, n_sections)
            Contact forces per wire at the end of the step [N].
        point : ndarray, shape (P, 3)
            Where their resultants act [m].
        """
        loads = [p.load(end, np.zeros(2)) + _air(p.definition) for p in self.pantographs]
        rates = [self._reference_rate(i) for i in range(len(self.states))]
        each = zip(self.pantographs, self.states, loads, rates, strict=True)
        free = [p.free_response(s, step, load, rate) for p, s, load, rate in each]
        held = [(i, h) for i, h in enumerate(self._held) if h is not None]
        for i, own in held:
            own.begin(self.states[i], step, free[i])
        before = self.line_state.snapshot() if held else {}
        for trial in range(_TRIALS if held else 1):
            if trial:
                self.line_state.restore(before)
            moved = self._responses(step, free)
            motion = StripMotion(
                np.array([self._strip(i, end, d[-1], self._speed(i, step, d)) for i, (d, _) in enumerate(moved)]),
                np.array([c[-1] for _, c in moved]),
            )
            result = self.line.step(self.line_state, step, motion)
            force = result.force.sum(axis=1)
            as_supposed = [own.holds(float(force[i])) for i, own in held]  # each is asked
            if all(as_supposed):
                break
            if trial == _TRIALS - 2:  # two ways to be that call for each other: the last one, and as it is found in it
                for _, own in held:
                    own.fix()
        for i, (model, state) in enumerate(zip(self.pantographs, self.states, strict=True)):
            end_place = moved[i][0] - force[i] * moved[i][1]
            if (kept := self._held[i]) is not None:
                kept.end(end_place)
            model.advance(state, step, end_place, rates[i])
        self.time = end
        return result.force, _points(result, motion.strip)

    def _responses(self, step: float, free: list[FloatArray]) -> list[tuple[FloatArray, FloatArray]]:
        """Return for every pantograph where its masses go without contact force, and how they yield to one."""
        found = []
        for model, held, place in zip(self.pantographs, self._held, free, strict=True):
            compliance = model.compliance(step)
            if held is not None:
                own, per_force = held.response()
                place, compliance = place - own, compliance + per_force
            found.append((place, compliance))
        return found

    @property
    def strips(self) -> FloatArray:
        """Return the strips as they are, shape (P, 2, 2, 3): end A, B; position, velocity; x, y, z."""
        states = enumerate(self.states)
        return np.array([self._strip(i, self.time, s.displacement[-1], s.velocity[-1]) for i, s in states])

    def contact_at_rest(self) -> tuple[FloatArray, FloatArray]:
        """Return forces and points, as of `step`, of the strips with the line as it stands; nothing is advanced."""
        strips = self.strips
        result = self.line.contact_at_rest(self.line_state, strips)
        return result.force, _points(result, strips)

    def run(self, stop: float, step: float, progress: Callable[[float], None] | None = None) -> CoupledRecord:
        """Run to ``stop`` [s] with a fixed step [s] and record every step."""
        count = round(stop / step)
        record = self._empty_record(count + 1, step)
        for n in range(count + 1):
            if n:
                force, point = self.step(step, n * step)
                record.section_force[n], record.contact_point[n] = force, point
                record.contact_force[n] = force.sum(axis=1)
            record.strip_height[n] = [self._height(i) for i in range(len(self.states))]
            record.uplift[n] = self.line.uplift(self.line_state)
            record.dropper_force[n] = self.line.dropper_force(self.line_state)
            record.dropper_slack[n] = self.line.dropper_slack(self.line_state)
            if progress is not None:
                progress(n * step)
        return record

    def _reference_rate(self, i: int) -> float:
        """Return the rate of the line's nominal height under a strip whose reference follows, as a step begins."""
        model = self.pantographs[i]
        if not model.follows:
            return 0.0
        x = model.definition.start_position + model.definition.speed * self.time
        return self._nominal.at(x)[1] * model.definition.speed

    def _speed(self, i: int, step: float, displacement: FloatArray) -> float:
        return float(self.pantographs[i].velocity_of(self.states[i], step, displacement)[-1])

    def _strip(self, i: int, time: float, rise: float, vz: float) -> FloatArray:
        definition = self.pantographs[i].definition
        half = 0.5 * definition.strip_length
        x = definition.start_position + definition.speed * time
        z = definition.reference_height + rise
        ends = [[[x, definition.strip_offset + side, z], [definition.speed, 0.0, vz]] for side in (half, -half)]
        return np.array(ends)

    def _height(self, i: int) -> float:
        return float(self.pantographs[i].definition.reference_height + self.states[i].displacement[-1])

    def _empty_record(self, rows: int, step: float) -> CoupledRecord:
        P = len(self.pantographs)
        time = np.arange(rows, dtype=np.float64) * step
        position = np.stack([p.definition.start_position + p.definition.speed * time for p in self.pantographs], 1)
        line = self.line
        return CoupledRecord(
            time=time,
            position=position,
            contact_force=np.zeros((rows, P)),
            contact_point=np.full((rows, P, 3), np.nan),
            section_force=np.zeros((rows, P, len(line.wires))),
            strip_height=np.zeros((rows, P)),
            uplift=np.zeros((rows, len(line.uplift_places))),
            dropper_force=np.zeros((rows, len(line.dropper_law.stiffness))),
            dropper_slack=np.zeros((rows, len(line.dropper_law.stiffness)), dtype=np.bool_),
        )


def _air(definition: LumpedDefinition) -> FloatArray:
    return np.array(definition.air_shares) * definition.aerodynamic_force(0.0)


def _points(result: ContactResult, strips: FloatArray) -> FloatArray:
    return np.array([application_point(*each) for each in zip(result.force, result.point, strips, strict=True)])

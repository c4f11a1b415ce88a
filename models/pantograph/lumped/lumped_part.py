"""A lumped pantograph between communication points."""

from __future__ import annotations

import math

import numpy as np

from models.arrays import FloatArray, Snapshot
from models.numerics.energy_ledger import NO_BALANCE
from models.numerics.extrapolation import ForceExtrapolation
from models.numerics.newmark import steps_within
from models.pantograph.excursions import Excursions, Place
from models.pantograph.lumped.compiled_step import CompiledStep, compiled_step
from models.pantograph.lumped.held_forces import HeldForces, held_forces
from models.pantograph.lumped.lumped_definition import LumpedDefinition
from models.pantograph.lumped.lumped_energy import LumpedBalance
from models.pantograph.lumped.lumped_model import LumpedModel, LumpedState
from models.pantograph.lumped.swaying_strip import SwayingStrip
from models.pantograph.operation import NO_DRIVE, NO_SWAY, Drive


class LumpedPantographPart:
    """A lumped pantograph between communication points.

    Parameters
    ----------
    definition : LumpedDefinition

    Attributes
    ----------
    outputs : ndarray, shape (12 + 3 n,)
        The strip, then what is observed.
    strip : ndarray, shape (2, 2, 3)
        End A (left), B (right); position, velocity; x, y, z.
    observed : tuple of (name, unit, description)
        What ``observation_values`` gives.
    told : list of str
        What the user should know of the steps so far; whoever fetches it empties it.
    """

    def __init__(self, definition: LumpedDefinition) -> None:
        self.definition = definition
        self.model = LumpedModel(definition)
        self.time = 0.0
        self._start_time = 0.0
        # What the model's transition takes: the motion mass by mass, then the load.
        n = self.model.size
        self._values = np.zeros(4 * n)
        self._motion, self._load = self._values[: 3 * n], self._values[3 * n :]
        self.state = LumpedState(self._motion[0::3], self._motion[1::3], self._motion[2::3])
        # A step changes x, z and z's velocity alone.
        half, y = 0.5 * definition.strip_length, definition.strip_offset
        self._train = definition.train_motion()
        velocity = [self._train.at(0.0).speed, 0.0, 0.0]
        self.outputs = np.zeros(12 + 3 * n)
        self.strip = self.outputs[:12].reshape(2, 2, 3)
        self.strip[...] = [[[0.0, y + side, 0.0], velocity] for side in (half, -half)]
        self._rest = np.array([definition.reference_height, 0.0, 0.0] * n)
        self._force = ForceExtrapolation(definition.extrapolation_order)
        self._base = np.zeros(2)
        self._roof = 0.0
        self._shares = np.array(definition.air_shares)
        held = held_forces(definition)
        # Loads that do not change in a step, and behind them the table of stops and friction, if there are any.
        self._own = np.zeros(n + held.size)
        self._own[n:] = held.ravel()
        self._held = HeldForces(self._own[n:].reshape(held.shape)) if held.size else None
        self._range = definition.range
        self._excursions = Excursions() if self._range != (-math.inf, math.inf) else None
        self.told: list[str] = [] if self._excursions is None else self._excursions.told
        self._has_met = False
        self._driven: tuple[float, float, float] | None = None  # what these loads are of
        self._sway = SwayingStrip(definition)
        self._balance: LumpedBalance | None = None
        self._compiled: CompiledStep | None = None
        self._steps_as_kernels = False
        self.observed = _observed(n)

    def initialise(
        self, time: float, force: float, point: FloatArray, base: FloatArray, drive: Drive = NO_DRIVE
    ) -> None:
        """Set the pantograph to rest at its reference height at ``time``.

        Parameters
        ----------
        force : float
            Contact force [N].
        point : ndarray, shape (3,)
            Its point of application [m]; unused by masses on a line.
        base : ndarray, shape (2,)
            Height and vertical velocity of the roof [m, m/s].
        drive : Drive
            What else acts.
        """
        del point
        self.time = self._start_time = time
        self._roof = float(base[0])
        self._has_met = False
        if self._excursions is not None:
            self._excursions.start()
        self.state.reference = self.definition.rise - self._roof
        self._train.begin(time, drive.train)
        load = self.model.load(0.0, base) + self._drive_loads(drive.air, drive.uplift, self._train.at(time).speed)
        if self.model.follows:  # the reference starts where the mass is
            load[0] -= self.definition.stage[0].stiffness * self._roof
        load[-1] -= force
        self._motion[:] = 0.0
        self._motion[0::3] = self.definition.rise
        self.state.acceleration[:] = self.model.initial_state(load).acceleration
        if self._held is not None:
            self._held.start(self._motion, self._roof)
        self._balance = LumpedBalance(self.model, load, force) if self.definition.monitor_energy else None
        self._force.start(time, force)
        self._sway.receive(drive, base, 0.0)
        self._compile()
        self._place()
        self._sway.place(self.strip)

    def step(self, force: float, point: FloatArray, base: FloatArray, step: float, drive: Drive = NO_DRIVE) -> None:
        """Advance by ``step`` [s] under a contact force received for its beginning (or its end, if it says so)."""
        start, x, count = self.time, point.item(0), steps_within(step, self.definition.time_step)
        self.time = start + step
        way = self._travel(start, step, drive)
        driven = drive.air, drive.uplift, way[1]
        if driven != self._driven:
            self._driven, self._own[: self.model.size] = driven, self._drive_loads(*driven)
        if drive.sway != NO_SWAY or not self._sway.is_still:
            self._sway.receive(drive, base, step)
        if self._compiled is not None:
            when, contact = (self._start_time, start, step), (force, x)
            hung = (self.state.reference, self._roof, drive.reference_rate)
            self.state.reference = self._compiled.step(
                self._values, when, count, contact, way, base, hung, self._own, self.outputs
            )
            self._roof = float(base[0]) + step * float(base[1])
            self._sway.place(self.strip)
            self._watch(force, point)
            return
        self._force.receive_at(start, force, x, way[0], way[1], step)
        h = step / count
        height, velocity = base.tolist()
        for k in range(1, count + 1):
            # Received for the step's beginning; the roof continues with its velocity.
            self._base[...] = height + k * h * velocity, velocity
            self._substep(start + k * h, h, drive.reference_rate)
        self._place()
        self._sway.place(self.strip)
        self._watch(force, point)

    @property
    def energy(self) -> FloatArray:
        """Return the values of `energy_ledger.BALANCE` [J], shape (4,); 0 if the balance is not kept."""
        return NO_BALANCE if self._balance is None else self._balance.balance(self.state)

    @property
    def contact_work(self) -> FloatArray:
        """Return the work of the strip against the contact [J], shape (1,); 0 if the balance is not kept."""
        return np.zeros(1) if self._balance is None else self._balance.contact_work

    def observation_values(self) -> FloatArray:
        """Return height, velocity and acceleration of every mass, shape (3 n,)."""
        return self.outputs[12:].copy()

    def snapshot(self) -> Snapshot:
        """Return the whole state, bit for bit."""
        if self._compiled is not None:
            self._compiled.give(self._force)
        return {
            "time": np.array([self.time, self._start_time]),
            "displacement": self.state.displacement.copy(),
            "velocity": self.state.velocity.copy(),
            "acceleration": self.state.acceleration.copy(),
            "reference": np.array([self.state.reference, self._roof]),
            **self._force.snapshot(),
            **({} if self._held is None else self._held.snapshot()),
            **self._sway.snapshot(),
            **self._train.snapshot(),
            **({} if self._balance is None else self._balance.snapshot()),
        }

    def restore(self, snapshot: Snapshot) -> None:
        """Take over a snapshot."""
        self.time, self._start_time = (float(t) for t in snapshot["time"])
        for name in ("displacement", "velocity", "acceleration"):
            getattr(self.state, name)[:] = snapshot[name]
        self.state.reference, self._roof = (float(v) for v in snapshot["reference"])
        self._force.restore(snapshot)
        if self._held is not None:
            self._held.restore(snapshot)
        if self._balance is not None:
            self._balance.restore(snapshot)
            self._balance.held = 0.0 if self._held is None else self._held.stored
        self._sway.restore(snapshot)
        self._train.restore(snapshot)
        self._compile()
        self._place()
        self._sway.place(self.strip)

    def _compile(self) -> None:
        """Let kernels make the steps, if there are any; they keep no balance."""
        if self._compiled is None and not self.definition.monitor_energy:
            self._compiled = compiled_step(self.model)
        elif self.definition.monitor_energy:
            self._steps_as_kernels = compiled_step(self.model) is not None
        if self._compiled is not None:
            self._compiled.take(self._force)

    def _substep(self, time: float, h: float, rate: float) -> None:
        load = self.model.load(time - self._start_time, self._base) + self._own[: self.model.size]
        force = self._force.at(time)
        load[-1] -= force
        outer = load.copy()
        before = self._motion.item(0) - self._roof
        if self.model.follows:
            self._hang(load, outer, before, h, rate)
        self._load[:] = load
        transition = self.model.transition(h)
        after = self._moved(transition)
        if self._held is not None:
            work, lifting = self._held.act(transition, after, (self._base.item(0), self._base.item(1)))
            if self._balance is not None:
                self._balance.add_held(work, self._held.stored, -lifting * (self._base.item(0) - self._roof))
        if self._balance is not None:
            self._balance.add(h, after[0::3] - self.state.displacement, outer, force)
        if self.model.follows:
            self._follow(before, float(after[0]) - self._base.item(0), h, rate)
        self._roof = self._base.item(0)
        self._motion[:] = after

    def _moved(self, transition: FloatArray) -> FloatArray:
        """Return the motion after a step; where kernels step while nobody watches, added up in their order."""
        if not self._steps_as_kernels:
            moved: FloatArray = transition.dot(self._values)
            return moved
        moved = np.zeros(len(transition))
        for column, value in zip(transition.T, self._values.tolist(), strict=True):
            moved += column * value
        return moved

    def _hang(self, load: FloatArray, outer: FloatArray, before: float, h: float, rate: float) -> None:
        """Let the lowest spring hang on the reference; its work is not that of an outer load."""
        stiffness, height = self.definition.stage[0].stiffness, self._base.item(0)
        load[0] += self.model.reference_load(self.state.reference, before, rate, h)
        load[0] -= stiffness * self.model.following(h).after * height
        outer[0] -= stiffness * height

    def _follow(self, before: float, after: float, h: float, rate: float) -> None:
        following = self.model.following(h)
        if self._balance is not None:
            motion, roof = (before - self.state.reference, (after - before) / h), (self._base.item(0) - self._roof) / h
            self._balance.add_reference(following.integrals(*motion, rate, h), roof + rate)
        self.state.reference = following.moved(self.state.reference, before, after, rate)
        if self._balance is not None:
            self._balance.stretch = after - self.state.reference

    def _travel(self, start: float, step: float, drive: Drive) -> tuple[float, float, float, float]:
        """Take how the train moves; return the way of a step, as `TrainMotion.way` does."""
        train = self._train
        if train.by_inputs:
            train.receive(start, drive.train, step)
            if train.told:
                self.told.append(train.told)
        return train.way(start, step)

    def _drive_loads(self, air: float, uplift: float, speed: float) -> FloatArray:
        """Return what the air and a force from outside load the masses with, shape (n,) [N]."""
        loads = self._shares * self.definition.aerodynamic_force(air, speed)
        loads[0] += uplift
        return loads

    def _watch(self, force: float, point: FloatArray) -> None:
        """Note stops that are touched, and a contact outside the range."""
        if self._excursions is None or self._held is None:
            return
        self._has_met |= force > 0.0
        x, height = self.outputs.item(0), self.definition.reference_height + self._motion.item(-3)
        if touched := self._held.touched():
            place, follows = Place(self.time, x, height), self.model.follows
            self._excursions.touch(touched, place, has_met=self._has_met, is_loaded=force > 0.0, is_neutral=follows)
        self._excursions.check_contact(force, Place(self.time, x, point.item(2)), *self._range)

    def _place(self) -> None:
        """Write the strip and what is observed."""
        outputs, height = self.outputs, self.definition.reference_height
        now = self._train.at(self.time)
        outputs[0:12:6], outputs[3:12:6] = now.x, now.speed
        outputs[2:12:6] = height + self._motion.item(-3)
        outputs[5:12:6] = self._motion.item(-2)
        np.add(self._motion, self._rest, out=outputs[12:])


def _observed(stages: int) -> tuple[tuple[str, str, str], ...]:
    kinds = (("z", "m", "height"), ("vz", "m/s", "vertical velocity"), ("az", "m/s2", "vertical acceleration"))
    return tuple(
        (f"mass[{i}].{key}", unit, f"{text} of mass {i}") for i in range(1, stages + 1) for key, unit, text in kinds
    )

"""A multibody pantograph between communication points."""

from __future__ import annotations

import math

import numpy as np

from models.arrays import FloatArray, Snapshot
from models.numerics.energy_ledger import NO_BALANCE
from models.numerics.extrapolation import ForceExtrapolation, lead_of
from models.pantograph.excursions import Place
from models.pantograph.multibody.analysis.cam_design import fit_force
from models.pantograph.multibody.analysis.posture import take_posture
from models.pantograph.multibody.base_motion import BaseMotion, LateralExtrapolation, SwayMotion
from models.pantograph.multibody.compiled.compiled_equations import compiled_equations
from models.pantograph.multibody.compiled.mechanism_tables import unknown_to_kernels
from models.pantograph.multibody.mechanism import Evaluation, Inputs, Mechanism, MechanismError
from models.pantograph.multibody.mechanism_advice import mechanism_warning, working_height_warning
from models.pantograph.multibody.mechanism_assembly import project
from models.pantograph.multibody.mechanism_definition import MechanismDefinition
from models.pantograph.multibody.mechanism_energy import MechanismBalance
from models.pantograph.multibody.mechanism_integrator import Advance, History, Integrator, ends_of_pieces
from models.pantograph.multibody.range_watch import RangeWatch
from models.pantograph.multibody.reduced.reduced_motion import ReducedMotion, reduced_if_possible
from models.pantograph.multibody.reduced.reduction import unsuitable_drive
from models.pantograph.multibody.step_memory import (
    LastEvaluation,
    beyond_response,
    history_snapshot,
    restored_history,
)
from models.pantograph.operation import NO_DRIVE, Drive, OperationError


class MultibodyPantographPart:
    """A multibody pantograph between communication points.

    At first it stands in its working configuration (the written one, assembled) with the strip at the reference
    height, held by the lifting value that balances the weights; the ramp of the raise leads from there to the full
    value. The base stands at the height above the rails that this takes, or where the definition says; the arms then
    take the angle that the reference height needs, or the start height.

    Parameters
    ----------
    definition : MechanismDefinition

    Attributes
    ----------
    time : float
        [s]
    strip : ndarray, shape (2, 2, 3)
        End A (left), B (right); position, velocity; x, y, z.
    observed : tuple of (name, unit, description)
        What ``observation_values`` gives.
    told : list of str
        What the user should know of the steps so far; whoever fetches it empties it.
    """

    def __init__(self, definition: MechanismDefinition) -> None:
        self.definition = definition
        self.observed = _observed(definition)
        self._lifted, self._holds = definition.lift, float(definition.holds_force)
        self._is_blown = definition.air_coefficient != 0.0
        self.time = 0.0
        self.strip = np.zeros((2, 2, 3))
        self.told: list[str] = []
        self._start_time = 0.0
        self._force = ForceExtrapolation(definition.extrapolation_order)
        self._lateral = LateralExtrapolation()
        self._base = BaseMotion()
        self._sway = SwayMotion()
        self._train = definition.train_motion()
        self._drive = NO_DRIVE
        self._y = np.zeros(0)
        self._last: LastEvaluation | None = None
        self._history: History | None = None
        self._substep = definition.time_step
        self._observation = np.zeros(len(self.observed))
        self._reduced: ReducedMotion | None = None  # in what form it moves: the general one if there is none
        self._is_shown = True
        self._ends = np.zeros((2, 2, 3))
        self._evaluation: Evaluation | None = None  # of the general form, at the end of the last step
        self._left = ""  # why it went on in the general form
        self._built: _Built | None = None
        self._balance: MechanismBalance | None = None

    def initialise(
        self, time: float, force: float, point: FloatArray, base: FloatArray, drive: Drive = NO_DRIVE
    ) -> None:
        """Set the pantograph to rest (on its roof) at its reference height at ``time``.

        Parameters
        ----------
        time : float
            [s]
        force : float
            Contact force [N].
        point : ndarray, shape (3,)
            Its point of application [m].
        base : ndarray, shape (2,)
            Height and vertical velocity of the roof [m, m/s].
        drive : Drive
            What else acts.

        Raises
        ------
        MechanismError
            If the mechanism cannot be assembled or balanced.
        """
        built = self._ready()
        self._take(drive)
        if built.watch is not None:
            built.watch.start()
        time, force = float(time), float(force)  # as in ``step``
        self.time = self._start_time = time
        self._force.start(time, force)
        self._lateral.start(time, float(point[1]))
        self._base.start(base)
        self._sway.start(drive.sway)
        self._train.begin(time, drive.train)
        self._substep = self.definition.time_step
        self._history = None
        self._left = unsuitable_drive(drive)
        self._reduced = None if self._left or built.reduced is None else ReducedMotion(built.reduced)
        if self._reduced is not None:
            self._reduced.begin(self._given())
            self._show_reduced()
            return
        built.compile()
        inputs = self._inputs(0.0)
        self._y = built.mechanism.standing_on(built.standing, inputs)
        self._remember(built.integrator.equations.evaluate(self._y, inputs, respond=True), inputs)
        watched = self.definition.monitor_energy
        self._balance = MechanismBalance(built.mechanism, self._y) if watched else None

    def step(self, force: float, point: FloatArray, base: FloatArray, step: float, drive: Drive = NO_DRIVE) -> None:
        """Advance by ``step`` [s].

        Parameters
        ----------
        force : float
            Contact force received for the beginning of the step (or its end, if its point says so) [N].
        point : ndarray, shape (3,)
            Its point of application [m].
        base : ndarray, shape (2,)
            Height and vertical velocity of the roof at the beginning of the step [m, m/s].
        step : float
            [s]
        drive : Drive
            What else acts, held over the step.

        Raises
        ------
        MechanismError
            If the motion becomes singular.
        """
        force, step = float(force), float(step)  # an array's scalar would make the whole step's arithmetic one of such
        built = self._ready()
        self._look(built, force, point)
        values = (force, *point.tolist(), *base.tolist(), *drive.sway, *drive.train, *drive[1:4])
        if not all(map(math.isfinite, values)):
            raise MechanismError(f"{self.definition.name}: an input at {self.time:.6g} s is not a number: {values}")
        self._take(drive)
        operation = self.definition
        speed = self._travel(drive, step)
        expected = 0.5 * (self.strip.item(0) + self.strip.item(6))
        self._force.receive_at(self.time, force, float(point[0]), expected, speed, step)
        self._receive_lateral(force, point, speed, expected, step)
        self._base.receive(base, step)
        self._sway.receive(drive.sway, step)
        if self._reduced is not None and self._step_reduced(self._reduced, step, drive):
            return
        elapsed = self.time - self._start_time
        raising = (operation.raise_start - elapsed, operation.raise_start + operation.raise_duration - elapsed)
        kinks = (*raising, *self._train.kinks(self.time))
        first, history = self._continuation(0.5 * ends_of_pieces(step, kinks)[0])
        done = built.integrator.advance(self._y, self._inputs, step, self._substep, kinks, first, history)
        self._account(step, first, done)
        self._y, self._substep, self._history = done.y, done.step, done.history
        self._base.finish(step)
        self._sway.finish(step)
        self.time += step
        self._remember(done.evaluation, done.inputs)

    def _look(self, built: _Built, force: float, point: FloatArray) -> None:
        """Note stops that are touched and ranges that are left as a step begins."""
        watch = built.watch
        if watch is None or not watch.is_due(self.time, force):
            return
        x, z = (0.5 * (self.strip.item(k) + self.strip.item(6 + k)) for k in (0, 2))
        watch.look_at_contact(force, Place(self.time, x, point.item(2)))
        if self._reduced is None:
            watch.look(self._y, Place(self.time, x, z), force)
        elif not self._reduced.is_free(*watch.cam_range):
            watch.look(self._reduced.posture(self._base.now), Place(self.time, x, z), force)
        self.told += watch.told
        watch.told.clear()

    @property
    def energy(self) -> FloatArray:
        """Return the values of `energy_ledger.BALANCE` [J], shape (4,); 0 if the balance is not kept."""
        return NO_BALANCE if self._balance is None else self._balance.balance(self._y)

    @property
    def contact_work(self) -> FloatArray:
        """Return the work of the strip against the contact [J], shape (1,); 0 if the balance is not kept."""
        return np.zeros(1) if self._balance is None else self._balance.contact_work

    def observation_values(self) -> FloatArray:
        """Return the values of ``observed``."""
        if not self._is_shown:
            self._observe()
        return self._observation.copy()

    def working_height_warning(self, x: float, z: float) -> str:
        """Say so if the wire above the start, at (x, z) [m], is higher than the lifting value is for."""
        built = self._ready()
        return working_height_warning(built.mechanism, built.reference, x, z)

    def mechanism_warning(self) -> str:
        """Say so if the mechanism has motions too many, or some that grow."""
        built = self._ready()
        return mechanism_warning(built.mechanism, built.reference)

    @property
    def state(self) -> FloatArray:
        """State of the bodies, shape (13 n,); see `Mechanism`."""
        return self._y if self._reduced is None else self._reduced.cartesian(self._base.now)

    def form(self) -> str:
        """Say in which form the equations of motion are solved, and why if it is the general one."""
        built = self._ready()
        text = f"general form of the equations of motion: {self._left}" if self._left else built.form
        unknown = unknown_to_kernels(built.mechanism) if self._left or built.reduced is None else ""
        return f"{text}; without kernels, which know no {unknown}" if unknown else text

    def snapshot(self) -> Snapshot:
        """Return the whole state, bit for bit."""
        return {
            "time": np.array([self.time, self._start_time]),
            "state": self._y.copy(),
            "substep": np.array([self._substep]),
            "strip": self.strip.copy(),
            "observation": self.observation_values(),
            **({} if self._reduced is None else self._reduced.snapshot()),
            **(self._last.snapshot() if self._last is not None else {}),
            **(history_snapshot(self._history) if self._history is not None else {}),
            **self._force.snapshot(),
            **self._lateral.snapshot(),
            **self._base.snapshot(),
            **self._sway.snapshot(),
            **self._train.snapshot(),
            **({} if self._balance is None else self._balance.snapshot()),
        }

    def restore(self, snapshot: Snapshot) -> None:
        """Take over a snapshot."""
        self.time, self._start_time = (float(t) for t in snapshot["time"])
        self._y = snapshot["state"].astype(np.float64)
        self._substep = float(snapshot["substep"][0])
        self.strip[...] = snapshot["strip"]
        self._observation[...] = snapshot["observation"]
        self._last = LastEvaluation.restored(snapshot)
        self._history = restored_history(snapshot)
        self._is_shown = True
        self._reduced = self._restored_motion(snapshot)
        if self._reduced is None:
            self._ready().compile()
        went_on = self._reduced is None and self._ready().reduced is not None
        self._left = self._left or "the state that was restored is in it" if went_on else ""
        self._force.restore(snapshot)
        self._lateral.restore(snapshot)
        self._base.restore(snapshot)
        self._sway.restore(snapshot)
        self._train.restore(snapshot)
        if self._balance is not None:
            self._balance.restore(snapshot)

    def _restored_motion(self, snapshot: Snapshot) -> ReducedMotion | None:
        """Return the motion that a snapshot holds; None: it went on in the general form."""
        built = self._ready()
        if built.reduced is None or "reduced" not in snapshot:
            return None
        motion = ReducedMotion(built.reduced)
        motion.restore(snapshot)
        return motion

    def _step_reduced(self, motion: ReducedMotion, step: float, drive: Drive) -> bool:
        """Advance in the reduced form; False if that ends here and the general form has to take over."""
        reason = unsuitable_drive(drive)
        if not reason:
            reason = motion.step(self._given(), step)
        if reason:
            self._ready().compile()
            self._y = motion.cartesian(self._base.now)
            self._reduced, self._left, self._is_shown = None, f"from {self.time:.6g} s on, {reason}", True
            self._last, self._history, self._substep = None, None, self.definition.time_step
            return False
        self._base.finish(step)
        self.time += step
        self._show_reduced()
        return True

    def _given(self) -> list[float]:
        """Return the inputs of a step as the reduced form takes them; see `ReducedMotion.step`."""
        operation, force, lateral, drive = self.definition, self._force, self._lateral, self._drive
        uplift = drive.uplift
        if self._is_blown:
            uplift += operation.aerodynamic_force(drive.air, self._train.at(self.time).speed)
        return [
            self.time, self._start_time,
            force.known, *force.times, *force.values, force.order,
            lateral.values[0], lateral.rate, lateral.times[0],
            *self._base.cubic.tolist(),
            self._ready().balance, self._lifted, operation.raise_start, operation.raise_duration,
            uplift, self._holds,
        ]  # fmt: skip

    def _show_reduced(self) -> None:
        """Bring the strip up to the state; what is observed waits until somebody asks."""
        assert self._reduced is not None
        built, travel = self._ready(), self._train.at(self.time)
        z, vz = self._base.now.tolist()
        self._reduced.place_strip((travel.x - built.strip_x, z + built.base_height, travel.speed, vz), self.strip)
        self._is_shown = False

    def _observe(self) -> None:
        """Bring what is observed up to the state."""
        self._is_shown = True
        if self._reduced is not None:
            self._observe_reduced(self._reduced)
        elif self._evaluation is not None:
            self._observe_general(self._evaluation)

    def _observe_reduced(self, motion: ReducedMotion) -> None:
        built, base = self._ready(), self._base
        z, vz = base.now.tolist()
        bodies = motion.bodies((z + built.base_height, vz, motion.base_acceleration))
        held = (motion.lift[0],) if self._holds else ()
        self._observation[: bodies.size] = bodies.ravel()
        self._observation[bodies.size :] = (*self._seen(self.strip), motion.lift_value(), *held, 0.0, 0.0)

    def _seen(self, ends: FloatArray) -> tuple[float, float, float]:
        """Return roll, roll rate, and place of the contact along the strip for its ends, shape (2, 2, 3)."""
        across = ends[0] - ends[1]
        length2 = float(across[0] @ across[0])
        roll = math.atan2(across[0, 2], across[0, 1])
        roll_rate = float(across[1, 2] * across[0, 1] - across[1, 1] * across[0, 2]) / length2
        middle = 0.5 * float(ends[0, 0, 1] + ends[1, 0, 1])
        # Along the strip, which may roll and yaw.
        offset = (self._lateral.at(self.time) - middle) * math.sqrt(length2) / max(float(across[0, 1]), 1e-9)
        return roll, roll_rate, offset

    def _ready(self) -> _Built:
        if self._built is None:
            self._built = _Built(self.definition)
        return self._built

    def _remember(self, evaluation: Evaluation, inputs: Inputs) -> None:
        """Keep the equations of motion at the end of a step: they begin the next one."""
        self._last = LastEvaluation(evaluation.acceleration, evaluation.response, inputs)
        self._evaluation = evaluation
        self._show()

    def _account(self, step: float, first: FloatArray | None, done: Advance) -> None:
        """Add a step to the energy balance, if it is kept."""
        if self._balance is None:
            return
        if first is None:
            first = self._ready().integrator.equations.evaluate(self._y.copy(), self._inputs(0.0)).rates
        self._balance.add(step, (self._y, first), (done.y, done.evaluation.rates), self._inputs)

    def _continuation(self, inside: float) -> tuple[FloatArray | None, History | None]:
        """Return the rates at the step's beginning under the inputs just received, and those before as if these had
        acted, as far as they follow from the last inputs; ``inside`` is a time in the step's first piece.
        """
        last, inputs, history = self._last, self._inputs(0.0, inside), self._history
        if last is None or beyond_response(last.inputs) != beyond_response(inputs):
            return None, None
        equations = self._ready().integrator.equations
        first, change = equations.with_inputs(self._y, last.acceleration, last.response, last.inputs, inputs)
        if history is not None:
            history = History(history.step, history.middle + change, history.begin + change)
        return first, history

    def _travel(self, drive: Drive, step: float) -> float:
        """Take how the train moves; return its speed within the step [m/s]."""
        self._train.receive(self.time, drive.train, step)
        if self._train.told:
            self.told.append(self._train.told)
        return self._train.at(self.time + 0.5 * step).speed

    def _receive_lateral(self, force: float, point: FloatArray, speed: float, expected: float, step: float) -> None:
        """Follow the contact point across the strip while there is contact."""
        time = self.time + lead_of(float(point[0]), expected, speed, step)
        if force > 0.0:
            self._lateral.receive(time, float(point[1]))
        else:
            self._lateral.start(time, float(point[1]))

    def _inputs(self, tau: float, inside: float | None = None) -> Inputs:
        """Return what acts ``tau`` [s] after the beginning of the step, in the piece that another time lies in."""
        built, drive, time = self._ready(), self._drive, self.time + tau
        within = time if inside is None else self.time + inside
        force = self._force.at(time)
        _, speed, pull = self._train.at(time, within)
        lift, uplift = self._lift(time, within), drive.uplift
        if self._is_blown:
            uplift = self.definition.aerodynamic_force(drive.air, speed) + uplift
        if self._holds:
            lift, uplift = lift + uplift, 0.0
        driven = drive.lift if self.definition.lift_input else None
        against = speed - drive.air if built.mechanism.forces.air.count else 0.0
        return Inputs(
            self._base.at(tau), lift, force, self._lateral.at(time), uplift, self._sway.at(tau), pull, against, driven
        )

    def _take(self, drive: Drive) -> None:
        """Take what acts besides contact and roof.

        Raises
        ------
        OperationError
            If a force is added to a lift that is set directly.
        """
        self._drive, definition = drive, self.definition
        if definition.lift_input:
            if drive.uplift != 0.0:
                raise OperationError(
                    f"{definition.name}: uplift_force is {drive.uplift:g} N, but with lift_input = 1 the input "
                    "lift.value replaces all that lifts: add it there, or set lift_input to 0"
                )
        elif drive.uplift != 0.0 or definition.air_coefficient != 0.0:
            built = self._ready()
            fit_force(built.mechanism, built.reference)

    def _lift(self, time: float, within: float) -> float:
        built = self._ready()
        jumps = self.definition.raise_duration == 0.0
        share = self.definition.raised((within if jumps else time) - self._start_time)
        return built.balance + share * (self._lifted - built.balance)

    def _show(self) -> None:
        """Bring the strip up to the state; what is observed waits until somebody asks."""
        built, travel = self._ready(), self._train.at(self.time)
        self._ends = built.integrator.equations.strip_ends(self._y)
        self.strip[...] = self._ends
        self.strip[:, 0, 0] += travel.x - built.strip_x
        self.strip[:, 0, 2] += built.base_height
        self.strip[:, 1, 0] += travel.speed
        self._is_shown = False

    def _observe_general(self, evaluation: Evaluation) -> None:
        built = self._ready()
        mechanism = built.mechanism
        s, free = mechanism.split(self._y), slice(mechanism.driven, None)
        bodies = np.stack([s.r[free, 2] + built.base_height, s.v[free, 2], evaluation.acceleration[free, 2]], axis=1)
        values = evaluation.constraints
        acting = self._inputs(0.0) if self._last is None else self._last.inputs
        held = (mechanism.held_force(self._y, acting),) if self._holds else ()
        own = (
            *self._seen(self._ends),
            mechanism.lift_value(self._y, acting),
            *held,
            np.abs(values.violation).max(initial=0.0),
            np.abs(values.rate).max(initial=0.0),
        )
        self._observation[: bodies.size] = bodies.ravel()
        self._observation[bodies.size :] = own


class _Built:
    """What is worked out once: the mechanism, where it stands, what balances it."""

    def __init__(self, definition: MechanismDefinition) -> None:
        if definition.strip is None:
            raise MechanismError(f"{definition.name}: a pantograph needs a [strip]")
        self.mechanism = Mechanism(definition)
        self.integrator = Integrator(self.mechanism, definition.tolerance, definition.time_step)
        posture = take_posture(self.mechanism)
        self.standing = project(self.mechanism, posture.start.y)
        self.reference = posture.reference
        self.balance = posture.start.lift
        self.base_height = posture.base_height
        self.watch = RangeWatch.over(self.mechanism, self.standing, self.base_height)
        self.reduced, self.form = reduced_if_possible(self.mechanism, self.standing)
        self.strip_x = float(self.mechanism.strip_ends(self.standing)[:, 0, 0].mean())
        self._is_compiled = False

    def compile(self) -> None:
        """Have the general form in kernels, if there are any."""
        if not self._is_compiled:
            self._is_compiled = True
            compiled = compiled_equations(self.mechanism, self.standing)
            self.integrator.equations = compiled or self.integrator.equations


def _observed(definition: MechanismDefinition) -> tuple[tuple[str, str, str], ...]:
    kinds = (("z", "m", "height"), ("vz", "m/s", "vertical velocity"), ("az", "m/s2", "vertical acceleration"))
    bodies = [
        (f"{b.name}.{key}", unit, f"{text} of the centre of mass of {b.name}")
        for b in definition.bodies
        if b.name not in definition.driven
        for key, unit, text in kinds
    ]
    held = (("uplift.force", "N", "force on the strip that the cam holds"),) if definition.holds_force else ()
    return (
        *bodies,
        ("strip.roll", "rad", "roll of the collector strip, left end up"),
        ("strip.roll_rate", "rad/s", "roll rate of the collector strip"),
        ("strip.contact_y", "m", "contact point on the strip, from its middle to the left"),
        ("lift.moment", "N.m", "lifting moment")
        if definition.lifts_by_moment
        else ("lift.force", "N", "lifting force"),
        *held,
        ("joints.violation", "m", "largest constraint violation"),
        ("joints.violation_rate", "m/s", "largest rate of constraint violation"),
    )

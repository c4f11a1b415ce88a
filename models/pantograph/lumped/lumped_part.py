"""A lumped pantograph between communication points."""

from __future__ import annotations

import numpy as np

from models.arrays import FloatArray, Snapshot
from models.numerics.energy_ledger import NO_BALANCE
from models.numerics.extrapolation import ForceExtrapolation
from models.numerics.newmark import steps_within
from models.pantograph.lumped.lumped_definition import LumpedDefinition
from models.pantograph.lumped.lumped_energy import LumpedBalance
from models.pantograph.lumped.lumped_model import LumpedModel, LumpedState


class LumpedPantographPart:
    """A lumped pantograph between communication points.

    Parameters
    ----------
    definition : LumpedDefinition

    Attributes
    ----------
    strip : ndarray, shape (2, 2, 3)
        End A (left), B (right); position, velocity; x, y, z.
    observed : tuple of (name, unit, description)
        What ``observation_values`` gives.
    """

    def __init__(self, definition: LumpedDefinition) -> None:
        self.definition = definition
        self.model = LumpedModel(definition)
        self.state = self.model.initial_state()
        self.time = 0.0
        self._start_time = 0.0
        # A step changes x, z and z's velocity alone.
        half, y = 0.5 * definition.strip_length, definition.strip_offset
        velocity = [definition.speed, 0.0, 0.0]
        self.strip = np.array([[[0.0, y + side, 0.0], velocity] for side in (half, -half)])
        self._force = ForceExtrapolation(definition.extrapolation_order)
        self._base = np.zeros(2)
        self._balance: LumpedBalance | None = None
        self.observed = _observed(len(definition.stage))

    def initialise(self, time: float, force: float, point: FloatArray, base: FloatArray) -> None:
        """Set the pantograph to rest at its reference height at ``time``.

        Parameters
        ----------
        force : float
            Contact force [N].
        point : ndarray, shape (3,)
            Its point of application [m]; unused by masses on a line.
        base : ndarray, shape (2,)
            Height and vertical velocity of the roof [m, m/s].
        """
        del point
        self.time = self._start_time = time
        load = self.model.load(0.0, base)
        load[-1] -= force
        self.state = self.model.initial_state(load)
        self._balance = LumpedBalance(self.model, load, force) if self.definition.monitor_energy else None
        self._force.start(time, force)
        self._base[...] = base
        self._place_strip()

    def step(self, force: float, point: FloatArray, base: FloatArray, step: float) -> None:
        """Advance by ``step`` [s] under a contact force received for its beginning (or its end, if it says so)."""
        self._force.receive_at(self.time, force, point.item(0), self._x(self.time), self.definition.speed, step)
        count = steps_within(step, self.definition.time_step)
        start, h = self.time, step / count
        height, velocity = base.tolist()
        for k in range(1, count + 1):
            # Received for the step's beginning; the roof continues with its velocity.
            self._base[...] = height + k * h * velocity, velocity
            self._substep(start + k * h, h)
        self.time = start + step
        self._place_strip()

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
        values = np.empty((self.model.size, 3))
        np.add(self.definition.reference_height, self.state.displacement, out=values[:, 0])
        values[:, 1] = self.state.velocity
        values[:, 2] = self.state.acceleration
        return values.ravel()

    def snapshot(self) -> Snapshot:
        """Return the whole state, bit for bit."""
        return {
            "time": np.array([self.time, self._start_time]),
            "displacement": self.state.displacement.copy(),
            "velocity": self.state.velocity.copy(),
            "acceleration": self.state.acceleration.copy(),
            "base": self._base.copy(),
            **self._force.snapshot(),
            **({} if self._balance is None else self._balance.snapshot()),
        }

    def restore(self, snapshot: Snapshot) -> None:
        """Take over a snapshot."""
        self.time, self._start_time = (float(t) for t in snapshot["time"])
        self.state = LumpedState(
            *(np.array(snapshot[n], dtype=np.float64) for n in ("displacement", "velocity", "acceleration"))
        )
        self._base[...] = snapshot["base"]
        self._force.restore(snapshot)
        if self._balance is not None:
            self._balance.restore(snapshot)
        self._place_strip()

    def _substep(self, time: float, h: float) -> None:
        load = self.model.load(time - self._start_time, self._base)
        force = self._force.at(time)
        load[-1] -= force
        before = self.state.displacement
        self.model.advance(self.state, h, self.model.free_response(self.state, h, load))
        if self._balance is not None:
            self._balance.add(h, self.state.displacement - before, load, force)

    def _x(self, time: float) -> float:
        return self.definition.start_position + self.definition.speed * (time - self._start_time)

    def _place_strip(self) -> None:
        d = self.definition
        height, velocity = d.reference_height + self.state.displacement.item(-1), self.state.velocity.item(-1)
        self.strip[:, 0, 0] = self._x(self.time)
        self.strip[:, 0, 2] = height
        self.strip[:, 1, 2] = velocity


def _observed(stages: int) -> tuple[tuple[str, str, str], ...]:
    kinds = (("z", "m", "height"), ("vz", "m/s", "vertical velocity"), ("az", "m/s2", "vertical acceleration"))
    return tuple(
        (f"mass[{i}].{key}", unit, f"{text} of mass {i}") for i in range(1, stages + 1) for key, unit, text in kinds
    )

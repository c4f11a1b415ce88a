"""The energy balance of a mechanism; see `models.numerics.energy_ledger`.

Joints do no work, so its kinetic energy changes by the work of all other forces on the bodies: that is the
balance, and its drift the error of the integration and of the sums. What the energy of weights and springs does not
account for in this work, dampers and friction have taken (and bushings, whose energy is not counted).

Powers are integrated by Simpson's rule, with the middle of a step from the cubic through its ends.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from models.arrays import FloatArray, Snapshot
from models.numerics.energy_ledger import Ledger
from models.pantograph.multibody.mechanism import Inputs, Mechanism


class _Power(NamedTuple):
    """Power of all forces on the free bodies, of those from outside, and of the strip on the contact [W]."""

    total: float
    outer: float
    contact: float


class MechanismBalance:
    """Add up, step by step, what the forces on a mechanism do.

    Parameters
    ----------
    mechanism : Mechanism
    y : ndarray, shape (13 n,)
        State at the beginning.
    """

    def __init__(self, mechanism: Mechanism, y: FloatArray) -> None:
        self._mechanism = mechanism
        self._ledger = Ledger(np.zeros(1))
        self._start = np.array([mechanism.energy(y), mechanism.kinetic(y)])
        self._total = 0.0

    @property
    def contact_work(self) -> FloatArray:
        """Return the work that the strip has done against the contact [J], shape (1,)."""
        return self._ledger.at_contact

    def add(
        self, step: float, begin: tuple[FloatArray, FloatArray], end: tuple[FloatArray, FloatArray],
        inputs_at: Callable[[float], Inputs],
    ) -> None:  # fmt: skip
        """Add a step.

        Parameters
        ----------
        step : float
            [s]
        begin, end : (ndarray, ndarray)
            States and their rates, each of shape (13 n,).
        inputs_at : callable
            Inputs at a time from the beginning of the step.
        """
        (y, rate), (new, new_rate) = begin, end
        middle = 0.5 * (y + new) + (step / 8.0) * (rate - new_rate)
        self._mechanism.place_base(middle, inputs_at(0.5 * step))
        powers = [self._power(state, inputs_at(t)) for t, state in ((0.0, y), (0.5 * step, middle), (step, new))]
        total, outer, contact = (np.array([1.0, 4.0, 1.0]) @ np.array(powers) * (step / 6.0)).tolist()
        self._total += total
        self._ledger.work += outer
        self._ledger.at_contact += contact

    def balance(self, y: FloatArray) -> FloatArray:
        """Return the values of `models.numerics.energy_ledger.BALANCE` [J], shape (4,); y has shape (13 n,)."""
        stored, kinetic = self._mechanism.energy(y) - self._start[0], self._mechanism.kinetic(y) - self._start[1]
        self._ledger.dissipated = self._ledger.work - (stored - kinetic) - self._total
        return self._ledger.balance(stored)

    def snapshot(self) -> Snapshot:
        """Return the whole state."""
        return self._ledger.snapshot() | {"energy.start": self._start.copy(), "energy.total": np.array([self._total])}

    def restore(self, snapshot: Snapshot) -> None:
        """Take over a snapshot."""
        self._ledger.restore(snapshot)
        self._start[...] = snapshot["energy.start"]
        self._total = float(snapshot["energy.total"][0])

    def _power(self, y: FloatArray, inputs: Inputs) -> _Power:
        mechanism = self._mechanism
        kinematics = mechanism.kinematics(y, inputs)
        vectors, state = mechanism.pool.evaluate(kinematics), mechanism.split(y)
        turning = (kinematics.frames[:, :3] @ state.w[:, :, None])[:, :, 0]
        motion = np.concatenate([state.v, turning], axis=1)
        loads = mechanism.loads(y, kinematics, inputs, vectors)
        unlifted = mechanism.loads(y, kinematics, inputs, vectors, lifted=False)
        by_body = (loads * motion).sum(axis=1)
        contact = 0.0
        if inputs.force != 0.0:
            strip = mechanism.strip_body
            contact = -float(mechanism.contact_load(y, inputs, kinematics.frames[strip, :3]) @ motion[strip])
        lift = float(((loads - unlifted) * motion).sum())
        free, joints = float(by_body[mechanism.driven :].sum()), mechanism.power_of_base(y, inputs)
        # What the base is loaded with; its own weight is nobody's here, as in the energy that is stored.
        on_base = loads[: mechanism.driven].copy()
        on_base[:, 2] += mechanism.definition.gravity * mechanism.mass[: mechanism.driven]
        outer = lift - contact + joints - float((on_base * motion[: mechanism.driven]).sum())
        if inputs.pull != 0.0 or inputs.against != 0.0:
            travel = np.zeros_like(loads)
            mechanism.add_travel_loads(travel, kinematics, inputs)
            outer += float((travel * motion)[mechanism.driven :].sum())
        return _Power(free + joints, outer, contact)

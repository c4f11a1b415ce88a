"""The energy balance of a lumped pantograph; see `models.numerics.energy_ledger`."""

from __future__ import annotations

import numpy as np

from models.arrays import FloatArray, Snapshot
from models.numerics.energy_ledger import Ledger
from models.pantograph.lumped.lumped_model import LumpedModel, LumpedState


class LumpedBalance:
    """Add up, step by step, the work of all loads on the masses and what the dampers take.

    Energy counts from where the pantograph starts, at rest; the roof's motion is a load. A lowest spring that hangs
    on a reference is counted apart: what it stores, what the reference takes in following, what moves it and the roof
    do.

    Parameters
    ----------
    model : LumpedModel
    load : ndarray, shape (n,)
        Load on the masses at the beginning, the contact force included [N].
    force : float
        Contact force at the beginning [N].

    Attributes
    ----------
    stretch : float
        Of a lowest spring that hangs on a reference, as it is [m].
    held : float
        What the springs of stops and friction store [J].
    """

    def __init__(self, model: LumpedModel, load: FloatArray, force: float) -> None:
        self._model = model
        self._load, self._force = load.copy(), force
        self._ledger = Ledger(np.zeros(1))
        self._stiffness = model.K.copy()
        self._hung = model.definition.stage[0].stiffness if model.follows else 0.0
        self._stiffness[0, 0] -= self._hung
        self.stretch = self.held = 0.0
        # A spring on the roof is stretched where the strip starts elsewhere than at the reference height.
        self._at_start = float(self._stiffness.sum()) * model.definition.rise**2

    @property
    def contact_work(self) -> FloatArray:
        """Return the work that the strip has done against the contact [J], shape (1,)."""
        return self._ledger.at_contact

    def add(self, step: float, change: FloatArray, load: FloatArray, force: float) -> None:
        """Add a step.

        Parameters
        ----------
        step : float
            [s]
        change : ndarray, shape (n,)
            What the displacements have changed by [m].
        load : ndarray, shape (n,)
            Load at its end, the contact force included [N].
        force : float
            Contact force at its end [N].
        """
        ledger = self._ledger
        ledger.work += 0.5 * float(change @ (self._load + load))
        ledger.dissipated += float(change @ self._model.C @ change) / step
        ledger.at_contact += 0.5 * (self._force + force) * change[-1]
        self._load, self._force = load, force

    def add_reference(self, integrals: tuple[float, float], rate: float) -> None:
        """Add what the lowest spring does in a step if it hangs on a reference that follows the height.

        Parameters
        ----------
        integrals : (float, float)
            Of its stretch and of the stretch's square over the step [m.s, m2.s].
        rate : float
            Of the roof and of the reference, as given from outside, together [m/s].
        """
        first, second = integrals
        self._ledger.work -= self._hung * rate * first
        self._ledger.dissipated += self._hung / self._model.definition.reference_time * second

    def add_held(self, work: float, stored: float, by_roof: float) -> None:
        """Add the work that stops and friction take in a step, what their springs store at its end, and the work of a
        roof that moves against them [J].
        """
        self._ledger.dissipated += work - (stored - self.held)
        self._ledger.work += by_roof
        self.held = stored

    def balance(self, state: LumpedState) -> FloatArray:
        """Return the values of `models.numerics.energy_ledger.BALANCE` [J], shape (4,)."""
        d, v, model = state.displacement, state.velocity, self._model
        stored = v @ model.M @ v + d @ self._stiffness @ d + self._hung * self.stretch**2 - self._at_start
        return self._ledger.balance(0.5 * float(stored) + self.held)

    def snapshot(self) -> Snapshot:
        """Return the whole state."""
        return self._ledger.snapshot() | {
            "energy.load": self._load.copy(),
            "energy.force": np.array([self._force, self.stretch]),
        }

    def restore(self, snapshot: Snapshot) -> None:
        """Take over a snapshot."""
        self._ledger.restore(snapshot)
        self._load = snapshot["energy.load"].astype(np.float64)
        self._force, self.stretch = (float(v) for v in snapshot["energy.force"])

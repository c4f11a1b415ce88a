"""The energy balance of a part: the energy supplied must equal the energy stored and dissipated.

The trapezoidal rule keeps this balance exactly: over a step of length h, with the change of displacement d,

    E_n+1 - E_n = d . (f_n + f_n+1) / 2 - d . C d / h

whatever the forces f are. So the drift, the error of the balance, is rounding; a larger one means that something other
than a force has changed the state.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.arrays import FloatArray, Snapshot

#: Names of the values of a balance, and their meaning.
BALANCE = (
    ("stored", "kinetic and elastic energy, from the static state"),
    ("dissipated", "energy lost in dampers"),
    ("work", "work of all outer forces"),
    ("drift", "stored and dissipated energy minus work: what the balance is off by"),
)
#: The values where no balance is kept: zeros, as hosts and comparisons of states do not cope with NaN.
NO_BALANCE = np.zeros(len(BALANCE))


@dataclass
class Ledger:
    """Sums over all steps so far.

    Attributes
    ----------
    at_contact : ndarray, shape (P,)
        Work done by the strip at each contact [J].
    work, dissipated : float
        Work of the outer forces, and energy dissipated [J].
    """

    at_contact: FloatArray
    work: float = 0.0
    dissipated: float = 0.0

    def balance(self, stored: float) -> FloatArray:
        """Return the values of `BALANCE` [J], shape (4,), for a stored energy [J].

        Examples
        --------
        >>> Ledger(np.zeros(1), work=5.0, dissipated=2.0).balance(3.5).tolist()
        [3.5, 2.0, 5.0, 0.5]
        """
        return np.array([stored, self.dissipated, self.work, stored + self.dissipated - self.work])

    def snapshot(self) -> Snapshot:
        """Return the sums."""
        return {"energy.sums": np.array([self.work, self.dissipated, *self.at_contact])}

    def restore(self, snapshot: Snapshot) -> None:
        """Take over the sums of a snapshot."""
        self.work, self.dissipated, *at_contact = snapshot["energy.sums"].tolist()
        self.at_contact[...] = at_contact

"""Forces of the air on bodies: a coefficient times the square of the speed against the air."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from models.arrays import FloatArray
from models.pantograph.multibody.elements.rotations import cross
from models.pantograph.multibody.mechanism_definition import Aerodynamic


class AirForces:
    """The aerodynamic force elements of a mechanism.

    Parameters
    ----------
    forces : sequence of Aerodynamic
    numbers : dict
        Body name -> number.
    """

    def __init__(self, forces: Sequence[Aerodynamic], numbers: dict[str, int]) -> None:
        self.count = len(forces)
        self._bodies = np.array([numbers[f.body] for f in forces], dtype=np.int64)
        self._points = np.array([f.point for f in forces]).reshape(-1, 3, 1)
        self._per_square = np.array([[f.coefficient * d for d in f.direction] for f in forces]).reshape(-1, 3)

    def table(self) -> FloatArray:
        """Return body, point and force per square of the speed of every element, 7 numbers."""
        return np.column_stack([self._bodies, self._points[:, :, 0], self._per_square])

    def add_loads(self, loads: FloatArray, frames: FloatArray, against: float) -> None:
        """Add the forces at a speed against the air [m/s] to loads of shape (n, 6); frames have shape (n, 9, 3)."""
        force = self._per_square * (abs(against) * against)
        levers = (frames[self._bodies, :3] @ self._points)[:, :, 0]
        np.add.at(loads, self._bodies, np.concatenate([force, cross(levers, force)], axis=1))

"""Stops and friction of a pantograph that is solved together with the line.

While every stop is open, closed or just left, and every friction sticks or slips, the force of each follows linearly
from where the masses go, and so does what is left for the contact force: a free response and a compliance of the strip.
How they are is supposed, the contact force found for that, and then each law asked whether it was so.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from models.arrays import FloatArray
from models.pantograph.lumped.held_forces import (
    FORCE,
    GAP,
    IS_FRICTION,
    LOWER,
    PLACE,
    SECOND,
    SIDE,
    STIFFNESS,
    UPPER,
    HeldForces,
    held_forces,
)
from models.pantograph.lumped.lumped_model import LumpedModel, LumpedState

#: Difference between a force supposed and the one that its law gives, that is none [N].
_SAME: Final = 1e-7
#: A friction within this share of its limit slips.
_SLIPS: Final = 1.0 - 1e-12
#: How far beyond its begin a stop still leaves a mass at its edge [m], and the stiffness that holds it there [N/m].
_AT_THE_EDGE: Final = 1e-12
_RIGID: Final = 1e12


class HeldCoupling:
    """Stops and friction of one pantograph within steps of the coupled system.

    Parameters
    ----------
    model : LumpedModel
    state : LumpedState
        Where it begins, on a roof at rest.
    """

    def __init__(self, model: LumpedModel, state: LumpedState) -> None:
        self._model = model
        self._rows = held_forces(model.definition)
        HeldForces(self._rows).start(_motion(state.displacement, state.velocity, state.acceleration), 0.0)
        self._acting = self._rows[:, FORCE].copy()  # at the end of a step as it was supposed
        self._found = self._acting  # then, by their laws
        self._follows = np.zeros(len(self._rows))  # force per displacement that each is supposed to follow with [N/m]
        self._join = np.zeros((len(self._rows), model.size))
        for k, row in enumerate(self._rows):
            self._join[k, int(row[UPPER])] = 1.0
            if row[LOWER] >= 0.0:
                self._join[k, int(row[LOWER])] = -1.0

    def __len__(self) -> int:
        return len(self._rows)

    def begin(self, state: LumpedState, step: float, free: FloatArray) -> None:
        """Begin a step [s] in which the masses would go to ``free``, shape (n,) [m], without these and the contact."""
        inverse, per_velocity = self._model.compliances(step)
        self._yield = inverse @ self._join.T  # of the masses per force
        self._give = self._join @ self._yield  # of what the forces join
        self._strip_yield = self._join @ inverse[:, -1]
        self._free = self._join @ free
        speed = self._model.velocity_of(state, step, free)
        self._free_speed, self._per_velocity = self._join @ speed, per_velocity
        self._suppose(self._rows[:, FORCE].copy(), self._rows[:, PLACE])

    def response(self) -> tuple[FloatArray, FloatArray]:
        """Return by how much the masses fall for these forces as supposed, and per contact force, shape (n,) each."""
        own, per_force = self._forces()
        return self._yield @ own, self._yield @ per_force

    def holds(self, force: float) -> bool:
        """Ask every law for its force under a contact force [N]; return whether it is the one supposed.

        If it is not, that is supposed from now on.
        """
        own, per_force = self._forces()
        self._acting = own + force * per_force
        found, pair = self._by_their_laws(force)
        self._suppose(found, pair - self._give @ found)
        return bool(np.abs(found - self._acting).max(initial=0.0) <= _SAME)

    def fix(self) -> None:
        """Suppose the forces found last, whatever the contact does."""
        self._follows[:], self._values = 0.0, self._found.copy()

    def end(self, displacement: FloatArray) -> None:
        """Keep the forces, and where the masses are at the end of the step, shape (n,) [m]."""
        self._rows[:, FORCE], self._rows[:, PLACE] = self._acting, self._join @ displacement

    def _forces(self) -> tuple[FloatArray, FloatArray]:
        """Return the forces supposed without contact force, and what they become per one."""
        right = np.stack([self._values + self._follows * self._free, -self._follows * self._strip_yield], axis=1)
        found = np.linalg.solve(np.eye(len(self)) + self._follows[:, None] * self._give, right).view(np.float64)
        return found[:, 0], found[:, 1]

    def _by_their_laws(self, force: float) -> tuple[FloatArray, FloatArray]:
        """Return the forces, and where what they join would be without them."""
        pair = self._free - force * self._strip_yield
        speed = self._free_speed - self._per_velocity * force * self._strip_yield
        give = np.stack([self._give, self._per_velocity * self._give], axis=2)
        free = list(zip(pair.tolist(), speed.tolist(), strict=True))
        return np.array(HeldForces(self._rows).forces(free, give.tolist())), pair

    def _suppose(self, forces: FloatArray, places: FloatArray) -> None:
        """Suppose that every element stays as it is under some forces, where it is: how it follows, and from where."""
        self._found = forces
        self._values = np.zeros(len(self))
        for k, row in enumerate(self._rows):
            value, stiffness = float(forces[k]), float(row[STIFFNESS])
            if row[IS_FRICTION]:
                slips = abs(value) >= _SLIPS * row[SECOND]
                self._follows[k] = 0.0 if slips else stiffness
                self._values[k] = value if slips else row[FORCE] - stiffness * row[PLACE]
            elif value == 0.0:
                self._follows[k] = 0.0
            elif row[SIDE] * (places[k] - row[GAP]) <= _AT_THE_EDGE:  # its damper alone would push the mass out of it
                self._follows[k], self._values[k] = _RIGID, -_RIGID * row[GAP]
            else:
                rate = row[SECOND] * self._per_velocity
                self._follows[k] = stiffness + rate
                self._values[k] = row[SECOND] * self._free_speed[k] - rate * self._free[k] - stiffness * row[GAP]


def _motion(displacement: FloatArray, velocity: FloatArray, acceleration: FloatArray) -> FloatArray:
    return np.stack([displacement, velocity, acceleration], axis=1).ravel()

"""What is not linear in a lumped pantograph: stops of its lowest mass, dry friction between its masses.

A stop pushes the lowest mass back once it is beyond a height above the roof, F = max(0, k p + c p') at a penetration p.
Friction is elastic-plastic: a spring of F_c / d_0 that slips at F_c, so that it holds at rest. The linear step gives
where the masses go without these forces; what the forces are at its end is found from that by Gauss and Seidel's
iteration, each law solved exactly.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from models.arrays import FloatArray, Snapshot
from models.pantograph.lumped.lumped_definition import LumpedDefinition

#: Columns of a table of these forces: upper mass, lower one (-1: the roof), whether it is friction, stiffness [N/m],
#: damping [N.s/m] or limit [N], where a stop begins above the place of rest [m], 1 above it or -1 below, force [N] and
#: relative displacement [m] at the end of the step before.
UPPER, LOWER, IS_FRICTION, STIFFNESS, SECOND, GAP, SIDE, FORCE, PLACE, WIDTH = range(10)
_SWEEPS: Final = 200
#: Change of a force in an iteration at which it ends [N].
_SETTLED: Final = 1e-11
_NAMES: Final = {1.0: "highest_height", -1.0: "lowest_height"}


def held_forces(definition: LumpedDefinition) -> FloatArray:
    """Return the table of a pantograph's stops and friction, shape (m, 9)."""
    k, c, rest = definition.stop_stiffness, definition.stop_damping, definition.reference_height
    rows = [
        (0.0, -1.0, 0.0, k, c, height - rest, side, 0.0, 0.0)
        for height, side in ((definition.lowest_height, -1.0), (definition.highest_height, 1.0))
        if height is not None
    ]
    for i, stage in enumerate(definition.stage):
        if stage.friction > 0.0:
            slip = stage.friction / stage.friction_slip
            rows.append((float(i), i - 1.0, 1.0, slip, stage.friction, 0.0, 0.0, 0.0, 0.0))
    return np.array(rows, dtype=np.float64).reshape(-1, WIDTH)


class HeldForces:
    """Stops and friction of one pantograph: what they do in a step, what they store.

    Parameters
    ----------
    rows : ndarray, shape (m, 9)
        See the columns above; force and place in it are the state.
    """

    def __init__(self, rows: FloatArray) -> None:
        self.rows = rows
        self._ports = [(int(row[UPPER]), int(row[LOWER])) for row in rows.tolist()]

    def start(self, motion: FloatArray, roof: float) -> None:
        """Begin without friction where the masses are; arguments as of `act`."""
        self.rows[:, FORCE] = 0.0
        self.rows[:, PLACE] = [x for x, _ in self._relative(motion, (roof, 0.0))]

    def act(self, transition: FloatArray, motion: FloatArray, roof: tuple[float, float]) -> tuple[float, float]:
        """Let stops and friction act in a step.

        Parameters
        ----------
        transition : ndarray, shape (3 n, 4 n)
            See `LumpedModel.transition`.
        motion : ndarray, shape (3 n,)
            At the end of the step without them; changed in place.
        roof : (float, float)
            Height and velocity of the roof then [m, m/s].

        Returns
        -------
        work, lifting : float
            Work that they take [J]; mean force, in the step, that they lift the roof with [N].
        """
        force = self.forces(self._relative(motion, roof), [self._given(transition, port) for port in self._ports])
        n = len(motion) // 3
        for (upper, lower), value in zip(self._ports, force, strict=True):
            motion -= value * _load_column(transition, n, upper, lower)
        places = [x for x, _ in self._relative(motion, roof)]
        moved = np.array(places) - self.rows[:, PLACE]
        mean = 0.5 * (self.rows[:, FORCE] + np.array(force))
        lifting = sum(f for f, (_, lower) in zip(mean.tolist(), self._ports, strict=True) if lower < 0)
        self.rows[:, FORCE], self.rows[:, PLACE] = force, places
        return float(mean @ moved), lifting

    def forces(self, free: list[tuple[float, float]], give: list[list[tuple[float, float]]]) -> list[float]:
        """Return the forces at the end of a step [N]; the state stays as it is.

        Parameters
        ----------
        free : list of (float, float)
            Displacement and velocity against each other, without the forces, of what each joins [m, m/s].
        give : list of lists
            By how much these fall per force of every element.
        """
        rows = self.rows.tolist()
        force = [row[FORCE] for row in rows]
        for _ in range(_SWEEPS):
            change = 0.0
            for k, row in enumerate(rows):
                x, v = free[k]
                for m, other in enumerate(force):
                    if m != k:
                        x -= give[m][k][0] * other
                        v -= give[m][k][1] * other
                new = _friction(row, x, give[k][k]) if row[IS_FRICTION] else _stop(row, x, v, give[k][k])
                change, force[k] = max(change, abs(new - force[k])), new
            if change <= _SETTLED:
                break
        return force

    @property
    def stored(self) -> float:
        """Energy in the springs of stops and friction [J]."""
        total = 0.0
        for row in self.rows.tolist():
            if row[IS_FRICTION]:
                total += 0.5 * row[FORCE] ** 2 / row[STIFFNESS]
            else:
                total += 0.5 * row[STIFFNESS] * max(0.0, row[SIDE] * (row[PLACE] - row[GAP])) ** 2
        return total

    def touched(self) -> list[str]:
        """Return the names of the stops that push."""
        return [_NAMES[row[SIDE]] for row in self.rows.tolist() if not row[IS_FRICTION] and row[FORCE] != 0.0]

    def snapshot(self) -> Snapshot:
        """Return forces and places, bit for bit."""
        return {"held": self.rows[:, FORCE : PLACE + 1].copy()}

    def restore(self, snapshot: Snapshot) -> None:
        """Take over a snapshot."""
        self.rows[:, FORCE : PLACE + 1] = snapshot["held"]

    def _relative(self, motion: FloatArray, roof: tuple[float, float]) -> list[tuple[float, float]]:
        """Return displacements and velocities against each other of what the forces join."""
        values = motion.tolist()
        found = []
        for upper, lower in self._ports:
            z, vz = roof if lower < 0 else (values[3 * lower], values[3 * lower + 1])
            found.append((values[3 * upper] - z, values[3 * upper + 1] - vz))
        return found

    def _given(self, transition: FloatArray, port: tuple[int, int]) -> list[tuple[float, float]]:
        """Return by how much every port's displacement and velocity fall per force at one of them."""
        column = _load_column(transition, len(transition) // 3, *port)
        return self._relative(column, (0.0, 0.0))


def _load_column(transition: FloatArray, n: int, upper: int, lower: int) -> FloatArray:
    column: FloatArray = transition[:, 3 * n + upper]
    return column if lower < 0 else column - transition[:, 3 * n + lower]


def _friction(row: list[float], x: float, give: tuple[float, float]) -> float:
    """Return the force at a relative displacement that falls by ``give`` per force: sticking, or its limit."""
    trial = (row[FORCE] + row[STIFFNESS] * (x - row[PLACE])) / (1.0 + row[STIFFNESS] * give[0])
    return max(-row[SECOND], min(row[SECOND], trial))


def _stop(row: list[float], x: float, v: float, give: tuple[float, float]) -> float:
    """Return the force of a stop; where its damper alone would push the mass out of it, what leaves it at the edge."""
    beyond = row[SIDE] * (x - row[GAP])
    if beyond <= 0.0:
        return 0.0
    k, c = row[STIFFNESS], row[SECOND]
    force = (k * beyond + c * row[SIDE] * v) / (1.0 + k * give[0] + c * give[1])
    return row[SIDE] * max(0.0, min(force, beyond / give[0]))

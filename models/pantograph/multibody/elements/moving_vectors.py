"""Vectors that move with bodies, kept together so that joints and forces take them from one array operation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from models.arrays import FloatArray, IntArray

#: Body number of vectors fixed to the ground.
GROUND: Final = -1


@dataclass(frozen=True)
class Vector:
    """A vector or point fixed to a body, in its body-fixed components, or to the ground (one of its axes)."""

    body: int
    local: tuple[float, float, float]


class Kinematics(NamedTuple):
    """Where the bodies are and how they move.

    Attributes
    ----------
    frames : ndarray, shape (n, 9, 3)
        A, A w~ and A w~ w~ of every body, stacked: a body-fixed vector times it gives the global vector and
        the parts of its first and second derivatives that depend on positions and velocities alone.
    origins : ndarray, shape (n, 9)
        Position, velocity and known acceleration (that of prescribed motion) of every centre of mass.
    spin : ndarray, shape (n, 3, 3)
        w~
    """

    frames: FloatArray
    origins: FloatArray
    spin: FloatArray


class Handle(NamedTuple):
    """A place in the pool: which kind of entry, which number."""

    kind: str
    number: int


class MovingVectors(NamedTuple):
    """All entries of a pool at one instant.

    Attributes
    ----------
    values : ndarray, shape (entries, 9)
        Vector, first and second derivative (that part of it which positions and velocities decide).
    crosses : ndarray, shape (crosses, 3)
    """

    values: FloatArray
    crosses: FloatArray


class VectorPool:
    """Vectors, gaps between points, levers and cross products, entered one by one, evaluated together.

    A gap is P_to - P_start; a lever is a gap plus the start's own lever: from body i's centre to the other point. After
    ``close`` nothing can be entered and handles become positions.
    """

    def __init__(self) -> None:
        self._vectors: list[Vector] = []
        self._gaps: list[tuple[int, int]] = []
        self._levers: list[tuple[int, int]] = []
        self._crosses: list[tuple[Handle, Handle]] = []

    def vector(self, vector: Vector) -> Handle:
        """Enter a vector (its lever, if it is a point)."""
        if vector.body == GROUND:
            return Handle("ground", int(np.argmax(vector.local)))
        return Handle("vector", _once(self._vectors, vector))

    def gap(self, start: Vector, to: Vector) -> Handle:
        """Enter the gap from one point to another."""
        return Handle("gap", _once(self._gaps, (self.vector(start).number, self.vector(to).number)))

    def lever(self, start: Vector, to: Vector) -> Handle:
        """Enter the vector from the centre of the start's body to the other point."""
        return Handle("lever", _once(self._levers, (self.gap(start, to).number, self.vector(start).number)))

    def cross(self, a: Handle, b: Handle) -> int:
        """Enter the cross product a x b and return its number."""
        self._crosses.append((a, b))
        return len(self._crosses) - 1

    def close(self) -> None:
        """Turn the lists into index arrays."""
        self._bodies = np.array([v.body for v in self._vectors], dtype=np.int64)
        self._locals = np.array([v.local for v in self._vectors], dtype=np.float64).reshape(-1, 3, 1)
        self._gap_start, self._gap_to = _columns(self._gaps)
        self._lever_gap, self._lever_start = _columns(self._levers)
        count = len(self._vectors)
        self._first_gap = count + 3
        self._first_lever = self._first_gap + len(self._gaps)
        self._offsets = {"vector": 0, "ground": count, "gap": self._first_gap, "lever": self._first_lever}
        self._template = np.zeros((self._first_lever + len(self._levers), 9))
        self._template[count : self._first_gap, :3] = np.eye(3)
        a = self.positions([a for a, _ in self._crosses])
        b = self.positions([b for _, b in self._crosses])
        self._crossed = np.stack([a, b], axis=1)
        self._a1, self._a2 = self.components(a, (1, 2, 0)), self.components(a, (2, 0, 1))
        self._b1, self._b2 = self.components(b, (1, 2, 0)), self.components(b, (2, 0, 1))

    def tables(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return vectors (body, three components), gaps (numbers of two vectors), levers (number of a gap and of a
        vector) and cross products (two entries of ``values``) as tables, a row for each.
        """
        vectors = np.column_stack([self._bodies, self._locals[:, :, 0]])
        gaps = np.column_stack([self._gap_start, self._gap_to])
        levers = np.column_stack([self._lever_gap, self._lever_start])
        return vectors, gaps.astype(float), levers.astype(float), self._crossed.astype(float)

    def positions(self, handles: list[Handle]) -> IntArray:
        """Return the rows of the entries in ``values``."""
        return np.array([self._offsets[h.kind] + h.number for h in handles], dtype=np.int64)

    @staticmethod
    def components(rows: IntArray, order: tuple[int, int, int] = (0, 1, 2)) -> IntArray:
        """Return positions in the flat ``values`` of the vectors in some rows, in a chosen order of axes."""
        return (rows[:, None] * 9 + np.array(order)).ravel()

    def evaluate(self, kinematics: Kinematics) -> MovingVectors:
        """Return all entries for one state of motion."""
        values = self._template.copy()
        count = len(self._bodies)
        turned = values[:count]
        np.matmul(kinematics.frames.take(self._bodies, axis=0), self._locals, out=turned[:, :, None])
        points = turned + kinematics.origins.take(self._bodies, axis=0)
        gaps = values[self._first_gap : self._first_lever]
        np.subtract(points.take(self._gap_to, axis=0), points.take(self._gap_start, axis=0), out=gaps)
        if len(self._lever_gap):
            values[self._first_lever :] = gaps.take(self._lever_gap, axis=0) + turned.take(self._lever_start, axis=0)
        flat = values.ravel()
        crosses = flat.take(self._a1) * flat.take(self._b2)
        crosses -= flat.take(self._a2) * flat.take(self._b1)
        return MovingVectors(values, crosses.reshape(-1, 3))


def _once(known: list, entry: object) -> int:  # type: ignore[type-arg]
    if entry not in known:
        known.append(entry)
    return known.index(entry)


def _columns(pairs: list[tuple[int, int]]) -> tuple[IntArray, IntArray]:
    array = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    return array[:, 0], array[:, 1]

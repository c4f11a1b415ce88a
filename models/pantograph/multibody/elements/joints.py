"""Joints as sets of scalar constraints, each the product X . Y of two vectors that move with bodies.

Every joint of the library is made of two kinds of rows:

- *axis* rows a . b = 0: an axis a of body i stays perpendicular to an axis b of body j;
- *gap* rows a . d = 0: the gap d from a point of one body to a point of the other has no component along
  a, an axis of the first body or of the ground.

With virtual displacements dr and virtual rotations dtheta (global components) the rows of the Jacobian are, for
a gap from s_f on body f to s_t on body t, dr: -a, +a; dtheta: a x (d + s_f) (or a x s_f if a is fixed to the
ground), s_t x a; for axes, dtheta: a x b, b x a. ``Constraints`` evaluates all rows of all joints at once [1]_.

References
----------
.. [1] P. E. Nikravesh, "Computer-Aided Analysis of Mechanical Systems", Prentice-Hall 1988, chapters 7 and 11.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np

from models.arrays import FloatArray
from models.pantograph.multibody.elements.moving_vectors import GROUND, Handle, MovingVectors, Vector, VectorPool
from models.pantograph.multibody.elements.rotations import cross, normals
from models.pantograph.multibody.mechanism_definition import (
    Fixed,
    PairJoint,
    Perpendicular,
    PointJoint,
    Prismatic,
    Revolute,
    RevolutePrismatic,
    Spherical,
    Universal,
)


@dataclass(frozen=True)
class AxisRow:
    """Constraint a . b = 0 between axes of two bodies [1]."""

    a: Vector
    b: Vector


@dataclass(frozen=True)
class GapRow:
    """Constraint a . (P_to - P_start) = 0 [m]; ``a`` is fixed to the ground or to the start's body."""

    a: Vector
    start: Vector
    to: Vector


Row = AxisRow | GapRow


@dataclass(frozen=True)
class Pair:
    """The two bodies of a joint: their numbers and orientations as written, shape (3, 3)."""

    i: int
    j: int
    A_i: FloatArray
    A_j: FloatArray


def _fixed_to(body: int, local: FloatArray) -> Vector:
    x, y, z = local.tolist()
    return Vector(body, (x, y, z))


def coincidence(joint: PointJoint, pair: Pair) -> list[Row]:
    """Return the three rows that hold point_i on point_j."""
    start = Vector(pair.i, joint.point_i)
    to = Vector(pair.j, joint.point_j)
    return [GapRow(_fixed_to(GROUND, axis), start, to) for axis in np.eye(3)]


def perpendicular(joint: Perpendicular | Universal, pair: Pair) -> list[Row]:
    """Return the row that holds axis_i perpendicular to axis_j (added to a ball joint it stops the spin)."""
    return [AxisRow(Vector(pair.i, joint.axis_i), Vector(pair.j, joint.axis_j))]


def revolute(joint: Revolute, pair: Pair) -> list[Row]:
    """Return the five rows of a hinge about axis_i, which stays parallel to axis_j."""
    axis = Vector(pair.j, joint.axis_j)
    first, second = normals(np.array(joint.axis_i))
    parallel: list[Row] = [AxisRow(_fixed_to(pair.i, first), axis), AxisRow(_fixed_to(pair.i, second), axis)]
    return coincidence(joint, pair) + parallel


def spherical(joint: Spherical, pair: Pair) -> list[Row]:
    """Return the three rows of a ball joint."""
    return coincidence(joint, pair)


def universal(joint: Universal, pair: Pair) -> list[Row]:
    """Return the four rows of a cardan joint with the perpendicular axes axis_i and axis_j."""
    return coincidence(joint, pair) + perpendicular(joint, pair)


def fixed_orientation(pair: Pair) -> list[Row]:
    """Return the three rows that hold the bodies' relative orientation as written."""
    x, y, z = np.eye(3)
    pairs = ((x, y), (y, z), (z, x))
    return [AxisRow(_fixed_to(pair.i, pair.A_i.T @ a), _fixed_to(pair.j, pair.A_j.T @ b)) for a, b in pairs]


def fixed(joint: Fixed, pair: Pair) -> list[Row]:
    """Return the six rows of a rigid connection, with the relative orientation as written."""
    return coincidence(joint, pair) + fixed_orientation(pair)


def prismatic(joint: Prismatic, pair: Pair) -> list[Row]:
    """Return the five rows of a slide along axis_i, with the relative orientation as written."""
    start = Vector(pair.i, joint.point_i)
    to = Vector(pair.j, joint.point_j)
    across: list[Row] = [GapRow(_fixed_to(pair.i, n), start, to) for n in normals(np.array(joint.axis_i))]
    return across + fixed_orientation(pair)


def revolute_prismatic(joint: RevolutePrismatic, pair: Pair) -> list[Row]:
    """Return the four rows of a body j that turns about axis_i and slides along its own axis_j.

    The slide's line goes through point_j and stays on point_i; the orientation about it is as written.
    """
    roll = np.array(joint.axis_i)
    slide = np.array(joint.axis_j)
    side = cross(slide, pair.A_j.T @ pair.A_i @ roll)
    if np.linalg.norm(side) < 0.5:
        raise ValueError("the roll axis and the slide axis must be perpendicular")
    side /= np.linalg.norm(side)
    start = Vector(pair.j, joint.point_j)
    to = Vector(pair.i, joint.point_i)
    return [
        GapRow(_fixed_to(pair.j, cross(side, slide)), start, to),
        GapRow(_fixed_to(pair.j, side), start, to),
        AxisRow(_fixed_to(pair.i, roll), _fixed_to(pair.j, slide)),
        AxisRow(_fixed_to(pair.i, roll), _fixed_to(pair.j, side)),
    ]


#: What makes the rows of a kind of joint. A prescribed motion has none: the body's motion is known.
JOINT_ROWS: Final[Mapping[type[PairJoint], Callable[[Any, Pair], list[Row]]]] = {
    Revolute: revolute,
    Spherical: spherical,
    Prismatic: prismatic,
    RevolutePrismatic: revolute_prismatic,
    Universal: universal,
    Fixed: fixed,
    Perpendicular: perpendicular,
}


class ConstraintValues(NamedTuple):
    """All rows at one instant.

    Attributes
    ----------
    violation, rate : ndarray, shape (m,)
        Phi and Phi' [m, m/s; 1, 1/s].
    gamma : ndarray, shape (m,)
        Right-hand side of Phi_q q'' = gamma.
    jacobian : ndarray, shape (m, n, 6)
        Phi_q with respect to the displacement and (global) rotation of every body.
    """

    violation: FloatArray
    rate: FloatArray
    gamma: FloatArray
    jacobian: FloatArray


class Constraints:
    """The rows of all joints, evaluated together with array operations.

    Parameters
    ----------
    rows : sequence of Row
    body_count : int
    pool : VectorPool
        Takes the vectors that the rows are products of; to be closed before ``compile``.
    """

    def __init__(self, rows: Sequence[Row], body_count: int, pool: VectorPool) -> None:
        self.count = len(rows)
        self._bodies = body_count
        entries = [_enter(row, pool) for row in rows]
        self._handles = [(x, y) for x, y, _, _ in entries]
        self._turn_from = [pool.cross(x, z) for x, _, z, _ in entries]
        self._turn_to = [pool.cross(lever, x) for x, _, _, lever in entries]
        self._is_gap = np.array([isinstance(r, GapRow) for r in rows], dtype=bool)
        self._from = np.array([r.start.body if isinstance(r, GapRow) else r.a.body for r in rows], dtype=np.int64)
        self._to = np.array([r.to.body if isinstance(r, GapRow) else r.b.body for r in rows], dtype=np.int64)

    def compile(self, pool: VectorPool) -> None:
        """Work out where everything comes from and where it goes in the Jacobian."""
        self._x = pool.positions([x for x, _ in self._handles])
        self._y = pool.positions([y for _, y in self._handles])
        row = np.arange(self.count)
        column_from = (row * self._bodies + self._from) * 6
        column_to = (row * self._bodies + self._to) * 6
        three = np.arange(3)
        gaps = np.flatnonzero(self._is_gap)
        self._along = pool.components(self._x[gaps])
        self._at_from = (column_from[gaps, None] + three).ravel()
        self._at_to = (column_to[gaps, None] + three).ravel()
        self._turns = np.array(self._turn_from + self._turn_to, dtype=np.int64)
        self._at_turns = (np.concatenate([column_from, column_to])[:, None] + 3 + three).ravel()

    def table(self) -> FloatArray:
        """Return 1 of a gap and 0 of axes, the entries X and Y, the two bodies and the two cross products of every row,
        shape (m, 7).
        """
        columns = (self._is_gap, self._x, self._y, self._from, self._to, self._turn_from, self._turn_to)
        return np.column_stack([np.asarray(c, dtype=np.float64) for c in columns])

    def evaluate(self, vectors: MovingVectors) -> ConstraintValues:
        """Return violations, their rates, gamma and the Jacobian."""
        x = vectors.values.take(self._x, axis=0).reshape(-1, 3, 3)
        y = vectors.values.take(self._y, axis=0).reshape(-1, 3, 3)
        values = (x @ y.transpose(0, 2, 1)).reshape(-1, 9) @ _DERIVATIVES
        jacobian = np.zeros(self.count * self._bodies * 6)
        along = vectors.values.ravel().take(self._along)
        jacobian[self._at_to] = along
        jacobian[self._at_from] = -along
        jacobian[self._at_turns] = vectors.crosses.take(self._turns, axis=0).ravel()
        return ConstraintValues(values[:, 0], values[:, 1], values[:, 2], jacobian.reshape(self.count, self._bodies, 6))


def _derivatives() -> FloatArray:
    """Return what makes X.Y, X'.Y + X.Y' and -(X''.Y + 2 X'.Y' + X.Y'') of the nine products, shape (9, 3)."""
    table = np.zeros((3, 3, 3))
    table[0, 0, 0] = 1.0
    table[0, 1, 1] = table[1, 0, 1] = 1.0
    table[0, 2, 2] = table[2, 0, 2] = -1.0
    table[1, 1, 2] = -2.0
    return table.reshape(9, 3)


_DERIVATIVES = _derivatives()


def _enter(row: Row, pool: VectorPool) -> tuple[Handle, Handle, Handle, Handle]:
    """Return where X and Y are, and the levers that X is crossed with for the first and the second body."""
    if isinstance(row, AxisRow):
        b = pool.vector(row.b)
        return pool.vector(row.a), b, b, b
    ground = row.a.body == GROUND
    lever = pool.vector(row.start) if ground else pool.lever(row.start, row.to)
    return pool.vector(row.a), pool.gap(row.start, row.to), lever, pool.vector(row.to)

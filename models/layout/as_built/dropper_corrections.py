"""Which droppers to change, and by how much, so that the wire comes to the heights of the design.

The changes c minimise |J c - (wanted rise)|, with J the influence of lengths on heights. They are limited to lengths
that a dropper may have, to the most useful few on request, and to whole steps of what can be cut or set.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy.sparse as sp
from scipy.optimize import lsq_linear
from scipy.sparse.linalg import splu

from models.arrays import BoolArray, FloatArray, IntArray
from models.catenary.condition.fitted_lengths import FittedLengths, with_errors
from models.catenary.shape.form_finding import StaticState

#: Rounds in which changes that leave a dropper slack are taken back, a step each.
_MAX_ROUNDS: Final = 100
#: Of the largest column, what a dropper adds to those chosen must be more than this.
_NOTHING: Final = 1e-10


@dataclass(frozen=True)
class Allowed:
    """What changes may be: rounded to ``step``, of ``only`` so many droppers, none made shorter than ``shortest`` [m].

    Where the design has a shorter one, its length is the limit.
    """

    step: float
    only: int | None
    shortest: float


@dataclass(frozen=True)
class Corrections:
    """Changes of the lengths of droppers, and the line with them.

    Attributes
    ----------
    change : ndarray, shape (k,)
        What each dropper is to be lengthened by [m], in whole steps; 0: it stays.
    exact : ndarray, shape (k,)
        The same before rounding, limits of length kept.
    state : StaticState
        The line at rest with the changed lengths.
    taken_back : int
        Steps that were taken back, as a dropper would have gone slack.
    """

    change: FloatArray
    exact: FloatArray
    state: StaticState
    taken_back: int

    @property
    def is_changed(self) -> BoolArray:
        """Return which droppers change, shape (k,)."""
        return self.change != 0.0


def correct(
    design: StaticState,
    built: FittedLengths,
    droppers: IntArray,
    influence: sp.csc_matrix,
    rise: FloatArray,
    allowed: Allowed,
    tell: Callable[[int], None] = lambda done: None,
) -> Corrections:
    """Find the changes of droppers that bring the wire to its heights.

    Parameters
    ----------
    design : StaticState
    built : FittedLengths
        The line as it hangs.
    droppers : ndarray, shape (k,)
        Those that may be changed and whose heights count, by their places in the mesh.
    influence : sparse, shape (k, k)
        Of their lengths on their heights, about the line as it hangs.
    rise : ndarray, shape (k,)
        By how much the wire should rise at them [m].
    allowed : Allowed
    tell : callable, optional
        Is told how many droppers have been chosen.
    """
    length, designed = built.state.unstrained_length[droppers], design.unstrained_length[droppers]
    lowest = np.minimum(np.minimum(allowed.shortest, designed) - length, 0.0)
    acting = np.flatnonzero(influence.diagonal())
    count = len(acting) if allowed.only is None else min(allowed.only, len(acting))
    chosen = acting if count == len(acting) else most_useful(influence, rise, count, tell)
    exact = np.zeros(len(droppers))
    exact[chosen] = _least_squares(influence[:, chosen], rise, lowest[chosen])
    steps = np.rint(exact / allowed.step)
    steps = np.maximum(steps, np.ceil(lowest / allowed.step - 1e-9))
    return _without_slack(design, built, droppers, exact, steps, allowed.step)


def most_useful(
    influence: sp.csc_matrix, rise: FloatArray, count: int, tell: Callable[[int], None] = lambda done: None
) -> IntArray:
    """Return the droppers whose changes, one after the other, take most off the remaining error; up to ``count``.

    Every choice is the best with those before it changed anew: a Cholesky factorisation of J'J that takes as its next
    pivot the column that adds most.
    """
    products = (influence.T @ influence).tocsc()
    diagonal, along = products.diagonal().copy(), np.asarray(influence.T @ rise)
    least, rows = _NOTHING * float(diagonal.max(initial=0.0)), np.zeros((count, len(diagonal)))
    chosen: list[int] = []
    for k in range(count):
        gain = np.where(diagonal > least, along**2 / np.where(diagonal > least, diagonal, 1.0), 0.0)
        gain[chosen] = 0.0
        best = int(gain.argmax())
        if gain[best] <= 0.0:
            break
        root = np.sqrt(diagonal[best])
        column = products[:, [best]].toarray()[:, 0]
        rows[k] = (column - rows[:k].T @ rows[:k, best]) / root
        along = along - rows[k] * (along[best] / root)
        diagonal -= rows[k] ** 2
        chosen.append(best)
        tell(k + 1)
    return np.array(chosen, dtype=np.int64)


def _least_squares(columns: sp.csc_matrix, rise: FloatArray, lowest: FloatArray) -> FloatArray:
    """Return the changes of some droppers that come nearest to a rise, none below its ``lowest``."""
    if not columns.shape[1]:
        return np.zeros(0)
    if columns.shape[0] == columns.shape[1]:
        found = splu(sp.csc_matrix(columns)).solve(rise)
    else:
        found = splu(sp.csc_matrix(columns.T @ columns)).solve(np.asarray(columns.T @ rise))
    if (found >= lowest).all():
        return np.asarray(found)
    return np.asarray(lsq_linear(columns, rise, bounds=(lowest - 1e-12, np.inf), tol=1e-12).x)


def _without_slack(
    design: StaticState, built: FittedLengths, droppers: IntArray, exact: FloatArray, steps: FloatArray, step: float
) -> Corrections:
    """Take back, a step at a time, what would leave a dropper slack that is not slack now."""
    error = built.state.unstrained_length - design.unstrained_length
    was_slack, taken_back = built.is_slack | built.state.is_slack, 0
    while True:
        changed = error.copy()
        changed[droppers] += step * steps
        state = with_errors(design, changed)
        new = np.flatnonzero(state.is_slack & ~was_slack)
        blamed = sorted({k for j in new if (k := _loosening(state, droppers, steps, int(j))) is not None})
        if not blamed or taken_back > _MAX_ROUNDS * len(droppers):
            return Corrections(step * steps, exact, state, taken_back)
        steps[blamed] -= np.sign(steps[blamed])
        taken_back += len(blamed)


def _loosening(state: StaticState, droppers: IntArray, steps: FloatArray, slack: int) -> int | None:
    """Return which change to take back for a slack dropper: its own lengthening, else the nearest shortening."""
    own = np.flatnonzero(droppers == slack)
    if own.size and steps[own[0]] > 0.0:
        return int(own[0])
    mesh = state.shape.mesh
    x = mesh.points[mesh.droppers[:, 0], 0]
    shortened = np.flatnonzero(steps < 0.0)
    if not shortened.size:
        changed = np.flatnonzero(steps)
        return int(changed[np.abs(x[droppers[changed]] - x[slack]).argmin()]) if changed.size else None
    return int(shortened[np.abs(x[droppers[shortened]] - x[slack]).argmin()])

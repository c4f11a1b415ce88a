"""One time step of a line in modes of its intervals and displacements of its attachments, to be read.

The trapezoidal rule in increments: with a0 ... a5 of [2.28], M a_n = f_n - C v_n - K d_n and gamma = 1/2, beta = 1/4,
the step [2.25-2.27] is

    K_hat (d_n+1 - d_n) = f_n + f_n+1 - 2 K d_n + a2 M v_n,        v_n+1 = a1 (d_n+1 - d_n) - v_n:

the damping matrix drops out of the right-hand side, and accelerations are not needed. In the coordinates of
`interval_modes` K_hat is diagonal but for the attachments and for mu G with mu = a0 + a1 beta, so that an interval
is eliminated by a division: one product with G' leads to the attachments, one band solution gives them, one
product with G leads back.

What acts inside the step and is not known before it (contacts, slack droppers) acts on the attachments and on single
intervals. It is added between the two products, where it costs next to nothing.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp

from models.arrays import FloatArray
from models.catenary.contact_and_slack.contact_wire import WireInterval
from models.catenary.contact_and_slack.wire_response import IntervalResponse, WirePoint
from models.catenary.linear_motion.interval_modes import IntervalModes
from models.catenary.linear_motion.line_motion import LineMotion
from models.catenary.linear_motion.sparse_products import BlockProduct, Multiplier, Product, TransposedProduct
from models.catenary.linear_motion.step_matrices import StepMatrices

#: Ends of an interval that its modes in one plane move with.
_ENDS_IN_PLANE = 6

#: A point of a contact wire, and a force on it that is known before a step, positive up [N].
AppliedForce = tuple[WirePoint, float]


class LinearStep:
    """What is linear in steps of one size, in the parts that contacts and slack come between.

    The order of calls: `begin`; `local` where strips are; `apply` and changes of ``attached`` for what acts inside the
    step and is not known before it; `finish`.

    Parameters
    ----------
    matrices : StepMatrices

    Attributes
    ----------
    matrices : StepMatrices
    attached : ndarray, shape (n_attached,)
        Change of the attachments' displacements in this step [m].
    """

    def __init__(self, matrices: StepMatrices) -> None:
        modes, newmark, mu = matrices.modes, matrices.newmark, matrices.mu
        self.matrices, self.attached = matrices, np.zeros(len(modes.attached))
        self._out, self._back = _products(modes, matrices.coupling)
        self._own = Product(sp.hstack([-2.0 * modes.K, newmark.a2 * modes.M]))
        self._from_modal = -2.0 * modes.eigenvalue * matrices.inverse
        self._from_momentum = newmark.a2 * matrices.inverse
        # One number where all wires are damped alike: that is read faster than a vector.
        divisor = float(mu[0]) if mu.size and np.all(mu == mu[0]) else mu
        self._from_velocity, self._to_momentum = newmark.a2 / divisor, newmark.a1 / divisor
        self._ends = np.empty(self._back[0].matrix.shape[0])
        #: Change of the modal amplitudes in this step, were the attachments held; work space.
        self._modal, self._work, self._following = (np.empty(len(mu)) for _ in range(3))
        #: Motion of intervals at the end of this step, forces found inside it left out.
        self._free: dict[WireInterval, FloatArray] = {}

    def begin(self, motion: LineMotion, load: FloatArray, applied: Sequence[AppliedForce] = ()) -> None:
        """Find the changes of this step without what is found inside it.

        Parameters
        ----------
        motion : LineMotion
            At the beginning of the step.
        load : ndarray, shape (n_attached,)
            Known forces on the attachments, beginning plus end of the step [N]; changed in place: what those on the
            wires do to the attachments at their ends is added, and what the motion does.
        applied : sequence of AppliedForce
            Forces on the contact wires, at the beginning of the step.
        """
        self._free.clear()
        for point, force in applied:
            load[point.response.interval.ends] += force * point.load
        modal, work, ends = self._modal, self._work, self._ends
        amplitudes, momentum = motion.plain()
        np.multiply(self._from_modal, amplitudes[0], out=modal)
        np.multiply(self._from_momentum, momentum, out=work)
        modal += work
        np.multiply(self._from_velocity, amplitudes[1], out=work)
        work -= modal
        self._own.add(motion.attached.ravel(), load)
        ends.fill(0.0)
        self._back[0].add(work, ends)
        self._back[1].add(ends, load)
        self.attached = self.matrices.factor.solve(load)
        for point, force in applied:
            self._press(point, force)

    def local(self, response: IntervalResponse, motion: LineMotion) -> FloatArray:
        """Return an interval's local coordinates and their rates at the end of the step, shape (2, m).

        Forces that are found inside the step are left out.

        Parameters
        ----------
        motion : LineMotion
            At the beginning of the step.
        """
        interval = response.interval
        found = self._free.get(interval)
        if found is None:
            change = np.concatenate((self._modal[interval.modes], self.attached.take(interval.ends)))
            a1 = self.matrices.newmark.a1
            found = self._free[interval] = response.advance(interval.local(motion), change, a1)
        return found

    def apply(self, point: WirePoint, force: float) -> None:
        """Add what a force on a point of a wire changes in this step; ``force`` is that at its end [N], positive up."""
        self._press(point, force)
        columns = point.response.columns
        self.attached[columns.rows] += columns.values.dot(force * point.load)

    def finish(self, motion: LineMotion) -> None:
        """Let the intervals follow their attachments, and replace the motion by that at the end of the step."""
        a1, modal, following, ends = self.matrices.newmark.a1, self._modal, self._following, self._ends
        ends.fill(0.0)
        self._out[1].add(self.attached, ends)
        following.fill(0.0)
        self._out[0].add(ends, following)
        np.multiply(following, self.matrices.inverse, out=self._work)
        modal -= self._work
        amplitudes, momentum = motion.plain()
        amplitudes[0] += modal
        modal *= a1
        np.subtract(modal, amplitudes[1], out=amplitudes[1])
        following *= self._to_momentum
        modal += following
        np.subtract(modal, momentum, out=momentum)
        attached = motion.attached
        attached[0] += self.attached
        self.attached *= a1
        np.subtract(self.attached, attached[1], out=attached[1])

    def _press(self, point: WirePoint, force: float) -> None:
        """Add what a force does to the modes of its interval, the attachments held."""
        self._modal[point.response.interval.modes] += force * point.give


_Chain = tuple[Multiplier, Multiplier]


def _products(modes: IntervalModes, coupling: sp.csr_matrix) -> tuple[_Chain, _Chain]:
    """Return mu G and its transpose, each as two products that lead over the intervals' ends.

    Where blocks have one size they are kept dense, which makes a step a sixth shorter (benchmarks/line_step.py).
    """
    by_blocks = _by_blocks(modes, coupling)
    if by_blocks is None:
        out = Product(coupling)
        return (out, Product(modes.turn)), (TransposedProduct(out), Product(modes.turn.T))
    blocks, turn = by_blocks
    back = BlockProduct(blocks.T.tobsr(blocks.blocksize[::-1]))
    return (BlockProduct(blocks), Product(turn)), (back, Product(turn.T))


def _by_blocks(modes: IntervalModes, coupling: sp.csr_matrix) -> tuple[sp.bsr_matrix, sp.csr_matrix] | None:
    """Return mu G by dense blocks and the turn to its ends, renumbered; None if intervals are of several sizes.

    Every end belongs to one block of modes. Behind the ends of each block zeros fill its last column of blocks up.
    """
    if len(modes.blocks) != 1:
        return None
    size = modes.blocks[0].modes.shape[1]
    entries = coupling.tocoo()
    owner = np.zeros(coupling.shape[1], dtype=np.int64)
    owner[entries.col] = entries.row // size  # ends are numbered block by block
    gaps = -np.bincount(owner, minlength=coupling.shape[0] // size) % _ENDS_IN_PLANE
    before = np.arange(len(owner))
    place = before + (np.cumsum(gaps) - gaps)[owner]
    shape = len(owner) + int(gaps.sum()), len(owner)
    renumbered = sp.csr_matrix((np.ones(len(owner)), (place, before)), shape=shape)
    return (coupling @ renumbered.T).tobsr((size, _ENDS_IN_PLANE)), (renumbered @ modes.turn).tocsr()

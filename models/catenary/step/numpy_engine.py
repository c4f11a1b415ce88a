"""One time step of a line in modes of its intervals and displacements of its attachments.

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

from models.arrays import FloatArray, IntArray
from models.catenary.contact_and_slack.contact_wire import ContactWire, WireInterval
from models.catenary.contact_and_slack.crossing import Crossing
from models.catenary.contact_and_slack.wire_response import Meeting, Point
from models.catenary.linear_motion.attachment_solver import Banded, Cyclic, Sparse, factorised
from models.catenary.linear_motion.interval_modes import IntervalModes
from models.catenary.linear_motion.line_motion import LineMotion
from models.catenary.linear_motion.sparse_products import BlockProduct, Multiplier, Product, TransposedProduct
from models.catenary.step.step_engine import Known, ReactionOf
from models.numerics.newmark import Newmark

#: Ends of an interval that its modes in one plane move with.
_ENDS_IN_PLANE = 6


class Stepper:
    """What belongs to one step size, and the arrays a step works in.

    The order of calls: `begin`, then `press`, `apply` and changes of ``attached`` for what acts inside the step, then
    `finish`.

    Parameters
    ----------
    modes : IntervalModes
    newmark : Newmark

    Attributes
    ----------
    factor : Factor
        Of what the attachments feel, intervals eliminated.
    attached : ndarray, shape (n_attached,)
        Change of the attachments' displacements in this step [m].
    inverse : ndarray, shape (n_modes,)
        1 / K_hat of the modes.
    """

    def __init__(self, modes: IntervalModes, newmark: Newmark) -> None:
        a0, a1 = newmark.a0, newmark.a1
        self.modes, self.newmark = modes, newmark
        self._mu = a0 + a1 * modes.beta
        self.inverse = 1.0 / (modes.eigenvalue * (1.0 + a1 * modes.alpha) + self._mu)
        coupling = (sp.diags(self._mu) @ modes.coupling).tocsr()
        G = coupling @ modes.turn
        self.factor: Banded | Cyclic | Sparse = factorised(
            modes.K + a0 * modes.M + a1 * modes.C - G.T @ sp.diags(self.inverse) @ G
        )
        self.attached = np.empty(G.shape[1])
        self._ends, self._right = np.empty(coupling.shape[1]), np.empty(G.shape[1])
        self._set_up(coupling)

    def _set_up(self, coupling: sp.csr_matrix) -> None:
        """Lay out what the two halves of a step read, from mu G over the intervals' ends."""
        modes, newmark = self.modes, self.newmark
        by_blocks = _by_blocks(modes, coupling)
        self._out: tuple[Multiplier, Multiplier]
        self._back: tuple[Multiplier, Multiplier]
        if by_blocks is None:
            out = Product(coupling)
            self._out, self._back = (out, Product(modes.turn)), (TransposedProduct(out), Product(modes.turn.T))
        else:
            blocks, turn = by_blocks
            self._out = BlockProduct(blocks), Product(turn)
            self._back = BlockProduct(blocks.T.tobsr(blocks.blocksize[::-1])), Product(turn.T)
            self._ends = np.empty(turn.shape[0])
        self._own = Product(sp.hstack([-2.0 * modes.K, newmark.a2 * modes.M]))
        self._from_modal = -2.0 * modes.eigenvalue * self.inverse
        self._from_momentum = newmark.a2 * self.inverse
        # One number where all wires are damped alike, as a number is sooner read than a vector.
        alike = np.all(self._mu == self._mu[:1])
        mu = float(self._mu[0]) if alike and self._mu.size else self._mu
        self._from_velocity, self._to_momentum = newmark.a2 / mu, newmark.a1 / mu
        #: Change of the modal amplitudes in this step, were the attachments held.
        self._modal = np.empty(coupling.shape[0])
        self._work, self._following = np.empty(coupling.shape[0]), np.empty(coupling.shape[0])

    def begin(self, motion: LineMotion, pressed: FloatArray, known: Sequence[Known] = ()) -> None:
        """Find the changes of this step without what is found inside it.

        Parameters
        ----------
        motion : LineMotion
            At the beginning of the step.
        pressed : ndarray, shape (n_attached,)
            Known forces on the attachments, beginning plus end of the step [N]; what those on the wires do to the
            attachments at their ends is added.
        known : sequence of Known
            Forces on the contact wires, at the beginning of the step.
        """
        points = []
        for reaction, element, xi, force in known:
            point = reaction.point(element, xi)
            pressed[reaction.interval.ends] += force * point.load
            points.append(point)
        modal, work, right = self._modal, self._work, self._right
        (amplitude, rate), momentum = motion.plain()
        np.multiply(self._from_modal, amplitude, out=modal)
        np.multiply(self._from_momentum, momentum, out=work)
        modal += work
        np.multiply(self._from_velocity, rate, out=work)
        work -= modal
        right[...] = pressed
        self._own.add(motion.attached.ravel(), right)
        self._ends[...] = 0.0
        self._back[0].add(work, self._ends)
        self._back[1].add(self._ends, right)
        self.solve()
        for point, load in zip(points, known, strict=True):
            self.press(point.reaction.interval.modes, load.force * point.touch.modal)

    def solve(self) -> None:
        """Find the change of the attachments' displacements from the forces on them."""
        self.attached[...] = self.factor.solve(self._right)

    def press(self, span: slice, force: FloatArray) -> None:
        """Add a force on the modes of an interval, its attachments held."""
        self._modal[span] += force * self.inverse[span]

    def apply(self, point: Point, force: float) -> None:
        """Add what a force on a point of a wire changes in this step.

        Parameters
        ----------
        force : float
            At the end of the step [N], positive up.
        """
        columns = point.reaction.columns
        self.press(point.reaction.interval.modes, force * point.touch.modal)
        self.attached[columns.rows] += columns.values @ (force * point.load)

    def slots(self, span: slice) -> IntArray:
        """Return where the modes of an interval are kept while they are packed, shape (n_span,); empty if never."""
        return np.zeros(0, dtype=np.uint64)

    def local(self, interval: WireInterval, motion: LineMotion) -> tuple[FloatArray, FloatArray]:
        """Return an interval's local coordinates and rates at the beginning of a step, and their changes in it.

        Returns
        -------
        before : ndarray, shape (2, m)
        change : ndarray, shape (m,)
            Of the modes' amplitudes as if the attachments were held.
        """
        change = np.concatenate((self._modal[interval.modes], self.attached.take(interval.ends)))
        return local_motion(interval, motion), change

    def meet(
        self, wire: ContactWire, reaction: ReactionOf, strip: FloatArray, guess: int, motion: LineMotion
    ) -> Meeting | None:
        """Return where a strip crosses a wire at the end of the step, if a stepper can tell that at once.

        Parameters
        ----------
        strip : ndarray, shape (2, 2, 3)
            Ends A and B; position and velocity.
        guess : int
            Element of the wire, to begin with.
        motion : LineMotion
            At the beginning of the step.
        """
        return None

    def place(self, crossing: Crossing, point: Point, motion: LineMotion, place: FloatArray) -> None:
        """Put a point of a wire into ``place``, shape (3,) [m]."""
        interval, touch = point.reaction.interval, point.touch
        local = np.concatenate((motion.modal[0, interval.modes], motion.attached[0].take(interval.ends)))
        place[:] = *interval.at(crossing, local), touch.height + touch.row.dot(local)

    def coupling(self, span: slice, places: IntArray) -> FloatArray:
        """Return mu G of one interval, a column for each displacement of its attachments, shape (n_span, n_places)."""
        modes = self.modes
        moved, low = _dense_rows(modes.coupling, span.start, span.stop)
        turned, first = _dense_rows(modes.turn, low, low + moved.shape[1])
        inside = (places >= first) & (places < first + turned.shape[1])
        result = np.zeros((moved.shape[0], len(places)))
        result[:, inside] = moved @ turned[:, places[inside] - first]
        return self._mu[span, None] * result

    def finish(self, motion: LineMotion) -> None:
        """Let the intervals follow their attachments, and replace the motion by that at the end of the step."""
        a1, modal, following, work = self.newmark.a1, self._modal, self._following, self._work
        self._ends[...] = 0.0
        self._out[1].add(self.attached, self._ends)
        following[...] = 0.0
        self._out[0].add(self._ends, following)
        np.multiply(following, self.inverse, out=work)
        modal -= work
        (amplitude, rate), momentum = motion.plain()
        amplitude += modal
        modal *= a1
        np.subtract(modal, rate, out=rate)
        following *= self._to_momentum
        modal += following
        np.subtract(modal, momentum, out=momentum)
        displacement, velocity = motion.attached
        displacement += self.attached
        self.attached *= a1
        np.subtract(self.attached, velocity, out=velocity)


def local_motion(interval: WireInterval, motion: LineMotion) -> FloatArray:
    """Return an interval's local coordinates and their rates, shape (2, m)."""
    return np.concatenate((motion.modal[:, interval.modes], motion.attached.take(interval.ends, axis=1)), axis=1)


def _dense_rows(matrix: sp.csr_matrix, start: int, stop: int) -> tuple[FloatArray, int]:
    """Return some rows of a matrix from their first column that is not empty, and that column."""
    bounds = matrix.indptr[start : stop + 1]
    columns = matrix.indices[bounds[0] : bounds[-1]]
    if not columns.size:
        return np.zeros((stop - start, 0)), 0
    low = int(columns.min())
    result = np.zeros((stop - start, int(columns.max()) - low + 1))
    result[np.repeat(np.arange(stop - start), np.diff(bounds)), columns - low] = matrix.data[bounds[0] : bounds[-1]]
    return result, low


def _by_blocks(modes: IntervalModes, coupling: sp.csr_matrix) -> tuple[sp.bsr_matrix, sp.csr_matrix] | None:
    """Return mu G by dense blocks and the turn to its ends, renumbered; None if intervals are of several sizes.

    Every end belongs to one block of modes; a block with more than six of them takes several columns of blocks.
    """
    sizes = {block.modes.shape[1] for block in modes.blocks}
    if len(sizes) != 1:
        return None
    size = sizes.pop()
    entries = coupling.tocoo()
    owner = np.zeros(coupling.shape[1], dtype=np.int64)
    owner[entries.col] = entries.row // size
    order = np.argsort(owner, kind="stable")
    count = np.bincount(owner, minlength=coupling.shape[0] // size)
    begin = np.cumsum(np.concatenate([[0], -(-count // _ENDS_IN_PLANE) * _ENDS_IN_PLANE]))
    place = np.empty_like(order)
    place[order] = begin[owner[order]] + np.arange(len(order)) - np.repeat(np.cumsum(count) - count, count)
    ones, before = np.ones(len(place)), np.arange(len(place))
    renumbered = sp.csr_matrix((ones, (place, before)), shape=(int(begin[-1]), len(place)))
    return (coupling @ renumbered.T).tobsr((size, _ENDS_IN_PLANE)), (renumbered @ modes.turn).tocsr()

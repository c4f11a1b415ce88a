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

from dataclasses import dataclass
from types import ModuleType

import numpy as np
import scipy.sparse as sp

from models.catenary.band import Banded, Sparse, factorised
from models.catenary.contact_wire import ContactWire, Crossing, Touch
from models.catenary.interval_modes import IntervalModes
from models.catenary.product import Product
from models.part import FloatArray, IntArray
from models.time_integration import Newmark


@dataclass
class LineMotion:
    """Motion of a line; changed in place.

    Attributes
    ----------
    modal : ndarray, shape (2, n_modes)
        Modal amplitudes q and their rates.
    momentum : ndarray, shape (n_modes,)
        q' + G x', which acts on the intervals.
    attached : ndarray, shape (2, n_attached)
        Displacements x of the attachments [m, rad] and their velocities.
    prepared : ndarray
        What a stepper has found for the next step already: its step size, then its own affair; empty if nothing.
    """

    modal: FloatArray
    momentum: FloatArray
    attached: FloatArray
    prepared: FloatArray

    @classmethod
    def at_rest(cls, modes: IntervalModes) -> LineMotion:
        """Return a line that does not move."""
        n, m = modes.coupling.shape[0], len(modes.attached)
        return cls(np.zeros((2, n)), np.zeros(n), np.zeros((2, m)), np.zeros(0))


class Stepper:
    """What belongs to one step size, and the arrays a step works in.

    The order of calls: `begin`, then `press` and changes of ``attached`` for what acts inside the step, then `finish`.

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
    modal : ndarray, shape (n_modes,)
        Change of the modal amplitudes in this step, were the attachments held.
    inverse : ndarray, shape (n_modes,)
        1 / K_hat of the modes.
    kernels : module or None
        Compiled kernels, where there are any.
    """

    kernels: ModuleType | None = None

    def __init__(self, modes: IntervalModes, newmark: Newmark) -> None:
        a0, a1 = newmark.a0, newmark.a1
        self.modes, self.newmark = modes, newmark
        self._mu = a0 + a1 * modes.beta
        self.inverse = 1.0 / (modes.eigenvalue * (1.0 + a1 * modes.alpha) + self._mu)
        coupling = (sp.diags(self._mu) @ modes.coupling).tocsr()
        G = coupling @ modes.turn
        self.factor: Banded | Sparse = factorised(
            modes.K + a0 * modes.M + a1 * modes.C - G.T @ sp.diags(self.inverse) @ G
        )
        self._from_modal = -2.0 * modes.eigenvalue * self.inverse
        self.modal, self.attached = np.empty(G.shape[0]), np.empty(G.shape[1])
        self._ends, self._right = np.empty(coupling.shape[1]), np.empty(G.shape[1])
        self._set_up(coupling)

    def _set_up(self, coupling: sp.csr_matrix) -> None:
        """Lay out what the two halves of a step read, from mu G over the intervals' ends."""
        modes, newmark = self.modes, self.newmark
        self._out = Product(coupling), Product(modes.turn)
        self._back = Product(coupling.T), Product(modes.turn.T)
        self._own = Product(sp.hstack([-2.0 * modes.K, newmark.a2 * modes.M]))
        self._from_momentum = newmark.a2 * self.inverse
        self._from_velocity = newmark.a2 / self._mu
        self._to_momentum = newmark.a1 / self._mu
        self._work, self._following = np.empty(coupling.shape[0]), np.empty(coupling.shape[0])

    def begin(self, motion: LineMotion, pressed: FloatArray) -> None:
        """Find the changes of this step without forces on intervals.

        Parameters
        ----------
        motion : LineMotion
            At the beginning of the step.
        pressed : ndarray, shape (n_attached,)
            Known forces on the attachments, beginning plus end of the step [N]. Known forces on intervals act on the
            attachments at their ends as well, here; on the interval itself they are put by `press`.
        """
        modal, work, right = self.modal, self._work, self._right
        np.multiply(self._from_modal, motion.modal[0], out=modal)
        np.multiply(self._from_momentum, motion.momentum, out=work)
        modal += work
        np.multiply(self._from_velocity, motion.modal[1], out=work)
        work -= modal
        right[...] = pressed
        self._own.add(motion.attached.ravel(), right)
        self._ends[...] = 0.0
        self._back[0].add(work, self._ends)
        self._back[1].add(self._ends, right)
        self.attached[...] = self.factor.solve(right)

    def place(
        self, wire: ContactWire, crossing: Crossing, touch: Touch, motion: LineMotion, point: FloatArray
    ) -> None:
        """Put a point of a wire into ``point``, shape (3,) [m]."""
        interval = touch.interval
        local = np.concatenate((motion.modal[0, interval.modes], motion.attached[0].take(interval.ends)))
        point[:] = *wire.plan(crossing, local), touch.height + touch.row.dot(local)

    def press(self, span: slice, force: FloatArray) -> None:
        """Add a force on the modes of an interval, its attachments held."""
        self.modal[span] += force * self.inverse[span]

    def coupling(self, span: slice, places: IntArray) -> FloatArray:
        """Return mu G of one interval, a column for each displacement of its attachments, shape (n_span, n_places)."""
        turned = (self.modes.coupling[span] @ self.modes.turn)[:, places]
        return self._mu[span, None] * turned.toarray()

    def finish(self, motion: LineMotion) -> None:
        """Let the intervals follow their attachments, and replace the motion by that at the end of the step."""
        a1, modal, following, work = self.newmark.a1, self.modal, self._following, self._work
        self._ends[...] = 0.0
        self._out[1].add(self.attached, self._ends)
        following[...] = 0.0
        self._out[0].add(self._ends, following)
        np.multiply(following, self.inverse, out=work)
        modal -= work
        amplitude, rate = motion.modal
        amplitude += modal
        modal *= a1
        np.subtract(modal, rate, out=rate)
        following *= self._to_momentum
        modal += following
        np.subtract(modal, motion.momentum, out=motion.momentum)
        displacement, velocity = motion.attached
        displacement += self.attached
        self.attached *= a1
        np.subtract(self.attached, velocity, out=velocity)

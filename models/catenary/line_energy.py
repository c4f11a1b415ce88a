"""The energy balance of a line, from its state before and after each step; see `models.numerics.energy_ledger`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp

from models.arrays import FloatArray, IntArray, Snapshot
from models.catenary.line_model import CatenaryModel
from models.catenary.line_state import CatenaryState, ContactResult, StripMotion
from models.catenary.linear_motion.sparse_products import Product, inner
from models.numerics.energy_ledger import Ledger

#: A force on a strip: pantograph, share of the way from A to B, force [N].
_Press = tuple[int, float, float]


class LineBalance:
    """Steps a line and adds up the work of the contact forces on it and what its dampers dissipate.

    The energy in droppers is counted as if they carried compression, too; the forces that cancel it belong to what the
    line stores, not to the work done on it. Their damping is counted likewise; what cancels it belongs to the
    dissipation. A dropper that goes slack before its spring does loses what the spring still holds, and one that pulls
    before its spring is taut acts as a damper.

    Parameters
    ----------
    model : CatenaryModel
    strips : ndarray, shape (P, 2, 2, 3)
        At the beginning: end A, B; position, velocity.
    contacts : ContactResult
        At the beginning.
    """

    def __init__(self, model: CatenaryModel, strips: FloatArray, contacts: ContactResult) -> None:
        self._model = model
        self._ledger = Ledger(np.zeros(len(strips)))
        self._compensated = 0.0
        self._ends = strips[:, :, 0, 2].copy()
        self._presses = _presses(strips, contacts)
        modes = model.modes
        self._modal, self._attached = np.zeros(len(modes.eigenvalue)), np.zeros(len(modes.attached))
        self._stretch, self._damping = Product(model.dropper_law.B), _Damping(model)

    @property
    def contact_work(self) -> FloatArray:
        """Return the work that each strip has done against its contact [J], shape (P,)."""
        return self._ledger.at_contact

    def balance(self, state: CatenaryState) -> FloatArray:
        """Return the values of `models.numerics.energy_ledger.BALANCE` [J], shape (4,)."""
        return self._ledger.balance(self._model.energy(state) - self._compensated)

    def step(self, state: CatenaryState, step: float, motion: StripMotion) -> ContactResult:
        """Advance the line by one time step; see `CatenaryModel.step`."""
        np.copyto(self._modal, state.motion.modal[0])
        np.copyto(self._attached, state.motion.attached[0])
        loads, slack = [(state.loaded, state.load)], [(state.slack, state.compensation)]
        released = self._released(state)
        result = self._model.step(state, step, motion)
        np.subtract(state.motion.modal[0], self._modal, out=self._modal)
        np.subtract(state.motion.attached[0], self._attached, out=self._attached)
        self._ledger.dissipated += self._damping.form(self._modal, self._attached) / step
        self._ledger.work += self._work([*loads, (state.loaded, state.load)])
        undamped = self._undamped(released, self._released(state))
        self._ledger.dissipated += undamped
        self._compensated += undamped + self._compensation([*slack, (state.slack, state.compensation)])
        self._follow(motion.strip, result)
        return result

    def snapshot(self) -> Snapshot:
        """Return the whole state."""
        own = np.array([self._compensated])
        presses = np.array(self._presses).reshape(-1, 3)
        return self._ledger.snapshot() | {
            "energy.compensated": own, "energy.ends": self._ends.copy(), "energy.presses": presses,
        }  # fmt: skip

    def restore(self, snapshot: Snapshot) -> None:
        """Take over a snapshot."""
        self._ledger.restore(snapshot)
        self._compensated = float(snapshot["energy.compensated"][0])
        self._ends[...] = snapshot["energy.ends"]
        self._presses = [(int(p), share, force) for p, share, force in snapshot["energy.presses"].tolist()]

    def _work(self, instants: Sequence[tuple[IntArray, FloatArray]]) -> float:
        """Return the work of the contact forces over a step, each where it acts, half for each instant."""
        total = 0.0
        for loaded, load in instants:
            for (s, element), (xi, force) in zip(loaded.tolist(), load.tolist(), strict=True):
                interval = self._model.wires[s].interval(element)
                modal, ends = interval.split(interval.lift(element, xi)[0])
                rise = modal.dot(self._modal[interval.modes]) + ends.dot(self._attached[interval.ends])
                total += 0.5 * force * float(rise)
        return total

    def _compensation(self, instants: Sequence[tuple[IntArray, FloatArray]]) -> float:
        """Return the work over a step of the forces that slack droppers lack to their elastic ones."""
        rest = self._model.dropper_law.rest_compensation
        if not rest.any() and not any(slack.size for slack, _ in instants):
            return 0.0
        stretch = np.zeros(len(rest))
        self._stretch.add(self._attached, stretch)
        lacking = sum(0.5 * float(force @ stretch[slack]) for slack, force in instants)
        return float(rest @ stretch) - lacking

    def _released(self, state: CatenaryState) -> FloatArray:
        """Return what slack takes off the droppers besides their springs' compression [N], shape (n_droppers,)."""
        model = self._model
        released = np.zeros(len(model.dropper_law.slack_delay))
        if model.dropper_law.slack_delay.any():
            released[state.slack] = state.compensation
            released -= model.dropper_law.unilateral * np.maximum(-model.spring_force(state), 0.0)
            released[model.dropper_law.slack_delay == 0.0] = 0.0
        return released

    def _undamped(self, *instants: FloatArray) -> float:
        """Return the work over a step of what is `_released`."""
        if not any(released.any() for released in instants):
            return 0.0
        stretch = np.zeros(len(instants[0]))
        self._stretch.add(self._attached, stretch)
        return sum(0.5 * float(released @ stretch) for released in instants)

    def _follow(self, strips: FloatArray, result: ContactResult) -> None:
        """Add what the strips have done against the contacts since the last step."""
        ends = strips[:, :, 0, 2]
        rises = (ends - self._ends).tolist()
        now = _presses(strips, result)
        for p, share, force in (*self._presses, *now):
            a, b = rises[p]
            self._ledger.at_contact[p] += 0.5 * force * (a + share * (b - a))
        self._ends[...] = ends
        self._presses = now


class _Damping:
    """The line's damping as a quadratic form: C = diag(alpha lambda + beta) + beta G + (beta G)' + C_x."""

    def __init__(self, model: CatenaryModel) -> None:
        modes = model.modes
        self._own = modes.alpha * modes.eigenvalue + modes.beta
        upper = 2.0 * sp.triu(modes.C, 1) + sp.diags(modes.C.diagonal())
        self._attached = Product(upper)
        self._coupling = Product(2.0 * sp.diags(modes.beta) @ modes.coupling @ modes.turn)
        self._across = bool(modes.beta.any())
        self._work, self._felt = np.empty(len(self._own)), np.empty(len(modes.attached))

    def form(self, modal: FloatArray, attached: FloatArray) -> float:
        """Return s . C s of coordinates s = (q, x)."""
        np.multiply(self._own, modal, out=self._work)
        if self._across:
            self._coupling.add(attached, self._work)
        self._felt[...] = 0.0
        self._attached.add(attached, self._felt)
        return inner(self._work, modal) + inner(self._felt, attached)


def _presses(strips: FloatArray, contacts: ContactResult) -> list[_Press]:
    found = []
    for p, s in np.argwhere(contacts.force).tolist():
        (ax, ay), (bx, by) = strips[p, :, 0, :2].tolist()
        x, y, _ = contacts.point[p, s].tolist()
        length2 = (bx - ax) ** 2 + (by - ay) ** 2
        share = ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length2
        found.append((p, share, contacts.force.item(p, s)))
    return found

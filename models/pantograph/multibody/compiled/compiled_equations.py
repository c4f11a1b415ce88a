"""A mechanism's equations of motion in compiled kernels."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from models.arrays import FloatArray
from models.numerics.kernel_cache import joined, kernels_if_wanted
from models.pantograph.multibody.compiled.mechanism_tables import MechanismTables, tables_of, unknown_to_kernels
from models.pantograph.multibody.elements.joints import ConstraintValues
from models.pantograph.multibody.mechanism import NO_INPUTS, Evaluation, Inputs, Mechanism
from models.pantograph.multibody.mechanism_integrator import (
    PROJECT_POSITIONS,
    PROJECT_VELOCITIES,
    VELOCITY_SCALE,
    Equations,
    History,
    Trial,
)
from models.pantograph.multibody.step_memory import flat_inputs

if TYPE_CHECKING:  # an FMU carries what is imported, and these are never imported by their names
    from models.pantograph.multibody.compiled import element_kernels as _  # noqa: F401
    from models.pantograph.multibody.compiled import mechanism_kernels as __  # noqa: F401

#: Read now: an FMU's folder may be gone when a second instance asks for the kernels.
_SOURCE: Final = joined(Path(__file__).with_name(f"{name}_kernels.py") for name in ("element", "mechanism"))


class CompiledEquations:
    """The equations of motion in compiled kernels, and by array operations where these find no answer.

    Parameters
    ----------
    mechanism : Mechanism
        Assembled, its springs settled, its cam fitted.
    kernels : module
        `element_kernels` and `mechanism_kernels`, compiled.
    """

    def __init__(self, mechanism: Mechanism, kernels: ModuleType) -> None:
        self._mechanism, self._kernels = mechanism, kernels
        self._work = self._results()
        self.refresh()

    def refresh(self) -> None:
        """Take the mechanism's tables again: a curve of its lift was fitted."""
        self._fitted = self._mechanism.forces.per_force
        self._known = tables_of(self._mechanism)

    def rehearse(self, y: FloatArray) -> None:
        """Try everything on a state, so that the first real step finds it compiled: a paced run must not wait."""
        last = self.evaluate(y.copy(), NO_INPUTS, respond=True)
        self.continued(y, last.rates, History(1e-6, last.rates, last.rates), NO_INPUTS, NO_INPUTS, 1e-6)
        self.with_inputs(y, last.acceleration, last.response, NO_INPUTS, NO_INPUTS)
        self.strip_ends(y)
        self.has_strayed(y, last.constraints)

    def strip_ends(self, y: FloatArray) -> FloatArray:
        """Return what `Mechanism.strip_ends` does."""
        ends = np.empty((2, 2, 3))
        self._kernels.strip_ends(*self._tables(), y, ends)
        return ends

    def has_strayed(self, y: FloatArray, values: ConstraintValues) -> bool:
        """Return whether a state is to be projected; see `Equations`."""
        return self._kernels.has_strayed(y, values.violation, values.rate, PROJECT_POSITIONS, PROJECT_VELOCITIES)

    def evaluate(self, y: FloatArray, inputs: Inputs, *, respond: bool = False) -> Evaluation:
        """Return what `Mechanism.evaluate` does."""
        to = self._results()
        if not self._kernels.evaluate(*self._tables(), y, _flat(inputs), respond, *to):
            return self._mechanism.evaluate(y, inputs, respond=respond)
        violation, rate, gamma = to.found
        values = ConstraintValues(violation, rate, gamma, to.jacobian)
        return Evaluation(to.rates, to.acceleration, to.multipliers, values, to.response)

    def _rates(self, y: FloatArray, inputs: Inputs) -> FloatArray:
        """Return the rates alone; all else is written over the next time."""
        rates, (_, *rest) = np.empty(len(y)), self._work
        if not self._kernels.evaluate(*self._tables(), y, _flat(inputs), False, rates, *rest):
            return self._mechanism.evaluate(y, inputs).rates
        return rates

    def _results(self) -> _Results:
        n, m = self._mechanism.count, self._mechanism.constraints.count
        response, jacobian = np.zeros((n, 6, 4)), np.zeros((m, n, 6))
        return _Results(np.empty(13 * n), np.empty((n, 6)), response, np.empty((3, m)), np.empty(m), jacobian)

    def with_inputs(
        self, y: FloatArray, acceleration: FloatArray, response: FloatArray, old: Inputs, new: Inputs
    ) -> tuple[FloatArray, FloatArray]:
        """Return what `Mechanism.with_inputs` does."""
        rates, difference = np.empty((2, len(y)))
        acting = _flat(old), _flat(new)
        self._kernels.changed(*self._tables(), y, acceleration, response, *acting, rates, difference)
        return rates, difference

    def continued(
        self, y: FloatArray, first: FloatArray, history: History, at_middle: Inputs, at_end: Inputs, h: float
    ) -> Trial:
        """Take a step; see `Equations`."""
        kernels, (half, predicted, moving) = self._kernels, np.empty((3, len(y)))
        kernels.half_way(y, first, history.middle, history.begin, h, half, moving)
        middle = self._rates(half, at_middle)
        kernels.ahead(y, first, history.middle, middle, h, predicted, moving)
        last, new = self.evaluate(predicted, at_end, respond=True), np.empty(len(y))
        error = kernels.corrected(y, first, middle, last.rates, h, VELOCITY_SCALE, half, predicted, new, moving)
        return Trial(new, last, middle, error)

    def _tables(self) -> MechanismTables:
        if self._fitted is not self._mechanism.forces.per_force:
            self.refresh()
        return self._known


class _Results(NamedTuple):
    """What an evaluation writes, in the order in which the kernel takes it."""

    rates: FloatArray
    acceleration: FloatArray
    response: FloatArray
    found: FloatArray
    multipliers: FloatArray
    jacobian: FloatArray


def _flat(inputs: Inputs) -> FloatArray:
    return np.array(flat_inputs(inputs))


def compiled_equations(mechanism: Mechanism, state: FloatArray) -> Equations | None:
    """Return the equations of motion of a mechanism in kernels, tried on a state, None where there are none for it.

    Raises
    ------
    KernelError
        If the environment asks for kernels that cannot be had, or for ones that do not exist.
    """
    kernels = kernels_if_wanted("mechanism", _SOURCE)
    if kernels is None or unknown_to_kernels(mechanism):
        return None
    equations = CompiledEquations(mechanism, kernels)
    equations.rehearse(state)
    return equations

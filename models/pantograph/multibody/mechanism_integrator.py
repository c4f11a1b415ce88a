"""Error-controlled steps that land exactly on a given time.

Both formulas are of fourth order and have the rates at the middle and the end of a step. Where the step before had
the same length, its rates are continued by a parabola to predict the middle, then the end, and Simpson's rule
corrects: two evaluations of the equations of motion a step. Otherwise (start, change of step, kink of an input) it
is the classical Runge-Kutta formula with the rates at its end as fifth stage. The error estimates, h/6 times a third
difference of the rates, are of third order. The rates at the end begin the next step; its accelerations are outputs.

After each step the constraints are checked; positions and velocities are projected long before the violation matters.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Final, NamedTuple, Protocol

import numpy as np

from models.arrays import FloatArray
from models.pantograph.multibody.elements.joints import ConstraintValues
from models.pantograph.multibody.mechanism import Evaluation, Inputs, Mechanism, MechanismError
from models.pantograph.multibody.mechanism_assembly import project

#: Violation [m, 1] and rate of violation [m/s, 1/s] at which the state is projected on the constraints.
PROJECT_POSITIONS: Final = 5e-9
PROJECT_VELOCITIES: Final = 5e-8
#: Velocity error counted like 1 m of position error [m/s].
VELOCITY_SCALE: Final = 100.0
SMALLEST_STEP: Final = 1e-9
#: A step grows only where it may grow by at least this much: steps of one length are cheaper.
_GROWTH: Final = 2.0

#: Inputs at a time, as they are in the piece of a step that another time lies in: they may jump where pieces meet.
InputsAt = Callable[[float, float], Inputs]


class History(NamedTuple):
    """Rates in the step before.

    Attributes
    ----------
    step : float
        Its length [s].
    middle, begin : ndarray, shape (13 n,)
        Rates at its middle and its beginning.
    """

    step: float
    middle: FloatArray
    begin: FloatArray


class Advance(NamedTuple):
    """Where an advance has ended.

    Attributes
    ----------
    y : ndarray, shape (13 n,)
        State.
    step : float
        Internal step to try next [s].
    evaluation : Evaluation
        Equations of motion at the end.
    inputs : Inputs
        What acted then, in the last piece.
    history : History or None
        What the next step may continue.
    steps, evaluations : int
        Internal steps taken, evaluations of the equations of motion.
    """

    y: FloatArray
    step: float
    evaluation: Evaluation
    inputs: Inputs
    history: History | None
    steps: int
    evaluations: int


class Trial(NamedTuple):
    """A step that was tried.

    Attributes
    ----------
    y : ndarray, shape (13 n,)
        State at its end.
    last : Evaluation
        Equations of motion there.
    middle : ndarray, shape (13 n,)
        Rates at its middle.
    error : float
        Estimated error [m]; that of velocities divided by ``VELOCITY_SCALE``.
    """

    y: FloatArray
    last: Evaluation
    middle: FloatArray
    error: float


class Equations(Protocol):
    """A mechanism's equations of motion as the integrator asks for them, in a row of steps."""

    def evaluate(self, y: FloatArray, inputs: Inputs, *, respond: bool = False) -> Evaluation:
        """Return what `Mechanism.evaluate` does; what is not asked for may be left out of it."""

    def with_inputs(
        self, y: FloatArray, acceleration: FloatArray, response: FloatArray, old: Inputs, new: Inputs
    ) -> tuple[FloatArray, FloatArray]:
        """Return what `Mechanism.with_inputs` does."""

    def strip_ends(self, y: FloatArray) -> FloatArray:
        """Return what `Mechanism.strip_ends` does."""

    def has_strayed(self, y: FloatArray, values: ConstraintValues) -> bool:
        """Return whether the constraints or the lengths of Euler parameters are violated by more than the limits."""

    def continued(
        self, y: FloatArray, first: FloatArray, history: History, at_middle: Inputs, at_end: Inputs, h: float
    ) -> Trial:
        """Predict by the parabola through the last three rates, correct by Simpson's rule.

        Positions take one more integration of the velocities, predicted and corrected: one order more.
        """


class PlainEquations:
    """The equations of motion by array operations; the reference for any others."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        self.evaluate, self.with_inputs = mechanism.evaluate, mechanism.with_inputs
        self.strip_ends = mechanism.strip_ends

    def has_strayed(self, y: FloatArray, values: ConstraintValues) -> bool:
        """Return whether a state is to be projected; see `Equations`."""
        n = self.mechanism.count
        position = np.abs(values.violation).max(initial=0.0)
        velocity = np.abs(values.rate).max(initial=0.0)
        length = np.abs((y[3 * n : 7 * n].reshape(n, 4) ** 2).sum(axis=1) - 1.0).max()
        return not (position <= PROJECT_POSITIONS and velocity <= PROJECT_VELOCITIES and length <= PROJECT_POSITIONS)

    def continued(
        self, y: FloatArray, first: FloatArray, history: History, at_middle: Inputs, at_end: Inputs, h: float
    ) -> Trial:
        """Take a step; see `Equations`."""
        evaluate, place = self.evaluate, 7 * self.mechanism.count
        before, begin = history.middle, history.begin
        half = y + (h / 24.0) * (23.0 * first - 16.0 * before + 5.0 * begin)
        moving = self.mechanism.position_rates(half)
        known = begin[:place] - 5.0 * before[:place] + 19.0 * first[:place]
        half[:place] = y[:place] + (h / 48.0) * (known + 9.0 * moving)
        middle = evaluate(half, at_middle).rates
        predicted = y + (h / 6.0) * (before - 2.0 * first + 7.0 * middle)
        moving = self.mechanism.position_rates(predicted)
        predicted[:place] = y[:place] + (h / 6.0) * (first[:place] + 4.0 * middle[:place] + moving)
        last = evaluate(predicted, at_end, respond=True)
        new = y + (h / 6.0) * (first + 4.0 * middle + last.rates)
        error = error_of(new - predicted)
        half[place:] = y[place:] + (h / 24.0) * (5.0 * first + 8.0 * middle - last.rates)[place:]
        moving = 4.0 * self.mechanism.position_rates(half) + self.mechanism.position_rates(new)
        new[:place] = y[:place] + (h / 6.0) * (first[:place] + moving)
        return Trial(new, last, middle, error)


def error_of(difference: FloatArray) -> float:
    """Return the largest difference of two states, shape (13 n,), velocities divided by ``VELOCITY_SCALE`` [m]."""
    size = np.abs(difference)
    size[len(size) // 13 * 7 :] *= 1.0 / VELOCITY_SCALE
    return float(size.max())


def ends_of_pieces(duration: float, kinks: Iterable[float]) -> list[float]:
    """Return where the pieces of a step end that kinks divide it into; the last one ends with it."""
    return sorted({t for t in kinks if SMALLEST_STEP < t < duration - SMALLEST_STEP} | {duration})


class Integrator:
    """The integrator of one mechanism: it advances states.

    Parameters
    ----------
    mechanism : Mechanism
    tolerance : float
        Local error per internal step [m]; velocities take ``VELOCITY_SCALE`` times it.
    largest_step : float
        [s]

    Attributes
    ----------
    equations : Equations
        Of the mechanism: by array operations, unless others are put there.
    """

    def __init__(self, mechanism: Mechanism, tolerance: float, largest_step: float) -> None:
        self.mechanism = mechanism
        self.tolerance = tolerance
        self.largest_step = largest_step
        self.equations: Equations = PlainEquations(mechanism)

    def advance(
        self,
        y: FloatArray,
        inputs_at: InputsAt,
        duration: float,
        step: float,
        kinks: tuple[float, ...] = (),
        first: FloatArray | None = None,
        history: History | None = None,
    ) -> Advance:
        """Integrate over ``duration`` [s]; times count from its beginning.

        Parameters
        ----------
        y : ndarray, shape (13 n,)
        inputs_at : callable
            Inputs at a time in the piece that another lies in.
        duration : float
        step : float
            Internal step to try first [s].
        kinks : tuple of float
            Times at which inputs may have a kink or jump: internal steps end there.
        first : ndarray, shape (13 n,), optional
            Rates at the beginning, if they are known.
        history : History, optional
            Of the step before, under inputs that these continue.

        Raises
        ------
        MechanismError
            If no step is small enough, or the joints come apart.
        """
        ends = ends_of_pieces(duration, kinks)
        if any(abs(t) <= SMALLEST_STEP for t in kinks):
            history = None
        now, steps, evaluations = 0.0, 0, 0
        inputs = None
        for end in ends:
            inside = 0.5 * (now + end)
            if first is None or (inputs is not None and inputs != inputs_at(now, inside)):
                y = y.copy()
                first, evaluations = self.equations.evaluate(y, inputs_at(now, inside)).rates, evaluations + 1
            while now < end:
                longest = min(step, self.largest_step, duration)
                pieces = max(1, math.ceil((end - now) / longest - 1e-6))
                h = (end - now) / pieces
                continues = history is not None and abs(history.step - h) <= 1e-9 * h
                at_middle, at_end = inputs_at(now + 0.5 * h, inside), inputs_at(now + h, inside)
                if history is not None and continues:
                    trial = self.equations.continued(y, first, history, at_middle, at_end, h)
                else:
                    trial = self._started(y, first, at_middle, at_end, h)
                error = trial.error / self.tolerance
                evaluations += 2 if continues else 4
                if not error <= 1.0:
                    step = h * self._factor(error)
                    self._check_step(step)
                    history = None
                    continue
                reached, now, steps = now + h, end if pieces == 1 else now + h, steps + 1
                inputs = at_end if reached == now else inputs_at(now, inside)
                y, evaluation, projected = self._corrected(trial, inputs)
                history, first = History(h, trial.middle, first), evaluation.rates
                evaluations += projected
                growth = self._factor(error)
                step = min(longest * growth if growth >= _GROWTH else longest, self.largest_step)
            history = history if end == duration else None
        assert inputs is not None
        return Advance(y, step, evaluation, inputs, history, steps, evaluations)

    def _started(self, y: FloatArray, first: FloatArray, at_middle: Inputs, at_end: Inputs, h: float) -> Trial:
        """Take a Runge-Kutta step."""
        evaluate = self.equations.evaluate
        k2 = evaluate(y + (0.5 * h) * first, at_middle).rates
        k3 = evaluate(y + (0.5 * h) * k2, at_middle).rates
        k4 = evaluate(y + h * k3, at_end).rates
        new = y + (h / 6.0) * (first + 2.0 * (k2 + k3) + k4)
        last = evaluate(new, at_end, respond=True)
        return Trial(new, last, k3, error_of((h / 6.0) * (k4 - last.rates)))

    def _factor(self, error: float) -> float:
        if not np.isfinite(error):
            return 0.1
        return float(min(4.0, max(0.1, 0.9 * max(error, 1e-10) ** -0.25)))

    def _check_step(self, step: float) -> None:
        if step < SMALLEST_STEP:
            raise MechanismError(
                f"{self.mechanism.definition.name}: the error control wants a step below {SMALLEST_STEP:g} s: "
                "a force or the motion has become singular (a dead centre, an input that is not a number?)"
            )

    def _corrected(self, trial: Trial, inputs: Inputs) -> tuple[FloatArray, Evaluation, int]:
        """Project if the constraints are violated by more than the limits."""
        if not self.equations.has_strayed(trial.y, trial.last.constraints):
            return trial.y, trial.last, 0
        y = project(self.mechanism, trial.y)
        return y, self.equations.evaluate(y, inputs, respond=True), 1

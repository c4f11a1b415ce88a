"""Error-controlled steps that land exactly on a given time.

Both formulas are of fourth order and have the rates at the middle and the end of a step. Where the step before had
the same length, its rates are continued by a parabola to predict the middle, then the end, and Simpson's rule
corrects: two evaluations of the equations of motion a step. Otherwise (start, change of step, kink of an input) it
is the classical Runge-Kutta formula with the rates at its end as fifth stage. The error estimates, h/6 times a third
difference of the rates, are of third order. The rates at the end begin the next step; its accelerations are outputs.

After each step the constraints are checked; positions and velocities are projected long before the violation matters.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np

from models.arrays import FloatArray
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

InputsAt = Callable[[float], Inputs]


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
    history : History or None
        What the next step may continue.
    steps, evaluations : int
        Internal steps taken, evaluations of the equations of motion.
    """

    y: FloatArray
    step: float
    evaluation: Evaluation
    history: History | None
    steps: int
    evaluations: int


class Integrator:
    """The integrator of one mechanism: it advances states.

    Parameters
    ----------
    mechanism : Mechanism
    tolerance : float
        Local error per internal step [m]; velocities take ``VELOCITY_SCALE`` times it.
    largest_step : float
        [s]
    """

    def __init__(self, mechanism: Mechanism, tolerance: float, largest_step: float) -> None:
        self.mechanism = mechanism
        self.tolerance = tolerance
        self.largest_step = largest_step
        n = mechanism.count
        self._weights = np.ones(13 * n)
        self._weights[7 * n :] = 1.0 / VELOCITY_SCALE

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
            Inputs at a time.
        duration : float
        step : float
            Internal step to try first [s].
        kinks : tuple of float
            Times at which inputs may have a kink: internal steps end there.
        first : ndarray, shape (13 n,), optional
            Rates at the beginning, if they are known.
        history : History, optional
            Of the step before, under inputs that these continue.

        Raises
        ------
        MechanismError
            If no step is small enough, or the joints come apart.
        """
        ends = sorted({t for t in kinks if SMALLEST_STEP < t < duration - SMALLEST_STEP} | {duration})
        if any(abs(t) <= SMALLEST_STEP for t in kinks):
            history = None
        now, steps, evaluations = 0.0, 0, 0
        if first is None:
            y = y.copy()
            first, evaluations = self.mechanism.evaluate(y, inputs_at(0.0)).rates, 1
        for end in ends:
            while now < end:
                trial = min(step, self.largest_step, duration)
                pieces = max(1, int(np.ceil((end - now) / trial - 1e-6)))
                h = (end - now) / pieces
                continues = history is not None and abs(history.step - h) <= 1e-9 * h
                if history is not None and continues:
                    new_y, last, middle, error = self._continued(y, first, history, inputs_at, now, h)
                else:
                    new_y, last, middle, error = self._started(y, first, inputs_at, now, h)
                evaluations += 2 if continues else 4
                if not error <= 1.0:
                    step = h * self._factor(error)
                    self._check_step(step)
                    history = None
                    continue
                now, steps = end if pieces == 1 else now + h, steps + 1
                y, evaluation, projected = self._corrected(new_y, last, inputs_at, now)
                history, first = History(h, middle, first), evaluation.rates
                evaluations += projected
                growth = self._factor(error)
                step = min(trial * growth if growth >= _GROWTH else trial, self.largest_step)
            history = history if end == duration else None
        return Advance(y, step, evaluation, history, steps, evaluations)

    def _continued(
        self, y: FloatArray, first: FloatArray, history: History, inputs_at: InputsAt, now: float, h: float
    ) -> tuple[FloatArray, Evaluation, FloatArray, float]:
        """Predict by the parabola through the last three rates, correct by Simpson's rule.

        Positions take one more integration of the velocities, predicted and corrected: one order more.
        """
        evaluate, place = self.mechanism.evaluate, 7 * self.mechanism.count
        before, begin = history.middle, history.begin
        half = y + (h / 24.0) * (23.0 * first - 16.0 * before + 5.0 * begin)
        moving = self.mechanism.position_rates(half)
        known = begin[:place] - 5.0 * before[:place] + 19.0 * first[:place]
        half[:place] = y[:place] + (h / 48.0) * (known + 9.0 * moving)
        middle = evaluate(half, inputs_at(now + 0.5 * h)).rates
        predicted = y + (h / 6.0) * (before - 2.0 * first + 7.0 * middle)
        moving = self.mechanism.position_rates(predicted)
        predicted[:place] = y[:place] + (h / 6.0) * (first[:place] + 4.0 * middle[:place] + moving)
        last = evaluate(predicted, inputs_at(now + h), respond=True)
        new = y + (h / 6.0) * (first + 4.0 * middle + last.rates)
        error = self._error(new - predicted)
        half[place:] = y[place:] + (h / 24.0) * (5.0 * first + 8.0 * middle - last.rates)[place:]
        moving = 4.0 * self.mechanism.position_rates(half) + self.mechanism.position_rates(new)
        new[:place] = y[:place] + (h / 6.0) * (first[:place] + moving)
        return new, last, middle, error

    def _started(
        self, y: FloatArray, first: FloatArray, inputs_at: InputsAt, now: float, h: float
    ) -> tuple[FloatArray, Evaluation, FloatArray, float]:
        """Take a Runge-Kutta step."""
        evaluate = self.mechanism.evaluate
        at_middle, at_end = inputs_at(now + 0.5 * h), inputs_at(now + h)
        k2 = evaluate(y + (0.5 * h) * first, at_middle).rates
        k3 = evaluate(y + (0.5 * h) * k2, at_middle).rates
        k4 = evaluate(y + h * k3, at_end).rates
        new = y + (h / 6.0) * (first + 2.0 * (k2 + k3) + k4)
        last = evaluate(new, at_end, respond=True)
        return new, last, k3, self._error((h / 6.0) * (k4 - last.rates))

    def _error(self, difference: FloatArray) -> float:
        """Return the error in units of the tolerance."""
        return float(np.abs(difference * self._weights).max()) / self.tolerance

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

    def _corrected(
        self, y: FloatArray, last: Evaluation, inputs_at: InputsAt, now: float
    ) -> tuple[FloatArray, Evaluation, int]:
        """Project if the constraints are violated by more than the limits."""
        values = last.constraints
        position = np.abs(values.violation).max(initial=0.0)
        velocity = np.abs(values.rate).max(initial=0.0)
        n = self.mechanism.count
        length = np.abs((y[3 * n : 7 * n].reshape(n, 4) ** 2).sum(axis=1) - 1.0).max()
        if position <= PROJECT_POSITIONS and velocity <= PROJECT_VELOCITIES and length <= PROJECT_POSITIONS:
            return y, last, 0
        y = project(self.mechanism, y)
        return y, self.mechanism.evaluate(y, inputs_at(now), respond=True), 1

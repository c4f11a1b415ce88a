"""Find the value of a parameter (usually the static force) that gives the wanted mean contact force."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from master.errors import MasterError, RequestError
from master.results.run_results import Results
from master.safety import folder_lock
from master.safety.safe_files import write_atomically
from master.scenario.overrides import find_parameter
from master.ssp.run_settings import Calibration
from master.system.components import System

MAX_RUNS: Final = 12
#: Suffixes of the files of a scenario that hold values.
_TEXTS: Final = (".ssd", ".ssv", ".ssm", ".csv", ".toml")
#: First change to be tried, as a share of the start value.
_FIRST_CHANGE: Final = 0.03


@dataclass(frozen=True)
class CalibrationTrial:
    """One run of a calibration: the value of the parameter and the result."""

    value: float
    result: float


@dataclass(frozen=True)
class CalibrationResult:
    """The value that a calibration has found, its result, and all trials in order."""

    value: float
    result: float
    trials: tuple[CalibrationTrial, ...]


def task(system: System, parameter: str | None, mean: float | None, tolerance: float | None) -> Calibration:
    """Return what to calibrate to which mean force: as asked for, else as the scenario says.

    Raises
    ------
    RequestError
        If neither says it.
    """
    known = system.settings.calibration
    parameter = parameter or (known.parameter if known else None)
    mean = mean or (known.mean_force if known else None)
    if parameter is None or mean is None:
        raise RequestError(
            "the scenario does not say what to calibrate to which mean force; give --parameter and --mean"
        )
    tolerance = tolerance or (known.tolerance if known else 0.1)
    is_known = known is not None and parameter == known.parameter
    contact = known.contact if known and is_known else _contact_of(system, parameter)
    return Calibration(parameter=parameter, meanForce=mean, tolerance=tolerance, contact=contact)


def _contact_of(system: System, parameter: str) -> int:
    """Return the contact of the pantograph that a parameter belongs to, else the first."""
    return next((c.index for c in system.contacts if parameter.startswith(f"{c.pantograph}.")), 1)


def start_value(system: System, parameter: str) -> float:
    """Return the value that a Real parameter has in the scenario.

    Raises
    ------
    RequestError
        If there is no such parameter.
    """
    index, variable = find_parameter(system.components, parameter)
    if variable.type != "Real":
        raise RequestError(f"parameter '{parameter}' is not Real and cannot be calibrated")
    return float(system.components[index].parameters.get(variable.name, variable.start or 0.0))


def mean_force(done: Results, wanted: Calibration) -> float:
    """Return the mean force of the calibrated contact in the interval of interest [N].

    Raises
    ------
    MasterError
        If it has no figures there.
    """
    for assessment in done.assessments():
        if assessment.quality.contact == wanted.contact:
            return assessment.quality.mean
    raise MasterError(
        f"contact {wanted.contact} has no figures in the interval of interest; so there is nothing to calibrate"
    )


def find_value(
    function: Callable[[float], float],
    target: float,
    start: float,
    tolerance: float,
    guess: float | None = None,
) -> CalibrationResult:
    """Return the value at which ``function`` gives ``target``.

    By secant steps, kept inside a bracket once there is one.

    Parameters
    ----------
    function : callable
        Value -> result; every call is a whole run.
    target, tolerance : float
        Wanted result, and how near to it is enough.
    start : float
        First value tried.
    guess : float, optional
        Second value; by default ``start`` plus the first miss (right if both are the same quantity).

    Raises
    ------
    MasterError
        If it is not found within `MAX_RUNS` runs, or the result does not depend on the value.
    """
    trials = [CalibrationTrial(start, function(start))]
    while abs(trials[-1].result - target) > tolerance:
        if len(trials) >= MAX_RUNS:
            raise MasterError(
                f"no value found after {MAX_RUNS} runs; the last was {trials[-1].value:g}, "
                f"giving {trials[-1].result:g}; widen the tolerance or start nearer"
            )
        value = _first_step(trials[0], target, guess) if len(trials) == 1 else _next(trials, target)
        trials.append(CalibrationTrial(value, function(value)))
    return CalibrationResult(trials[-1].value, trials[-1].result, tuple(trials))


def find_values(
    function: Callable[[tuple[float, ...]], tuple[float, ...]],
    target: float,
    starts: Sequence[float],
    tolerance: float,
) -> tuple[CalibrationResult, ...]:
    """Return the values at which every result of ``function`` is ``target``, all found in the same runs.

    Each result must depend mainly on the value in the same place, for every value takes its own secant steps.

    Parameters
    ----------
    function : callable
        Values -> as many results; every call is a whole run.
    target, tolerance : float
        Wanted result, and how near to it is enough.
    starts : sequence of float
        First values tried.

    Raises
    ------
    MasterError
        If they are not found within `MAX_RUNS` runs, or a result does not depend on its value.
    """
    values = tuple(starts)
    trials: list[list[CalibrationTrial]] = [[] for _ in values]
    for _ in range(MAX_RUNS):
        for own, value, result in zip(trials, values, function(values), strict=True):
            own.append(CalibrationTrial(value, result))
        if all(abs(own[-1].result - target) <= tolerance for own in trials):
            return tuple(CalibrationResult(own[-1].value, own[-1].result, tuple(own)) for own in trials)
        values = tuple(_next_of_several(own, target, tolerance) for own in trials)
    last = ", ".join(f"{own[-1].value:g} giving {own[-1].result:g}" for own in trials)
    raise MasterError(f"no values found after {MAX_RUNS} runs; the last were {last}; widen the tolerance")


def _next_of_several(trials: list[CalibrationTrial], target: float, tolerance: float) -> float:
    """Return the next value; a good one stays, and runs in which only the others changed are ignored."""
    last = trials[-1]
    if abs(last.result - target) <= 0.5 * tolerance:
        return last.value
    others = [t for t in trials if t.value != last.value]
    return _next([*others, last], target) if others else _first_step(last, target, None)


def _first_step(first: CalibrationTrial, target: float, guess: float | None) -> float:
    if guess is not None:
        return guess
    miss = target - first.result
    bound = max(_FIRST_CHANGE * abs(first.value), 1e-6)
    return first.value + math.copysign(min(abs(miss), 10.0 * bound), miss)


def _next(trials: list[CalibrationTrial], target: float) -> float:
    """Return the value of the secant; the middle of the bracket if the secant leaves it or has hardly helped."""
    a, b = trials[-2], trials[-1]
    bracket = _bracket(trials, target)
    has_helped = abs(b.result - target) <= 0.5 * abs(a.result - target)
    if bracket is not None and not (has_helped and bracket[0] < _secant(a, b, target) < bracket[1]):
        return 0.5 * (bracket[0] + bracket[1])
    value = _secant(a, b, target)
    span = 4.0 * abs(b.value - a.value)
    return min(max(value, b.value - span), b.value + span)


def _secant(a: CalibrationTrial, b: CalibrationTrial, target: float) -> float:
    if a.result == b.result:
        raise MasterError(
            f"the result {b.result:g} does not depend on the parameter (tried {a.value:g} and {b.value:g})"
        )
    return b.value + (target - b.result) * (b.value - a.value) / (b.result - a.result)


def _bracket(trials: list[CalibrationTrial], target: float) -> tuple[float, float] | None:
    below = [t for t in trials if t.result < target]
    above = [t for t in trials if t.result > target]
    if not below or not above:
        return None
    lower = min(below, key=lambda t: target - t.result)
    upper = min(above, key=lambda t: t.result - target)
    return min(lower.value, upper.value), max(lower.value, upper.value)


@contextmanager
def unchanged(folder: Path) -> Iterator[Callable[[], None]]:
    """Work on a scenario that a value is stored in at the end; yields a check that nobody else changed it.

    Must be entered before the scenario is read.

    Parameters
    ----------
    folder : Path
        The scenario's folder, in which one calibration at a time may work.

    Raises
    ------
    FolderInUseError
        If another calibration is working there.
    MasterError
        From the check, naming a file that was changed meanwhile.
    """
    with folder_lock.claimed(folder, "wait for it to end, or try with --dry-run"):
        before = _texts(folder)

        def check() -> None:
            now = _texts(folder)
            for path in sorted({*before, *now}):
                if before.get(path) != now.get(path):
                    raise MasterError(f"{path} was changed during the calibration; nothing was stored, run it again")

        yield check


def _texts(folder: Path) -> dict[Path, bytes]:
    """Return the files that determine what is computed; FMUs may be built meanwhile."""
    return {path: path.read_bytes() for path in folder.rglob("*") if path.suffix in _TEXTS and path.is_file()}


def store_value(path: Path, parameter: str, value: float, note: str) -> None:
    """Write the value of a Real parameter into an ``.ssv`` file, leaving the rest of its text as it is.

    A comment before the parameter says how the value was found, and replaces that of an earlier calibration.

    Raises
    ------
    MasterError
        If the parameter does not occur exactly once.
    """
    text = path.read_text(encoding="utf-8")
    pattern = re.compile(
        r"(?P<indent>[ \t]*)(?:<!-- calibrated:[^>]*-->\s*)?"
        rf"(?P<head><ssv:Parameter\s+name=\"{re.escape(parameter)}\"[^>]*>\s*<ssv:Real\s[^>]*?value=\")[^\"]*(?P<tail>\")"
    )
    found = list(pattern.finditer(text))
    if len(found) != 1:
        raise MasterError(f"{path}: parameter '{parameter}' occurs {len(found)} times as ssv:Real; it must occur once")
    m = found[0]
    comment = f"<!-- calibrated: {note.replace('--', '- -').replace('>', '')} -->"
    new = f"{m['indent']}{comment}\n{m['indent']}{m['head']}{value:.6g}{m['tail']}"
    write_atomically(path, (text[: m.start()] + new + text[m.end() :]).encode(), "a copy of the scenario elsewhere")

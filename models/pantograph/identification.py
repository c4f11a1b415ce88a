"""Lumped masses, dampers and springs from a measured frequency response of the strip [1]_.

A test rig moves the strip vertically and measures the force it takes. Of a chain of n stages on fixed ground that
response is a continued fraction: the dynamic stiffness of the stages below, seen through spring and damper i, plus
mass i. Its numbers are found by least squares of the relative deviation, from many starts.

References
----------
.. [1] P. Antunes (2012), section 3.4.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from scipy.optimize import least_squares

from models.arrays import ComplexArray, FloatArray
from models.definition_files.message_text import hint, not_utf8, said
from models.definition_files.toml_reader import LARGEST, SMALLEST, DefinitionError, Problem
from models.pantograph.lumped.lumped_rig import chain_stiffness

#: What a response file may hold: displacement per force [m/N], force per acceleration [kg], per displacement [N/m].
RESPONSE_KINDS: Final = ("receptance", "apparent_mass", "dynamic_stiffness")

#: Most stages of a chain that a response at its top can distinguish.
MAX_STAGES: Final = 6
_HIGHEST_FREQUENCY: Final = 1e5
_KINDS: Final = {"m": "mass", "c": "damping", "k": "stiffness", "T": "time constant"}
_STARTS: Final = 40
#: Relative step of differences: the root of the machine precision.
_DIFFERENCE: Final = float(np.finfo(np.float64).eps) ** 0.5
_SEED: Final = 20120
#: Name of the time constant of a lowest spring that hangs on a reference following the height.
_TIME: Final = "T"
#: Range of the starts: masses [kg], dampings [N.s/m], stiffnesses [N/m], that time constant [s].
_RANGES: Final = {"m": (1.0, 30.0), "c": (1.0, 300.0), "k": (30.0, 30000.0), "T": (0.1, 3.0)}
#: Smallest value that a search may reach: below it a damper or spring is as good as none.
_FLOOR: Final = {"m": 1e-3, "c": 1e-4, "k": 1e-3, "T": 0.05}


@dataclass(frozen=True)
class Response:
    """A frequency response at the strip.

    Attributes
    ----------
    frequency : ndarray, shape (f,)
        [Hz]
    stiffness : ndarray, shape (f,)
        Dynamic stiffness: force per displacement, complex [N/m].
    """

    frequency: FloatArray
    stiffness: ComplexArray


@dataclass(frozen=True)
class IdentifiedModel:
    """A lumped model and how well it fits.

    Attributes
    ----------
    masses, dampings, stiffnesses : ndarray, shape (n,)
        Bottom to top [kg, N.s/m, N/m].
    deviations : dict
        Standard deviation of every value found, by name (``m1`` ...), from the residual and the fit's curvature.
    misfit : float
        Root mean square of the relative deviation from the response [1].
    reference_time : float
        Time constant of a lowest spring that hangs on a reference following the height [s]; infinite: on the roof.
    """

    masses: FloatArray
    dampings: FloatArray
    stiffnesses: FloatArray
    deviations: dict[str, float]
    misfit: float
    reference_time: float = math.inf


def read_response(path: Path, kind: str = "receptance") -> Response:
    """Read a CSV file with the columns frequency [Hz], real and imaginary part.

    Parameters
    ----------
    path : Path
    kind : str
        One of ``RESPONSE_KINDS``: what the two parts are of.

    Raises
    ------
    models.definition_files.toml_reader.DefinitionError
        With every line that cannot be used.
    """
    if kind not in RESPONSE_KINDS:
        raise DefinitionError([Problem(str(path), "", f"'{kind}' is none of {', '.join(RESPONSE_KINDS)}")])
    problems: list[Problem] = []
    rows: list[tuple[float, float, float]] = []
    for number, line in _data_lines(_read_lines(path)):
        row = _row(line)
        if isinstance(row, str):
            problems.append(Problem(str(path), f"line {number}", row))
        else:
            rows.append(row)
    if not rows and not problems:
        problems.append(Problem(str(path), "", "has no line of three numbers: frequency, real, imaginary"))
    if problems:
        raise DefinitionError(problems)
    data = np.array(rows)
    return _response(data[:, 0], data[:, 1] + 1j * data[:, 2], kind)


def _read_lines(path: Path) -> list[list[str]]:
    try:
        return list(csv.reader(path.read_text(encoding="utf-8-sig").splitlines()))
    except OSError as error:
        raise DefinitionError([Problem(str(path), "", f"cannot be read ({said(error)})")]) from error
    except UnicodeDecodeError as error:
        raise DefinitionError([Problem(str(path), "", not_utf8(error))]) from error
    except csv.Error as error:
        raise DefinitionError([Problem(str(path), "", f"is not a table with commas ({error})")]) from error


def _data_lines(lines: list[list[str]]) -> list[tuple[int, list[str]]]:
    """Return the lines that must hold numbers, counted from 1: neither empty, nor comments, nor the titles."""
    kept = [
        (number, line)
        for number, line in enumerate(lines, 1)
        if any(cell.strip() for cell in line) and not line[0].lstrip().startswith("#")
    ]
    # Titles name all columns: a first line with a number in it is data, be it faulty.
    has_titles = bool(kept) and not any(_is_number(cell) for cell in kept[0][1])
    return kept[1:] if has_titles else kept


def identify(
    response: Response, stages: int = 3, fixed: Mapping[str, float] | None = None, *, following: bool = False
) -> IdentifiedModel:
    """Fit a lumped model to a response.

    Parameters
    ----------
    response : Response
    stages : int
        Number of masses.
    fixed : mapping, optional
        Values known beforehand, by name: ``m1`` is the lowest mass, ``k3`` the third spring. The source takes the top
        stage from the real pan-head. ``T`` is the time constant of a reference that follows.
    following : bool
        Whether the lowest spring hangs on a reference that follows the height, whose time constant is found too.

    Returns
    -------
    IdentifiedModel

    Raises
    ------
    ValueError
        If the number of stages or a fixed value is not possible, or the response has too few points.
    """
    if not 1 <= stages <= MAX_STAGES:
        raise ValueError(f"{stages} stages: 1 to {MAX_STAGES} can be found")
    given = dict(fixed or {})
    names = [f"{letter}{stage}" for letter in "mck" for stage in range(1, stages + 1)]
    names += [_TIME] if following else []
    unknown = sorted(set(given) - set(names))
    if unknown:
        raise ValueError(
            f"there is no value {', '.join(unknown)} to fix (there are {', '.join(names)}){hint(unknown[0], names)}"
        )
    for name, value in given.items():
        _check_fixed(name, value)
    free = [name for name in names if name not in given]
    if not free:
        raise ValueError("every value is fixed: there is nothing to find")
    if 2 * len(response.frequency) <= len(free):
        raise ValueError(f"{len(response.frequency)} frequencies are too few for {len(free)} unknown values")
    fit = _Fit(response, names, free, given)
    best = min((fit.search(start) for start in fit.starts()), key=lambda result: result[0])
    return fit.model(best[1])


class _Fit:
    """One identification: which values are free, their logarithms x, the deviation at x."""

    def __init__(self, response: Response, names: list[str], free: list[str], given: dict[str, float]) -> None:
        self._response, self._free, self._given = response, free, given
        self._names = [name for name in names if name != _TIME]
        self._follows = _TIME in names
        self._low = np.log([_FLOOR[name[0]] for name in free])
        self._high = np.log([1e3 * _RANGES[name[0]][1] for name in free])

    def starts(self) -> list[FloatArray]:
        """Return the logarithms to start from: always the same ones."""
        random = np.random.default_rng(_SEED)
        low = np.log([_RANGES[name[0]][0] for name in self._free])
        high = np.log([_RANGES[name[0]][1] for name in self._free])
        return [low + random.random(len(low)) * (high - low) for _ in range(_STARTS)]

    def values(self, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return masses, dampings and stiffnesses, shape (n, ...), and the time constant of the reference, shape (...).

        Parameters
        ----------
        x : ndarray, shape (..., free)
        """
        found = dict(zip(self._free, np.moveaxis(np.exp(x), -1, 0), strict=True))
        shape = x.shape[:-1]
        known = {name: np.full(shape, value) for name, value in self._given.items()} | found
        m, c, k = np.array([known[name] for name in self._names]).reshape(3, -1, *shape)
        return m, c, k, known[_TIME] if self._follows else np.full(shape, math.inf)

    def deviation(self, x: FloatArray) -> FloatArray:
        """Return the relative deviation, real and imaginary part, shape (..., 2 f), for x of shape (..., free)."""
        wanted = self._response.stiffness
        m, c, k, time = (value[..., None] for value in self.values(x))
        relative = chain_stiffness(self._response.frequency, m, c, k, time) / wanted - 1.0
        return np.concatenate([relative.real, relative.imag], axis=-1)

    def slope(self, x: FloatArray) -> FloatArray:
        """Return the derivatives of the deviation, shape (2 f, free): differences, all at once."""
        step = _DIFFERENCE * np.where(x < 0.0, -1.0, 1.0) * np.maximum(1.0, np.abs(x))
        step = np.where((x + step < self._low) | (x + step > self._high), -step, step)
        there = self.deviation(np.concatenate([x[None, :], x + np.diag(step)]))
        return ((there[1:] - there[0]) / ((x + step) - x)[:, None]).T

    def search(self, start: FloatArray) -> tuple[float, FloatArray]:
        """Return the cost and place of the minimum found from a start."""
        result = least_squares(self.deviation, start, self.slope, bounds=(self._low, self._high), max_nfev=200)
        return float(result.cost), result.x

    def model(self, x: FloatArray) -> IdentifiedModel:
        """Polish a minimum and say how certain its values are."""
        limits, tight = (self._low, self._high), {"xtol": 1e-13, "ftol": 1e-13, "gtol": 1e-13}
        result = least_squares(self.deviation, x, self.slope, bounds=limits, **tight, max_nfev=500)
        m, c, k, time = self.values(result.x)
        points = len(self._response.frequency)
        variance = 2.0 * result.cost / max(2 * points - len(x), 1)
        spread = np.sqrt(np.maximum(variance * np.diag(np.linalg.pinv(result.jac.T @ result.jac)), 0.0))
        deviations = dict(zip(self._free, (spread * np.exp(result.x)).tolist(), strict=True))
        return IdentifiedModel(m, c, k, deviations, math.sqrt(2.0 * result.cost / points), float(time))


def _check_fixed(name: str, value: float) -> None:
    lowest = SMALLEST if name[0] == "m" else _FLOOR[_TIME] if name == _TIME else 0.0
    if not lowest <= value <= LARGEST:
        rule = "greater than 0" if name[0] == "m" else f"{lowest:g} or greater"
        raise ValueError(f"{name} = {value:g} cannot be: a {_KINDS[name[0]]} must be {rule}, and finite")


def _is_number(cell: str) -> bool:
    try:
        _number(cell)
    except ValueError:
        return False
    return True


def _number(cell: str) -> float:
    # Python reads 1_000, and the digits of every script; in a table they are slips of the pen.
    if "_" in cell or not cell.isascii():
        raise ValueError(f"could not convert string to float: '{cell}'")
    return float(cell)


def _row(line: list[str]) -> tuple[float, float, float] | str:
    """Return the three numbers of a line, or what is wrong with it."""
    if len(line) != 3:
        return f"has {len(line)} columns where frequency, real and imaginary part are needed"
    try:
        f, real, imaginary = (_number(cell) for cell in line)
    except ValueError as error:
        return str(error)
    if not (math.isfinite(f) and math.isfinite(real) and math.isfinite(imaginary)):
        return "holds a value that is not finite"
    if not 0.0 < f <= _HIGHEST_FREQUENCY:
        return f"frequency {f:g} Hz must be greater than 0 and at most {_HIGHEST_FREQUENCY:g} Hz"
    if real == 0.0 and imaginary == 0.0:
        return "the response is 0"
    if not SMALLEST <= max(abs(real), abs(imaginary)) <= LARGEST:
        return f"a response of {real:g} and {imaginary:g} is that of no pantograph"
    return f, real, imaginary


def _response(frequency: FloatArray, values: ComplexArray, kind: str) -> Response:
    if kind == "receptance":
        return Response(frequency, 1.0 / values)
    if kind == "apparent_mass":
        return Response(frequency, -((2.0 * np.pi * frequency) ** 2) * values)
    return Response(frequency, values)

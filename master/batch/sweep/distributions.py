"""Distributions of swept parameters, and samples of several that fill their space evenly."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from master.arrays import FloatArray
from master.batch.sweep.swept_parameter import ParameterReader, SweptParameter
from master.errors import RequestError, hint

Method = Literal["lhs", "sobol"]
_WRITTEN: Final = re.compile(r"\s*(\w+)\s*\((.*)\)\s*")
#: Probabilities are kept this far from 0 and 1, where a normal distribution is infinite.
_LEAST: Final = 1e-12


@dataclass(frozen=True)
class Distribution:
    """The distribution of a parameter.

    Attributes
    ----------
    parameter : SweptParameter
    kind : str
    arguments : tuple of float
        In the parameter's unit.
    """

    parameter: SweptParameter
    kind: str
    arguments: tuple[float, ...]

    @property
    def text(self) -> str:
        """As a user would write it."""
        numbers = ", ".join(f"{a:.12g}" for a in self.arguments)
        return f"{self.kind}({numbers}{' ' + self.parameter.unit if self.parameter.unit else ''})"

    @property
    def is_bounded(self) -> bool:
        """Whether it has a least and a greatest value."""
        return _KINDS[self.kind].is_bounded

    def quantile(self, share: FloatArray) -> FloatArray:
        """Return the values below which these shares of all values lie."""
        with np.errstate(all="ignore"):  # what is not finite is refused with its run
            return _KINDS[self.kind].quantile(np.clip(share, _LEAST, 1.0 - _LEAST), *self.arguments)


@dataclass(frozen=True)
class _Kind:
    """A kind of distribution: how it is written, which arguments are widths, what it demands, its quantiles."""

    written: str
    widths: tuple[bool, ...]
    problem: Callable[..., str]
    quantile: Callable[..., FloatArray]
    is_bounded: bool = True


def _normal_quantile(share: FloatArray, mean: float, sd: float) -> FloatArray:
    from scipy import stats  # here and below: it takes longer than all else that a command imports

    return stats.norm.ppf(share, mean, sd)


def _lognormal_quantile(share: FloatArray, mean: float, sd: float) -> FloatArray:
    """Return quantiles of the lognormal distribution whose own mean and standard deviation these are."""
    variance = np.log1p((sd / mean) ** 2)
    return np.exp(_normal_quantile(share, np.log(mean) - 0.5 * variance, np.sqrt(variance)))


def _truncated_quantile(share: FloatArray, mean: float, sd: float, low: float, high: float) -> FloatArray:
    from scipy import stats

    return stats.truncnorm.ppf(share, (low - mean) / sd, (high - mean) / sd, mean, sd)


def _triangular_quantile(share: FloatArray, low: float, mode: float, high: float) -> FloatArray:
    from scipy import stats

    return stats.triang.ppf(share, (mode - low) / (high - low), low, high - low)


def _width_problem(_: float, sd: float) -> str:
    return "" if sd > 0.0 else "its standard deviation must be greater than 0"


def _lognormal_problem(mean: float, sd: float) -> str:
    return _width_problem(mean, sd) or ("" if mean > 0.0 else "its mean must be greater than 0")


def _order_problem(*bounds: float) -> str:
    return "" if bounds[0] < bounds[-1] and list(bounds) == sorted(bounds) else "its bounds must rise"


def _truncated_problem(mean: float, sd: float, low: float, high: float) -> str:
    return _width_problem(mean, sd) or _order_problem(low, high)


_KINDS: Final = {
    "normal": _Kind("mean, sd", (False, True), _width_problem, _normal_quantile, is_bounded=False),
    "uniform": _Kind("low, high", (False, False), _order_problem, lambda share, low, high: low + share * (high - low)),
    "lognormal": _Kind("mean, sd", (False, True), _lognormal_problem, _lognormal_quantile, is_bounded=False),
    "truncnormal": _Kind("mean, sd, low, high", (False, True, False, False), _truncated_problem, _truncated_quantile),
    "triangular": _Kind("low, mode, high", (False, False, False), _order_problem, _triangular_quantile),
}


def read_distribution(reader: ParameterReader, text: str) -> Distribution:
    """Return the distribution that a text describes, such as ``normal(20kN, 0.2kN)``.

    Raises
    ------
    RequestError
        If there is no such distribution, or none with such numbers.
    """
    known = ", ".join(f"{name}({kind.written})" for name, kind in _KINDS.items())
    match = _WRITTEN.fullmatch(text)
    if match is None:
        raise RequestError(f"{reader.name}: '{text}' is not a distribution; known: {known}")
    name = match[1]
    if name not in _KINDS:
        raise RequestError(f"{reader.name}: there is no distribution '{name}'{hint(name, _KINDS)}; known: {known}")
    kind = _KINDS[name]
    parameter, arguments = reader.arguments(match[2], kind.widths)
    if problem := kind.problem(*arguments):
        raise RequestError(f"{reader.name}: {text.strip()} is impossible: {problem}")
    return Distribution(parameter, name, arguments)


def check_power_of_two(count: int) -> None:
    """Raise a `RequestError` if a Sobol sequence of this length would not be balanced."""
    if count & (count - 1):
        near = 1 << max(0, round(np.log2(count)))
        raise RequestError(f"a Sobol sequence has a power of two of samples, not {count}; take {near}")


def draw(distributions: Sequence[Distribution], count: int, seed: int, method: Method = "lhs") -> FloatArray:
    """Return samples of independent parameters, shape (count, n_parameters), the same for the same seed.

    Parameters
    ----------
    distributions : sequence of Distribution
    count : int
    seed : int
    method : str
        ``lhs``: a Latin hypercube, in which every parameter has one value in each of ``count`` equally probable
        parts; ``sobol``: a scrambled Sobol sequence, whose count must be a power of two.

    Raises
    ------
    RequestError
        If a Sobol sequence of this length would not be balanced.
    """
    from scipy.stats import qmc

    generator = np.random.default_rng(seed)
    if method == "sobol":
        check_power_of_two(count)
        shares = qmc.Sobol(len(distributions), seed=generator).random(count)
    else:
        shares = qmc.LatinHypercube(len(distributions), seed=generator).random(count)
    return np.column_stack([d.quantile(shares[:, k]) for k, d in enumerate(distributions)])

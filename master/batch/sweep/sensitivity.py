"""Which of the varied parameters matter: designs of samples, and indices of a figure, both by SALib.

Sobol indices are shares of a figure's variance: the first-order one is what a parameter explains by itself, the total
one what it explains together with all others. Morris' elementary effects are changes of the figure over the whole range
of a parameter: the mean of their magnitudes ranks parameters in few runs, their standard deviation shows that a
parameter acts not alone or not in proportion.

A design consists of blocks, each of which gives one estimate: base point, its partner and one mixture for each
parameter (Saltelli, D + 2 runs), or a trajectory that changes one parameter after the other (Morris, D + 1 runs).
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal, NamedTuple

import numpy as np

from master.arrays import FloatArray
from master.batch.sweep.distributions import Distribution, check_power_of_two
from master.errors import MasterError

SensitivityMethod = Literal["sobol", "morris"]
#: Bootstrap samples, and share of them that an interval holds.
RESAMPLES: Final = 1000
CONFIDENCE: Final = 0.95
#: Fewest blocks that indices are computed from.
LEAST_BLOCKS: Final = 4
#: Values that Morris' trajectories give a parameter, and the share of an unbounded distribution that they span.
_LEVELS: Final = 4
_CENTRAL: Final = 0.95
#: Relative spread of a figure that is no more than rounding.
_ROUNDING: Final = 1e-12
_MISSING: Final = "sensitivity indices need SALib: pip install 'openpanto[scale]'"


@dataclass(frozen=True)
class SensitivityIndices:
    """How much a figure depends on each parameter.

    Attributes
    ----------
    method : str
        ``sobol`` or ``morris``.
    figure, unit : str
        What depends; the unit is that of the figure.
    parameters : tuple of str
        D names.
    first, total : tuple of float
        Sobol: first-order and total index [1]. Morris: mean of the magnitudes and standard deviation of the elementary
        effects, in the unit of the figure.
    first_interval, total_interval : tuple of (float, float)
        Bootstrap intervals of 95 %.
    blocks, left_out : int
        How many blocks of runs this rests on, and how many were left out because a run failed or had no such figure.
    """

    method: SensitivityMethod
    figure: str
    unit: str
    parameters: tuple[str, ...]
    first: tuple[float, ...]
    first_interval: tuple[tuple[float, float], ...]
    total: tuple[float, ...]
    total_interval: tuple[tuple[float, float], ...]
    blocks: int = 0
    left_out: int = 0


def block_size(method: SensitivityMethod, parameters: int) -> int:
    """Return the number of runs in a block."""
    return parameters + (2 if method == "sobol" else 1)


def described(method: SensitivityMethod, parameters: int, count: int) -> str:
    """Return in words how many runs a design has, and why."""
    size = block_size(method, parameters)
    name, more = ("Saltelli blocks", 2) if method == "sobol" else ("Morris trajectories", 1)
    return f"sensitivity: {count} {name} of {parameters} + {more} runs make {count * size} runs"


def designed(distributions: Sequence[Distribution], count: int, seed: int, method: SensitivityMethod) -> FloatArray:
    """Return the values of a design, shape (count * block size, n_parameters), the same for the same seed.

    Parameters
    ----------
    distributions : sequence of Distribution
        Of independent parameters. Morris' four values are evenly spaced in probability, from end to end of a bounded
        distribution and over the central 95 % of one without bounds.
    count : int
        How many blocks; a power of two for Sobol indices.
    seed : int
    method : str

    Raises
    ------
    RequestError
        If a Sobol sequence of this length would not be balanced.
    MasterError
        If SALib is not installed.
    """
    shares = _shares(method, len(distributions), count, seed)
    if method == "morris":
        spans = np.array([1.0 if d.is_bounded else _CENTRAL for d in distributions])
        shares = 0.5 + (shares - 0.5) * spans
    return np.column_stack([d.quantile(shares[:, k]) for k, d in enumerate(distributions)])


class _Salib(NamedTuple):
    """What is used of SALib."""

    saltelli: Any
    trajectories: Any
    sobol: Any


def _salib() -> _Salib:
    try:
        from SALib.analyze import sobol
        from SALib.sample import morris as trajectories
        from SALib.sample import sobol as saltelli
    except ImportError as error:
        raise MasterError(_MISSING) from error
    return _Salib(saltelli, trajectories, sobol)


def _problem(parameters: int) -> dict[str, Any]:
    """Return what SALib wants to know: its parameters are the probabilities below our values."""
    names = [f"p{k}" for k in range(parameters)]
    return {"num_vars": parameters, "names": names, "bounds": [[0.0, 1.0]] * parameters}


def _shares(method: SensitivityMethod, parameters: int, count: int, seed: int) -> FloatArray:
    """Return the design in probabilities, shape (count * block size, n_parameters)."""
    library, problem = _salib(), _problem(parameters)
    generator = np.random.default_rng(seed)
    if method == "sobol":
        check_power_of_two(count)
        return library.saltelli.sample(problem, count, calc_second_order=False, seed=generator)
    return library.trajectories.sample(problem, count, num_levels=_LEVELS, seed=generator)


def indices_of(
    method: SensitivityMethod, parameters: Sequence[str], figure: str, unit: str, values: FloatArray, seed: int
) -> SensitivityIndices | None:
    """Return the indices of a figure, None if it does not vary or too few blocks are complete.

    Parameters
    ----------
    method : str
    parameters : sequence of str
        D names, in the order of the design.
    figure, unit : str
    values : ndarray, shape (n,)
        Of the figure in the runs of the design in their order; NaN where there is none.
    seed : int
        That of the design.
    """
    blocks = values.reshape(-1, block_size(method, len(parameters)))
    whole = np.isfinite(blocks).all(axis=1)
    used = blocks[whole]
    if len(used) < LEAST_BLOCKS or np.ptp(used) <= _ROUNDING * np.abs(used).max():
        return None
    if method == "sobol":
        found = _sobol(used, seed)
    else:
        shares = _shares(method, len(parameters), len(blocks), seed).reshape(*blocks.shape, -1)
        found = _morris(shares[whole], used, seed)
    first, first_interval, total, total_interval = found
    return SensitivityIndices(
        method=method,
        figure=figure,
        unit=unit,
        parameters=tuple(parameters),
        first=_numbers(first),
        first_interval=_pairs(first_interval),
        total=_numbers(total),
        total_interval=_pairs(total_interval),
        blocks=len(used),
        left_out=len(blocks) - len(used),
    )


#: First, its intervals (D, 2), total, its intervals.
_Found = tuple[FloatArray, FloatArray, FloatArray, FloatArray]


def _numbers(values: FloatArray) -> tuple[float, ...]:
    return tuple(map(float, values))


def _pairs(intervals: FloatArray) -> tuple[tuple[float, float], ...]:
    return tuple((float(low), float(high)) for low, high in intervals)


def _sobol(blocks: FloatArray, seed: int) -> _Found:
    """Return Sobol indices by the estimators of Saltelli et al. (2010, doi:10.1016/j.cpc.2009.09.018)."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = _salib().sobol.analyze(
            _problem(blocks.shape[1] - 2),
            blocks.ravel(),
            calc_second_order=False,
            num_resamples=RESAMPLES,
            conf_level=CONFIDENCE,
            seed=seed + 1,  # SALib takes 0 for none
        )
    return (
        found["S1"],
        _about(found["S1"], found["S1_conf"]),
        found["ST"],
        _about(found["ST"], found["ST_conf"]),
    )


def _about(middle: FloatArray, half: FloatArray) -> FloatArray:
    return np.column_stack([middle - half, middle + half])


def _morris(shares: FloatArray, blocks: FloatArray, seed: int) -> _Found:
    """Return statistics of elementary effects (Campolongo et al. 2007, doi:10.1016/j.envsoft.2006.10.004).

    SALib gives no interval of the standard deviation, so both intervals are bootstrapped here over trajectories.
    """
    steps = np.diff(shares, axis=1)  # (trajectory, step, parameter): one parameter in each step
    effects = np.sum(np.sign(steps) * np.diff(blocks, axis=1)[:, :, None], axis=1) / np.abs(steps).max(axis=1)
    drawn = effects[np.random.default_rng(seed).integers(len(effects), size=(RESAMPLES, len(effects)))]
    ends = [0.5 - 0.5 * CONFIDENCE, 0.5 + 0.5 * CONFIDENCE]
    return (
        np.abs(effects).mean(axis=0),
        np.quantile(np.abs(drawn).mean(axis=1), ends, axis=0).T,
        effects.std(axis=0, ddof=1),
        np.quantile(drawn.std(axis=1, ddof=1), ends, axis=0).T,
    )

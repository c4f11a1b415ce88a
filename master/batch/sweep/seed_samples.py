"""Samples of what is drawn from seeds: every parameter ``*.seed`` of a scenario, a value for each sample."""

from __future__ import annotations

from collections.abc import Collection
from typing import Final

from master.batch.sweep.swept_parameter import ParameterReader, SweptParameter, SweptValue
from master.errors import RequestError
from master.system.components import System
from master.system.pantograph_motion import parameter_value

#: Seeds from one S to the next, and the largest S: seeds of FMUs are whole numbers of 31 bits.
_STRIDE: Final = 100_000
_LARGEST: Final = (2**31 - 1) // _STRIDE


def seed_samples(
    system: System, count: int, seed: int, varied: Collection[str]
) -> tuple[tuple[SweptParameter, ...], list[tuple[SweptValue, ...]]]:
    """Return the seeds that draw something, and their values in every sample.

    Sample k has the seed 100 000 (S - 1) + k, the same for all of them, whose numbers come from streams of their own.
    So more samples add to those that there are, and samples of another S share none with them.

    Parameters
    ----------
    system : System
    count, seed : int
        Number of samples, and S.
    varied : collection of str
        Parameters that are varied besides.

    Raises
    ------
    RequestError
        If S is out of range, or no seed draws anything.
    """
    if not 1 <= seed <= _LARGEST:
        raise RequestError(f"--seed {seed}: samples of seeds take one from 1 to {_LARGEST}")
    found = [f"{c.name}.{v}" for c in system.components for v in c.fmu.variables if v.rpartition(".")[2] == "seed"]
    found = [name for name in found if name not in varied]
    acting = [name for name in found if _draws(system, name, varied)]
    if not acting:
        idle = f"{', '.join(found)}: nothing is drawn while all sigmas are 0, set one" if found else "there is none"
        raise RequestError(f"--samples without --vary varies seeds, and {idle}; or say with --vary what else varies")
    first = (seed - 1) * _STRIDE + 1
    listed = [ParameterReader(system, name).listed(f"{first}:{first + count - 1}:1") for name in acting]
    return tuple(p for p, _ in listed), list(zip(*(values for _, values in listed), strict=True))


def _draws(system: System, name: str, varied: Collection[str]) -> bool:
    """Return whether a seed draws anything: a sigma beside it is not 0, or varied, or none is there to tell."""
    owner, _, own = name.partition(".")
    component, table = system.component(owner), own.rpartition(".")[0]
    sigmas = [v for v in component.fmu.variables if v.endswith("sigma") and v.rpartition(".")[0] == table]
    return not sigmas or any(f"{owner}.{v}" in varied or parameter_value(component, v) for v in sigmas)

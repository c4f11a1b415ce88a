"""How much a run of the suite tries: a sample of everything, or the whole counts of the long checks."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any, Final

import pytest

#: Set by `.ci/long`: tests marked `long` run, and counts are whole.
IS_LONG: Final = os.environ.get("OPENPANTO_LONG") == "1"
#: Lines and pantographs that are in the library for long, of which a sample is enough.
ESTABLISHED: Final = {
    "AC_curve", "AC_mixed", "C270", "CA160", "CA220", "EN50318_2002", "EN50318_2018_AC_simple", "LN1", "LN2",
    "LN2_overlap", "LN2_ring", "LN2_supports", "LN6", "Re330", "Shinkansen", "generic_simple", "ATR95", "CX",
    "CX_multibody", "DSA380", "EN50318_2018", "generic", "generic_multibody", "generic_multibody_cam",
}  # fmt: skip


def count(sample: int, whole: int) -> int:
    """Return how many inputs, kills or runs to try: ``sample`` in `.ci/run`, ``whole`` in `.ci/long`."""
    return whole if IS_LONG else sample


def some(whole: Sequence[str], *sample: str) -> list[str]:
    """Return what to try of a library: a ``sample`` that has one of each kind, or the ``whole`` in `.ci/long`.

    What is new in the library is tried in every run.
    """
    assert set(sample) <= set(whole)
    return [name for name in whole if IS_LONG or name in sample or _definition(name) not in ESTABLISHED]


def rest(*values: object) -> list[Any]:
    """Return further values of a parameter, each one or a tuple of several, that are tried in `.ci/long` alone.

    What stands before them is the sample of every run.
    """
    return [
        pytest.param(*(value if isinstance(value, tuple) else (value,)), marks=pytest.mark.long) for value in values
    ]


def _definition(name: str) -> str:
    return name.removeprefix("Catenary_").removeprefix("Pantograph_")

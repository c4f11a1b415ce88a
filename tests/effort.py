"""How much a run of the suite tries: a sample of everything, or the whole counts of the long checks."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Final

#: Set by `.ci/long`: tests marked `long` run, and counts are whole.
IS_LONG: Final = os.environ.get("OPENPANTO_LONG") == "1"


def count(sample: int, whole: int) -> int:
    """Return how many inputs, kills or runs to try: ``sample`` in `.ci/run`, ``whole`` in `.ci/long`."""
    return whole if IS_LONG else sample


def some(whole: Sequence[str], *sample: str) -> list[str]:
    """Return what to try of a library: a ``sample`` that has one of each kind, or the ``whole`` in `.ci/long`."""
    assert set(sample) <= set(whole)
    return [*whole] if IS_LONG else [*sample]

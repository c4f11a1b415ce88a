"""Names of variables that the master knows, and patterns of names, in which ``*`` stands for anything."""

from __future__ import annotations

import re
from collections.abc import Callable
from fnmatch import fnmatchcase
from typing import Final

#: The parameter that makes an FMU keep its energy balance, what it then reports, and the period of recording that [s].
ENERGY_MONITOR: Final = "monitor_energy"
ENERGY_VARIABLES: Final = ("*.energy.*", "*contact.work")
ENERGY_INTERVAL: Final = 0.05
#: Outputs that an FMU computes for whoever takes them: recorded if they are connected, or if a setting says so.
ON_REQUEST: Final = ("*.nominal.z", "*.nominal.vz")


def matcher(pattern: str) -> Callable[[str], bool]:
    """Return a test for names; ``*`` stands for anything, every other character, brackets too, for itself.

    Examples
    --------
    >>> matcher("*.dropper[*].force")("catenary.dropper[12].force")
    True
    """
    literal = re.sub(r"[\[?]", r"[\g<0>]", pattern)  # to fnmatch, brackets are a set of characters
    return lambda name: fnmatchcase(name, literal)

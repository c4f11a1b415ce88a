"""Names of variables that the master knows, and patterns of names, in which ``*`` stands for anything."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

#: The parameter that makes an FMU keep its energy balance, what it says then, and how often that is recorded [s].
ENERGY_MONITOR: Final = "monitor_energy"
ENERGY_VARIABLES: Final = ("*.energy.*", "*contact.work")
ENERGY_INTERVAL: Final = 0.05


def matcher(pattern: str) -> Callable[[str], bool]:
    """Return a test for names; ``*`` stands for anything, brackets for themselves.

    Examples
    --------
    >>> matcher("*.dropper[*].force")("catenary.dropper[12].force")
    True
    """
    first, *others = pattern.split("*")
    if not others:
        return lambda name: name == pattern
    *inner, last = others

    def fits(name: str) -> bool:
        # From left to right, each part as early as it can be: a regular expression may try for ages.
        if not (name.startswith(first) and name.endswith(last)):
            return False
        place, end = len(first), len(name) - len(last)
        for part in inner:
            found = name.find(part, place, end)
            if found < 0:
                return False
            place = found + len(part)
        return place <= end

    return fits

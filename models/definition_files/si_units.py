"""Units accepted in definition files, and their conversion to SI, made once, at the edge."""

from __future__ import annotations

import math
from typing import Final

from models.definition_files.message_text import hint

#: Unit -> (SI unit, factor).  A quantity in a file is multiplied by the factor.
SI: Final[dict[str, tuple[str, float]]] = {
    "1": ("1", 1.0),
    "%": ("1", 0.01),
    "m": ("m", 1.0),
    "mm": ("m", 1e-3),
    "cm": ("m", 1e-2),
    "km": ("m", 1e3),
    "m2": ("m2", 1.0),
    "cm2": ("m2", 1e-4),
    "mm2": ("m2", 1e-6),
    "m4": ("m4", 1.0),
    "mm4": ("m4", 1e-12),
    "1/m": ("1/m", 1.0),
    "s": ("s", 1.0),
    "ms": ("s", 1e-3),
    "1/s": ("1/s", 1.0),
    "K": ("K", 1.0),
    "degC": ("K", 1.0),
    "1/K": ("1/K", 1.0),
    "Hz": ("Hz", 1.0),
    "m/s": ("m/s", 1.0),
    "mm/s": ("m/s", 1e-3),
    "km/h": ("m/s", 1.0 / 3.6),
    "m/s2": ("m/s2", 1.0),
    "kg": ("kg", 1.0),
    "kg/m": ("kg/m", 1.0),
    "kg/m3": ("kg/m3", 1.0),
    "kg.m2": ("kg.m2", 1.0),
    "N": ("N", 1.0),
    "daN": ("N", 10.0),
    "kN": ("N", 1e3),
    "N.m": ("N.m", 1.0),
    "kN.m": ("N.m", 1e3),
    "N/m": ("N/m", 1.0),
    "daN/m": ("N/m", 10.0),
    "kN/m": ("N/m", 1e3),
    "N/mm": ("N/m", 1e3),
    "N.s/m": ("N.s/m", 1.0),
    "N.s2/m2": ("N.s2/m2", 1.0),
    "N.m.s/rad": ("N.m.s/rad", 1.0),
    "N.m/rad": ("N.m/rad", 1.0),
    "N.m2": ("N.m2", 1.0),
    "Pa": ("Pa", 1.0),
    "MPa": ("Pa", 1e6),
    "GPa": ("Pa", 1e9),
    "rad": ("rad", 1.0),
    "deg": ("rad", math.pi / 180.0),
    "rad/s": ("rad/s", 1.0),
}

#: Unit -> what is added after the factor, where the unit's zero is not that of SI.
OFFSETS: Final[dict[str, float]] = {"degC": 273.15}


def to_si(value: float, unit: str, wanted: str) -> float:
    """Convert ``value`` in ``unit`` to the SI unit ``wanted``.

    Raises
    ------
    ValueError
        If ``unit`` is unknown or does not measure the same quantity as ``wanted``.

    Examples
    --------
    >>> to_si(20.0, "kN", "N")
    20000.0
    >>> to_si(-10.0, "degC", "K")
    263.15
    """
    if unit not in SI:
        known = units_of(wanted)
        raise ValueError(f"unknown unit '{unit}' (known for '{wanted}': {known}){hint(unit, known.split(', '))}")
    si, factor = SI[unit]
    if si != wanted:
        raise ValueError(f"unit '{unit}' where a unit of '{wanted}' is needed ({units_of(wanted)})")
    return value * factor + OFFSETS[unit] if unit in OFFSETS else value * factor


def units_of(wanted: str) -> str:
    """Return the known units of the quantity that an SI unit measures, for messages.

    Examples
    --------
    >>> units_of("N")
    'N, daN, kN'
    """
    return ", ".join(unit for unit, (si, _) in SI.items() if si == wanted)


def shown(value: float, unit: str) -> str:
    """Return a value with its unit as shown in a message; a plain number has none.

    Examples
    --------
    >>> shown(12.0, "kN"), shown(0.5, "1")
    ('12 kN', '0.5')
    """
    return f"{value:g}" if unit == "1" else f"{value:g} {unit}"

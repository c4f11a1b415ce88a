"""A value as a user gives it, a number or a text with or without a unit, and its conversion to SI."""

from __future__ import annotations

import math
import re
from typing import Final

from models.definition_files.si_units import to_si

#: A number, as Python writes it, and a unit or none.
WITH_UNIT: Final = re.compile(
    r"\s*([+-]?(?:(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?|nan|inf))\s*(\S*)\s*", re.ASCII | re.IGNORECASE
)


def number_advice(text: str) -> str:
    """Return what to do with a text that is not a number but nearly one, empty if it is far from it.

    Examples
    --------
    >>> number_advice("1,5"), number_advice("10s"), number_advice("soon")
    ('; write a decimal point', '; write it without its unit', '')
    """
    if re.search(r"\d,\d", text, re.ASCII):
        return "; write a decimal point"
    match = WITH_UNIT.fullmatch(text)
    return "; write it without its unit" if match is not None and match[2] else ""


def in_si(value: float | str, wanted: str | None) -> float:
    """Return a value in its SI unit.

    Parameters
    ----------
    value : float or str
        A number in ``wanted``, or a text that may have another unit of the same kind.
    wanted : str or None
        SI unit; None where it is not known, and units are ignored.

    Raises
    ------
    ValueError
        If the text is no number, or its unit does not fit; the message leaves out whose value it is.
    TypeError
        If it is neither a number nor a text.

    Examples
    --------
    >>> in_si("12 kN", "N"), in_si("180km/h", "m/s"), in_si(0.5, "1")
    (12000.0, 50.0, 0.5)
    """
    if not isinstance(value, str):
        try:
            return float(value)
        except (TypeError, ValueError) as error:
            raise TypeError("this is neither a number nor a text") from error
    match = WITH_UNIT.fullmatch(value)
    if "," in value:
        raise ValueError(f"'{value}' is not a number{number_advice(value)}")
    if match is None:
        raise ValueError(f"'{value}' is not a number, or a number with its unit ('12 kN')")
    number, unit = float(match[1]), match[2]
    if not unit or wanted is None:
        return number
    try:
        return to_si(number, unit, wanted)
    except ValueError as error:
        raise ValueError(f"{error}; give it in {wanted}") from error


def quantity(name: str, value: float | str, wanted: str) -> float:
    """Return a finite number in SI.

    Raises
    ------
    ValueError
        Naming the quantity, if it is something else.

    Examples
    --------
    >>> quantity("force", "0.1 kN", "N")
    100.0
    """
    try:
        found = in_si(value, wanted)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from error
    except TypeError as error:
        raise TypeError(f"{name}: {value!r} is neither a number nor a text") from error
    if not math.isfinite(found):
        raise ValueError(f"{name}: {value} is not a finite number")
    return found

"""Exchanged values that are not Real, as the numbers that the arrays of a network hold.

Integers, Booleans and items of enumerations are whole numbers of 32 bits, which a float64 holds exactly. A text is
exchanged as its number in a table of all texts seen so far.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from master.arrays import FloatArray, IntArray

_C_TYPES: Final[dict[str, Any]] = {
    "Real": ctypes.c_double,
    "Integer": ctypes.c_int,
    "Boolean": ctypes.c_int,
    "String": ctypes.c_char_p,
}
#: Types that FMI reads and writes as another type.
_AS: Final = {"Enumeration": "Integer"}


class TextTable:
    """Texts by number, and numbers by text; number 0 is the empty text."""

    def __init__(self) -> None:
        self._texts: list[bytes] = [b""]
        self._numbers: dict[bytes, int] = {b"": 0}

    def number(self, text: bytes | None) -> int:
        """Return the number of a text, a new one for a new text."""
        known = self._numbers.setdefault(text or b"", len(self._texts))
        if known == len(self._texts):
            self._texts.append(text or b"")
        return known

    def text(self, number: float) -> bytes:
        """Return the text of a number."""
        return self._texts[int(number)]


#: Shared by all instances of this process, so that a number means the same to all of them.
TEXTS: Final = TextTable()


@dataclass(frozen=True)
class _Part:
    """Variables of one type: their places among the values, and what FMI takes."""

    kind: str
    places: IntArray
    references: Any
    buffer: Any


class TypedValues:
    """Variables of several types that are read or written one type after the other.

    Parameters
    ----------
    kinds : sequence of str
        FMI types of the variables.
    references : sequence of int
        Their value references.
    values : ndarray, shape (n,)
        Where `read` puts them and `write` takes them from.
    call : callable
        Called with the name of an FMI function, value references, their number and a buffer; raises what fails.
    """

    def __init__(
        self,
        kinds: Sequence[str],
        references: Sequence[int],
        values: FloatArray,
        call: Callable[[str, Any, int, Any], None],
    ) -> None:
        self._values = values
        self._call = call
        fmi = [_AS.get(kind, kind) for kind in kinds]
        self._parts = [self._part(kind, fmi, references) for kind in dict.fromkeys(fmi)]

    def read(self) -> None:
        """Fill the values from the FMU."""
        for part in self._parts:
            self._call(f"fmi2Get{part.kind}", part.references, len(part.references), part.buffer)
            if part.kind == "String":
                self._values[part.places] = [TEXTS.number(text) for text in part.buffer]
            else:
                self._values[part.places] = part.buffer[:]

    def write(self) -> None:
        """Set the FMU's variables to the values."""
        for part in self._parts:
            values = self._values[part.places].tolist()
            if part.kind == "String":
                part.buffer[:] = [TEXTS.text(number) for number in values]
            else:
                part.buffer[:] = values if part.kind == "Real" else [int(value) for value in values]
            self._call(f"fmi2Set{part.kind}", part.references, len(part.references), part.buffer)

    @staticmethod
    def _part(kind: str, fmi: Sequence[str], references: Sequence[int]) -> _Part:
        places = [i for i, other in enumerate(fmi) if other == kind]
        count = len(places)
        chosen = (ctypes.c_uint * count)(*(references[i] for i in places))
        return _Part(kind, np.array(places, dtype=np.intp), chosen, (_C_TYPES[kind] * count)())

"""The state of an instance, and its bytes: self-describing, bit-exact, checked; nothing in them is ever executed.

The master packs its checkpoints in the same layout (``master/safety/array_container.py``); as the packages may not
import each other, each has its own few lines. It is ``MAGIC``; the length of the header, 8 bytes; the header,
``{"header": ..., "arrays": [{"name", "dtype", "shape"}, ...]}``, JSON in UTF-8; the arrays in that order, C order; the
SHA-256 of everything before it. Numbers are little-endian.
"""

from __future__ import annotations

import hashlib
import json
import math
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from models.arrays import FloatArray, Snapshot

#: The first bytes; the digit is the format's version.
MAGIC = b"openpanto arrays 1\n"
_LENGTH = struct.Struct("<Q")
_CHECKSUM = hashlib.sha256().digest_size
#: Kinds of numpy types that are plain bytes: bool, integer, float, complex, text of fixed length.
_PLAIN = "biufcSU"
#: Begins the names of the part's arrays, which lie beside the values and the time.
_PART = "part."
_FOREIGN = "the bytes are not a saved state of this kind of FMU"


class StateError(ValueError):
    """Bytes that are not a state, or not a whole one; says what is wrong."""


@dataclass(frozen=True)
class SavedState:
    """What a host holds between getting and setting a state.

    Attributes
    ----------
    header : mapping
        Whose state it is (``fingerprint``, ``model``), its ``phase`` and its failures (``refused``, ``broken``).
    values : ndarray
        Of all variables, by value reference.
    time : float
    part : mapping of arrays, or None
        The part's snapshot, if there was a part that could step.
    problem : str
        Why the state cannot be used; empty if it can.
    """

    header: Mapping[str, str] = field(default_factory=dict)
    values: FloatArray = field(default_factory=lambda: np.empty(0))
    time: float = 0.0
    part: Snapshot | None = None
    problem: str = ""

    @classmethod
    def from_bytes(cls, data: bytes) -> SavedState:
        """Return the state in bytes.

        Raises
        ------
        StateError
            If they hold none, or were cut or changed.
        """
        header, arrays = unpack(data)
        if problem := header.get("problem"):
            return cls(problem=problem)
        if "alive" not in header:
            raise StateError(_FOREIGN)
        part = {name.removeprefix(_PART): a for name, a in arrays.items() if name.startswith(_PART)}
        is_alive = header.pop("alive") == "yes"
        values = np.asarray(arrays["values"], np.float64)
        return cls(header, values, float(arrays["time"]), part if is_alive else None)

    def to_bytes(self) -> bytes:
        """Return the state as bytes.

        Raises
        ------
        StateError
            If an array holds Python objects.
        """
        header = {**self.header, "problem": self.problem, "alive": "no" if self.part is None else "yes"}
        arrays: Snapshot = {"values": self.values, "time": np.array(self.time)}
        return pack(header, arrays | {_PART + name: array for name, array in (self.part or {}).items()})

    def check(self, fingerprint: str, model: str, count: int) -> None:
        """Raise ``StateError`` unless an FMU with that many variables can go back to it."""
        if self.problem:
            raise StateError(self.problem)
        if self.header["fingerprint"] != fingerprint:
            raise StateError(
                f"the saved state belongs to {self.header['model']} ({self.header['fingerprint']}), "
                f"not to {model} ({fingerprint})"
            )
        if self.values.shape != (count,):
            raise StateError("the saved state has another number of variables")


def pack(header: Mapping[str, Any], arrays: Snapshot) -> bytes:
    """Return a header and arrays as bytes.

    Raises
    ------
    StateError
        If an array holds Python objects.
    """
    whole = {name: _little_endian(name, np.asarray(array)) for name, array in arrays.items()}
    listed = [{"name": name, "dtype": a.dtype.str, "shape": list(a.shape)} for name, a in whole.items()]
    text = json.dumps({"header": dict(header), "arrays": listed}, sort_keys=True).encode()
    body = b"".join((MAGIC, _LENGTH.pack(len(text)), text, *(a.tobytes() for a in whole.values())))
    return body + hashlib.sha256(body).digest()


def _little_endian(name: str, array: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    if array.dtype.kind not in _PLAIN:
        raise StateError(f"array '{name}' of the state holds {array.dtype}, not plain numbers")
    code = array.dtype.str
    return array.astype(code.replace(">", "<")) if code.startswith(">") else array


def unpack(data: bytes) -> tuple[dict[str, Any], Snapshot]:
    """Return the header and the arrays that ``pack`` was given.

    Raises
    ------
    StateError
        If the bytes are not of this format, or were cut or changed.
    """
    if not data.startswith(MAGIC):
        raise StateError(_FOREIGN)
    body, checksum = memoryview(data)[:-_CHECKSUM], data[-_CHECKSUM:]
    if hashlib.sha256(body).digest() != checksum:
        raise StateError("the saved state is damaged: its checksum does not fit, it was cut or changed")
    start = len(MAGIC) + _LENGTH.size
    (length,) = _LENGTH.unpack(body[len(MAGIC) : start])
    said: dict[str, Any] = json.loads(bytes(body[start : start + length]))
    return said["header"], _arrays(said["arrays"], body[start + length :])


def _arrays(listed: list[dict[str, Any]], raw: memoryview) -> Snapshot:
    arrays: Snapshot = {}
    position = 0
    for entry in listed:
        dtype, shape = np.dtype(entry["dtype"]), entry["shape"]
        count = math.prod(shape)
        arrays[entry["name"]] = np.frombuffer(raw, dtype, count, position).reshape(shape).copy()
        position += count * dtype.itemsize
    return arrays

"""A model's state as bytes: self-describing, bit-exact, checked; nothing in it is ever executed."""

from __future__ import annotations

import hashlib
import json
import struct
from collections.abc import Mapping
from typing import Any

import numpy as np

from models.arrays import Snapshot

#: First bytes of every state; the digit is the format's version.
MAGIC = b"openpanto state 1\n"
_LENGTH = struct.Struct("<Q")
_CHECKSUM = hashlib.sha256().digest_size
#: Kinds of numpy types that are plain bytes: bool, integer, float, complex, text of fixed length.
_PLAIN = "biufcSU"


class StateError(ValueError):
    """Bytes that are not a state, or not a whole one; says what is wrong."""


def pack(about: Mapping[str, str], arrays: Snapshot) -> bytes:
    """Return texts and arrays as bytes: magic, header length, JSON header, raw arrays, SHA-256 of all before.

    Raises
    ------
    StateError
        If an array holds Python objects.
    """
    whole = {name: np.asarray(array) for name, array in arrays.items()}
    for name, array in whole.items():
        if array.dtype.kind not in _PLAIN:
            raise StateError(f"array '{name}' of the state holds {array.dtype}, not plain numbers")
    listed = [[name, array.dtype.str, list(array.shape)] for name, array in whole.items()]
    header = json.dumps({"about": dict(about), "arrays": listed}, sort_keys=True).encode()
    body = MAGIC + _LENGTH.pack(len(header)) + header + b"".join(a.tobytes() for a in whole.values())
    return body + hashlib.sha256(body).digest()


def unpack(data: bytes) -> tuple[dict[str, str], Snapshot]:
    """Return the texts and arrays that ``pack`` was given.

    Raises
    ------
    StateError
        If the bytes are no state of this format, or were cut or changed.
    """
    if not data.startswith(MAGIC):
        raise StateError("the bytes are not a saved state of this kind of FMU")
    body, checksum = data[:-_CHECKSUM], data[-_CHECKSUM:]
    if hashlib.sha256(body).digest() != checksum:
        raise StateError("the saved state is damaged: its checksum does not fit, it was cut or changed")
    start = len(MAGIC) + _LENGTH.size
    (length,) = _LENGTH.unpack(body[len(MAGIC) : start])
    header: dict[str, Any] = json.loads(body[start : start + length])
    return header["about"], _arrays(header["arrays"], body[start + length :])


def _arrays(listed: list[tuple[str, str, list[int]]], raw: bytes) -> Snapshot:
    arrays: Snapshot = {}
    position = 0
    for name, code, shape in listed:
        dtype = np.dtype(code)
        count = int(np.prod(shape, dtype=np.int64))
        arrays[name] = np.frombuffer(raw, dtype, count, position).reshape(shape).copy()
        position += count * dtype.itemsize
    return arrays

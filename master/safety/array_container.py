"""A header and named arrays as bytes: self-describing, bit-exact, checked; nothing in them is ever executed.

A magic line, the length of the header as 8 bytes (little-endian), the header as JSON in UTF-8 with the name, type and
shape of every array, the raw arrays in this order, and the SHA-256 of all before. FMUs save their states in the same
layout (``fmus/slave/saved_state.py``).
"""

from __future__ import annotations

import hashlib
import json
import struct
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

#: First bytes; the digit is the version of the layout.
MAGIC: Final = b"openpanto arrays 1\n"
_LENGTH: Final = struct.Struct("<Q")
_CHECKSUM: Final = hashlib.sha256().digest_size
#: Kinds of numpy types that are plain bytes: bool, integer, float, complex, text of fixed length.
_PLAIN: Final = "biufcSU"

#: Arrays of plain numbers by name.
Arrays = Mapping[str, NDArray[Any]]


def pack(header: Mapping[str, Any], arrays: Arrays) -> bytes:
    """Return a header, which JSON can hold, and arrays as bytes.

    Raises
    ------
    ValueError
        If an array holds Python objects.
    """
    for name, array in arrays.items():
        _check_plain(name, array.dtype)
    listed = [{"name": n, "dtype": a.dtype.str, "shape": list(a.shape)} for n, a in arrays.items()]
    text = json.dumps({"header": header, "arrays": listed}, allow_nan=False).encode()
    body = b"".join((MAGIC, _LENGTH.pack(len(text)), text, *(a.tobytes() for a in arrays.values())))
    return body + hashlib.sha256(body).digest()


def unpack(data: bytes) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Return the header and the arrays that `pack` was given.

    Raises
    ------
    ValueError
        If the bytes are not in this layout, or were cut or changed.
    """
    if not data.startswith(MAGIC):
        raise ValueError("does not begin as arrays of this version do")
    body, checksum = data[:-_CHECKSUM], data[-_CHECKSUM:]
    if hashlib.sha256(body).digest() != checksum:
        raise ValueError("is damaged: its checksum does not match, it was cut or changed")
    start = len(MAGIC) + _LENGTH.size
    end = start + _LENGTH.unpack(body[len(MAGIC) : start])[0]
    held = json.loads(body[start:end])
    arrays = {}
    for entry in held["arrays"]:
        dtype, shape = np.dtype(entry["dtype"]), tuple(entry["shape"])
        _check_plain(entry["name"], dtype)
        start, end = end, end + dtype.itemsize * int(np.prod(shape, dtype=np.int64))
        arrays[entry["name"]] = np.frombuffer(body[start:end], dtype).reshape(shape).copy()
    return held["header"], arrays


def _check_plain(name: str, dtype: np.dtype[Any]) -> None:
    if dtype.kind not in _PLAIN:
        raise ValueError(f"holds the array '{name}' of {dtype}, not of plain numbers")

"""A repair of pythonfmu's Linux library, which frees memory twice when the process ends.

The library keeps Python's state in a static object. As ``exit`` runs, that object's destructor comes first; then the
library's own clean-up (its fini array) releases the object once more, through memory that is free by then. Sometimes
that ends the process with "corrupted double-linked list", after a run that was otherwise correct. The repair
leaves the first release and takes out the second: the fini array's entry in the dynamic section becomes the flag
NODELETE, so that the library stays loaded until the end (as it does anyway, because it has unique symbols), and its
size becomes 0. No instruction changes.
"""

from __future__ import annotations

import struct
from typing import Final

_HEAD: Final = b"\x7fELF\x02\x01"  # 64 bits, little-endian
_MARK: Final = b"\0finalizePythonInterpreter\0"
_PT_DYNAMIC: Final = 2
_DT_NULL: Final = 0
_DT_FINI_ARRAY: Final = 26
_DT_FINI_ARRAYSZ: Final = 28
_DT_FLAGS_1: Final = 0x6FFFFFFB
_DF_1_NODELETE: Final = 8
_ENTRY: Final = struct.Struct("<qQ")


def repaired(library: bytes) -> bytes:
    """Return pythonfmu's library with the repair; any other file as it is."""
    if not library.startswith(_HEAD) or _MARK not in library:
        return library
    places = _dynamic(library)
    if not {_DT_FINI_ARRAY, _DT_FINI_ARRAYSZ} <= places.keys() or _DT_FLAGS_1 in places:
        return library
    changed = bytearray(library)
    _ENTRY.pack_into(changed, places[_DT_FINI_ARRAY], _DT_FLAGS_1, _DF_1_NODELETE)
    _ENTRY.pack_into(changed, places[_DT_FINI_ARRAYSZ], _DT_FINI_ARRAYSZ, 0)
    return bytes(changed)


def _dynamic(library: bytes) -> dict[int, int]:
    """Return where the entries of the dynamic section lie in the file, by their tags."""
    offset, length = _dynamic_segment(library)
    places: dict[int, int] = {}
    for position in range(offset, offset + length, _ENTRY.size):
        tag, _ = _ENTRY.unpack_from(library, position)
        if tag == _DT_NULL:
            break
        places.setdefault(tag, position)
    return places


def _dynamic_segment(library: bytes) -> tuple[int, int]:
    (table,) = struct.unpack_from("<Q", library, 32)
    size, count = struct.unpack_from("<HH", library, 54)
    for position in range(table, table + size * count, size):
        (kind,) = struct.unpack_from("<I", library, position)
        if kind == _PT_DYNAMIC:
            (offset,) = struct.unpack_from("<Q", library, position + 8)
            (length,) = struct.unpack_from("<Q", library, position + 32)
            return offset, length
    return 0, 0

"""What a Linux library asks for: read from its dynamic section, without running anything."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import Final

_HEAD: Final = b"\x7fELF\x02\x01"  # 64 bits, little-endian
_PAGE: Final = 4096
_PT_LOAD: Final = 1
_PT_DYNAMIC: Final = 2
_DT_NULL: Final = 0
_DT_NEEDED: Final = 1
_DT_STRTAB: Final = 5
_DT_SONAME: Final = 14
_ENTRY: Final = struct.Struct("<qQ")


class ElfError(ValueError):
    """A file that is not a library of 64-bit Linux."""


def needed(library: bytes) -> tuple[str, ...]:
    """Return the names (DT_NEEDED) of the libraries that a library needs.

    Raises
    ------
    ElfError
    """
    return tuple(_texts(library, _DT_NEEDED))


def soname(library: bytes) -> str:
    """Return the name under which others ask for a library, empty if it has none.

    Raises
    ------
    ElfError
    """
    return next(_texts(library, _DT_SONAME), "")


def is_aligned(library: bytes) -> bool:
    """Return whether the system can map a library: whether its parts lie as they do in memory, but for whole pages.

    Raises
    ------
    ElfError
    """
    loads = [(offset, address) for kind, offset, address, _ in _segments(library) if kind == _PT_LOAD]
    return all((address - offset) % _PAGE == 0 for offset, address in loads)


def _texts(library: bytes, tag: int) -> Iterator[str]:
    try:
        entries = list(_dynamic(library))
        table = _file_offset(library, next(value for key, value in entries if key == _DT_STRTAB))
        for key, value in entries:
            if key == tag:
                end = library.index(b"\0", table + value)
                yield library[table + value : end].decode()
    except (struct.error, StopIteration, ValueError) as error:
        raise ElfError("not a library of 64-bit Linux") from error


def _segments(library: bytes) -> Iterator[tuple[int, int, int, int]]:
    """Yield kind, place in the file, place in memory and length in the file of each segment."""
    if not library.startswith(_HEAD):
        raise ElfError("not a library of 64-bit Linux")
    (table,) = struct.unpack_from("<Q", library, 32)
    size, count = struct.unpack_from("<HH", library, 54)
    for position in range(table, table + size * count, size):
        (kind,) = struct.unpack_from("<I", library, position)
        offset, address = struct.unpack_from("<QQ", library, position + 8)
        (length,) = struct.unpack_from("<Q", library, position + 32)
        yield kind, offset, address, length


def _dynamic(library: bytes) -> Iterator[tuple[int, int]]:
    for kind, offset, _, length in _segments(library):
        if kind != _PT_DYNAMIC:
            continue
        for position in range(offset, offset + length, _ENTRY.size):
            tag, value = _ENTRY.unpack_from(library, position)
            if tag == _DT_NULL:
                return
            yield tag, value


def _file_offset(library: bytes, address: int) -> int:
    for kind, offset, start, length in _segments(library):
        if kind == _PT_LOAD and start <= address < start + length:
            return offset + address - start
    raise ElfError("not a library of 64-bit Linux")

"""The icon of an FMU, drawn and written without any other package: the same bytes everywhere."""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Sequence
from itertools import pairwise
from typing import Final

#: Pixels along each side.
SIZE: Final = 96
_HALF_WIDTH: Final = 1.6
Point = tuple[float, float]
#: Polylines in a square of 100 x 100, y upwards.
_CONTACT_WIRE: Final = ((2.0, 50.0), (98.0, 50.0))
_LINE: Final = (
    _CONTACT_WIRE,
    tuple((float(x), 60.0 + 30.0 * ((x - 50.0) / 48.0) ** 2) for x in range(2, 99, 4)),
    *(((float(x), 50.0), (float(x), 60.0 + 30.0 * ((x - 50.0) / 48.0) ** 2)) for x in (14, 32, 50, 68, 86)),
)
_PANTOGRAPH: Final = (
    ((26.0, 78.0), (74.0, 78.0)),
    ((26.0, 78.0), (18.0, 71.0)),
    ((74.0, 78.0), (82.0, 71.0)),
    ((50.0, 78.0), (80.0, 45.0), (40.0, 12.0)),
    ((28.0, 12.0), (72.0, 12.0)),
)
_DRAWINGS: Final = {"catenary": _LINE, "pantograph": _PANTOGRAPH}


def icon(kind: str) -> bytes:
    """Return a PNG: a line if ``kind`` is catenary, a pantograph if it is pantograph, both otherwise."""
    strokes = _DRAWINGS.get(kind, (*_LINE[:2], *_PANTOGRAPH))
    rows = (bytes(_shade(strokes, column, row) for column in range(SIZE)) for row in range(SIZE))
    return _png(b"".join(b"\0" + row for row in rows))


def _shade(strokes: Sequence[Sequence[Point]], column: int, row: int) -> int:
    """Return the grey of a pixel: black on a stroke, white away from it, in between at its edge."""
    x, y = 100.0 * (column + 0.5) / SIZE, 100.0 - 100.0 * (row + 0.5) / SIZE
    nearest = min(_distance(x, y, a, b) for s in strokes for a, b in pairwise(s))
    return round(255.0 * min(1.0, max(0.0, nearest - _HALF_WIDTH)))


def _distance(x: float, y: float, a: Point, b: Point) -> float:
    dx, dy = b[0] - a[0], b[1] - a[1]
    share = ((x - a[0]) * dx + (y - a[1]) * dy) / (dx * dx + dy * dy)
    share = min(1.0, max(0.0, share))
    ex, ey = x - a[0] - share * dx, y - a[1] - share * dy
    return math.sqrt(ex * ex + ey * ey)


def _png(raw: bytes) -> bytes:
    header = struct.pack(">IIBBBBB", SIZE, SIZE, 8, 0, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", _stored(raw)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(*c) for c in chunks)


def _chunk(name: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


def _stored(raw: bytes) -> bytes:
    """Return a zlib stream of one uncompressed block: what compressors make differs between their versions."""
    block = struct.pack("<BHH", 1, len(raw), len(raw) ^ 0xFFFF) + raw
    return b"\x78\x01" + block + struct.pack(">I", zlib.adler32(raw))

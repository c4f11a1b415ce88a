"""Arrays in bytes: every bit is kept, and what was cut or changed is refused."""

import hashlib

import numpy as np
import pytest

from master.safety.array_container import MAGIC, pack, unpack

HEADER = {"name": "r\u00e9seau", "counts": [1, 2], "nothing": None}
ARRAYS = {
    "odd": np.array([[0.1, -0.0], [5e-324, np.nan]]),
    "one number": np.array(7),
    "none": np.zeros((0, 3)),
    "flags": np.array([True, False]),
    "raw": np.frombuffer(b"\x00\xff", np.uint8),
    "big": np.arange(3, dtype=">i4"),
}


def test_header_and_arrays_come_back_bit_for_bit():
    header, arrays = unpack(pack(HEADER, ARRAYS))
    assert header == HEADER
    assert list(arrays) == list(ARRAYS)
    for name, array in ARRAYS.items():
        assert (arrays[name].dtype, arrays[name].shape) == (array.dtype, array.shape)
        assert arrays[name].tobytes() == array.tobytes()
    arrays["odd"][0, 0] = 1.0  # they are copies that may be written to
    assert unpack(pack({}, {})) == ({}, {})


def test_the_layout_is_the_stated_one():
    data = pack({"a": 1}, {"x": np.array([2.0])})
    assert data.startswith(MAGIC)
    length = int.from_bytes(data[len(MAGIC) : len(MAGIC) + 8], "little")
    end = len(MAGIC) + 8 + length
    expected = b'{"header": {"a": 1}, "arrays": [{"name": "x", "dtype": "<f8", "shape": [1]}]}'
    assert data[len(MAGIC) + 8 : end] == expected
    assert data[end:-32] == np.array([2.0]).tobytes()
    assert data[-32:] == hashlib.sha256(data[:-32]).digest()


@pytest.mark.parametrize("place", [0, 25, 60, -40, -1])
def test_a_changed_byte_is_found(place):
    data = bytearray(pack(HEADER, ARRAYS))
    data[place] ^= 1
    with pytest.raises(ValueError, match=r"damaged|does not begin"):
        unpack(bytes(data))


@pytest.mark.parametrize("length", [0, 10, len(MAGIC), 40, -1])
def test_a_cut_is_found(length):
    with pytest.raises(ValueError, match=r"damaged|does not begin"):
        unpack(pack(HEADER, ARRAYS)[:length])


def test_objects_are_not_packed_nor_unpacked():
    with pytest.raises(ValueError, match="plain numbers"):
        pack({}, {"x": np.array([{}], dtype=object)})
    body = pack({}, {"x": np.zeros(1)})[:-32].replace(b"<f8", b"|O8")
    with pytest.raises(ValueError, match="plain numbers"):
        unpack(body + hashlib.sha256(body).digest())

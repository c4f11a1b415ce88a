"""Blind changes of bytes, as accidents and vandals make them."""

from __future__ import annotations

from collections.abc import Callable

from hypothesis import strategies as st

GARBAGE = (
    b"", b"\x00", b"\xff\xfe", b"\xef\xbb\xbf", b"\xc3", b"<", b">", b'"', b"'", b"&", b"]]>", b"<!--", b"-->", b"<?",
    b"&amp;", b"&x;", b"[", b"]", b"{", b"=", b"#", b",", b";", b"\n", b"\r", b"\t", b"-", b".", b"e9", b"9" * 400,
    b"nan", b"inf", b"NaN", b"1e999", b"-0", b"0x7f", b"true", b"<![CDATA[", b"xmlns:x=''", b"%s%n", b"\x1b[2J",
    b"A" * 5000, b"(" * 3000, b"[" * 3000, b"<a>" * 3000,
)  # fmt: skip

Change = Callable[[bytes], bytes]


def _at(place: float, data: bytes) -> int:
    return int(place * (len(data) + 1))


def _cut(place: float, length: int) -> Change:
    return lambda data: data[: _at(place, data)] + data[_at(place, data) + length :]


def _put(place: float, what: bytes) -> Change:
    return lambda data: data[: _at(place, data)] + what + data[_at(place, data) :]


def _flip(place: float, bit: int) -> Change:
    def change(data: bytes) -> bytes:
        i = min(_at(place, data), len(data) - 1)
        return data[:i] + bytes([data[i] ^ (1 << bit)]) + data[i + 1 :] if data else data

    return change


def _repeat(place: float, length: int) -> Change:
    return lambda data: data[: _at(place, data) + length] + data[_at(place, data) :]


def _swap(place: float, length: int) -> Change:
    def change(data: bytes) -> bytes:
        i = _at(place, data)
        return data[:i] + data[i + length : i + 2 * length] + data[i : i + length] + data[i + 2 * length :]

    return change


def _truncate(place: float) -> Change:
    return lambda data: data[: _at(place, data)]


_PLACE = st.floats(0.0, 1.0, exclude_max=True)
_LENGTH = st.integers(1, 300)
ONE = st.one_of(
    st.builds(_flip, _PLACE, st.integers(0, 7)),
    st.builds(_cut, _PLACE, _LENGTH),
    st.builds(_put, _PLACE, st.one_of(st.sampled_from(GARBAGE), st.binary(max_size=8))),
    st.builds(_repeat, _PLACE, _LENGTH),
    st.builds(_swap, _PLACE, _LENGTH),
    st.builds(_truncate, _PLACE),
)


@st.composite
def changes(draw: st.DrawFn) -> Change:
    """Return one to three changes in a row."""
    steps = draw(st.lists(ONE, min_size=1, max_size=3))

    def change(data: bytes) -> bytes:
        for step in steps:
            data = step(data)
        return data

    return change

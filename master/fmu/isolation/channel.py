"""Frames between master and child: a header, then numbers, text or raw bytes.

Every frame is a header of two 32-bit numbers (what, argument) and the length of the rest, in bytes. The request alone
determines the layout of what follows it and of its answer, so the master knows the length of every answer but texts and
serialised states beforehand and refuses others. Frames are no array containers: making and reading one takes 37 us, a
frame 1.6 us, and a step has two.
"""

from __future__ import annotations

import os
import select
import socket
import struct
from contextlib import suppress
from enum import IntEnum
from time import perf_counter
from typing import Final

#: What, argument, length of what follows.
HEADER: Final = struct.Struct("<IIQ")
#: Of a step: time, step, whether inputs follow, groups to read afterwards (a bit each).
STEP: Final = struct.Struct("<ddQQ")
#: Start and stop time.
TIMES: Final = struct.Struct("<dd")
#: Bytes of a number.
NUMBER: Final = 8
#: Groups that a step can read: as many as the bits in its mask.
MOST_PREFETCHED: Final = 64
#: Time for which an awaited frame is polled for before the process sleeps [s].
_WATCHFUL: Final = 1e-4
#: Longest text that is accepted from a child [bytes].
LONGEST_TEXT: Final = 1 << 16


class Ask(IntEnum):
    """What the master asks for."""

    LOAD = 1
    GROUP = 2
    START = 3
    FINISH = 4
    EXCHANGE = 5
    STEP = 6
    READ = 7
    SAVE = 8
    RESTORE = 9
    RELEASE = 10
    SERIALISE = 11
    DESERIALISE = 12
    REMARK = 13
    CLOSE = 14


class Answer(IntEnum):
    """The outcome of a request; after a failure the rest of the frame is text."""

    DONE = 0
    FAILED = 1


class EndedError(Exception):
    """The other side has gone."""


class ProtocolError(Exception):
    """The other side does not keep to the layout."""


class Channel:
    """One end of the connection.

    Parameters
    ----------
    connection : socket
        A stream socket.

    Attributes
    ----------
    buffer : bytearray
        Where frames are received, header first; arrays may be laid over it.
    """

    def __init__(self, connection: socket.socket) -> None:
        self._socket = connection
        self._poll = select.poll()
        self._poll.register(connection, select.POLLIN)
        self._watchful = _WATCHFUL if (os.cpu_count() or 1) > 1 else 0.0
        self.buffer = bytearray(HEADER.size)
        self._frame = self.buffer

    def limit(self, seconds: float | None) -> None:
        """Give up waiting after so long, with TimeoutError; None waits for ever."""
        self._socket.settimeout(seconds)

    def reserve(self, size: int) -> bytearray:
        """Make room for frames with ``size`` bytes after the header; returns the new buffer."""
        self.buffer = bytearray(HEADER.size + size)
        return self.buffer

    def send(self, what: int, argument: int = 0, rest: bytes = b"") -> None:
        """Send a frame."""
        self.send_frame(HEADER.pack(what, argument, len(rest)) + rest)

    def send_frame(self, frame: bytes | bytearray | memoryview) -> None:
        """Send a frame that is complete already."""
        try:
            self._socket.sendall(frame)
        except ConnectionError as error:
            raise EndedError from error

    def receive(self, longest: int) -> tuple[int, int, int]:
        """Receive a frame; returns its header.

        Raises
        ------
        EndedError
            If the other side has closed the connection.
        ProtocolError
            If more than ``longest`` bytes follow the header.
        """
        self._frame = self.buffer
        self._watch()
        got = self._fill(0, HEADER.size)
        what, argument, length = HEADER.unpack_from(self._frame)
        if length > longest:
            raise ProtocolError(f"a frame of {length} bytes where at most {longest} were expected")
        whole = HEADER.size + length
        if whole > len(self._frame):
            self._frame = bytearray(whole)
            self._frame[:got] = self.buffer[:got]
        if got < whole:
            got = self._fill(got, whole)
        if got > whole:
            raise ProtocolError(f"{got - whole} bytes more than announced")
        return what, argument, length

    def rest(self, length: int) -> bytes:
        """Return what followed the header of the last frame."""
        return bytes(self._frame[HEADER.size : HEADER.size + length])

    def shut(self) -> None:
        """Stop receiving, so that nobody waits for more; what has arrived can still be read."""
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_RD)

    def close(self) -> None:
        """Close the connection."""
        self._socket.close()

    def _watch(self) -> None:
        """Poll for a frame for a moment before sleeping: waking up takes longer than most answers do."""
        end = perf_counter() + self._watchful
        while not self._poll.poll(0) and perf_counter() < end:
            pass

    def _fill(self, got: int, wanted: int) -> int:
        with memoryview(self._frame) as view:
            while got < wanted:
                try:
                    count = self._socket.recv_into(view[got:])
                except ConnectionError as error:
                    raise EndedError from error
                if count == 0:
                    raise EndedError
                got += count
        return got

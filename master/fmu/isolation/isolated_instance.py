"""The master's side: an `Instance` whose FMU runs in another process."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from master.arrays import FloatArray
from master.errors import SlaveError, one_line
from master.fmu.instance import LONGEST_STATE
from master.fmu.isolation.channel import (
    HEADER,
    LONGEST_TEXT,
    MOST_PREFETCHED,
    NUMBER,
    STEP,
    TIMES,
    Answer,
    Ask,
    EndedError,
    ProtocolError,
)
from master.fmu.isolation.child import describe
from master.fmu.isolation.child_process import Process
from master.safety.interruption import interruptible_at_once, is_stop_requested
from master.system.components import Component

#: Seconds that an FMU has to load, or to complete a phase of its initialisation: many times what the longest line
#: takes, including the compilation of kernels.
INIT_TIMEOUT: Final = 300.0
#: Seconds that an FMU has to free itself when the run is over.
_CLOSING_SECONDS: Final = 5.0


@dataclass(frozen=True)
class _Owed:
    """An answer that is awaited: to which request, in words; its length in bytes; whether it holds the values."""

    doing: str
    size: int = 0
    is_exact: bool = True
    is_values: bool = False


@dataclass(frozen=True)
class Isolation:
    """How FMUs are isolated.

    Attributes
    ----------
    step_timeout : float, optional
        Seconds of wall time after which a step, or another call between steps, counts as an endless loop.
    is_paced : bool
        Whether the run is paced by the wall clock: then no child collects garbage while it steps.
    init_timeout : float
        Seconds of wall time after which a call while loading or initialising counts as an endless loop.
    """

    step_timeout: float | None = None
    is_paced: bool = False
    init_timeout: float = INIT_TIMEOUT


class IsolatedGroup:
    """Variables of an isolated FMU that are read together.

    Attributes
    ----------
    values : ndarray, shape (n,)
        Where `read` puts them.
    """

    def __init__(self, instance: IsolatedInstance, index: int, names: Sequence[str]) -> None:
        self.names = tuple(names)
        self.values: FloatArray = np.zeros(len(self.names))
        self._instance = instance
        self._index = index
        self._last = self._period = 0  # step after which it was last read, steps from the time before until then

    def read(self) -> None:
        """Fill `values` from the FMU."""
        if self.names:
            self.values[:] = self._instance.read_group(self._index)

    def is_due(self, step: int) -> bool:
        """Whether it will probably be read after a step, because it has been read at such intervals."""
        return self._period > 0 and step == self._last + self._period

    def note(self, step: int) -> None:
        """Record that it is read after a step."""
        if step != self._last:
            self._last, self._period = step, step - self._last


class IsolatedInstance:
    """An FMU in a separate process; a `Slave` with the order of calls, the texts and the figures of `Instance`.

    A step is one message each way: inputs travel with the request, outputs and recorded values with the answer. The
    answer is awaited only when it is needed, so that with scheme jacobi the components step at the same time.

    Parameters
    ----------
    component : Component
        What to load.
    isolation : Isolation

    Attributes
    ----------
    stepping_time : float
        Wall time spent in steps so far, in the FMU's process [s].

    Raises
    ------
    SlaveError
        When an awaited answer reports that the FMU failed, or does not arrive.
    """

    def __init__(self, component: Component, isolation: Isolation) -> None:
        self.component = component
        self.name = component.name
        self.input_names = component.inputs
        self.output_names = component.outputs
        self.stepping_time = 0.0
        self._isolation = isolation
        self._groups: list[IsolatedGroup] = []
        self._has_inputs = False  # whether inputs wait for the next message
        self._is_fresh = False  # whether the numbers are the FMU's present ones
        self._fetched = 0  # groups among the numbers, a bit each
        self._steps = 0
        self._owed: _Owed | None = None
        self._where = ""
        self._dead = False
        if component.texts:
            raise SlaveError(
                f"{self._who} exchanges the text '{component.texts[0]}': between processes only numbers are exchanged; "
                "run it without --isolate"
            )
        try:
            self._process = Process()
        except OSError as error:
            raise SlaveError(f"{self._who} cannot be given a separate process ({error})") from error
        self._channel = self._process.channel
        self._limit(isolation.init_timeout, "--init-timeout")
        self._lay_out()
        self._post(_Owed("loading"), Ask.LOAD, 0, describe(component, isolation.is_paced))

    def bind(self, inputs: FloatArray, outputs: FloatArray) -> None:
        """Exchange through these arrays from now on."""
        self._inputs, self._outputs = inputs, outputs

    def group(self, names: Sequence[str]) -> IsolatedGroup:
        """Return a group for further variables, e.g. for recording."""
        self._send_inputs()
        self._ask(_Owed("a request for variables"), Ask.GROUP, 0, json.dumps(list(names)).encode())
        group = IsolatedGroup(self, len(self._groups), names)
        self._groups.append(group)
        self._lay_out()
        return group

    def start(self, start: float, stop: float) -> None:
        """Set up the experiment, set the parameters, enter initialization mode."""
        self._settle()
        self._where = f" at t = {start:.6g} s"
        self._post(_Owed("entering initialization"), Ask.START, 0, TIMES.pack(start, stop))
        self._is_fresh = False

    def finish_initialisation(self) -> None:
        """Leave initialization mode; from here on no call may last longer than the step timeout."""
        self._send_inputs()
        self._ask(_Owed("its initialization"), Ask.FINISH)
        self._is_fresh = False
        self._limit(self._isolation.step_timeout, "--step-timeout")

    def write(self) -> None:
        """Take the bound inputs; the FMU receives them with the next message."""
        self._settle()
        self._request_inputs[:] = self._inputs
        self._has_inputs = True
        self._is_fresh = False

    def read(self) -> None:
        """Put the outputs into the bound array."""
        self._settle()
        if not self._is_fresh:
            self._exchange()
        self._outputs[:] = self._latest_outputs

    def step(self, time: float, step: float) -> None:
        """Begin to advance from ``time`` to ``time + step``; the end is awaited when a result is needed."""
        self._settle()
        self._where = f" at t = {time:.6g} s"
        self._steps += 1
        self._fetched = sum(1 << i for i, g in enumerate(self._groups[:MOST_PREFETCHED]) if g.is_due(self._steps))
        self._post_values("a step", Ask.STEP, time, step)

    def read_group(self, index: int) -> FloatArray:
        """Return the values of a group."""
        self._settle()
        self._groups[index].note(self._steps)
        if self._is_fresh and self._fetched >> index & 1:
            values: FloatArray = self._latest[self._places(self._fetched)[index]]
            return values
        self._send_inputs()
        size = NUMBER * len(self._groups[index].names)
        return np.frombuffer(self._ask(_Owed("reading its variables", size), Ask.READ, index), np.float64)

    def save(self) -> int:
        """Return a number that stands for the FMU's state; hand it back to `release`."""
        self._send_inputs()
        return int.from_bytes(self._ask(_Owed("saving its state", NUMBER), Ask.SAVE), "little")

    def restore(self, state: int) -> None:
        """Return to a saved state."""
        self._send_inputs()
        self._ask(_Owed("restoring its state"), Ask.RESTORE, state)
        self._is_fresh = False

    def release(self, state: int) -> None:
        """Free a saved state."""
        if not self._dead:
            self._ask(_Owed("freeing a state"), Ask.RELEASE, state)

    def serialise(self) -> bytes:
        """Return the state as bytes."""
        self._send_inputs()
        return self._ask(_Owed("serialising its state", LONGEST_STATE, is_exact=False), Ask.SERIALISE)

    def deserialise(self, data: bytes) -> None:
        """Return to a state given as bytes."""
        self._send_inputs()
        self._ask(_Owed("reading a state"), Ask.DESERIALISE, 0, data)
        self._is_fresh = False

    def remark(self) -> str:
        """Return the FMU's last warning or error message."""
        if self._dead:
            return ""
        said = self._ask(_Owed("a request for its messages", LONGEST_TEXT, is_exact=False), Ask.REMARK)
        return one_line(said.decode("utf-8", "replace"))

    def warnings(self) -> tuple[str, ...]:
        """Return the FMU's warnings so far, each once and on one line."""
        if self._dead:
            return ()
        said = self._ask(_Owed("a request for its warnings", LONGEST_TEXT, is_exact=False), Ask.REMARK, 1)
        return tuple(one_line(text) for text in said.decode("utf-8", "replace").split("\n") if text)

    def close(self) -> str:
        """Free the instance, end its process and remove its files; one that hangs or has died is only ended.

        Returns
        -------
        str
            What went wrong, empty if nothing did: how an FMU ends does not affect what was computed.
        """
        if self._dead:
            self._process.end()
            return ""
        self._dead = True
        if self._owed is not None and is_stop_requested():  # the result is no longer wanted
            self._process.end(grace=0.0)
            return ""
        self._channel.limit(_CLOSING_SECONDS)
        try:
            if self._owed is not None:
                self._channel.receive(LONGEST_STATE)
            self._channel.send(Ask.CLOSE)
            _, _, length = self._channel.receive(LONGEST_TEXT)
        except (EndedError, ProtocolError, TimeoutError) as error:
            self._limit_text = f"{_CLOSING_SECONDS:g} s"
            said = str(self._lost(_Owed("its termination"), error))
            self._process.end(grace=0.0)
            return said
        said = one_line(self._channel.rest(length).decode("utf-8", "replace"))
        self._process.end()
        return said

    def _limit(self, seconds: float | None, option: str) -> None:
        self._channel.limit(seconds)
        self._limit_text = "" if seconds is None else f"{seconds:g} s ({option})"

    def _lay_out(self) -> None:
        """Make the buffers: for a request with all inputs, for an answer with all outputs and groups."""
        inputs, outputs = len(self.input_names), len(self.output_names)
        self._request = bytearray(HEADER.size + STEP.size + NUMBER * inputs)
        self._request_inputs = np.frombuffer(self._request, np.float64, inputs, HEADER.size + STEP.size)
        count = 1 + outputs + sum(len(group.names) for group in self._groups)
        answer = self._channel.reserve(NUMBER * count)
        self._received = np.frombuffer(answer, np.float64, count, HEADER.size)
        self._latest: FloatArray = np.zeros(count)
        self._latest_outputs = self._latest[1 : 1 + outputs]
        self._by_mask: dict[int, dict[int, slice]] = {}
        self._has_inputs = self._is_fresh = False

    def _places(self, groups: int) -> dict[int, slice]:
        """Return where each group of a mask lies among the numbers."""
        if groups not in self._by_mask:
            places, first = {}, 1 + len(self.output_names)
            for index, group in enumerate(self._groups):
                if groups >> index & 1:
                    places[index] = slice(first, first + len(group.names))
                    first += len(group.names)
            self._by_mask[groups] = places
        return self._by_mask[groups]

    def _send_inputs(self) -> None:
        """Pass on waiting inputs before a call that depends on them."""
        self._settle()
        if self._has_inputs:
            self._exchange()

    def _exchange(self) -> None:
        self._fetched = 0
        self._post_values("an exchange", Ask.EXCHANGE, 0.0, 0.0)
        self._settle()

    def _post_values(self, kind: str, what: Ask, time: float, step: float) -> None:
        size = 1 + len(self.output_names)
        if self._fetched:
            size = max(part.stop for part in self._places(self._fetched).values())
        HEADER.pack_into(self._request, 0, what, 0, len(self._request) - HEADER.size)
        STEP.pack_into(self._request, HEADER.size, time, step, self._has_inputs, self._fetched)
        self._send(_Owed(kind, NUMBER * size, is_values=True), self._request)
        self._has_inputs = False

    def _post(self, owed: _Owed, what: Ask, argument: int, rest: bytes) -> None:
        self._settle()
        self._send(owed, HEADER.pack(what, argument, len(rest)) + rest)

    def _ask(self, owed: _Owed, what: Ask, argument: int = 0, rest: bytes = b"") -> bytes:
        self._post(owed, what, argument, rest)
        return self._settle()

    def _send(self, owed: _Owed, frame: bytes | bytearray) -> None:
        self._owed = owed
        try:
            self._channel.send_frame(frame)
        except (EndedError, TimeoutError) as error:
            raise self._lost(owed, error) from error

    def _settle(self) -> bytes:
        """Await the answer that is owed, if one is."""
        if self._dead:
            raise SlaveError(f"{self._who} has ended")
        owed = self._owed
        if owed is None:
            return b""
        try:
            with interruptible_at_once():
                length = self._receive(owed)
        except (EndedError, ProtocolError, TimeoutError) as error:
            raise self._lost(owed, error) from error
        except KeyboardInterrupt:
            self._dead, self._owed = True, None
            self._process.end(grace=0.0)
            raise
        if not owed.is_values:
            return self._channel.rest(length)
        count = length // NUMBER
        self._latest[:count] = self._received[:count]
        self.stepping_time = self._latest.item(0)
        self._is_fresh = True
        return b""

    def _receive(self, owed: _Owed) -> int:
        """Receive an answer; return the length of what follows its header."""
        answer, _, length = self._channel.receive(max(owed.size, LONGEST_TEXT))
        self._owed = None
        if answer == Answer.FAILED:
            raise SlaveError(one_line(self._channel.rest(length).decode("utf-8", "replace")))
        if answer != Answer.DONE or length > owed.size or (owed.is_exact and length != owed.size):
            raise ProtocolError(f"answer {answer} of {length} bytes, {owed.size} expected")
        return length

    def _lost(self, owed: _Owed, error: Exception) -> SlaveError:
        """End a child that gives no answer, or a wrong one, and return what became of it."""
        self._dead, self._owed = True, None
        doing = f"{owed.doing}{self._where}"
        if isinstance(error, TimeoutError):
            self._process.end(grace=0.0)
            text = f"{self._who} did not finish {doing} within {self._limit_text}; its process was ended"
            return SlaveError(text)
        if isinstance(error, ProtocolError):
            self._process.end(grace=0.0)
            return SlaveError(f"{self._who} disturbed the exchange with the master in {doing} ({error})")
        return SlaveError(f"{self._who} crashed in {doing}: its process {self._process.how_it_ended()}")

    @property
    def _who(self) -> str:
        return f"component '{self.name}' ({self.component.fmu.path.name})"

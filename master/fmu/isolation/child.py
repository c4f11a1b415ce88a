"""The child's side: holds an `Instance` and does what the master asks for, until the master is gone."""

from __future__ import annotations

import ctypes
import gc
import json
import os
import signal
import socket
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from master.errors import MasterError
from master.fmu.instance import LONGEST_STATE, Group, Instance
from master.fmu.isolation.channel import (
    HEADER,
    LONGEST_TEXT,
    NUMBER,
    STEP,
    TIMES,
    Answer,
    Ask,
    Channel,
    EndedError,
)
from master.safety.supervision import die_with
from master.system.components import Component, Fmu, Variable


def main() -> None:
    """Serve the connection whose file descriptor is the first argument; the second is the master's process."""
    descriptor, parent = int(sys.argv[1]), int(sys.argv[2])
    die_with(parent)
    # Ctrl-C is meant for the master, which ends its children when it is done.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with suppress(EndedError):
        Child(Channel(socket.socket(fileno=descriptor))).serve()
    # What an FMU has left behind, threads or handlers, must not keep the process.
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0)


class Child:
    """Answers requests.

    Parameters
    ----------
    channel : Channel
        The connection to the master.
    """

    def __init__(self, channel: Channel) -> None:
        self._channel = channel
        self._groups: list[Group] = []
        self._states: dict[int, ctypes.c_void_p] = {}
        self._state_count = 0
        self._is_paced = False
        self._answers: dict[int, Callable[[int, int], bytes | None]] = {
            Ask.LOAD: self._load,
            Ask.GROUP: self._group,
            Ask.START: self._start,
            Ask.FINISH: self._finish,
            Ask.EXCHANGE: self._exchange,
            Ask.STEP: self._step,
            Ask.READ: self._read,
            Ask.SAVE: self._save,
            Ask.RESTORE: self._restore,
            Ask.RELEASE: self._release,
            Ask.SERIALISE: self._serialise,
            Ask.DESERIALISE: self._deserialise,
            Ask.REMARK: self._remark,
            Ask.CLOSE: self._close,
        }

    def serve(self) -> None:
        """Answer until the master ends the connection."""
        while True:
            what, argument, length = self._channel.receive(LONGEST_STATE)
            try:
                rest = self._answers[what](argument, length)
            except MasterError as error:
                self._channel.send(Answer.FAILED, 0, str(error).encode("utf-8", "replace"))
            else:
                if rest is not None:  # else it has sent its answer itself
                    self._channel.send(Answer.DONE, 0, rest)
            if what == Ask.CLOSE:
                raise EndedError

    def _load(self, _argument: int, length: int) -> bytes:
        described = json.loads(self._channel.rest(length))
        self._is_paced = described["paced"]
        component = _component(described)
        self._instance = Instance(component)
        self._lay_out(len(component.inputs), len(component.outputs))
        self._instance.bind(self._inputs, self._outputs)
        return b""

    def _lay_out(self, inputs: int, outputs: int) -> None:
        """Lay the exchanged values over the buffers: what is received is what is written, and the reverse."""
        request = self._channel.reserve(STEP.size + NUMBER * inputs)
        self._inputs = np.frombuffer(request, np.float64, inputs, HEADER.size + STEP.size)
        self._answer = bytearray(HEADER.size + NUMBER * (1 + outputs))
        self._numbers = np.frombuffer(self._answer, np.float64, 1 + outputs, HEADER.size)
        self._outputs = self._numbers[1:]

    def _group(self, _argument: int, length: int) -> bytes:
        self._groups.append(self._instance.group(json.loads(self._channel.rest(length))))
        return b""

    def _start(self, _argument: int, length: int) -> bytes:
        self._instance.start(*TIMES.unpack(self._channel.rest(length)))
        return b""

    def _finish(self, _argument: int, _length: int) -> bytes:
        self._instance.finish_initialisation()
        gc.freeze()
        if self._is_paced:
            gc.disable()
        return b""

    def _exchange(self, _argument: int, _length: int) -> None:
        _, _, has_inputs, groups = STEP.unpack_from(self._channel.buffer, HEADER.size)
        if has_inputs:
            self._instance.write()
        self._send_values(groups)

    def _step(self, _argument: int, _length: int) -> None:
        time, step, has_inputs, groups = STEP.unpack_from(self._channel.buffer, HEADER.size)
        if has_inputs:
            self._instance.write()
        self._instance.step(time, step)
        self._send_values(groups)

    def _send_values(self, groups: int) -> None:
        self._instance.read()
        self._numbers[0] = self._instance.stepping_time
        rest = b""
        if groups:
            chosen = [group for i, group in enumerate(self._groups) if groups >> i & 1]
            for group in chosen:
                group.read()
            rest = b"".join(group.values.tobytes() for group in chosen)
        HEADER.pack_into(self._answer, 0, Answer.DONE, 0, len(self._answer) - HEADER.size + len(rest))
        self._channel.send_frame(self._answer + rest if rest else self._answer)

    def _read(self, argument: int, _length: int) -> bytes:
        group = self._groups[argument]
        group.read()
        return group.values.tobytes()

    def _save(self, _argument: int, _length: int) -> bytes:
        self._state_count += 1
        self._states[self._state_count] = self._instance.save()
        return self._state_count.to_bytes(NUMBER, "little")

    def _restore(self, argument: int, _length: int) -> bytes:
        self._instance.restore(self._states[argument])
        return b""

    def _release(self, argument: int, _length: int) -> bytes:
        self._instance.release(self._states.pop(argument))
        return b""

    def _serialise(self, _argument: int, _length: int) -> bytes:
        return self._instance.serialise()

    def _deserialise(self, _argument: int, length: int) -> bytes:
        self._instance.deserialise(self._channel.rest(length))
        return b""

    def _remark(self, argument: int, _length: int) -> bytes:
        text = "\n".join(self._instance.warnings()) if argument else self._instance.remark()
        return text.encode("utf-8", "replace")[:LONGEST_TEXT]

    def _close(self, _argument: int, _length: int) -> bytes:
        return self._instance.close().encode("utf-8", "replace")[:LONGEST_TEXT]


def describe(component: Component, is_paced: bool) -> bytes:
    """Return what a child has to know to load a component."""
    fmu = component.fmu
    described: dict[str, Any] = {
        "name": component.name,
        "path": str(fmu.path.resolve()),
        "guid": fmu.guid,
        "identifier": fmu.identifier,
        "variables": [[v.name, v.reference, v.type] for v in fmu.variables.values()],
        "parameters": component.parameters,
        "inputs": component.inputs,
        "outputs": component.outputs,
        "tolerance": component.tolerance,
        "paced": is_paced,
    }
    return json.dumps(described).encode()


def _component(described: dict[str, Any]) -> Component:
    variables = {
        name: Variable(name, reference, kind, "", "", "", None, None, None)
        for name, reference, kind in described["variables"]
    }
    fmu = Fmu(Path(described["path"]), described["guid"], described["identifier"], variables, True, "", "", True)
    inputs, outputs = tuple(described["inputs"]), tuple(described["outputs"])
    return Component(described["name"], fmu, described["parameters"], inputs, outputs, described["tolerance"])

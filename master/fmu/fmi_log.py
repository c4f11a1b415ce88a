"""The log messages of FMUs, kept per instance so that errors can quote them."""

from __future__ import annotations

from collections import defaultdict, deque
from ctypes import byref
from typing import Any, Final

from fmpy import calloc, free
from fmpy.fmi2 import (
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
    fmi2StepFinishedTYPE,
)
from fmpy.logging import addLoggerProxy

from master.errors import one_line

#: Messages kept per instance, and bytes of one that are looked at.
_KEPT: Final = 20
_LONGEST: Final = 1 << 16

#: FMI status of plain information, and of a warning.
_OK: Final = 0
_WARNING: Final = 1

#: Status and text, by instance.
_messages: defaultdict[str, deque[tuple[int, str]]] = defaultdict(lambda: deque(maxlen=_KEPT))


def _log(_environment: Any, instance: bytes, status: int, _category: bytes, message: bytes) -> None:
    if status != _OK:
        # The FMU's own words go to terminals, tables and pages: on one line, without control characters.
        text = one_line(" ".join(message[:_LONGEST].decode("utf-8", "replace").split()))
        _messages[(instance or b"").decode("utf-8", "replace")].append((status, text))


def _callbacks() -> Any:
    """Make the callbacks; the proxy, which formats printf arguments, knows one logger per process."""
    callbacks = fmi2CallbackFunctions()
    callbacks.logger = fmi2CallbackLoggerTYPE(_log)
    callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(calloc)
    callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(free)
    callbacks.stepFinished = fmi2StepFinishedTYPE()
    addLoggerProxy(byref(callbacks))
    return callbacks


CALLBACKS: Final = _callbacks()


def clear(instance: str) -> None:
    """Delete the messages of an instance of this name."""
    _messages.pop(instance, None)


def last_words(instance: str) -> str:
    """Return the last error message of an instance, its last warning if there is none, empty if there is none."""
    said = _messages.get(instance, ())
    errors = [text for status, text in said if status not in (_OK, _WARNING)]
    return [*(text for _, text in said), *errors][-1] if said else ""


def warnings(instance: str) -> tuple[str, ...]:
    """Return the warnings of an instance, each once."""
    return tuple(dict.fromkeys(text for status, text in _messages.get(instance, ()) if status == _WARNING))

"""The FMUs' own log messages, kept per instance so that errors can quote them."""

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

#: Messages kept per instance.
_KEPT: Final = 20

_messages: defaultdict[str, deque[str]] = defaultdict(lambda: deque(maxlen=_KEPT))


def _log(_environment: Any, instance: bytes, status: int, _category: bytes, message: bytes) -> None:
    if status > 0:
        text = " ".join(message.decode("utf-8", "replace").split())
        _messages[(instance or b"").decode("utf-8", "replace")].append(text)


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
    """Forget what an instance of this name has said."""
    _messages.pop(instance, None)


def last_words(instance: str) -> str:
    """Return the last message of an instance, empty if it said nothing."""
    said = _messages.get(instance)
    return said[-1] if said else ""

"""What FMUs in this process say through `logging`, as notes of a command: ours, that they compile."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Final

_LOGGER: Final = logging.getLogger("openpanto")


class _Notes(logging.Handler):
    """Hands every message on, once: each FMU says it for itself.

    Parameters
    ----------
    tell : callable
        Shows it to the user.
    """

    def __init__(self, tell: Callable[[str], None]) -> None:
        super().__init__()
        self._tell = tell
        self._told: set[str] = set()

    def emit(self, record: logging.LogRecord) -> None:
        """Show a message."""
        text = record.getMessage()
        if text not in self._told:
            self._told.add(text)
            self._tell(text)


def show_log(tell: Callable[[str], None]) -> None:
    """Have what is logged shown from now on, and no longer where an earlier call wanted it."""
    for handler in [h for h in _LOGGER.handlers if isinstance(h, _Notes)]:
        _LOGGER.removeHandler(handler)
    _LOGGER.addHandler(_Notes(tell))
    _LOGGER.setLevel(logging.INFO)

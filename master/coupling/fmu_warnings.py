"""Warnings of the FMUs of a run, and values that cannot be right.

An FMU is asked when initialization and the first step are over, and once more at the end.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Final, Protocol, runtime_checkable

import numpy as np

from master.coupling.network import Network
from master.errors import MasterError

#: Magnitude beyond which no length, velocity or force of a line and a pantograph lies [SI].
LARGEST: Final = 1e15


@dataclass(frozen=True)
class FmuWarning:
    """A warning from an FMU.

    Attributes
    ----------
    component : str
    text : str
        Its words.
    is_own : bool
        Whether the words are the FMU's; a failed termination is reported by the master.
    """

    component: str
    text: str
    is_own: bool = True

    def __str__(self) -> str:
        if not self.is_own:
            return f"warning: {self.text}; this does not affect what was computed"
        return f"warning: component '{self.component}' says: {self.text}"


class Excess(FmuWarning):
    """A value of an FMU that cannot be right, which it has not warned of itself; the text begins with the variable."""

    def __str__(self) -> str:
        return f"warning: component '{self.component}': {self.text}"


class FmuWarningObserver:
    """Observer that asks the FMUs after initialization, after the first step and at the end, and looks at all values.

    Parameters
    ----------
    tell : callable
        Called with every new warning.

    Attributes
    ----------
    warnings : list of FmuWarning
        So far.
    """

    def __init__(self, tell: Callable[[FmuWarning], None] = lambda _: None) -> None:
        self._tell = tell
        self._has_stepped = False
        self._network: Network | None = None
        self._seen: set[str] = set()
        self.warnings: list[FmuWarning] = []

    def begin(self, start: float, network: Network) -> None:
        """Initialization is over."""
        self._network = network
        self._look(network)
        self._check_size(start, network)

    def observe(self, index: int, end: float, network: Network) -> None:
        """Look at the values, and once more at the warnings after the first step."""
        values = network.outputs.tolist()  # plain floats: for so few faster than an array
        if values and (max(values) > LARGEST or min(values) < -LARGEST):
            self._check_size(end, network)
        if not self._has_stepped:
            self._has_stepped = True
            self._look(network)

    def finish(self) -> None:
        """Ask for warnings since the first step; an FMU that can no longer answer has reported why."""
        if self._network is not None:
            with suppress(MasterError):
                self._look(self._network)

    def add(self, found: FmuWarning) -> None:
        """Add a warning from elsewhere."""
        if found not in self.warnings:
            self.warnings.append(found)
            self._tell(found)

    def _look(self, network: Network) -> None:
        for slave in network.slaves:
            for text in slave.warnings() if isinstance(slave, WarningSource) else ():
                self.add(FmuWarning(slave.name, text))

    def _check_size(self, time: float, network: Network) -> None:
        """Warn once of every output that has become larger than anything can be."""
        for index in np.flatnonzero(np.abs(network.outputs) > LARGEST):
            name = network.output_names[index]
            if name not in self._seen:
                self._seen.add(name)
                component, _, variable = name.partition(".")
                text = f"{variable} became {network.outputs[index]:.3g} at t = {time:.6g} s, larger than anything here"
                self.add(Excess(component, f"{text} can be ({LARGEST:g}); the results mean nothing"))


@runtime_checkable
class WarningSource(Protocol):
    """A slave that may warn."""

    name: str

    def warnings(self) -> tuple[str, ...]:
        """Return its warnings so far, each once and on one line."""

"""What the FMUs of a run warn of: told once, when initialization and the first step are over."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from master.instance import Cautious
from master.network import Network


@dataclass(frozen=True)
class Caution:
    """What an FMU has warned of.

    Attributes
    ----------
    component : str
    text : str
        In the FMU's own words.
    is_own : bool
        Whether they are: how an FMU ended it does not say itself.
    """

    component: str
    text: str
    is_own: bool = True

    def __str__(self) -> str:
        if not self.is_own:
            return f"warning: {self.text}; what was computed is not touched by that"
        return f"warning: component '{self.component}' says: {self.text}"


class CautionObserver:
    """Observer that asks the FMUs after initialization, and once more after the first step.

    Parameters
    ----------
    tell : callable
        Called with every new warning.

    Attributes
    ----------
    warnings : list of Caution
        So far.
    """

    def __init__(self, tell: Callable[[Caution], None] = lambda _: None) -> None:
        self._tell = tell
        self._has_stepped = False
        self.warnings: list[Caution] = []

    def begin(self, start: float, network: Network) -> None:
        """Initialization is over."""
        self._look(network)

    def observe(self, index: int, end: float, network: Network) -> None:
        """Look once more after the first step."""
        if not self._has_stepped:
            self._has_stepped = True
            self._look(network)

    def finish(self) -> None:
        """Nothing to finish."""

    def add(self, found: Caution) -> None:
        """Take a warning that comes from elsewhere."""
        if found not in self.warnings:
            self.warnings.append(found)
            self._tell(found)

    def _look(self, network: Network) -> None:
        for slave in network.slaves:
            for text in slave.warnings() if isinstance(slave, Cautious) else ():
                self.add(Caution(slave.name, text))

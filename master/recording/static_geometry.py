"""The calculated parameters of all components, read once and kept next to the recordings."""

from __future__ import annotations

from collections.abc import Callable

from master.coupling.network import Network
from master.system.components import System

#: Values of calculated parameters by component and variable name.
Geometry = dict[str, dict[str, float]]


class GeometryObserver:
    """Observer that reads all Real calculated parameters once, when they are known.

    Parameters
    ----------
    system : System
    tell : callable
        Called with them.
    """

    def __init__(self, system: System, tell: Callable[[Geometry], None] = lambda _: None) -> None:
        self._system = system
        self._tell = tell
        self.geometry: Geometry = {}

    def begin(self, time: float, network: Network) -> None:
        """Read them."""
        for component, slave in zip(self._system.components, network.slaves, strict=True):
            variables = component.fmu.variables.values()
            names = [v.name for v in variables if v.causality == "calculatedParameter" and v.type == "Real"]
            group = getattr(slave, "group", None)
            if names and group is not None:
                values = group(names)
                values.read()
                self.geometry[component.name] = dict(zip(names, values.values.tolist(), strict=True))
        self._tell(self.geometry)

    def observe(self, index: int, time: float, network: Network) -> None:
        """Nothing changes."""

    def finish(self) -> None:
        """Nothing to close."""

"""Inputs that a parameter switches on: connected in vain, with nothing connected, or beside what they replace.

An FMU cannot tell: it does not know what its inputs are connected to.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

from master.system.components import System
from master.system.pantograph_motion import USE_TRAIN, is_switched_on


class _Switch(NamedTuple):
    """A parameter, the input that counts where it is not 0, and what happens with none connected (empty: no harm)."""

    parameter: str
    input: str
    without: str


#: Parameter in whose place these say how a pantograph moves.
_SPEED: Final = "speed"
_SWITCHES: Final = (
    _Switch(USE_TRAIN, "train.x", "it stands still"),
    _Switch(USE_TRAIN, "train.vx", "it has no speed between communication points"),
    _Switch("lift_input", "lift.value", "nothing lifts it"),
    _Switch("follow_height", "reference.vz", ""),
)


def doubts(system: System) -> Iterator[str]:
    """Yield a sentence for every such input."""
    connected = {(c.target, c.input) for c in system.connections}
    for component in system.components:
        for switch in _SWITCHES:
            if not {switch.parameter, switch.input} <= set(component.fmu.variables):
                continue
            is_on, name = is_switched_on(component, switch.parameter), f"{component.name}.{switch.input}"
            is_connected = (component.name, switch.input) in connected
            if is_connected and not is_on:
                yield f"{name} is connected, but does nothing while {switch.parameter} is 0"
            elif is_on and switch.without and not is_connected and switch.input not in component.parameters:
                set_to = f"{component.name}.{switch.parameter} = 1"
                yield f"{set_to}, but nothing is connected to {switch.input}: {switch.without}"
        if is_switched_on(component, USE_TRAIN) and _SPEED in component.parameters:
            instead = "the inputs train.x and train.vx say where it is"
            yield f"{component.name}.{_SPEED} is set, but does nothing while {USE_TRAIN} is 1: {instead}"

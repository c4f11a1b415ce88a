"""Where pantographs will be, as far as the parameters of their FMUs say."""

from __future__ import annotations

import math
from typing import Final

from master.system.components import Component, System

#: Parameter of a pantograph that moves along the track as inputs say, where it is 1.
USE_TRAIN: Final = "use_train"
#: Parameter that lifts a pantograph's strip to the wire.
STATIC_FORCE: Final = "static_force"


def parameter_value(component: Component, name: str) -> float | None:
    """Return the value that a Real parameter will have, None if there is no such parameter or no value."""
    variable = component.fmu.variables.get(name)
    if variable is None or variable.causality != "parameter" or variable.type != "Real":
        return None
    try:
        value = float(component.parameters.get(name, variable.start or math.nan))
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def is_switched_on(component: Component, name: str) -> bool:
    """Return whether a parameter that is 0 or 1 is not 0; False if there is none."""
    variable = component.fmu.variables.get(name)
    if variable is None or variable.causality != "parameter":
        return False
    try:
        return float(component.parameters.get(name, variable.start or 0.0)) != 0.0
    except ValueError:
        return False


def constant_speed(component: Component) -> float | None:
    """Return the speed that a pantograph keeps, None if its FMU does not say one or inputs say how it moves.

    A pantograph with a speed profile has no parameter ``speed``.
    """
    return None if is_switched_on(component, USE_TRAIN) else parameter_value(component, "speed")


def pantographs(system: System) -> tuple[Component, ...]:
    """Return the components that receive a contact force, each once."""
    names = dict.fromkeys(c.pantograph for c in system.contacts)
    return tuple(system.component(name) for name in names)


def final_position(system: System, pantograph: Component) -> float | None:
    """Return where a pantograph is at the stop time [m], None if its FMU gives no start or no constant speed."""
    start, speed = parameter_value(pantograph, "start_position"), constant_speed(pantograph)
    return None if start is None or speed is None else start + speed * (system.stop - system.start)

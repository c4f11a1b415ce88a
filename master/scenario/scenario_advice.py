"""Limits with a physical meaning that follow from the scenario's own numbers, before anything is run.

The master knows no physics but what FMUs show: where a line and a pantograph have the parameters named here, as ours
have, they are compared; of others nothing is said.

`validate` reports these, for there no FMU is initialised. In a run the line's FMU speaks of the same limits, and is the
better judge: it knows how fast the strips really come and how long the steps really are, whoever made the pantograph.
So a run leaves these out, and nothing is said twice (`master.coupling.fmu_warnings`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

from master.system.components import Component, System
from master.system.pantograph_motion import constant_speed

#: Highest speed of operation over the wave speed of the contact wire (EN 50119).
OPERATION_LIMIT: Final = 0.7
#: Largest step over the relaxation time of contact wire and contact spring.
_LARGEST_SHARE: Final = 0.25


def warnings(system: System) -> Iterator[str]:
    """Yield a sentence for every limit that is passed; the run is possible nevertheless."""
    pairs = dict.fromkeys((c.source, c.target) for c in system.connections)
    for pantograph, line in pairs:
        yield from _too_fast(system.component(pantograph), system.component(line))
    for component in system.components:
        yield from _too_long(component, system.step)


def _too_fast(pantograph: Component, line: Component) -> Iterator[str]:
    """Compare a pantograph's speed with that of transverse waves, sqrt(T / rho)."""
    speed, tension, mass = constant_speed(pantograph), *_wire(line)
    if speed is None or tension is None or mass is None:
        return
    C = math.sqrt(tension / mass)
    if abs(speed) > OPERATION_LIMIT * C:
        yield (
            f"{pantograph.name}.speed: {3.6 * abs(speed):.0f} km/h are {abs(speed) / C:.2f} of the wave speed of the "
            f"contact wire of '{line.name}', {3.6 * C:.0f} km/h; lines are operated up to {OPERATION_LIMIT:g} of it"
        )


def _too_long(line: Component, step: float) -> Iterator[str]:
    """Compare the macro step H with the time in which a long wire gives way on the contact spring K.

    Seen from the contact such a wire is a damper 2 sqrt(T rho), and an exchange once per step acts like a damping
    -K H: their ratio, H over the relaxation time 2 sqrt(T rho) / K, is how much of the wire's damping is lost.
    """
    stiffness, exponent = _value(line, "contact.stiffness"), _value(line, "contact.exponent")
    tension, mass = _wire(line)
    if stiffness is None or tension is None or mass is None or exponent not in (None, 1.0):
        return
    longest = _LARGEST_SHARE * 2.0 * math.sqrt(tension * mass) / stiffness
    if step > longest:
        yield (
            f"macro step {1e3 * step:.3g} ms is long for {line.name}.contact.stiffness = {stiffness:g} N/m; "
            f"take {1e3 * longest:.2g} ms or less"
        )


def _wire(line: Component) -> tuple[float | None, float | None]:
    return _value(line, "contact_wire.tension"), _value(line, "contact_wire.mass")


def _value(component: Component, name: str) -> float | None:
    """Return the value that a parameter will have, None if there is none, or none greater than 0."""
    variable = component.fmu.variables.get(name)
    if variable is None or variable.causality != "parameter":
        return None
    try:
        value = float(component.parameters.get(name, variable.start or 0.0))
    except ValueError:
        return None
    return value if 0.0 < value < math.inf else None

"""What every pantograph has: a collector strip, and how it is started, raised and driven."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, NamedTuple

from models.definition_files.field_schema import count, monitoring, quantity, text, vector

#: A roof that does not sway; see `Drive.sway`.
NO_SWAY: Final = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class OperationError(ValueError):
    """An input that a pantograph cannot be driven by; says which, and what to do."""


class Drive(NamedTuple):
    """What acts on a pantograph from outside besides contact and roof, held over a step; all 0 if nothing is connected.

    Attributes
    ----------
    reference_rate : float
        Rate of the line's nominal height under the strip [m/s].
    air : float
        Speed of the air along x [m/s].
    uplift : float
        Force added to the static force [N].
    lift : float
        Value of the lifting element [N or N.m], for a pantograph whose ``lift_input`` is 1.
    sway : tuple of float
        Of the roof: lateral position and velocity [m, m/s], roll and its rate, yaw and its rate [rad, rad/s].
    """

    reference_rate: float = 0.0
    air: float = 0.0
    uplift: float = 0.0
    lift: float = 0.0
    sway: tuple[float, float, float, float, float, float] = NO_SWAY


#: Nothing connected.
NO_DRIVE = Drive()


@dataclass(frozen=True, kw_only=True)
class Operation:
    """How a pantograph runs: speed, start, raising, collector strip.

    The names are the same for every kind of pantograph.
    """

    speed: float = quantity("m/s", "speed along the track", default=300.0 / 3.6, minimum=0.0, maximum=170.0)
    start_position: float = quantity("m", "position along the track at time 0", default=0.0, minimum=-1e7, maximum=1e7)
    reference_height: float = quantity(
        "m",
        "height of the strip at time 0, where the springs carry the weights",
        default=5.02,
        minimum=2.0,
        maximum=10.0,
    )
    raise_start: float = quantity("s", "when the uplift begins to act", default=0.0, minimum=0.0, maximum=1e4)
    raise_duration: float = quantity(
        "s", "time over which the uplift grows to its value", default=0.1, minimum=0.0, maximum=100.0
    )
    strip_length: float = quantity("m", "working length of the collector strip", default=1.45, minimum=0.1, maximum=4.0)
    strip_offset: float = quantity(
        "m", "lateral position of the strip's middle", default=0.0, minimum=-2.0, maximum=2.0
    )
    aerodynamic_uplift: tuple[float, float] = vector(
        "N.s2/m2",
        "aerodynamic uplift per square of the speed against the air, knuckle",
        labels=("leading", "trailing"),
        default=(0.0, 0.0),
        minimum=-1.0,
        maximum=1.0,
    )
    knuckle: str = text(default="leading", choices=("leading", "trailing"))
    direction: int = count(
        "1: the knuckle is where the definition says, -1: the pantograph runs the other way round",
        default=1, minimum=-1, maximum=1,
    )  # fmt: skip
    extrapolation_order: int = count(
        "order of the extrapolation of the contact force inside a step: 0 held, 1 linear, 2 quadratic",
        default=2, minimum=0, maximum=2,
    )  # fmt: skip
    monitor_energy: int = monitoring()
    # At least a thousandth of the usual one: a run in shorter steps would never end.
    time_step: float = quantity("s", "longest internal time step", default=1e-3, minimum=1e-6, maximum=0.1)

    def raised(self, time: float) -> float:
        """Return the share of the uplift that acts at ``time``: 0 before raising, a ramp, then 1."""
        if time < self.raise_start:
            return 0.0
        if self.raise_duration == 0.0:
            return 1.0
        return min(1.0, (time - self.raise_start) / self.raise_duration)

    def problems(self) -> Iterator[tuple[str, str]]:
        """Yield what is wrong with the direction."""
        if self.direction == 0:
            yield "direction", "0 is neither 1 (as the definition says) nor -1 (the other way round)"

    @property
    def air_coefficient(self) -> float:
        """Aerodynamic uplift per square of the speed against the air, for the way the knuckle points [N.s2/m2]."""
        leading, trailing = self.aerodynamic_uplift
        return leading if (self.knuckle == "leading") == (self.direction > 0) else trailing

    def aerodynamic_force(self, air: float, speed: float | None = None) -> float:
        """Return the aerodynamic uplift [N] in air that moves along x [m/s], at the speed of the train or another."""
        against = (self.speed if speed is None else speed) - air
        return self.air_coefficient * abs(against) * against

"""What every pantograph has: a collector strip, and how it is started, raised and driven."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final, NamedTuple

from models.definition_files.field_schema import count, monitoring, part, quantity, text, vector
from models.definition_files.parameter import Parameter, ParameterError
from models.definition_files.toml_reader import Table
from models.pantograph.train_motion import SpeedProfile, TrainMotion

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
    train : (float, float)
        Way along the track from the start position and speed [m, m/s], for a pantograph whose ``use_train`` is 1.
    """

    reference_rate: float = 0.0
    air: float = 0.0
    uplift: float = 0.0
    lift: float = 0.0
    sway: tuple[float, float, float, float, float, float] = NO_SWAY
    train: tuple[float, float] = (0.0, 0.0)


#: Nothing connected.
NO_DRIVE = Drive()
#: Keys that say nothing beside a speed profile.
_BESIDE_PROFILE: Final = ("speed", "use_train")


@dataclass(frozen=True, kw_only=True)
class Operation:
    """How a pantograph runs: speed, start, raising, collector strip.

    The names are the same for every kind of pantograph.
    """

    speed: float = quantity("m/s", "speed along the track", default=300.0 / 3.6, minimum=0.0, maximum=170.0)
    start_position: float = quantity("m", "position along the track at time 0", default=0.0, minimum=-1e7, maximum=1e7)
    speed_profile: SpeedProfile | None = part(SpeedProfile, default=None)
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
    use_train: int = count(
        "what moves it along the track: 0 the speed, 1 the inputs train.x and train.vx in place of it",
        default=0, maximum=1,
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
        if self.use_train and self.speed_profile is not None:
            yield "use_train", _idle_text("use_train")

    def check_speed(self, table: Table) -> None:
        """Tell a definition's table of keys that do nothing beside its speed profile, or beside inputs in its place."""
        for key in _BESIDE_PROFILE if self.speed_profile is not None else ():
            if table.has(key):
                table.problem(key, _idle_text(key))
        if self.use_train and self.speed_profile is None and table.has("speed"):
            text = "does nothing with use_train = 1: the inputs train.x and train.vx say where it is"
            table.problem("speed", f"{text}; leave out one of the two")

    def tunable(self, parameters: Iterable[Parameter]) -> tuple[Parameter, ...]:
        """Return those of the definition's parameters that do something."""
        idle = _BESIDE_PROFILE if self.speed_profile is not None else ()
        return tuple(p for p in parameters if p.name not in idle)

    def refuse_idle(self, names: Iterable[str]) -> None:
        """Raise ``ParameterError`` for a parameter that does nothing beside the speed profile."""
        for name in _BESIDE_PROFILE if self.speed_profile is not None else ():
            if name in names:
                raise ParameterError(f"parameter '{name}': {_idle_text(name)}")

    def refuse_varying_speed(self, who: str) -> None:
        """Raise ``ParameterError`` for a pantograph whose speed is not constant, on behalf of who makes the run."""
        if self.speed_profile is not None or self.use_train:
            key = "use_train = 1" if self.use_train else "[speed_profile]"
            raise ParameterError(f"{key}: {who} runs at constant speed; make a scenario of FMUs (openpanto new)")

    def train_motion(self) -> TrainMotion:
        """Return a motion along the track that has not begun."""
        return TrainMotion(self.start_position, self.speed, self.speed_profile, bool(self.use_train))

    @property
    def air_coefficient(self) -> float:
        """Aerodynamic uplift per square of the speed against the air, for the way the knuckle points [N.s2/m2]."""
        leading, trailing = self.aerodynamic_uplift
        return leading if (self.knuckle == "leading") == (self.direction > 0) else trailing

    def aerodynamic_force(self, air: float, speed: float | None = None) -> float:
        """Return the aerodynamic uplift [N] in air that moves along x [m/s], at the speed of the train or another."""
        against = (self.speed if speed is None else speed) - air
        return self.air_coefficient * abs(against) * against


def _idle_text(key: str) -> str:
    return f"does nothing beside [speed_profile], which says the speed: leave out '{key}' or the profile"

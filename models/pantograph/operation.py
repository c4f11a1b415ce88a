"""What every pantograph has: a collector strip, and how it is started, raised and driven."""

from __future__ import annotations

from dataclasses import dataclass

from models.definition_files.field_schema import count, monitoring, quantity


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

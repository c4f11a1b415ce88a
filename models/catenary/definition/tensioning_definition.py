"""What keeps the wires tensioned over temperature: devices, fixed point, cantilevers, as read and checked."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, Literal

from models.definition_files.field_schema import count, part, quantity, series, text

DeviceKind = Literal["weights", "spring", "fixed"]
DEVICE_KINDS: Final[tuple[DeviceKind, ...]] = ("weights", "spring", "fixed")
#: How much further the weights of a pulley or a wheel move than the wire, unless said otherwise.
_RATIO: Final = 5.0
#: Coldest and hottest that a wire can be meant to be [K].
COLDEST, HOTTEST = 173.15, 473.15


@dataclass(frozen=True, kw_only=True)
class TensioningDevice:
    """What one kind of wire ends in."""

    kind: DeviceKind = text(default="weights", choices=DEVICE_KINDS)
    ratio: float = quantity(
        "1", "movement of the weights over that of the wire", default=_RATIO, minimum=0.5, maximum=20.0
    )
    efficiency: float = quantity(
        "1", "efficiency of the tensioning device: by it the tension is less after the wire has lengthened, and "
        "greater after it has shortened",
        default=1.0, minimum=0.5, maximum=1.0,
    )  # fmt: skip
    stiffness: float | None = quantity(
        "N/m", "stiffness of the spring at the end of the wire", default=None, minimum=10.0, maximum=1e8
    )
    expansion: float = quantity("1/K", "thermal expansion of the wire", default=17e-6, minimum=0.0, maximum=1e-4)

    def problems(self) -> Iterator[tuple[str, str]]:
        """Yield a problem if a spring has no stiffness, or a device has what only another kind has."""
        if self.kind == "spring" and self.stiffness is None:
            yield "stiffness", "is missing: how stiff is the spring?"
        if self.kind in ("weights", "fixed") and self.stiffness is not None:
            yield "stiffness", f"means nothing for kind '{self.kind}': remove it, or take kind 'spring'"
        if self.kind != "weights" and self.efficiency != 1.0:
            yield "efficiency", f"means nothing for kind '{self.kind}': remove it, or take kind 'weights'"
        if self.kind != "weights" and self.ratio != _RATIO:
            yield "ratio", f"means nothing for kind '{self.kind}': remove it, or take kind 'weights'"


@dataclass(frozen=True, kw_only=True)
class Tensioning:
    """The temperature of a line and the devices that tension it; tensions are those at the reference temperature."""

    temperature: float = quantity("K", "temperature of the wires", minimum=COLDEST, maximum=HOTTEST)
    reference_temperature: float = quantity(
        "K", "temperature at which tensions, heights and lengths are those of the design",
        minimum=COLDEST, maximum=HOTTEST,
    )  # fmt: skip
    fixed_point: float | None = quantity(
        "m", "where the wires stay as they expand, along the track; without it the middle of the section",
        default=None, minimum=-1e7, maximum=1e7,
    )  # fmt: skip
    direction: int = count(
        "last movement of the wires against the friction of the devices: 1 they have lengthened, -1 shortened, 0 no "
        "friction",
        default=0, minimum=-1, maximum=1,
    )  # fmt: skip
    mast_side: tuple[float, ...] = series(
        "1", "side of the masts, 1 left and -1 right of the track: one value, or one for each support between the "
        "anchors",
        default=(-1.0,), minimum=-1.0, maximum=1.0,
    )  # fmt: skip
    cantilever_length: float = quantity(
        "m", "distance from mast to wire, on which the wire swings along the track", default=3.0, minimum=0.5,
        maximum=20.0,
    )  # fmt: skip
    contact_wire: TensioningDevice = part(TensioningDevice, default=TensioningDevice())
    messenger_wire: TensioningDevice = part(TensioningDevice, default=TensioningDevice())
    auxiliary_wire: TensioningDevice | None = part(TensioningDevice, default=None)

    def of(self, component: str) -> TensioningDevice:
        """Return the device of a kind of wire."""
        device: TensioningDevice | None = getattr(self, component)
        return device or TensioningDevice()

    @property
    def warming(self) -> float:
        """Return how much warmer than at the reference the wires are [K]."""
        return self.temperature - self.reference_temperature

    @property
    def is_design(self) -> bool:
        """Return whether all is as at the reference, without friction."""
        return self.temperature == self.reference_temperature and self.direction == 0

    def problems(self) -> Iterator[tuple[str, str]]:
        """Yield a problem if a side is none."""
        if wrong := [side for side in self.mast_side if abs(side) != 1.0]:
            yield "mast_side", f"{wrong[0]:g}: masts stand on the side 1, left, or -1, right"

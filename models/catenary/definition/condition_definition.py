"""What makes a line differ from its design: errors of assembly and faults, as read and checked."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from models.definition_files.field_schema import count, quantity, text

#: Largest seed: the largest whole number of FMI.
LARGEST_SEED = 2**31 - 1


@dataclass(frozen=True, kw_only=True)
class Irregularity:
    """Errors of assembly, normal and limited to three standard deviations; every seed has its own."""

    seed: int = count("number that decides which errors are drawn", default=0, maximum=LARGEST_SEED)
    dropper_length_sigma: float = quantity(
        "m", "standard deviation of the unstrained lengths of droppers and hangers about the design's; 0: none",
        default=0.0, minimum=0.0, maximum=0.5,
    )  # fmt: skip
    support_height_sigma: float = quantity(
        "m", "standard deviation of the heights of supports (messenger wire and registration end) about the design's; "
        "0: none",
        default=0.0, minimum=0.0, maximum=0.5,
    )  # fmt: skip


FaultKind = Literal["dropper_broken", "dropper_slipped"]
FAULT_KINDS: tuple[FaultKind, ...] = ("dropper_broken", "dropper_slipped")


@dataclass(frozen=True, kw_only=True)
class Fault:
    """A fault of one dropper, there from the start of a run if it is active."""

    kind: FaultKind = text(choices=FAULT_KINDS)
    section: int = count("section, from 1", default=1, minimum=1, tunable=False)
    span: int = count("span of the section, from 1", minimum=1, tunable=False)
    dropper: int = count("dropper of the span, from 1", minimum=1, tunable=False)
    active: int = count("whether the fault acts: 1 yes, 0 no", default=1, maximum=1)
    value: float | None = quantity(
        "m", "how far the dropper has slipped: what it is longer than designed", default=None, minimum=-5.0, maximum=5.0
    )

    def problems(self) -> Iterator[tuple[str, str]]:
        """Yield a problem if the value is missing or means nothing."""
        if self.kind == "dropper_slipped" and self.value is None:
            yield "value", "is missing: how far has the dropper slipped?"
        if self.kind == "dropper_broken" and self.value is not None:
            yield "value", "means nothing for a broken dropper: remove it"

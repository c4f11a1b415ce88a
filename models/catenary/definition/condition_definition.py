"""Errors of assembly, which make a line differ from its design, as read and checked."""

from __future__ import annotations

from dataclasses import dataclass

from models.definition_files.field_schema import count, quantity

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
    dropper_position_sigma: float = quantity(
        "m", "standard deviation of the places of droppers and hangers along the track about the design's, both clamps "
        "moved alike; 0: none",
        default=0.0, minimum=0.0, maximum=0.5,
    )  # fmt: skip
    support_height_sigma: float = quantity(
        "m", "standard deviation of the heights of supports (messenger wire and registration end) about the design's; "
        "0: none",
        default=0.0, minimum=0.0, maximum=0.5,
    )  # fmt: skip
    stagger_sigma: float = quantity(
        "m", "standard deviation of the lateral places of registration ends about the design's; 0: none",
        default=0.0, minimum=0.0, maximum=0.5,
    )  # fmt: skip

"""What leads a value from one component to another."""

from __future__ import annotations

from dataclasses import dataclass, field

from master.ssp.ssp_units import Conversion


@dataclass(frozen=True)
class Connection:
    """From one component's output to another's input: input = conversion(output)."""

    source: str
    output: str
    target: str
    input: str
    conversion: Conversion = field(default_factory=Conversion)

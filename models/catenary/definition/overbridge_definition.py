"""What stands over a line: bridges, portals, tunnel roofs, as read and checked. No run knows of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from models.definition_files.field_schema import quantity, text


@dataclass(frozen=True, kw_only=True)
class Overbridge:
    """A bridge, portal or tunnel roof over the track, its underside level in the rail plane; None is the norm's."""

    name: str = text(filled=True)
    start: float = quantity("m", "where it begins along the track", minimum=-1e7, maximum=1e7, tunable=False)
    end: float = quantity("m", "where it ends along the track", minimum=-1e7, maximum=1e7, tunable=False)
    underside: float = quantity(
        "m", "height of its underside above the rail plane", minimum=3.0, maximum=30.0, tunable=False
    )
    clearance: float | None = quantity(
        "m", "distance that is wanted between its underside and the highest wire at rest; without it that of the norm",
        default=None, minimum=0.0, maximum=2.0, tunable=False,
    )  # fmt: skip
    clearance_lifted: float | None = quantity(
        "m", "distance that is wanted while a pantograph lifts the wires; without it that of the norm",
        default=None, minimum=0.0, maximum=2.0, tunable=False,
    )  # fmt: skip
    lift: float | None = quantity(
        "m", "how far pantographs lift the messenger wire there; without it what a force at rest does",
        default=None, minimum=0.0, maximum=1.0, tunable=False,
    )  # fmt: skip

    def problems(self) -> Iterator[tuple[str, str]]:
        """Yield a problem if it ends before it begins, or is to be nearer at rest than while wires are lifted."""
        if self.end <= self.start:
            yield "end", f"{self.end:g} m must be greater than start, {self.start:g} m"
        if None not in (self.clearance, self.clearance_lifted) and self.clearance_lifted > self.clearance:  # type: ignore[operator]
            text = f"{self.clearance_lifted:g} m must not be greater than clearance, {self.clearance:g} m"
            yield "clearance_lifted", f"{text}: what is lifted is nearer"

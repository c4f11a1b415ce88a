"""Limits that a pantograph passes while it runs, each told once until it has been back for a while."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

#: How long a pantograph must have been back before another excursion is told [s] (choice: what rebounds is one).
_BACK: Final = 1.0


class Place(NamedTuple):
    """When and where something happened: time [s], along the track [m], height above the rails [m]."""

    time: float
    x: float
    z: float

    def __str__(self) -> str:
        return f"t = {self.time:.3f} s, x = {self.x:.1f} m"


class Excursions:
    """What is beyond its limit now, and the sentences about it that nobody has fetched yet.

    Attributes
    ----------
    told : list of str
        Whoever fetches them empties it.
    """

    def __init__(self) -> None:
        self.told: list[str] = []
        self._last: dict[str, float] = {}

    def start(self) -> None:
        """Begin a run: nothing is beyond its limit, nothing told."""
        self.told.clear()
        self._last.clear()

    def is_new(self, name: str, time: float) -> bool:
        """Note that a limit of some name is passed at a time [s]; return whether that begins another excursion."""
        last = self._last.get(name)
        self._last[name] = time
        return last is None or not last <= time + _BACK or time - last > _BACK

    def touch(self, stops: Sequence[str], place: Place, *, has_met: bool, is_loaded: bool, is_neutral: bool) -> None:
        """Note that stops are touched.

        Parameters
        ----------
        stops : sequence of str
            Their names, and which end.
        place : Place
            Of the strip.
        has_met : bool
            Whether the strip has met a wire before.
        is_loaded : bool
            Whether a wire presses on it.
        is_neutral : bool
            Whether without one it rests nowhere by itself.
        """
        new = [stop for stop in stops if self.is_new(stop, place.time)]
        if not new:
            return
        listed = f"stop{'s' if len(new) > 1 else ''}, {' and '.join(new)}"
        text = f"{place}: the pantograph is at its {listed}, the strip at {place.z:.3f} m"
        if not is_loaded and not has_met:
            text += "; it has met no wire on the way"
        elif not is_loaded and is_neutral:
            text += "; no wire presses on it, and a force that is the same at every height lets it drift"
        self.told.append(text)

    def check_contact(self, force: float, place: Place, lowest: float, highest: float) -> None:
        """Note a contact, if there is one, outside a range of heights above the rails [N, m]."""
        if force > 0.0 and not lowest <= place.z <= highest and self.is_new("contact", place.time):
            self.told.append(
                f"{place}: contact at a height of {place.z:.3f} m, outside the range of the pantograph, "
                f"{lowest:.3f} to {highest:.3f} m"
            )

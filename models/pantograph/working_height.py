"""The check that the wire above a pantograph is at the height that its lifting force or moment belongs to."""

from __future__ import annotations

from typing import Final, NamedTuple

#: A wire farther than this above the reference height is at another working height, and not merely sagging less [m].
_SAME_HEIGHT: Final = 0.1
#: Largest share of the contact force at the reference height that may be lost by then.
_LARGEST_LOSS: Final = 0.1
#: A wire farther than this from the pantograph's start is not the one above it [m].
_NEAR: Final = 1.0


class Raised(NamedTuple):
    """How a pantograph is lifted, and for which height.

    Attributes
    ----------
    parameter : str
        Name of the lifting value.
    value : float
        [N or N.m]
    unit : str
    reference : float
        Strip height that the value belongs to [m].
    start : float
        Where the strip starts along the track [m].
    """

    parameter: str
    value: float
    unit: str
    reference: float
    start: float

    def is_under_another_height(self, x: float, z: float) -> bool:
        """Return whether the wire at (x, z) [m] is the one above the start, and another than the value is for."""
        return abs(x - self.start) <= _NEAR and z - self.reference > _SAME_HEIGHT

    def warning(self, z: float, left: float | None, at_reference: float) -> str:
        """Say what is left at the wire's height, empty if that is nearly all.

        Parameters
        ----------
        z : float
            Height of the wire [m].
        left : float or None
            Static contact force there [N]; None if there is no equilibrium.
        at_reference : float
            Static contact force at the reference height [N].
        """
        if left is not None and left >= (1.0 - _LARGEST_LOSS) * at_reference:
            return ""
        kind, cure = self.parameter.replace("_", " "), "set reference_height to the wire's height"
        return (
            f"the {kind} of {self.value:g} {self.unit} is that at the reference height, {self.reference:g} m; at the "
            f"wire's, {z:.2f} m, {_left(left)}: {cure}, or find another {self.parameter}"
        )


def _left(force: float | None) -> str:
    if force is None:
        return "the pantograph has no equilibrium"
    return f"{force:.0f} N are left" if force > 0.0 else "nothing is left, and the strip does not reach it"

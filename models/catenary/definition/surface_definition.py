"""The running surface of the contact wires, as read and checked: measured, or generated from a spectrum."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from models.catenary.definition.condition_definition import LARGEST_SEED
from models.definition_files.field_schema import count, quantity, text

#: Numbers that generate a surface: fields, and keys; all but the last are needed together.
_GENERATING = (("sigma", "sigma"), ("exponent", "exponent"), ("from_", "from"), ("to", "to"), ("seed", "seed"))
#: Highest point of a measured surface above the static shape, or its lowest below [m]: more is another unit.
LARGEST_HEIGHT = 0.05


@dataclass(frozen=True, kw_only=True)
class RunningSurface:
    """Height r(x) of the contact wires' underside above their static shape: wear, kinks, splices.

    Attributes
    ----------
    profile : str
        Name of a file with measured heights, empty for a generated surface.
    points : tuple of (x, r)
        What that file says [m].
    """

    profile: str = text(default="", filled=True)
    sigma: float | None = quantity(
        "m", "standard deviation of the running surface's height; 0: none", default=None, minimum=0.0, maximum=0.01
    )
    exponent: float | None = quantity(
        "1", "exponent w of the running surface's spectrum, S(k) = A k^-w over the wavenumber k",
        default=None, minimum=0.0, maximum=6.0,
    )  # fmt: skip
    from_: float | None = quantity(
        "1/m", "lowest wavenumber of the running surface, in waves per metre", default=None, minimum=1e-4, maximum=20.0
    )
    to: float | None = quantity(
        "1/m", "highest wavenumber of the running surface, in waves per metre", default=None, minimum=1e-3, maximum=20.0
    )
    seed: int | None = count("number that decides which running surface is drawn", default=None, maximum=LARGEST_SEED)
    points: tuple[tuple[float, float], ...] = ()

    def problems(self) -> Iterator[tuple[str, str]]:
        """Yield a problem if it is neither measured nor generated, or both, or its band is none."""
        given = [key for field, key in _GENERATING if getattr(self, field) is not None]
        if self.profile and given:
            yield "profile", f"gives the surface, and so does {' and '.join(given)}: give one of them"
        elif not self.profile and not given:
            yield "", "says nothing of the surface: give profile, or sigma, exponent, from and to"
        elif given:
            for _, key in _GENERATING[:4]:
                if key not in given:
                    yield key, "is missing: a generated surface takes sigma, exponent, from and to"
        if self.from_ is not None and self.to is not None and self.from_ >= self.to:
            yield "to", f"{self.to:g} 1/m must be greater than from, {self.from_:g} 1/m"

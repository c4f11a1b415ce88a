"""What norms say of a line's supports, droppers and gradients: each a figure, its limit, and a verdict in words."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from models.catenary.statics.rest_profile import Droppers
from models.catenary.statics.support_loads import SupportLoads
from models.library.norm_tables import GradientLimits, SupportLimits

#: Gradients below this are those of rounding.
_LEVEL = 1e-9


def support_verdicts(
    supports: SupportLoads,
    droppers: Droppers,
    limits: SupportLimits,
    gradients: tuple[GradientLimits, ...],
    speed: float,
) -> Iterator[tuple[str, str]]:
    """Yield what was judged, and figure and verdict; gradients only of a line that has some, at a speed [m/s]."""
    lateral = np.abs(supports.lateral)
    if np.isfinite(lateral).any():
        yield "largest lateral load of an arm [N]", _largest(supports.x, lateral, limits)
        yield "smallest lateral load of an arm [N]", _smallest(supports.x, lateral, limits)
    if len(droppers.length):
        shortest = int(droppers.length.argmin())
        text = f"{droppers.length[shortest]:.3f} at {droppers.x[shortest]:.2f} m"
        kept = _verdict(is_kept=bool(droppers.length[shortest] >= limits.shortest_dropper))
        yield "shortest dropper [m]", f"{text}: {kept} {limits.shortest_dropper:g} at least (ADIF)"
    steepness = np.abs(supports.gradient)
    if np.nanmax(steepness, initial=0.0) > _LEVEL:
        yield from _gradient_verdicts(supports, steepness, gradients, speed)


def _gradient_verdicts(
    supports: SupportLoads, steepness: np.ndarray, gradients: tuple[GradientLimits, ...], speed: float
) -> Iterator[tuple[str, str]]:
    rows = (("steepest gradient", steepness, 1.0), ("largest change of gradient", supports.change, None))
    for what, values, share in rows:
        if not np.isfinite(values).any():
            continue
        worst = int(np.nanargmax(values))
        for norm in gradients:
            limit = norm.at(speed) * (share or norm.change)
            kept = _verdict(is_kept=bool(values[worst] <= limit + _LEVEL))
            text = f"{1e3 * values[worst]:.2f} at {supports.x[worst]:g} m: {kept}"
            yield f"{what} [permil], {norm.name}", f"{text} {1e3 * limit:g} at {3.6 * speed:g} km/h"


def _largest(x: np.ndarray, lateral: np.ndarray, limits: SupportLimits) -> str:
    worst = int(np.nanargmax(lateral))
    text = f"{lateral[worst]:.0f} at {x[worst]:g} m: "
    if lateral[worst] <= limits.largest_lateral:
        return f"{text}within {limits.largest_lateral:g} (ADIF, standard arm)"
    if lateral[worst] <= limits.largest_with_proof:
        return f"{text}beyond {limits.largest_lateral:g}, within {limits.largest_with_proof:g} (ADIF, with proof)"
    return f"{text}beyond {limits.largest_with_proof:g} (ADIF, with proof)"


def _smallest(x: np.ndarray, lateral: np.ndarray, limits: SupportLimits) -> str:
    worst = int(np.nanargmin(lateral))
    kept = _verdict(is_kept=bool(lateral[worst] >= limits.smallest_lateral))
    return f"{lateral[worst]:.0f} at {x[worst]:g} m: {kept} {limits.smallest_lateral:g} at least (from memory: check)"


def _verdict(*, is_kept: bool) -> str:
    return "keeps" if is_kept else "does not keep"

"""What norms say of a line's supports, droppers, gradients and of the room under bridges."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from models.arrays import FloatArray
from models.catenary.definition.overbridge_definition import Overbridge
from models.catenary.statics.overbridge_room import OverbridgeRoom
from models.catenary.statics.rest_profile import Droppers
from models.catenary.statics.support_loads import SupportLoads
from models.interface.norm_judgement import Judgement, verdict_word
from models.library.norm_tables import GradientLimits, SupportLimits, clearances, norm_sources

#: Gradients below this are those of rounding.
_LEVEL = 1e-9


def support_verdicts(
    supports: SupportLoads,
    droppers: Droppers,
    limits: SupportLimits,
    gradients: tuple[GradientLimits, ...],
    speed: float,
) -> Iterator[Judgement]:
    """Yield what norms say of loads and lengths; of gradients only if the line has some, at a speed [m/s]."""
    lateral, sources = np.abs(supports.lateral), norm_sources("supports")
    if np.isfinite(lateral).any():
        yield _largest(supports.x, lateral, limits, sources)
        yield _smallest(supports.x, lateral, limits, sources)
    if len(droppers.length):
        shortest = int(droppers.length.argmin())
        yield Judgement(
            "shortest dropper [m]",
            f"{droppers.length[shortest]:.3f} at {droppers.x[shortest]:.2f} m",
            verdict_word(is_kept=bool(droppers.length[shortest] >= limits.shortest_dropper)),
            f"{limits.shortest_dropper:g} at least (ADIF)",
            sources["shortest_dropper"],
        )
    steepness = np.abs(supports.gradient)
    if np.nanmax(steepness, initial=0.0) > _LEVEL:
        yield from _gradient_verdicts(supports, steepness, gradients, speed)


def overbridge_verdicts(overbridges: Sequence[Overbridge], room: OverbridgeRoom, force: float) -> Iterator[Judgement]:
    """Yield what norms, or wishes in the line's file, say of the room under bridges.

    Parameters
    ----------
    force : float
        By which wires are lifted where nothing is said of that [N].
    """
    wanted, sources = clearances(), norm_sources("clearance")
    for k, over in enumerate(overbridges):
        if not np.isfinite(room.clearance[k]):
            continue
        yield _clearance(over.name, "at rest", room.clearance[k], over.clearance, wanted.at_rest, sources["at_rest"])
        how = f"by {force:g} N at rest" if over.lift is None else "as its file says"
        lifted = f"lifted {1e3 * room.lift[k]:.0f} mm {how}"
        own = over.clearance_lifted
        if own is None and over.clearance is not None and over.clearance < wanted.lifted:
            own = over.clearance  # what is wanted at rest is enough when lifted
        yield _clearance(over.name, lifted, room.clearance_lifted[k], own, wanted.lifted, sources["lifted"])


def clearance_at_temperatures(
    overbridges: Sequence[Overbridge], temperatures: Sequence[float], highest: FloatArray
) -> Iterator[Judgement]:
    """Yield what the room under bridges is at rest where it is least of some temperatures.

    Parameters
    ----------
    temperatures : sequence of float
        [K].
    highest : ndarray, shape (n_temperatures, n_overbridges)
        Height of the highest wire [m].
    """
    wanted, sources = clearances(), norm_sources("clearance")
    for k, over in enumerate(overbridges):
        if not np.isfinite(highest[:, k]).all():
            continue
        worst = int(highest[:, k].argmax())
        where = f"at {temperatures[worst] - 273.15:g} degC"
        left = over.underside - float(highest[worst, k])
        yield _clearance(over.name, where, left, over.clearance, wanted.at_rest, sources["at_rest"])


def _clearance(name: str, state: str, left: float, own: float | None, norm: float, source: str) -> Judgement:
    """Return the verdict on what is left, with the line's own limit or that of the norm [m]."""
    least = norm if own is None else own
    return Judgement(
        f"clearance under {name}, {state} [m]",
        f"{left:.3f}",
        verdict_word(is_kept=bool(left >= least)),
        f"{least:g} at least ({'EN 50119, from memory: check' if own is None else 'as its file says'})",
        source if own is None else "the line's file",
    )


def _gradient_verdicts(
    supports: SupportLoads, steepness: FloatArray, gradients: tuple[GradientLimits, ...], speed: float
) -> Iterator[Judgement]:
    sources = norm_sources("gradient")
    rows = (("steepest gradient", steepness, 1.0), ("largest change of gradient", supports.change, None))
    for what, values, share in rows:
        if not np.isfinite(values).any():
            continue
        worst = int(np.nanargmax(values))
        for norm in gradients:
            limit = norm.at(speed) * (share or norm.change)
            yield Judgement(
                f"{what} [permil], {norm.name}",
                f"{1e3 * values[worst]:.2f} at {supports.x[worst]:g} m",
                verdict_word(is_kept=bool(values[worst] <= limit + _LEVEL)),
                f"{1e3 * limit:g} at {3.6 * speed:g} km/h",
                sources[norm.name],
            )


def _largest(x: FloatArray, lateral: FloatArray, limits: SupportLimits, sources: dict[str, str]) -> Judgement:
    worst = int(np.nanargmax(lateral))
    what, figure = "largest lateral load of an arm [N]", f"{lateral[worst]:.0f} at {x[worst]:g} m"
    standard, proof = limits.largest_lateral, limits.largest_with_proof
    if lateral[worst] <= standard:
        return Judgement(what, figure, "passed", f"{standard:g} (ADIF, standard arm)", sources["largest_lateral"])
    if lateral[worst] <= proof:
        limit = f"{standard:g}, and {proof:g} with proof (ADIF)"
        return Judgement(what, figure, "with proof", limit, sources["largest_with_proof"])
    return Judgement(what, figure, "failed", f"{proof:g} (ADIF, with proof)", sources["largest_with_proof"])


def _smallest(x: FloatArray, lateral: FloatArray, limits: SupportLimits, sources: dict[str, str]) -> Judgement:
    worst = int(np.nanargmin(lateral))
    return Judgement(
        "smallest lateral load of an arm [N]",
        f"{lateral[worst]:.0f} at {x[worst]:g} m",
        verdict_word(is_kept=bool(lateral[worst] >= limits.smallest_lateral)),
        f"{limits.smallest_lateral:g} at least (from memory: check)",
        sources["smallest_lateral"],
    )

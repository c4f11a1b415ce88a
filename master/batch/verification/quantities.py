"""The quantities that a row of a case can name, each measured in the unit in which it is printed."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from master.errors import MasterError
from master.evaluation.contact_assessment import Assessment
from master.evaluation.contact_positions import track_position
from master.evaluation.contact_quality import Filtered, Quality
from master.evaluation.filters import interval_mask
from master.evaluation.line_geometry import Uplift, indexed, passages, period_of, slackness
from master.results.run_results import Results

#: A support belongs to a place along the track within this distance [m].
SUPPORT_TOLERANCE: Final = 1.0
_WAVE_SPEED: Final = "contact_wire.wave_speed"


class MissingQuantityError(MasterError):
    """A run that lacks the quantity that a row names."""


@dataclass(frozen=True)
class Choice:
    """Where a quantity is to be measured.

    Attributes
    ----------
    contact : int
        Which pantograph's contact.
    at : tuple of float
        Supports along the track [m].
    within : float
        Distance along the track [m].
    """

    contact: int = 1
    at: tuple[float, ...] = ()
    within: float = math.inf


@dataclass(frozen=True)
class Measured:
    """The value of a quantity in a run, or several with a label each, and a remark.

    ``others`` holds the values with other filters, by their names, if the quantity can depend on the filter.
    """

    values: tuple[float, ...]
    labels: tuple[str, ...] = ()
    remark: str = ""
    others: tuple[tuple[str, float], ...] = ()
    depends_on_filter: bool = False


@dataclass(frozen=True)
class Quantity:
    """A quantity that a row can name.

    Attributes
    ----------
    title, unit : str
        As printed.
    decimals : int
        Digits printed after the point.
    measure : callable
        Run and choice -> value in ``unit``.
    needs : tuple of str
        Keys that a row must give: ``at``, ``within``.
    is_verdict : bool
        Whether it is true or false, as 1 or 0.
    """

    title: str
    unit: str
    decimals: int
    measure: Callable[[Results, Choice], Measured]
    needs: tuple[str, ...] = ()
    is_verdict: bool = False

    def show(self, value: float) -> str:
        """Return a value as text, without its unit."""
        if self.is_verdict:
            return "yes" if value else "no"
        return f"{value:.{self.decimals}f}"


def assessment(results: Results, choice: Choice) -> Assessment:
    """Return figures and verdict of the chosen contact."""
    for found in results.assessments():
        if found.quality.contact == choice.contact:
            return found
    raise MissingQuantityError(f"contact {choice.contact} has no figures in the interval of interest")


def _figure(get: Callable[[Quality], float | None], scale: float = 1.0) -> Callable[[Results, Choice], Measured]:
    def measure(results: Results, choice: Choice) -> Measured:
        value = get(assessment(results, choice).quality)
        if value is None:
            raise MissingQuantityError("the run does not record what this figure requires")
        return Measured((scale * value,))

    return measure


def _filtered(get: Callable[[Filtered | Quality], float]) -> Callable[[Results, Choice], Measured]:
    """Return how to measure a figure that can depend on the filter, together with its values for other filters."""

    def measure(results: Results, choice: Choice) -> Measured:
        quality = assessment(results, choice).quality
        others = tuple((o.filter, get(o)) for o in quality.others)
        return Measured((get(quality),), others=others, depends_on_filter=bool(quality.filter_dependent))

    return measure


def _en50367(results: Results, choice: Choice) -> Measured:
    found = assessment(results, choice)
    broken = [f"{c.name} {c.value}, limit {c.limit}" for c in found.criteria if not c.passed]
    broken += [f"{c.name}: {c.remark}" for c in found.criteria if c.remark]
    broken.insert(0, results.evaluation.limits.title)
    return Measured((float(found.passed),), remark="; ".join(broken))


def _uplifts(results: Results, choice: Choice) -> tuple[Uplift, ...]:
    """Return the uplifts of the chosen contact's line."""
    catenary = assessment(results, choice).contact.catenary
    found = tuple(u for u in results.uplifts if u.component == catenary)
    if not found:
        raise MissingQuantityError("the run records no uplift of supports")
    return found


def _largest_uplift(results: Results, choice: Choice) -> Measured:
    """Return the largest uplift at the supports in the interval of interest."""
    found = assessment(results, choice)
    if found.uplift is None:
        raise MissingQuantityError("there is no support in the interval of interest whose uplift is recorded")
    remark = f"{found.supports} supports, largest at {found.uplift.place}"
    return Measured((1e3 * found.uplift.maximum,), remark=remark)


def _slack(results: Results, choice: Choice) -> Measured:
    """Return the share of droppers in the interval that go slack as the pantograph passes, as in the run's table."""
    share = assessment(results, choice).slack
    if share is None:
        raise MissingQuantityError("the run records no dropper forces in the interval of interest")
    return Measured((100.0 * share,))


def _uplift_at(results: Results, choice: Choice) -> Measured:
    """Return the uplift of every support that the row names."""
    uplifts = _uplifts(results, choice)
    values = tuple(1e3 * _nearest(uplifts, x).maximum for x in choice.at)
    return Measured(values, tuple(f"{x:g} m" for x in choice.at))


def _uplift_spread(results: Results, choice: Choice) -> Measured:
    """Return the largest minus the smallest uplift of the named supports, in percent of their mean."""
    values = np.array(_uplift_at(results, choice).values)
    return Measured((100.0 * float(np.ptp(values)) / float(values.mean()),))


def _nearest(uplifts: Sequence[Uplift], x: float) -> Uplift:
    near = [u for u in uplifts if u.x is not None and abs(u.x - x) <= SUPPORT_TOLERANCE]
    if not near:
        raise MissingQuantityError(f"there is no support within {SUPPORT_TOLERANCE:g} m of x = {x:g} m")
    return min(near, key=lambda u: abs((u.x or 0.0) - x))


def _slack_share(results: Results, choice: Choice) -> Measured:
    """Return the share of droppers in the interval that go slack while the pantograph is near them."""
    found = assessment(results, choice)
    contact = found.contact
    geometry = results.geometry.get(contact.catenary, {})
    recorded = slackness(results.recordings)
    droppers = [s for s in recorded if s.component == contact.catenary and s.name.startswith("dropper")]
    if not droppers:
        raise MissingQuantityError("the run records no dropper forces")
    whole = results.recordings[0]
    position = track_position(whole, contact)
    travelled, period = (float(position.min()), float(position.max())), period_of(geometry)
    slack = [
        bool(np.any(s.slack[np.abs(np.interp(s.time, whole.time, position) - at) <= choice.within]))
        for s in droppers
        if (place := geometry.get(f"{s.name}.x")) is not None
        for at in passages(place, results.interval, travelled, period)
    ]
    if not slack:
        raise MissingQuantityError("there is no dropper in the interval of interest")
    return Measured((100.0 * sum(slack) / len(slack),), remark=f"{sum(slack)} of {len(slack)} droppers")


def _wave_speed(results: Results, choice: Choice) -> Measured:
    found = [values[_WAVE_SPEED] for values in results.geometry.values() if _WAVE_SPEED in values]
    if not found:
        raise MissingQuantityError(f"no component reports '{_WAVE_SPEED}'")
    return Measured((3.6 * found[0],))


def _elasticity(name: str) -> Callable[[Results, Choice], Measured]:
    """Return how to read a static elasticity of the line [mm/N]."""

    def measure(results: Results, choice: Choice) -> Measured:
        found = [values[name] for values in results.geometry.values() if name in values]
        if not found:
            raise MissingQuantityError(f"no component reports '{name}'")
        return Measured((1e3 * found[0],))

    return measure


def _dropper_length_range(results: Results, choice: Choice) -> Measured:
    """Return the longest minus the shortest unstressed length of the droppers in the interval of interest."""
    lengths = np.concatenate([
        indexed(values, "dropper", "length")[interval_mask(indexed(values, "dropper", "x"), *results.interval)]
        for values in results.geometry.values()
    ] or [np.zeros(0)])  # fmt: skip
    if not lengths.size:
        raise MissingQuantityError("there is no dropper in the interval of interest")
    remark = f"{len(lengths)} droppers, {lengths.max():.3f} to {lengths.min():.3f} m"
    return Measured((1e3 * float(np.ptp(lengths)),), remark=remark)


#: Every quantity by its key in a case file.
QUANTITIES: Final[dict[str, Quantity]] = {
    "mean": Quantity("mean force", "N", 1, _filtered(lambda q: q.mean)),
    "sigma": Quantity("standard deviation", "N", 1, _filtered(lambda q: q.sigma)),
    "sigma_0_2": Quantity("standard deviation, 0-2 Hz", "N", 1, _figure(lambda q: q.sigma_bands["0-2"])),
    "sigma_0_5": Quantity("standard deviation, 0-5 Hz", "N", 1, _figure(lambda q: q.sigma_bands["0-5"])),
    "sigma_5_20": Quantity("standard deviation, 5-20 Hz", "N", 1, _figure(lambda q: q.sigma_bands["5-20"])),
    "maximum": Quantity("actual maximum", "N", 1, _filtered(lambda q: q.maximum)),
    "minimum": Quantity("actual minimum", "N", 1, _filtered(lambda q: q.minimum)),
    "statistical_maximum": Quantity("statistical maximum", "N", 1, _filtered(lambda q: q.mean + 3.0 * q.sigma)),
    "statistical_minimum": Quantity("statistical minimum", "N", 1, _filtered(lambda q: q.mean - 3.0 * q.sigma)),
    "loss": Quantity("loss of contact", "%", 2, _figure(lambda q: q.losses.percentage)),
    "contact_height_range": Quantity(
        "range of the contact point", "mm", 1, _figure(lambda q: q.contact_height_range, 1e3)
    ),
    "uplift": Quantity("uplift at the supports, largest", "mm", 1, _largest_uplift),
    "uplift_at": Quantity("uplift at the supports, each", "mm", 1, _uplift_at, ("at",)),
    "uplift_spread": Quantity("spread of the supports' uplift", "%", 2, _uplift_spread, ("at",)),
    "elasticity_mid_span": Quantity("elasticity, mid-span", "mm/N", 3, _elasticity("elasticity.mid_span")),
    "elasticity_support": Quantity("elasticity, support", "mm/N", 3, _elasticity("elasticity.support")),
    "dropper_length_range": Quantity("dropper lengths, longest less shortest", "mm", 0, _dropper_length_range),
    "slack_share": Quantity("droppers slack at passage", "%", 0, _slack_share, ("within",)),
    "slack": Quantity("droppers slack as it passes", "%", 0, _slack),
    "en50367": Quantity("passes EN 50367", "", 0, _en50367, is_verdict=True),
    "wave_speed": Quantity("wave speed", "km/h", 1, _wave_speed),
}

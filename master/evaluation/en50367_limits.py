"""The limits of EN 50367 for the quality of current collection, by supply system, each with where it comes from.

Only the limit of sigma was found in texts on the standard; all others are recalled, not read in it, and are marked so
wherever they are printed. A scenario may give its own limits instead.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, fields
from typing import Final, Literal

from master.evaluation.contact_quality import Filtered, Quality, sigma_share

Supply = Literal["AC", "DC3", "DC1.5"]
SUPPLIES: Final[dict[Supply, str]] = {"AC": "AC", "DC3": "DC 3 kV", "DC1.5": "DC 1.5 kV"}

#: How far the mean may lie above the standard's upper limit and still be at it [N]: a choice. The reference pairs of
#: the source have 157.5 N, where the formula gives 157.3 N.
AT_LIMIT: Final = 0.5
#: A speed this near to one at which limits change is that speed [km/h]: speeds come from recorded positions.
_NEAR_SPEED: Final = 0.01

Origin = Literal["recalled", "read", "own"]
#: Meaning of the origins of limits.
ORIGINS: Final = "origin of a limit: recalled: not read in the standard; read: in texts on it; own: the scenario's"


@dataclass(frozen=True)
class OwnLimits:
    """Limits that a scenario gives itself, SI; None where the standard applies."""

    mean_upper: float | None = None
    mean_lower: float | None = None
    maximum: float | None = None
    sigma_share: float | None = None
    statistical_minimum: float | None = None
    nq: float | None = None
    uplift: float | None = None
    height_range: float | None = None


@dataclass(frozen=True)
class LimitChoice:
    """The limits that a run is judged by: supply system, and the scenario's own limits."""

    supply: Supply = "AC"
    own: OwnLimits = field(default_factory=OwnLimits)

    @property
    def title(self) -> str:
        """The limits in words."""
        own = [f.name for f in fields(self.own) if getattr(self.own, f.name) is not None]
        return f"EN 50367, {SUPPLIES[self.supply]}{' and own limits' if own else ''}"


@dataclass(frozen=True)
class Limit:
    """A limit that applies.

    Attributes
    ----------
    value : float
        In SI units, NQ in percent.
    source : str
        Where it comes from.
    origin : str
        Whether it is recalled, read, or the scenario's own.
    slack : float
        How far beyond it a figure still counts as at it.
    """

    value: float
    source: str
    origin: Origin = "recalled"
    slack: float = 0.0


@dataclass(frozen=True)
class Limits:
    """The limits at a speed: of force [N], sigma over mean, NQ [%], uplift and height range [m]."""

    mean_upper: Limit
    mean_lower: Limit
    maximum: Limit
    sigma_share: Limit
    statistical_minimum: Limit
    nq: Limit
    uplift: Limit
    height_range: Limit


@dataclass(frozen=True)
class Criterion:
    """One acceptance limit with its verdict; values as text with unit.

    Attributes
    ----------
    name, value, limit : str
        As printed.
    passed : bool
    source, origin : str
        Where the limit comes from, and whether it is recalled, read there, or the scenario's own.
    remark : str
        What the verdict depends on besides: a figure at its limit, or another filter that would decide otherwise.
    """

    name: str
    value: str
    limit: str
    passed: bool
    source: str = ""
    origin: str = ""
    remark: str = ""

    @property
    def is_at_limit(self) -> bool:
        """Whether it passes only because it is at the limit."""
        return self.passed and self.remark.startswith(_AT)

    @property
    def word(self) -> str:
        """The verdict in words."""
        return ("at the limit" if self.is_at_limit else "passed") if self.passed else "failed"


_AT: Final = "at the limit"
#: Names of the limits that need more than the contact force.
UPLIFT: Final = "uplift at supports"
HEIGHT_RANGE: Final = "contact height range"


def limits_at(speed: float, choice: LimitChoice) -> Limits:
    """Return the limits at a speed [m/s] in a supply system [EN 50367, recalled], or the scenario's own."""
    v, supply = 3.6 * speed, choice.supply
    standard = {
        "mean_upper": Limit(_mean_upper(v, supply), "EN 50367, mean contact force, upper limit", slack=AT_LIMIT),
        "mean_lower": Limit(_mean_lower(v, supply), "EN 50367, mean contact force, lower limit"),
        "maximum": Limit(_maximum(v, supply), "EN 50367, maximum contact force"),
        "sigma_share": Limit(0.3, "EN 50367, standard deviation of the contact force; TSI ENE 4.2.12", "read"),
        "statistical_minimum": Limit(0.0, "EN 50367, statistical minimum of the contact force"),
        "nq": Limit(_nq(v, supply), "EN 50367 with EN 50317, percentage of arcing; here from losses of 5 ms or more"),
        "uplift": Limit(0.120, "EN 50367, contact wire uplift"),
        "height_range": Limit(0.080, "EN 50367, vertical amplitude of the contact point"),
    }
    own = {f.name: value for f in fields(choice.own) if (value := getattr(choice.own, f.name)) is not None}
    return Limits(**{name: Limit(own[name], _OWN, "own") if name in own else it for name, it in standard.items()})


_OWN: Final = "given by the scenario"


def _mean_upper(v: float, supply: Supply) -> float:
    if supply == "DC1.5":
        return 0.00228 * v**2 + 90.0 if _above(v, 200.0) else 0.00097 * v**2 + 140.0
    if supply == "DC3":
        return 0.00097 * v**2 + 110.0
    return 0.00097 * v**2 + 70.0 if _above(v, 200.0) else 0.00047 * v**2 + 90.0


def _mean_lower(v: float, supply: Supply) -> float:
    factor, constant = {"AC": (0.00047, 60.0), "DC3": (0.00096, 60.0), "DC1.5": (0.00112, 70.0)}[supply]
    return factor * v**2 + constant


def _maximum(v: float, supply: Supply) -> float:
    fast = 350.0 if supply == "AC" else 400.0
    return fast if _above(v, 200.0) else 300.0


def _nq(v: float, supply: Supply) -> float:
    return 0.1 if supply == "AC" and not _above(v, 250.0) else 0.2


def _above(v: float, bound: float) -> bool:
    return v > bound + _NEAR_SPEED


def judge(quality: Quality, choice: LimitChoice, uplifts: Sequence[float] = ()) -> tuple[Criterion, ...]:
    """Return the verdicts, limit by limit.

    Parameters
    ----------
    quality : Quality
        Figures of a contact.
    choice : LimitChoice
        Limits to judge by.
    uplifts : sequence of float
        Largest uplift of every support of the interval [m].
    """
    limits = limits_at(abs(quality.speed), choice)
    own = Filtered("", quality.mean, quality.sigma, quality.minimum, quality.maximum)
    rows = [_of_force(row, own, quality.others) for row in _force_rows(limits)]
    nq = quality.losses.nq
    rows.append(_at_most("NQ (estimate)", f"{nq:.2f} %", f"<= {limits.nq.value:g} %", nq, limits.nq))
    if uplifts:
        rows.append(_millimetres(UPLIFT, max(uplifts), limits.uplift))
    if quality.contact_height_range is not None:
        rows.append(_millimetres(HEIGHT_RANGE, quality.contact_height_range, limits.height_range))
    return tuple(rows)


@dataclass(frozen=True)
class _ForceRow:
    """A limit of a figure that depends on the filter; ``excess`` is how far the figure lies beyond it."""

    name: str
    value: Callable[[Filtered], str]
    limit: str
    held: tuple[Limit, ...]
    excess: Callable[[Filtered], float]
    is_open: bool = False

    def passes(self, figures: Filtered) -> bool:
        excess = self.excess(figures)
        return excess < 0.0 if self.is_open else excess <= self.held[0].slack


def _force_rows(limits: Limits) -> tuple[_ForceRow, ...]:
    upper, lower, most = limits.mean_upper, limits.mean_lower, limits.maximum
    share, least = limits.sigma_share, limits.statistical_minimum
    return (
        _ForceRow(
            "mean force",
            lambda f: f"{f.mean:.1f} N",
            f"{lower.value:.1f} to {upper.value:.1f} N",
            (upper, lower),
            lambda f: f.mean - upper.value if f.mean >= lower.value else math.inf,
        ),
        _ForceRow(
            "sigma / mean",
            lambda f: f"{_share(f):.3f}",
            f"< {share.value:g}",
            (share,),
            lambda f: _share(f) - share.value,
            is_open=True,
        ),
        _ForceRow(
            "maximum force",
            lambda f: f"{f.maximum:.1f} N",
            f"< {most.value:g} N",
            (most,),
            lambda f: f.maximum - most.value,
            is_open=True,
        ),
        _ForceRow(
            "statistical minimum",
            lambda f: f"{_statistical_minimum(f):.1f} N",
            f"> {least.value:g} N",
            (least,),
            lambda f: least.value - _statistical_minimum(f),
            is_open=True,
        ),
    )


def _share(figures: Filtered) -> float:
    return sigma_share(figures.mean, figures.sigma)


def _statistical_minimum(figures: Filtered) -> float:
    return figures.mean - 3.0 * figures.sigma


def _of_force(row: _ForceRow, own: Filtered, others: Sequence[Filtered]) -> Criterion:
    passed = row.passes(own)
    remarks = [f"{_AT}: {row.excess(own):.2f} N above it"] if passed and row.excess(own) > 0.0 else []
    contrary = [o for o in others if row.passes(o) != passed]
    if contrary:
        others_say = ", ".join(f"{row.value(o)} with {o.filter}" for o in contrary)
        remarks.append(f"the filter decides: {'failed' if passed else 'passed'} at {others_say}")
    source, origin = _listed(h.source for h in row.held), _listed(h.origin for h in row.held)
    return Criterion(row.name, row.value(own), row.limit, passed, source, origin, "; ".join(remarks))


def _listed(texts: Iterable[str]) -> str:
    return ", ".join(dict.fromkeys(texts))


def _at_most(name: str, value: str, limit: str, figure: float, held: Limit) -> Criterion:
    return Criterion(name, value, limit, figure <= held.value, held.source, held.origin)


def _millimetres(name: str, value: float, limit: Limit) -> Criterion:
    return _at_most(name, f"{1e3 * value:.1f} mm", f"<= {1e3 * limit.value:g} mm", value, limit)

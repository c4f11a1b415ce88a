"""The verdict on a row: a measured quantity against a value, a range, an expected verdict or other runs."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal

from master.batch.verification.case import Row
from master.batch.verification.quantities import QUANTITIES, Measured, Quantity
from master.errors import MasterError
from master.results.run_results import Results

#: passed; near: outside its range, but within the tolerance stated for it; failed; and of rows that are only
#: reported: agrees, departs.
Verdict = Literal["passed", "near", "failed", "agrees", "departs"]
Place = Literal["inside", "near", "outside"]
FAILING: Final[Verdict] = "failed"
_ORDER: Final = ("inside", "near", "outside")
#: Share by which a figure may miss a limit through rounding.
_ROUNDING: Final = 1e-9


@dataclass(frozen=True)
class Bounds:
    """The limits of one number.

    Attributes
    ----------
    low, high : float
        Limits; infinite where there is none.
    allowance : float
        How far beyond the nearer limit a number may lie, in percent of that limit (``is_relative``) or absolute.
    is_relative : bool
    target : float, optional
        The reference value, if the limits are a tolerance around it.
    is_open : bool
        Whether the limits themselves do not belong to the range.
    """

    low: float
    high: float
    allowance: float = 0.0
    is_relative: bool = False
    target: float | None = None
    is_open: bool = False

    def place(self, value: float) -> Place:
        """Return where a number lies."""
        beyond = self.beyond(value)
        if not math.isfinite(value) or (self.is_open and value in (self.low, self.high)):
            return "outside"
        scale = _ROUNDING * max(1.0, abs(self._nearer(value)))
        if beyond <= scale:
            return "inside"
        allowed = self.allowance * abs(self._nearer(value)) / 100.0 if self.is_relative else self.allowance
        return "near" if beyond <= allowed + scale else "outside"

    def beyond(self, value: float) -> float:
        """Return how far beyond the nearer limit a number lies, 0 inside."""
        return max(self.low - value, value - self.high, 0.0)

    def deviation(self, value: float) -> float | None:
        """Return the deviation of a number in percent of the reference value, or of the nearer limit; None inside."""
        if self.target is not None:
            return 100.0 * (value - self.target) / abs(self.target) if self.target else None
        limit = self._nearer(value)
        return 100.0 * (value - limit) / abs(limit) if self.beyond(value) > 0.0 and limit else None

    def _nearer(self, value: float) -> float:
        limits = [x for x in (self.low, self.high) if math.isfinite(x)]
        return min(limits, key=lambda x: abs(x - value), default=0.0)


@dataclass(frozen=True)
class Judged:
    """A row with its verdict.

    Attributes
    ----------
    row : Row
        As read from the case.
    title, unit, computed, reference : str
        As printed.
    measured : Measured, optional
        The numbers; None where there are none.
    bounds : tuple of Bounds
        One per number.
    verdict : Verdict
    deviation : float, optional
        Of the worst number [%].
    remark : str
        Further notes, such as why there is no number.
    """

    row: Row
    title: str
    unit: str
    computed: str
    reference: str
    measured: Measured | None
    bounds: tuple[Bounds, ...]
    verdict: Verdict
    deviation: float | None
    remark: str

    @property
    def shown(self) -> str:
        """The computed figure with its unit."""
        return f"{self.computed} {self.unit}" if self.unit and self.measured else self.computed

    @property
    def fails(self) -> bool:
        """Whether the row fails the verification."""
        return self.verdict == FAILING


def judge_row(row: Row, run: Callable[[str], Results]) -> Judged:
    """Measure a row's quantity and judge it; a run that fails, or lacks the quantity, fails the row.

    Parameters
    ----------
    row : Row
        Quantity and reference.
    run : callable
        Name of a run -> its results.
    """
    quantity = QUANTITIES[row.quantity]
    try:
        measured = quantity.measure(run(row.run), row.choice)
        others = {name: quantity.measure(run(name), row.choice).values[0] for name in row.others}
    except MasterError as error:
        return _unmeasured(row, quantity, error)
    return decide(row, quantity, measured, others)


def decide(row: Row, quantity: Quantity, measured: Measured, others: Mapping[str, float]) -> Judged:
    """Judge a measured quantity; ``others`` holds the values of the runs with which the row compares."""
    bounds = bounds_of(row, len(measured.values), others)
    pairs = list(zip(measured.values, bounds, strict=True))
    place = max((b.place(v) for v, b in pairs), key=_ORDER.index)
    worst = _worst([b.deviation(v) for v, b in pairs])
    notes = list(_notes(row, quantity, measured))
    return Judged(
        row=row,
        title=row.title or quantity.title,
        unit=quantity.unit,
        computed=_span(quantity, measured.values),
        reference=reference_text(row, quantity, others),
        measured=measured,
        bounds=bounds,
        verdict=verdict_of(row, place, stands_in_band(row, measured.values)),
        deviation=worst[0],
        remark="; ".join([t for t in (measured.remark or _where(measured, worst[1]),) if t] + notes),
    )


def stands_in_band(row: Row, values: Sequence[float]) -> bool:
    """Return whether all numbers lie in the band of untuned readings; true if no band is known."""
    return row.band is None or all(Bounds(*row.band).place(v) == "inside" for v in values)


def verdict_of(row: Row, place: Place, in_band: bool = True) -> Verdict:
    """Return the verdict from where the worst number lies; outside its band a row of any kind fails."""
    if not in_band:
        return FAILING
    if row.kind == "report":
        return "agrees" if place == "inside" else "departs"
    verdicts: dict[Place, Verdict] = {"inside": "passed", "near": "near", "outside": "failed"}
    return verdicts[place]


def bounds_of(row: Row, count: int, others: Mapping[str, float]) -> tuple[Bounds, ...]:
    """Return the limits of each of ``count`` numbers."""
    if row.value is not None:
        values = row.value if len(row.value) == count else row.value * count
        return tuple(_around(v, row) for v in values)
    if row.truth is not None:
        return (Bounds(float(row.truth), float(row.truth)),) * count
    if row.below:
        return (Bounds(-math.inf, min(others[n] for n in row.below), is_open=True),) * count
    if row.above:
        return (Bounds(max(others[n] for n in row.above), math.inf, is_open=True),) * count
    low, high = row.range or (row.minimum, row.maximum)
    is_relative = row.tolerance_percent is not None
    allowance = (row.tolerance_percent if is_relative else row.tolerance) or 0.0
    limits = (-math.inf if low is None else low, math.inf if high is None else high)
    return (Bounds(*limits, allowance, is_relative),) * count


def reference_text(row: Row, quantity: Quantity, others: Mapping[str, float] | None = None) -> str:
    """Return the reference of a row as printed, with the names of other runs where ``others`` has no values."""
    unit = f" {quantity.unit}" if quantity.unit else ""
    if row.truth is not None:
        return quantity.show(float(row.truth))
    if row.others:
        shown = ", ".join(f"{quantity.show(others[n])} ({n})" if others else n for n in row.others)
        return f"{'below' if row.below else 'above'} {shown}"
    if row.value is not None:
        shown = _span(quantity, row.value, exact=True)
        return f"{shown} {_allowed(row)}{unit}" if row.tolerance is not None else f"{shown}{unit} {_allowed(row)}"
    if row.range is not None:
        limits = f"{row.range[0]:g} to {row.range[1]:g}{unit}"
    else:
        limits = f"{'at least' if row.minimum is not None else 'at most'} {row.minimum or row.maximum or 0.0:g}{unit}"
    own_unit = unit if row.tolerance is not None else ""
    return f"{limits}, {_allowed(row)}{own_unit}" if _allowed(row) else limits


def _allowed(row: Row) -> str:
    if row.tolerance_percent is not None:
        return f"\N{PLUS-MINUS SIGN}{row.tolerance_percent:g} %"
    return f"\N{PLUS-MINUS SIGN}{row.tolerance:g}" if row.tolerance is not None else ""


def _around(value: float, row: Row) -> Bounds:
    half = row.tolerance or 0.0
    if row.tolerance_percent is not None:
        half = abs(value) * row.tolerance_percent / 100.0
    return Bounds(value - half, value + half, target=value)


def _worst(deviations: Sequence[float | None]) -> tuple[float | None, int]:
    """Return the deviation of largest magnitude and the index of its number."""
    known = [(abs(d), i) for i, d in enumerate(deviations) if d is not None]
    if not known:
        return None, 0
    index = max(known)[1]
    return deviations[index], index


def _where(measured: Measured, index: int) -> str:
    return f"{len(measured.labels)} supports, worst at {measured.labels[index]}" if measured.labels else ""


def _notes(row: Row, quantity: Quantity, measured: Measured) -> Iterator[str]:
    """Yield notes to the verdict: whether the reference is recalled, the band, and the figures of other filters."""
    if row.recalled:
        yield "reference recalled, not read"
    if row.band is not None:
        out = "" if stands_in_band(row, measured.values) else "outside the band: "
        yield f"{out}untuned readings span {row.band[0]:g} to {row.band[1]:g} {quantity.unit}".rstrip()
    if measured.others and (row.recalled or measured.depends_on_filter):
        yield "with other filters " + ", ".join(f"{quantity.show(v)} ({name})" for name, v in measured.others)


def _span(quantity: Quantity, values: Sequence[float], exact: bool = False) -> str:
    ends = sorted({min(values), max(values)})
    return " to ".join(f"{v:g}" if exact else quantity.show(v) for v in ends)


def _unmeasured(row: Row, quantity: Quantity, error: MasterError) -> Judged:
    return Judged(
        row=row,
        title=row.title or quantity.title,
        unit=quantity.unit,
        computed="none",
        reference=reference_text(row, quantity),
        measured=None,
        bounds=(),
        verdict=verdict_of(row, "outside"),
        deviation=None,
        remark=str(error),
    )

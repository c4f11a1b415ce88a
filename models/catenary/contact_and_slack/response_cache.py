"""The responses of the intervals that strips are on, kept from step to step."""

from __future__ import annotations

from collections.abc import Callable

from models.catenary.contact_and_slack.contact_wire import WireInterval
from models.catenary.contact_and_slack.wire_response import IntervalResponse
from models.catenary.linear_motion.compliance import Columns, Compliance

#: Intervals of each contact wire whose response is kept.
_KEPT_INTERVALS = 12


class ResponseCache:
    """Responses of intervals, each made once while strips are near.

    Parameters
    ----------
    make : callable
        What a step engine makes of an interval and of the responses to unit loads at its attachments.
    compliance : Compliance
        Of the attachments.
    wires : int
        How many contact wires there are.
    """

    def __init__(
        self, make: Callable[[WireInterval, Columns], IntervalResponse], compliance: Compliance, wires: int
    ) -> None:
        self._make, self._compliance = make, compliance
        self._limit = _KEPT_INTERVALS * wires
        self._kept: dict[WireInterval, IntervalResponse] = {}

    def of(self, interval: WireInterval) -> IntervalResponse:
        """Return how a wire gives way to forces on an interval."""
        found = self._kept.get(interval)
        if found is None:
            found = self._make(interval, self._compliance.units(interval.ends))
            while len(self._kept) >= self._limit:
                del self._kept[next(iter(self._kept))]
            self._kept[interval] = found
        return found

    def prepare(self, interval: WireInterval) -> None:
        """Find a part of an interval's response before a strip gets there: no step shall take long."""
        if interval not in self._kept and self._compliance.prepare(interval.ends):
            self.of(interval)

"""A run read back from its results folder."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Final

from master.errors import MasterError
from master.evaluation.contact_assessment import Assessment, assess_contacts, interval_of
from master.evaluation.contact_signals import EvaluationSettings, Signals, all_signals
from master.evaluation.en50367_limits import LimitChoice, OwnLimits
from master.evaluation.energy_balance import EnergyBalance, drift_events, find_balances
from master.evaluation.filters import BEFORE_CHOICE, ForceFilter
from master.evaluation.following_pantograph import FollowerEffect, follower_effects
from master.evaluation.line_geometry import Uplift, support_uplifts
from master.evaluation.run_events import Event, find_events
from master.recording.recording import TIMESERIES, Recording, load
from master.recording.static_geometry import Geometry
from master.results import summary_schema
from master.results.results_folder import GEOMETRY, summary_of
from master.safety import folder_lock
from master.system.contacts import Contact


@dataclass(frozen=True)
class Results:
    """A run, read back from its folder.

    Attributes
    ----------
    folder : Path
        The results folder.
    summary : dict
        Contents of ``summary.json``.
    recordings : tuple of Recording
        ``timeseries.csv`` first, then the coarser ones.
    geometry : dict
        Calculated parameters by component.
    """

    folder: Path
    summary: dict[str, Any]
    recordings: tuple[Recording, ...]
    geometry: Geometry

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """The contacts of the run."""
        return tuple(Contact.from_data(c) for c in self.summary.get("contacts", []))

    @property
    def interval(self) -> tuple[float | None, float | None]:
        """The interval of interest [m]; None where it is open."""
        return self.evaluation.interval

    @property
    def evaluated_interval(self) -> tuple[float | None, float | None]:
        """Where along the track the figures come from [m]; an open bound is the farthest of all contacts."""
        found = [interval_of(a.quality, self.interval) for a in self.assessments()]
        if not found or None not in self.interval:
            return self.interval
        return min(low for low, _ in found), max(high for _, high in found)

    @cached_property
    def evaluation(self) -> EvaluationSettings:
        """How the run is evaluated: with the filter that it was made with, in its interval, by its limits."""
        settings = self.summary.get("settings", {})
        chosen, limits = settings.get("interval", {}), dict(settings.get("limits", {}))
        supply = limits.pop("supply", "AC")
        return EvaluationSettings(
            filter_of(settings.get("filter")),
            (chosen.get("start"), chosen.get("end")),
            LimitChoice(supply, OwnLimits(**limits)),
            settings.get("start"),
        )

    @cached_property
    def signals(self) -> tuple[Signals, ...]:
        """Force of every contact, raw and filtered."""
        return all_signals(self.recordings, self.contacts, self.evaluation)

    @property
    def uplifts(self) -> tuple[Uplift, ...]:
        """Largest uplift of every support in the whole run."""
        return support_uplifts(self.recordings, self.geometry)

    @property
    def not_judged(self) -> str:
        """Why a complete run has no figures; empty if it has some."""
        return str(self.summary.get("not_judged", ""))

    def assessments(self) -> tuple[Assessment, ...]:
        """Return figures and verdict of every contact with samples in the interval; none if it was not passed."""
        return () if self.not_judged else self.assessments_in(self.interval)

    def assessments_in(self, interval: tuple[float | None, float | None]) -> tuple[Assessment, ...]:
        """Return figures and verdict of every contact with samples in another interval [m]."""
        if interval not in self._assessed:
            chosen = replace(self.evaluation, interval=interval)
            found = assess_contacts(self.recordings, self.contacts, self.geometry, chosen)
            reason = self.verdict_withheld
            self._assessed[interval] = tuple(a.without_verdict(reason) for a in found) if reason else found
        return self._assessed[interval]

    @cached_property
    def _assessed(self) -> dict[tuple[float | None, float | None], tuple[Assessment, ...]]:
        """Assessments by interval: pages and tables ask for the same ones again and again."""
        return {}

    @property
    def verdict_withheld(self) -> str:
        """Why figures are given without a verdict; empty if they have one."""
        status = str(self.summary.get("status") or "complete")
        if status != "complete":
            return f"the run {_ENDS.get(status, f'is {status}')}; these are its figures so far"
        beyond = [b.what for b in self.balances if b.exceeded is not None]
        return f"the energy of {', '.join(beyond)} does not balance; try a smaller --step" if beyond else ""

    @property
    def events(self) -> tuple[Event, ...]:
        """What happened when: losses of contact, slack droppers, energy that does not balance."""
        found = find_events(self.recordings, self.contacts, self.geometry)
        end = max((float(r.time[-1]) for r in self.recordings if len(r.time)), default=0.0)
        drifts = drift_events(self.balances, end)
        return tuple(sorted((*found, *drifts), key=lambda e: (e.time, e.kind, e.what)))

    @property
    def balances(self) -> tuple[EnergyBalance, ...]:
        """The recorded energy balances."""
        return find_balances(self.recordings, self.contacts)

    @property
    def follower_effects(self) -> tuple[FollowerEffect, ...]:
        """Every pantograph compared with the one ahead of it."""
        assessments = self.assessments()
        return follower_effects(self.recordings[0], assessments) if assessments else ()


def read(folder: Path) -> Results:
    """Return a run, read back from its folder.

    Raises
    ------
    MasterError
        If it is not a results folder of this tool, a file in it is damaged, or a run is writing there.
    """
    folder_lock.check_free(folder)
    done = _read(folder)
    folder_lock.check_free(folder)
    now = summary_of(folder)
    if (now.get("run"), now.get("status")) != (done.summary.get("run"), done.summary.get("status")):
        raise MasterError(f"{folder} was written while it was being read; try again")
    return done


def _read(folder: Path) -> Results:
    summary = summary_of(folder)
    geometry = summary_schema.read_geometry(folder / GEOMETRY) if (folder / GEOMETRY).is_file() else {}
    coarse = sorted(p for p in folder.glob("timeseries*.csv") if p.name != TIMESERIES)
    recordings = tuple(load(p) for p in (folder / TIMESERIES, *coarse))
    return Results(folder, summary, recordings, geometry)


#: How incomplete runs ended.
_ENDS: Final = {"running": "was not finished", "failed": "has failed", "interrupted": "was interrupted"}


def filter_of(settings: Mapping[str, Any] | None) -> ForceFilter:
    """Return the filter that a run was made with, from its settings."""
    if settings is None:
        return BEFORE_CHOICE
    return ForceFilter(**{name: value for name, value in settings.items() if value is not None})

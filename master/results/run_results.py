"""Result folders: made, written and read back."""

from __future__ import annotations

import csv
import io
import json
import math
import platform
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from importlib import metadata
from pathlib import Path
from typing import Any, Final

import numpy as np

from master.errors import MasterError, RequestError
from master.evaluation.contact_assessment import Assessment, assess_contacts, interval_of
from master.evaluation.contact_signals import EvaluationSettings, Signals, all_signals, force_table
from master.evaluation.en50367_limits import LimitChoice, OwnLimits
from master.evaluation.energy_balance import Balance, drift_events, find_balances
from master.evaluation.filters import BEFORE_CHOICE, ForceFilter
from master.evaluation.following_pantograph import Following, followings
from master.evaluation.line_geometry import Uplift, support_uplifts
from master.evaluation.run_events import MOST_EVENTS, Event, find_events
from master.recording.checkpoint import NAME as CHECKPOINT
from master.recording.recording import NUMBER_FORMAT, TIMESERIES, Recording, load
from master.recording.static_geometry import Geometry
from master.results import summary_schema
from master.safety import folder_lock
from master.safety.safe_files import PART, safe_cell, write_whole
from master.system.contacts import Contact

GENERATOR: Final = "openpanto master"
#: Version of what a run leaves. 1, which says none: figures of a brick wall at 20 Hz; 2: as it stands here.
FORMAT: Final = 2
SUMMARY: Final = "summary.json"
GEOMETRY: Final = "geometry.json"
FORCES: Final = "contact_force.csv"
REPORT: Final = "report.html"
_TABLES: Final = ("timeseries*.csv", "timeseries*.parquet", FORCES, "contact_force.parquet")
_OURS: Final = (*_TABLES, SUMMARY, GEOMETRY, REPORT, "*.png", "*.svg")
#: What a run, a study or a verification that was killed may leave half written, and what is no result.
_PARTS: Final = (*(name + PART for name in (SUMMARY, GEOMETRY, FORCES, CHECKPOINT)), f".*{PART}")
_LOCKS: Final = (folder_lock.LOCK, folder_lock.OWNER)
_NOT_OURS: Final = "exists and is {kind} of this tool; it is left alone, choose another with --out"


@dataclass(frozen=True)
class Results:
    """A run as it lies in its folder.

    Attributes
    ----------
    folder : Path
        Where.
    summary : dict
        Contents of summary.json.
    recordings : tuple of Recording
        timeseries.csv first, then the coarser ones.
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
        return tuple(Contact(**c) for c in self.summary.get("contacts", []))

    @property
    def interval(self) -> tuple[float | None, float | None]:
        """The interval of interest [m]; None where it is open."""
        return self.evaluation.interval

    @property
    def evaluated_interval(self) -> tuple[float | None, float | None]:
        """Where along the track the figures come from [m]; an open bound is that of the contact with most of it."""
        found = [interval_of(a.quality, self.interval) for a in self.assessments()]
        if not found or None not in self.interval:
            return self.interval
        return min(low for low, _ in found), max(high for _, high in found)

    @cached_property
    def evaluation(self) -> EvaluationSettings:
        """How the run is evaluated: by the filter that it was made with, in its interval, by its limits."""
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
        """Why a run that is complete has no figures, empty if it has."""
        return str(self.summary.get("not_judged", ""))

    def assessments(self) -> tuple[Assessment, ...]:
        """Return figures and verdict of every contact that has samples in the interval; none if it was not passed."""
        return () if self.not_judged else self.assessments_in(self.interval)

    def assessments_in(self, interval: tuple[float | None, float | None]) -> tuple[Assessment, ...]:
        """Return figures and verdict of every contact that has samples in another interval [m]."""
        if interval not in self._assessed:
            chosen = replace(self.evaluation, interval=interval)
            found = assess_contacts(self.recordings, self.contacts, self.geometry, chosen)
            reason = self.verdict_withheld
            self._assessed[interval] = tuple(a.without_verdict(reason) for a in found) if reason else found
        return self._assessed[interval]

    @cached_property
    def _assessed(self) -> dict[tuple[float | None, float | None], tuple[Assessment, ...]]:
        """What was assessed once, by interval: pages and tables ask again and again."""
        return {}

    @property
    def verdict_withheld(self) -> str:
        """Why figures are given without a verdict, empty if they are given with one."""
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
    def balances(self) -> tuple[Balance, ...]:
        """The energy balances that were recorded."""
        return find_balances(self.recordings, self.contacts)

    @property
    def followings(self) -> tuple[Following, ...]:
        """Every pantograph beside the one ahead of it."""
        assessments = self.assessments()
        return followings(self.recordings[0], assessments) if assessments else ()


@contextmanager
def claimed(folder: Path) -> Iterator[None]:
    """Work alone in a results folder of ours, or a new one; nothing in it is changed yet.

    Raises
    ------
    FolderInUseError
        If another process works in it.
    MasterError
        If it exists and is something else, or cannot be written.
    """
    if folder.exists() and not folder.is_dir():
        raise MasterError(f"{folder} is a file, not a results folder; choose another with --out")
    if not (is_ours(folder) or _holds_nothing(folder)):
        raise MasterError(f"{folder} {_NOT_OURS.format(kind='not a results folder')}")
    with _alone_in(folder, "results folder"):
        yield


@contextmanager
def taken_over(folder: Path, marker: str, generator: str, kind: str) -> Iterator[None]:
    """Work alone in a folder, or one whose JSON file ``marker`` names its ``generator``; nothing is removed.

    Raises
    ------
    FolderInUseError
        If another process works in it.
    MasterError
        If it is there and is no ``kind`` of ours, or cannot be made.
    """
    if folder.is_dir() and not (made_by(folder / marker, generator) or _holds_nothing(folder)):
        raise MasterError(f"{folder} {_NOT_OURS.format(kind=f'no {kind}')}")
    with _alone_in(folder, "folder"):
        _remove(folder, _PARTS)
        yield


@contextmanager
def _alone_in(folder: Path, kind: str) -> Iterator[None]:
    """Make a folder and lock it; it goes away again if the command line turns out to be wrong."""
    is_new = not folder.exists()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        claim = ExitStack()
        claim.enter_context(folder_lock.claimed(folder))
    except OSError as error:
        text = f"the {kind} {folder} cannot be written ({error.strerror}); choose another with --out"
        raise MasterError(text) from error
    try:
        with claim:
            yield
    except RequestError:
        if is_new:
            with suppress(OSError):  # there is something in it
                folder.rmdir()
        raise


def prepare(folder: Path, keep: Path | None = None) -> None:
    """Empty a claimed folder of the results of an earlier run.

    Parameters
    ----------
    folder : Path
    keep : Path, optional
        The checkpoint that a new run begins from, if it lies there.

    Raises
    ------
    MasterError
        If it cannot be written.
    """
    try:
        _remove(folder, (*_OURS, *_PARTS))
        checkpoint = folder / CHECKPOINT
        if checkpoint.exists() and not (keep is not None and keep.exists() and checkpoint.samefile(keep)):
            checkpoint.unlink()
    except OSError as error:
        raise MasterError(
            f"the results folder {folder} cannot be written ({error.strerror}); choose another with --out"
        ) from error


def _remove(folder: Path, patterns: Sequence[str]) -> None:
    for pattern in patterns:
        for path in folder.glob(pattern):
            path.unlink()


def _holds_nothing(folder: Path) -> bool:
    """Whether a folder is not there, or holds nothing but what a run that was killed at once has left."""
    if not folder.is_dir():
        return not folder.exists()
    return all(any(path.match(p) for p in (*_PARTS, *_LOCKS)) for path in folder.iterdir())


def is_ours(folder: Path) -> bool:
    """Whether the folder is a result of this tool."""
    return made_by(folder / SUMMARY, GENERATOR)


def identity(folder: Path) -> str:
    """Return which run it is whose results lie in a folder.

    Raises
    ------
    MasterError
        If it is not a results folder of ours.
    """
    return str(_summary(folder).get("run", ""))


def made_by(path: Path, generator: str) -> bool:
    """Whether a JSON file says that it is from ``generator``."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return False
    return isinstance(found, dict) and found.get("generator") == generator


def write_json(path: Path, data: Mapping[str, Any]) -> None:
    """Write a JSON file in one go: readers see the old one or the new one, never half of it."""
    write_text(path, json.dumps(_finite(data), indent=1, ensure_ascii=False, allow_nan=False) + "\n")


def write_text(path: Path, text: str) -> None:
    """Write a text file in one go."""
    write_whole(path, text.encode())


def read(folder: Path) -> Results:
    """Read a run back from its folder.

    Raises
    ------
    MasterError
        If it is not a results folder of ours, a file in it is damaged, or a run writes there.
    """
    folder_lock.check_free(folder)
    done = _read(folder)
    folder_lock.check_free(folder)
    now = _summary(folder)
    if (now.get("run"), now.get("status")) != (done.summary.get("run"), done.summary.get("status")):
        raise MasterError(f"{folder} was written anew while it was read; try again")
    return done


def _read(folder: Path) -> Results:
    summary = _summary(folder)
    geometry = summary_schema.read_geometry(folder / GEOMETRY) if (folder / GEOMETRY).is_file() else {}
    coarse = sorted(p for p in folder.glob("timeseries*.csv") if p.name != TIMESERIES)
    recordings = tuple(load(p) for p in (folder / TIMESERIES, *coarse))
    return Results(folder, summary, recordings, geometry)


def _summary(folder: Path) -> dict[str, Any]:
    if not is_ours(folder):
        raise MasterError(f"{folder} is not a results folder: it has no {SUMMARY} written by this tool")
    found = summary_schema.read_summary(folder / SUMMARY)
    if found.get("format", 1) > FORMAT:
        raise MasterError(
            f"{folder / SUMMARY} has format {found['format']}, this version reads up to {FORMAT}; "
            "read it with the newer version that wrote it"
        )
    return found


#: How runs end that are not complete.
_ENDS: Final = {"running": "was not finished", "failed": "has failed", "interrupted": "was interrupted"}


def figures(done: Results) -> dict[str, Any]:
    """Return the figures, verdicts, events and energy balances for summary.json."""
    events = done.events
    return {
        "filter": done.evaluation.filter.sentence,
        "judged_by": done.evaluation.limits.title,
        "quality": [_assessed(a) for a in done.assessments()],
        "following": [asdict(f) for f in done.followings],
        "uplift": [asdict(u) for u in done.uplifts],
        "events": [asdict(e) for e in events[:MOST_EVENTS]],
        "events_left_out": max(0, len(events) - MOST_EVENTS),
        "energy": [{**asdict(b), "share": b.share, "text": b.text} for b in done.balances],
    }


def _assessed(a: Assessment) -> dict[str, Any]:
    return {
        **asdict(a.quality),
        "depends_on_filter": bool(a.quality.told),
        "uplift": None if a.uplift is None else asdict(a.uplift),
        "supports": a.supports,
        "slack_droppers": a.slack,
        "spans": [asdict(s) for s in a.spans],
        "drift": a.drift,
        "early": a.early,
        "unchecked": a.unchecked,
        "criteria": [{**asdict(c), "verdict": c.word} for c in a.criteria],
        "passed": None if a.withheld else a.passed,
        "withheld": a.withheld,
    }


def write_forces(done: Results) -> None:
    """Write the filtered contact forces, as the figures are made of them, to the last bit."""
    if not done.signals:
        return
    titles, columns = force_table(done.signals)
    formats = [_EXACT if title.endswith(".filtered_force [N]") else NUMBER_FORMAT for title in titles]
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(map(safe_cell, titles))
    np.savetxt(text, np.column_stack(columns), fmt=formats, delimiter=",")
    write_text(done.folder / FORCES, text.getvalue())


_EXACT: Final = "%.17g"


def filter_data(chosen: ForceFilter) -> dict[str, Any]:
    """Return a filter as a summary's settings have it."""
    known = asdict(chosen)
    return known if chosen.kind == "butterworth" else {**known, "order": None, "phase": None}


def filter_of(told: Mapping[str, Any] | None) -> ForceFilter:
    """Return the filter that a run was made with, from its settings."""
    if told is None:
        return BEFORE_CHOICE
    return ForceFilter(**{name: value for name, value in told.items() if value is not None})


def versions() -> dict[str, str]:
    """Return the versions of what computed."""
    found = {"python": platform.python_version()}
    for name in ("openpanto", "fmpy", "numpy"):
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "not installed"
    return found


def peak_memory() -> float:
    """Return the largest memory that the process has occupied so far [MB]."""
    status = Path("/proc/self/status")
    if status.is_file():  # Linux counts in its resource usage what the program took that has started this one
        found = re.search(r"^VmHWM:\s*(\d+) kB$", status.read_text(encoding="ascii", errors="replace"), re.MULTILINE)
        if found is not None:
            return int(found[1]) / 1024.0
    try:
        import resource
    except ImportError:  # Windows
        return 0.0
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1024.0**2 if sys.platform == "darwin" else 1024.0)


def _finite(data: Any) -> Any:
    if isinstance(data, Mapping):
        return {str(k): _finite(v) for k, v in data.items()}
    if isinstance(data, list | tuple):
        return [_finite(v) for v in data]
    if isinstance(data, float) and not math.isfinite(data):
        return None
    return data

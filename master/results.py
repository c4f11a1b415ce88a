"""Result folders: made, written and read back."""

from __future__ import annotations

import json
import math
import platform
import re
import resource
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib import metadata
from pathlib import Path
from typing import Any, Final

import numpy as np

from master import summary_schema
from master.checkpoint import NAME as CHECKPOINT
from master.contacts import Contact, lateral_position, track_position
from master.durable import PART, write_whole
from master.energy import Balance, drift_events, find_balances
from master.errors import MasterError
from master.events import MOST_EVENTS, Event, find_events
from master.line import Geometry, Uplift, support_uplifts
from master.quality import FILTER_NOTE, Criterion, Quality, assess, judge
from master.recorder import Recording, load
from master.trains import Following, followings

GENERATOR: Final = "openpanto master"
SUMMARY: Final = "summary.json"
GEOMETRY: Final = "geometry.json"
TIMESERIES: Final = "timeseries.csv"
REPORT: Final = "report.html"
_OURS: Final = ("timeseries*.csv", "timeseries*.parquet", SUMMARY, GEOMETRY, REPORT, "*.png", "*.svg")
#: What a run that was killed may leave half written.
_PARTS: Final = tuple(name + PART for name in (SUMMARY, GEOMETRY, CHECKPOINT))


@dataclass(frozen=True)
class Assessment:
    """Figures and verdict of one contact."""

    contact: Contact
    quality: Quality
    criteria: tuple[Criterion, ...]

    @property
    def passed(self) -> bool:
        """Whether every limit is kept."""
        return all(c.passed for c in self.criteria)


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
        """The interval of interest [m]."""
        chosen = self.summary.get("settings", {}).get("interval", {})
        return chosen.get("start"), chosen.get("end")

    @property
    def uplifts(self) -> tuple[Uplift, ...]:
        """Largest uplift of every support."""
        return support_uplifts(self.recordings, self.geometry)

    def assessments(self) -> tuple[Assessment, ...]:
        """Return figures and verdict of every contact that has samples in the interval."""
        return assess_contacts(self.recordings, self.contacts, self.interval, self.uplifts)

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


def assess_contacts(
    recordings: tuple[Recording, ...],
    contacts: Sequence[Contact],
    interval: tuple[float | None, float | None],
    uplifts: Sequence[Uplift],
) -> tuple[Assessment, ...]:
    """Return the figures of all contacts from the recording at every step."""
    recording = recordings[0]
    if len(recording.time) < 2:
        return ()
    step = float(recording.time[-1] - recording.time[0]) / (len(recording.time) - 1)
    found = []
    for contact in contacts:
        quality = _quality(recording, contact, step, interval)
        if quality is not None:
            largest = [u.maximum for u in uplifts if u.component == contact.catenary]
            found.append(Assessment(contact, quality, judge(quality, largest)))
    return tuple(found)


def _quality(
    recording: Recording, contact: Contact, step: float, interval: tuple[float | None, float | None]
) -> Quality | None:
    if contact.force not in recording or recording.units[recording.names.index(contact.force)] not in (
        "N",
        "",
    ):
        return None
    force = recording[contact.force]
    height = None
    if contact.point("z") in recording:
        height = np.where(force > 0.0, recording[contact.point("z")], np.nan)
    position, lateral = track_position(recording, contact), lateral_position(recording, contact)
    return assess(force, position, step, interval, height, lateral, contact.index)


def prepare(folder: Path) -> None:
    """Make the folder, or empty one that is recognisably a result of ours.

    Raises
    ------
    MasterError
        If it exists and is something else, or cannot be written.
    """
    try:
        if folder.exists():
            _empty(folder)
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise MasterError(
            f"the results folder {folder} cannot be written ({error.strerror}); choose another with --out"
        ) from error


def _empty(folder: Path) -> None:
    if not folder.is_dir():
        raise MasterError(f"{folder} is a file, not a results folder; choose another with --out")
    left = list(folder.iterdir())
    if all(path.name in _PARTS for path in left):  # nothing, or a run that was killed at once
        for path in left:
            path.unlink()
        return
    if not is_ours(folder):
        raise MasterError(
            f"{folder} exists and is not a results folder of this tool; it is left alone, choose another with --out"
        )
    for pattern in (*_OURS, *(name + PART for name in _OURS), *_PARTS):
        for path in folder.glob(pattern):
            path.unlink()


def take_over(folder: Path, marker: str, generator: str, kind: str) -> None:
    """Make a folder, or take over one whose JSON file ``marker`` names its ``generator``; nothing is removed.

    Raises
    ------
    MasterError
        If it is there and is no ``kind`` of ours, or cannot be made.
    """
    if folder.is_dir() and any(folder.iterdir()) and not made_by(folder / marker, generator):
        raise MasterError(
            f"{folder} exists and is no {kind} of this tool; it is left alone, choose another with --out"
        )
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise MasterError(
            f"the folder {folder} cannot be made ({error.strerror}); choose another with --out"
        ) from error


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
        If it is not a results folder of ours, or a file in it is damaged.
    """
    summary = _summary(folder)
    geometry = summary_schema.read_geometry(folder / GEOMETRY) if (folder / GEOMETRY).is_file() else {}
    coarse = sorted(p for p in folder.glob("timeseries*.csv") if p.name != TIMESERIES)
    recordings = tuple(load(p) for p in (folder / TIMESERIES, *coarse))
    return Results(folder, summary, recordings, geometry)


def _summary(folder: Path) -> dict[str, Any]:
    if not is_ours(folder):
        raise MasterError(f"{folder} is not a results folder: it has no {SUMMARY} written by this tool")
    return summary_schema.read_summary(folder / SUMMARY)


def figures(
    assessments: Sequence[Assessment],
    uplifts: Sequence[Uplift],
    following: Sequence[Following] = (),
    events: Sequence[Event] = (),
    balances: Sequence[Balance] = (),
) -> dict[str, Any]:
    """Return the figures, verdicts, events and energy balances for summary.json."""
    return {
        "filter": FILTER_NOTE,
        "quality": [
            {**asdict(a.quality), "criteria": [asdict(c) for c in a.criteria], "passed": a.passed} for a in assessments
        ],
        "following": [asdict(f) for f in following],
        "uplift": [asdict(u) for u in uplifts],
        "events": [asdict(e) for e in events[:MOST_EVENTS]],
        "events_left_out": max(0, len(events) - MOST_EVENTS),
        "energy": [{**asdict(b), "share": b.share, "text": b.text} for b in balances],
    }


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

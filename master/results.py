"""Result folders: made, written and read back."""

from __future__ import annotations

import json
import math
import platform
import resource
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib import metadata
from pathlib import Path
from typing import Any, Final

import numpy as np

from master.contacts import Contact, lateral_position, track_position
from master.errors import MasterError
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
    if not any(folder.iterdir()):
        return
    if not is_ours(folder):
        raise MasterError(
            f"{folder} exists and is not a results folder of this tool; it is left alone, choose another with --out"
        )
    for pattern in _OURS:
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


def made_by(path: Path, generator: str) -> bool:
    """Whether a JSON file says that it is from ``generator``."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    return isinstance(found, dict) and found.get("generator") == generator


def write_json(path: Path, data: Mapping[str, Any]) -> None:
    """Write a JSON file in one go: readers see the old one or the new one, never half of it."""
    write_text(path, json.dumps(_finite(data), indent=1, ensure_ascii=False, allow_nan=False) + "\n")


def write_text(path: Path, text: str) -> None:
    """Write a text file in one go."""
    temporary = path.with_name(path.name + ".part")
    temporary.write_text(text, encoding="utf-8")
    temporary.replace(path)


def read(folder: Path) -> Results:
    """Read a run back from its folder.

    Raises
    ------
    MasterError
        If it is not a results folder of ours.
    """
    if not is_ours(folder):
        raise MasterError(f"{folder} is not a results folder: it has no {SUMMARY} written by this tool")
    summary = json.loads((folder / SUMMARY).read_text(encoding="utf-8"))
    geometry = {}
    if (folder / GEOMETRY).is_file():
        geometry = json.loads((folder / GEOMETRY).read_text(encoding="utf-8"))
    coarse = sorted(p for p in folder.glob("timeseries*.csv") if p.name != TIMESERIES)
    recordings = tuple(load(p) for p in (folder / TIMESERIES, *coarse))
    return Results(folder, summary, recordings, geometry)


def figures(
    assessments: Sequence[Assessment], uplifts: Sequence[Uplift], following: Sequence[Following] = ()
) -> dict[str, Any]:
    """Return the figures and verdicts for summary.json."""
    return {
        "filter": FILTER_NOTE,
        "quality": [
            {**asdict(a.quality), "criteria": [asdict(c) for c in a.criteria], "passed": a.passed} for a in assessments
        ],
        "following": [asdict(f) for f in following],
        "uplift": [asdict(u) for u in uplifts],
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

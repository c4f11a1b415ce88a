"""One run of a sweep: what a worker does with it, and what it reports."""

from __future__ import annotations

import gc
import json
import math
import os
import shutil
import socket
import tempfile
import time
import uuid
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Final

from master.batch.assessment_figures import FIGURES, verdict_of
from master.batch.calibration import find_values
from master.batch.sweep.sweep_plan import Keep
from master.batch.sweep.swept_systems import SweepRun
from master.errors import InterruptedRunError, MasterError, RunError, one_line
from master.evaluation.contact_assessment import Assessment
from master.evaluation.contact_positions import leading_first
from master.evaluation.output_figures import output_figures
from master.results.results_folder import FORCES, GEOMETRY, SUMMARY, WORK
from master.results.run_results import Results
from master.results.run_summary import peak_memory
from master.run_session import RunOptions, run
from master.system.components import System
from master.system.pantograph_motion import STATIC_FORCE, pantographs, parameter_value

#: What is in a cell of the table.
Cell = float | str | None
Row = Mapping[str, Cell]
#: Columns of the table that hold text, whatever it looks like.
TEXTS: Final = ("variant", "key", "status", "reason", "pantograph", "verdict", "failed limits", "remarks")
#: Figures of a recorded output, in runs without a pantograph.
OUTPUT_KINDS: Final = ("end", "minimum", "maximum", "mean")
#: Files of a run that stay if it is thinned.
_THINNED: Final = (SUMMARY, GEOMETRY, FORCES)
#: How often a run is made whose process dies.
ATTEMPTS: Final = 2
#: Why a run has failed that no process survives: the same words wherever it was made.
DIED: Final = f"the worker's process died in this run, {ATTEMPTS} times"


@dataclass(frozen=True)
class RunPlace:
    """Where the runs of a sweep are made and what of them stays.

    Attributes
    ----------
    folder : Path
        Holds a folder for every run that stays, named by its key.
    keep : str
        See `sweep_plan.SweepRequest`.
    """

    folder: Path
    keep: Keep

    def of(self, key: str) -> Path:
        """Return the folder of a run."""
        return self.folder / key


@dataclass(frozen=True)
class SweepResult:
    """What has become of a run.

    Attributes
    ----------
    key : str
        Which run.
    rows : tuple of dict
        Figures by column, a row for each pantograph, the leading one first.
    reason : str
        Why it has failed; empty if it has not.
    seconds, stepping : float
        Wall time of the whole and of its steps [s].
    memory : float
        Peak memory of the process so far [MB].
    worker : str
        Where it was made.
    """

    key: str
    rows: tuple[Row, ...] = ()
    reason: str = ""
    seconds: float = 0.0
    stepping: float = 0.0
    memory: float = 0.0
    worker: str = field(default_factory=lambda: f"process {os.getpid()} on {socket.gethostname()}")

    @property
    def failed(self) -> bool:
        """Whether the run has failed."""
        return bool(self.reason)

    def line(self) -> bytes:
        """Return the result as a line of the journal."""
        return (json.dumps(asdict(self)) + "\n").encode()

    @classmethod
    def of_line(cls, line: bytes) -> SweepResult | None:
        """Return the result in a line, None if it is damaged."""
        try:
            data = json.loads(line)
            return cls(**{**data, "rows": tuple(data["rows"])})
        except (ValueError, TypeError, KeyError, RecursionError):
            return None


def carry_out(base: System, wanted: SweepRun, place: RunPlace) -> SweepResult:
    """Make a run and return its figures; one that fails is a result too.

    Raises
    ------
    InterruptedRunError, KeyboardInterrupt
        If the user stops it.
    """
    began = time.perf_counter()
    stepping, reason = 0.0, ""
    rows: tuple[Row, ...] = ()
    if wanted.is_rehearsal:
        place = replace(place, keep="figures")
    with _working_folder(place) as folder:
        try:
            system = _calibrated(wanted.system(base), wanted, folder)
            # All runs have the same ones: only a folder that stays whole has a use for them.
            done = run(system, folder / "run", (), RunOptions(keep_definitions=place.keep in ("all", "failed")))
            stepping = float(done.summary["performance"]["wall_time"])
            rows = tuple(figure_rows(done, system))
            _kept(folder / "run", place, wanted.key)
        except InterruptedRunError:
            raise
        except Exception as error:  # one of a thousand runs must not end them all, whatever it is
            rows, reason = (), reason_of(error)
            with suppress(OSError):
                _kept(folder / "run", place, wanted.key, failed=True)
    # An FMU in Python leaves its model in cycles of references: before Python takes them for many, they are gigabytes.
    gc.collect()
    return SweepResult(wanted.key, rows, reason, time.perf_counter() - began, stepping, peak_memory())


@contextmanager
def _working_folder(place: RunPlace) -> Iterator[Path]:
    """Yield an empty folder, beside the runs if any may stay."""
    if place.keep == "figures":
        with tempfile.TemporaryDirectory(prefix="sweep-") as name:
            yield Path(name)
        return
    place.folder.mkdir(parents=True, exist_ok=True)
    # A run that a dead master has left behind may still be going on in a worker.
    folder = place.folder / f"{WORK}{uuid.uuid4().hex}"
    folder.mkdir()
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _kept(made: Path, place: RunPlace, key: str, failed: bool = False) -> None:
    """Move what stays of a run to its place."""
    if not made.is_dir() or place.keep == "figures" or (place.keep == "failed" and not failed):
        return
    if place.keep == "thinned":
        for path in made.iterdir():
            if path.name not in _THINNED:
                path.unlink()
    shutil.rmtree(place.of(key), ignore_errors=True)
    made.replace(place.of(key))


def reason_of(error: Exception) -> str:
    """Return why a run has failed, without the place where it was made."""
    if isinstance(error, RunError) and isinstance(error.__cause__, MasterError):
        error = error.__cause__
    if isinstance(error, MasterError):
        return one_line(str(error))
    return one_line(f"{type(error).__name__}: {error}")


def _calibrated(system: System, wanted: SweepRun, folder: Path) -> System:
    """Return a system whose pantographs have the static force that gives the wanted mean contact force."""
    if wanted.target is None:
        return system
    names = [c.name for c in pantographs(system)]
    starts = [parameter_value(system.component(name), STATIC_FORCE) or wanted.target for name in names]

    def with_forces(values: tuple[float, ...]) -> System:
        forces = dict(zip(names, values, strict=True))
        return replace(
            system,
            components=tuple(
                replace(c, parameters={**c.parameters, STATIC_FORCE: forces[c.name]}) if c.name in forces else c
                for c in system.components
            ),
        )

    def means(values: tuple[float, ...]) -> tuple[float, ...]:
        trial = run(with_forces(values), folder / "trial", (), RunOptions(keep_definitions=False))
        found = {a.contact.pantograph: a.quality.mean for a in trial.assessments()}
        if missing := [name for name in names if name not in found]:
            raise MasterError(f"{', '.join(missing)} has no contact in the interval of interest")
        return tuple(found[name] for name in names)

    return with_forces(tuple(r.value for r in find_values(means, wanted.target, starts, wanted.tolerance)))


def figure_rows(done: Results, system: System) -> Iterator[Row]:
    """Yield the figures of every pantograph; without one, those of the recorded outputs."""
    found = {a.contact: a for a in done.assessments()}
    for contact in leading_first(done.recordings[0], list(found)) if found else ():
        yield _row(found[contact], system)
    if not done.contacts:
        figures = output_figures(done.recordings)
        yield {
            f"{f.name} {kind} [{f.unit or '1'}]": _finite(getattr(f, kind)) for f in figures for kind in OUTPUT_KINDS
        }
    elif not found:
        yield {"verdict": done.not_judged or "nothing to judge"}


def _finite(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else float(value)


def _row(assessment: Assessment, system: System) -> Row:
    force = parameter_value(system.component(assessment.contact.pantograph), STATIC_FORCE)
    figures = {f"{title} [{unit}]": get(assessment) for title, unit, get, _ in FIGURES}
    return {
        "pantograph": assessment.contact.pantograph,
        "static force [N]": force,
        **{title: _finite(v) for title, v in figures.items()},
        "verdict": verdict_of(assessment),
        "passed": "" if assessment.withheld else str(assessment.passed).lower(),
        "failed limits": "; ".join(c.name for c in assessment.criteria if not c.passed),
        "remarks": "; ".join(assessment.warnings),
    }

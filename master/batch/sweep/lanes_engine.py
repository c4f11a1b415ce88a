"""The engine of a sweep that makes runs of one line side by side, without FMUs: ``python -m models lanes``.

Runs whose line is the same are one job of a process of its own. What comes back is evaluated by the functions that
evaluate a run of FMUs. Before the first job some runs are made both ways, and the sweep ends if they differ.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from master.arrays import FloatArray
from master.batch.sweep.lane_evaluation import LaneOutput, evaluated_run
from master.batch.sweep.lane_system import LaneGroup, check_scenario, grouped
from master.batch.sweep.sweep_engines import MakeRuns
from master.batch.sweep.sweep_run import RunPlace, SweepResult, figure_rows, reason_of
from master.batch.sweep.swept_systems import SweepRun
from master.errors import InterruptedRunError, MasterError, RequestError
from master.results.run_summary import peak_memory
from master.run_session import run as run_system
from master.system.components import System

#: Most that the contact force of a run may differ from that of its FMUs [N].
AGREEMENT: Final = 1e-6
#: Runs that a process steps at a time.
_SIDE_BY_SIDE: Final = 16


@dataclass(frozen=True)
class LaneCheck:
    """A run that was made both ways.

    Attributes
    ----------
    run : int
        Its number.
    difference : float
        By how much the contact forces differ at most, over the whole run [N].
    """

    run: int
    difference: float

    @property
    def data(self) -> dict[str, Any]:
        """Return it as ``sweep.json`` has it."""
        return {"run": self.run, "largest difference [N]": self.difference}


class LanesEngine:
    """Makes runs side by side in a process that steps no FMUs.

    Parameters
    ----------
    check : int
        How many runs are made as FMUs as well, before all others.
    tell : callable
        Shows the user what takes time.

    Attributes
    ----------
    checks : list of dict
        What came of that, run by run.
    """

    width = _SIDE_BY_SIDE
    is_rehearsed = False

    def __init__(self, check: int = 1, tell: Callable[[str], None] = lambda _: None) -> None:
        self._check, self._tell = check, tell
        self.checks: list[Mapping[str, Any]] = []

    @contextmanager
    def opened(self, base: System, place: RunPlace) -> Iterator[MakeRuns]:
        """Check that lanes can make the runs of a scenario, and yield what makes them.

        Raises
        ------
        RequestError
            Naming what cannot be done side by side.
        """
        if place.keep != "figures":
            text = "lanes leave nothing of a run but its figures"
            raise RequestError(f"--keep {place.keep}: {text}; use --keep figures, or --engine fmu")
        check_scenario(base)

        def make(runs: Sequence[SweepRun]) -> Iterator[SweepResult]:
            if any(r.target is not None for r in runs):
                text = "the static force of each run is found in trials, which are no runs side by side"
                raise RequestError(f"--mean-force: {text}; use --static-force, or --engine fmu")
            checked = _samples(runs, self._check)
            yield from self._compared(base, checked)
            known = {r.key for r in checked}
            for group in grouped(base, [r for r in runs if r.key not in known]):
                yield from (result for _, result, _ in _made(group, self._tell))

        yield make

    def _compared(self, base: System, runs: Sequence[SweepRun]) -> Iterator[SweepResult]:
        """Yield results of runs that were made both ways.

        Raises
        ------
        MasterError
            If the two differ by more than rounding.
        """
        found: list[SweepResult] = []
        for group in grouped(base, runs):
            for wanted, result, forces in _made(group, self._tell):
                difference = _difference(wanted, base, result, forces)
                self.checks.append(LaneCheck(wanted.number, difference).data)
                if not difference <= AGREEMENT:
                    text = f"run {wanted.number} made side by side and by FMUs differs by {difference:.3g} N"
                    raise MasterError(f"{text} in its contact force, more than {AGREEMENT:g} N; use --engine fmu")
                found.append(result)
        self.checks.sort(key=lambda check: int(check["run"]))
        yield from found


def _samples(runs: Sequence[SweepRun], count: int) -> list[SweepRun]:
    """Return some runs, spread over all of them."""
    places = np.unique(np.linspace(0, len(runs) - 1, min(count, len(runs))).round().astype(int))
    return [runs[i] for i in places.tolist()] if runs else []


def _difference(wanted: SweepRun, base: System, result: SweepResult, forces: FloatArray) -> float:
    """Return by how much contact forces, shape (n, P), differ from those of FMUs [N]; NaN if only one run has ended."""
    system = wanted.system(base)
    with tempfile.TemporaryDirectory(prefix="sweep-") as name:
        try:
            done = run_system(system, Path(name) / "run")
        except MasterError:
            return 0.0 if result.failed else float("nan")
    if result.failed:
        return float("nan")
    theirs = np.stack([done.recordings[0][contact.force] for contact in system.contacts], axis=1)
    return float(np.abs(theirs - forces).max()) if theirs.shape == forces.shape else float("nan")


def _made(group: LaneGroup, tell: Callable[[str], None]) -> Iterator[tuple[SweepRun, SweepResult, FloatArray]]:
    """Make the runs of a group in a process; yield each with its result and its contact forces, shape (n, P)."""
    with tempfile.TemporaryDirectory(prefix="lanes-") as name:
        folder = Path(name)
        group.write(folder)
        with _process(folder) as process:
            began = time.perf_counter()
            waiting = dict(enumerate(group.runs))
            geometry: Mapping[str, float] = {}
            assert process.stdout is not None
            for line in process.stdout:
                kind, _, rest = line.strip().partition(" ")
                if kind == "line":
                    geometry = LaneOutput.read(folder / "out" / "line.arrays").header["geometry"]
                elif kind == "note":
                    tell(rest)
                elif kind == "lane":
                    number = int(rest.split()[0])
                    path = folder / "out" / f"lane_{number}.arrays"
                    output = LaneOutput.read(path)
                    path.unlink()
                    wanted = waiting.pop(number)
                    now = time.perf_counter()
                    yield wanted, _result(group, wanted, output, geometry, now - began), output.forces
                    began = time.perf_counter()
            code, said = process.wait(), _last_line(folder)
        if code < 0:
            raise MasterError(f"python -m models lanes was ended by signal {-code}; the same command goes on from here")
        if waiting and said == "error: interrupted":  # no fault of the runs
            raise InterruptedRunError("python -m models lanes was interrupted")
        if waiting and not said.startswith("error: "):
            raise MasterError(f"python -m models lanes has ended early: {said or f'exit code {code}'}")
        for wanted in waiting.values():  # the line has no equilibrium, say
            yield wanted, SweepResult(wanted.key, (), said.removeprefix("error: ")), np.zeros((0, 0))


def _result(
    group: LaneGroup, wanted: SweepRun, output: LaneOutput, geometry: Mapping[str, float], seconds: float
) -> SweepResult:
    """Return the figures of a run, or why it has failed."""
    try:
        system = wanted.system(group.base)
        done = evaluated_run(system, output, geometry)
        return SweepResult(wanted.key, tuple(figure_rows(done, system)), "", seconds, seconds, peak_memory())
    except MasterError as error:
        return SweepResult(wanted.key, (), reason_of(error), seconds, seconds, peak_memory())


@contextmanager
def _process(folder: Path) -> Iterator[subprocess.Popen[str]]:
    """Yield the process that makes the job in a folder; it does not outlive the sweep."""
    command = [sys.executable, "-P", "-m", "models", "lanes", str(folder / "job.json"), "--out", str(folder / "out")]
    own = str(Path(__file__).resolve().parents[3])
    # What multiplies matrices here is small: threads would only wait for one another.
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([own, *filter(None, sys.path)]), "OMP_NUM_THREADS": "1"}
    with (folder / "stderr").open("w", encoding="utf-8") as errors:
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors, text=True, env=environment)
    try:
        yield process
    finally:
        if process.poll() is None:
            process.kill()
        process.wait()
        if process.stdout is not None:
            process.stdout.close()


def _last_line(folder: Path) -> str:
    lines = (folder / "stderr").read_text(encoding="utf-8", errors="replace").strip().splitlines()
    return lines[-1] if lines else ""

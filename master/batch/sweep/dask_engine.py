"""The runs of a sweep on the workers of a Dask cluster: processes of this computer, or any cluster by its scheduler.

Every worker is given one run at a time, whatever its threads, so that it is known which worker makes which run. A
worker that dies costs its run one retry; it is named when that happens, and when the run fails for it.
"""

from __future__ import annotations

import contextlib
import logging
import math
import platform
import re
import time
import uuid
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from importlib import metadata
from pathlib import Path
from typing import Any, Final, NamedTuple

import dask.config
from distributed import Client, Future, WorkerPlugin, get_worker, wait

from master.batch.sweep.local_cluster import AGAIN, local_cluster
from master.batch.sweep.sweep_engines import MakeRuns
from master.batch.sweep.sweep_run import ATTEMPTS, DIED, RunPlace, SweepResult, carry_out
from master.batch.sweep.swept_systems import SweepRun
from master.errors import MasterError
from master.system.components import System

#: Seconds within which a scheduler has to answer, and between looks at its workers.
_PATIENCE: Final = 5.0
_LOOK: Final = 0.5
#: Seconds within which a result that is there has to arrive.
_FETCH: Final = 30.0
#: Seconds without a worker before the user is told.
_ALONE: Final = 10.0
#: How Dask is to work: a process that is slow to come back must not be given up; no profile of every second is kept.
_SETTINGS: Final = {
    "distributed.worker.daemon": True,
    "distributed.deploy.lost-worker-timeout": "120s",
    "distributed.worker.profile.enabled": False,
}
#: Packages whose versions workers must share with the master: what computes a figure, and what carries it.
_PACKAGES: Final = ("openpanto", "numpy", "scipy", "numba", "fmpy", "pythonfmu", "distributed")
_ADDRESS: Final = re.compile(r"(?:[a-z]+://)?(?:\[[0-9a-f:]+\]|[^\s/:\[\]]+):\d+")
#: What cuts a connection.
_GONE: Final = (OSError, TimeoutError, RuntimeError, AttributeError, CancelledError)


def _anywhere(base: System) -> System:
    """Return a system whose FMUs are found from every working folder."""
    fmus = (replace(c.fmu, path=c.fmu.path.absolute()) for c in base.components)
    return replace(base, components=tuple(replace(c, fmu=f) for c, f in zip(base.components, fmus, strict=True)))


class ScenarioOnWorker(WorkerPlugin):  # type: ignore[misc]
    """What every worker knows of a sweep, those included that join late or are started again."""

    def __init__(self, base: System, place: RunPlace) -> None:
        self.base, self.place = base, place
        self.name = f"openpanto-sweep-{uuid.uuid4().hex}"  # others may use the same cluster
        self.made = 0


class MadeRun(NamedTuple):
    """The result of a run, and how many its worker has made."""

    result: SweepResult
    made: int


def on_worker(wanted: SweepRun, scenario: str) -> MadeRun:
    """Make a run on this worker, which holds the scenario under a name."""
    held: ScenarioOnWorker = get_worker().plugins[scenario]
    held.made += 1
    return MadeRun(carry_out(held.base, wanted, held.place), held.made)


def versions() -> dict[str, str]:
    """Return the versions of the packages that a result depends on."""
    found = {"python": platform.python_version()}
    for name in _PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "missing"
    return found


def examine(files: Sequence[str], folder: str) -> tuple[dict[str, str], list[str]]:
    """Return the versions on this worker, and which files and folder of the sweep it does not see."""
    return versions(), [path for path in (*files, folder) if path and not Path(path).exists()]


@dataclass
class _Errand:
    """A run on its way: on which worker, and how often workers have died of it."""

    run: SweepRun
    future: Future
    worker: str


@dataclass
class DaskEngine:
    """Makes runs on Dask workers.

    Attributes
    ----------
    jobs : int, optional
        How many processes of this computer make runs.
    scheduler : str, optional
        Address of a scheduler whose workers make them instead.
    memory_limit : str
        Of every process of this computer; one that needs more is ended.
    renew_after : int
        Runs after which a process is replaced by a new one.
    tell : callable
        Shows the user what workers do.
    advice : str
        What to do if processes cannot be started.
    """

    jobs: int | None = None
    scheduler: str | None = None
    memory_limit: str = "auto"
    renew_after: int = 200
    tell: Callable[[str], None] = lambda _: None
    advice: str = AGAIN
    width: int = field(default=1, init=False)
    is_rehearsed: bool = field(default=True, init=False)
    checks: Sequence[Mapping[str, Any]] = field(default=(), init=False)

    @contextmanager
    def opened(self, base: System, place: RunPlace) -> Iterator[MakeRuns]:
        """Yield what makes runs on workers that were examined.

        Raises
        ------
        MasterError
            If the scheduler does not answer, or a worker has other versions or lacks the scenario's files.
        """
        with _quiet(), self._client() as (client, replenish):
            crew = _Crew(client, base, place, self, replenish)
            with crew.ready() as results:
                yield results

    @contextmanager
    def _client(self) -> Iterator[tuple[Client, Callable[[], None]]]:
        """Yield what talks to the scheduler, and what sees to it that there are as many workers as are wanted."""
        if self.scheduler is not None:
            with _connected(self.scheduler) as client:
                yield client, lambda: None
            return
        assert self.jobs is not None  # there is no scheduler
        with local_cluster(self.jobs, self.memory_limit, self.advice) as cluster, Client(cluster) as client:
            yield client, lambda: cluster.scale(self.jobs)


@contextmanager
def _connected(address: str) -> Iterator[Client]:
    if not _ADDRESS.fullmatch(address):
        raise MasterError(f"'{address}' is not the address of a Dask scheduler, such as tcp://host:8786")
    try:
        client = Client(address, timeout=_PATIENCE)
    except (OSError, ValueError, TimeoutError) as error:
        text = f"no Dask scheduler answers at {address} within {_PATIENCE:g} s; is it running, and is that its address?"
        raise MasterError(text) from error
    try:
        yield client
    finally:
        with contextlib.suppress(*_GONE):
            client.close(timeout=2.0)


@contextmanager
def _quiet() -> Iterator[None]:
    """Leave it to us to say what workers and connections do."""
    ours = ("distributed", "tornado", "asyncio")
    loggers = [logging.getLogger(name) for name in (*ours, *logging.root.manager.loggerDict) if name.startswith(ours)]
    before = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL)
    try:
        with warnings.catch_warnings(), dask.config.set(_SETTINGS):
            warnings.simplefilter("ignore")
            yield
    finally:
        for logger, level in zip(loggers, before, strict=True):
            logger.setLevel(level)


class _Crew:
    """The workers of a cluster at the runs of one sweep.

    Parameters
    ----------
    client : Client
    base : System
    place : RunPlace
    engine : DaskEngine
        How it is to be done.
    replenish : callable
        Starts workers if there are fewer than are wanted.
    """

    def __init__(
        self, client: Client, base: System, place: RunPlace, engine: DaskEngine, replenish: Callable[[], None]
    ) -> None:
        self._client, self._engine, self._replenish = client, engine, replenish
        self._files = [str(c.fmu.path.resolve()) for c in base.components]
        self._folder = "" if place.keep == "figures" else str(place.folder.parent.resolve())
        self._ours = versions()
        self._known: dict[str, str] = {}
        self._refused: set[str] = set()
        self._errands: dict[str, _Errand] = {}
        self._deaths: Counter[str] = Counter()
        self._looked = 0.0
        self._seen = time.monotonic()
        self._scenario = ScenarioOnWorker(_anywhere(base), RunPlace(place.folder.resolve(), place.keep))

    @contextmanager
    def ready(self) -> Iterator[MakeRuns]:
        """Yield what makes runs, with the scenario on all workers; refuse to begin if a worker does not fit."""
        self._look()
        for address, text in self._problems(list(self._known)).items():
            raise MasterError(f"worker {self._known[address]} {text}")
        self._ask(lambda: self._client.register_plugin(self._scenario))
        try:
            yield self._results
        finally:
            with contextlib.suppress(*_GONE):
                self._client.unregister_worker_plugin(self._scenario.name)

    def _results(self, runs: Sequence[SweepRun]) -> Iterator[SweepResult]:
        """Yield the results of runs as they come."""
        waiting = list(reversed(runs))
        try:
            while waiting or self._errands:
                self._look_now_and_then()
                yield from self._mourn(waiting)
                self._send_out(waiting)
                yield from self._arrived(waiting)
        finally:
            with contextlib.suppress(*_GONE):
                self._client.cancel([e.future for e in self._errands.values()], force=True)

    def _look_now_and_then(self) -> None:
        if time.monotonic() - self._looked > _LOOK or len(self._errands) < len(self._known):
            self._look()

    def _look(self) -> None:
        """See which workers there are; those that are new are examined."""
        before, was_first = set(self._known), not self._looked
        info = self._ask(lambda: self._client.nthreads())
        names = {address: self._known.get(address, address.removeprefix("tcp://")) for address in info}
        self._looked = time.monotonic()
        new = [address for address in names if address not in before and address not in self._refused]
        if new and not was_first:
            problems = self._problems(new)
            for address, text in problems.items():
                self._engine.tell(f"worker {names[address]} {text}; it is not used")
            self._refused |= set(problems)
        self._known = {address: name for address, name in names.items() if address not in self._refused}
        if len(self._known) < self._engine.width:
            self._replenish()
        self._note_absence()
        self._engine.width = max(1, self._engine.jobs or len(self._known))

    def _note_absence(self) -> None:
        """Tell the user once if there has been no worker for a while."""
        now = time.monotonic()
        if self._known:
            self._seen = now
        elif now - self._seen > _ALONE:
            self._seen = math.inf
            self._engine.tell("there is no worker at present; waiting for one")

    def _ask(self, question: Callable[[], Any]) -> Any:
        try:
            if self._client.status != "running":
                raise OSError("closed")
            return question()
        except _GONE as error:
            address = self._engine.scheduler or "the scheduler"
            raise MasterError(f"the Dask scheduler at {address} is gone; start the sweep again to go on") from error

    def _problems(self, addresses: Sequence[str]) -> dict[str, str]:
        """Return what does not fit about workers, by address."""
        if not addresses:
            return {}
        answers = self._ask(
            lambda: self._client.run(examine, self._files, self._folder, workers=list(addresses), on_error="return")
        )
        found = {address: self._problem(answer) for address, answer in answers.items()}
        return {address: text for address, text in found.items() if text}

    def _problem(self, answer: Any) -> str:
        if isinstance(answer, ImportError):
            return f"cannot import {answer.name or 'openpanto'}: install there what is installed here"
        if isinstance(answer, OSError) and self._engine.memory_limit != "auto":
            return f"died before its first run: --memory-limit {self._engine.memory_limit} may be too little"
        if isinstance(answer, BaseException):
            return f"cannot be examined: {answer}"
        theirs, missing = answer
        other = [f"{n} {theirs.get(n)}, here {v}" for n, v in self._ours.items() if theirs.get(n) != v]
        if other:
            return f"has other versions: {'; '.join(other)}"
        return (
            f"does not see {missing[0]}: scenario and results must lie on a file system that all share"
            if missing
            else ""
        )

    def _send_out(self, waiting: list[SweepRun]) -> None:
        """Give a run to every worker that has none."""
        busy = {e.worker for e in self._errands.values()}
        for address in self._known:
            if address not in busy and waiting:
                run = waiting.pop()
                only = {"workers": [address], "allow_other_workers": False, "pure": False}
                future = self._ask(partial(self._client.submit, on_worker, run, self._scenario.name, **only))
                self._errands[run.key] = _Errand(run, future, address)

    def _mourn(self, waiting: list[SweepRun]) -> Iterator[SweepResult]:
        """Take back the runs of workers that have died."""
        for errand in [e for e in self._errands.values() if e.worker not in self._known]:
            if not errand.future.done() or errand.future.status != "finished":
                yield from self._lost(errand, waiting)

    def _lost(self, errand: _Errand, waiting: list[SweepRun]) -> Iterator[SweepResult]:
        """Make a run once more whose worker has died, or report that it fails."""
        with contextlib.suppress(*_GONE):
            self._client.cancel([errand.future], force=True)
        run, worker = errand.run, errand.worker.removeprefix("tcp://")
        del self._errands[run.key]
        self._deaths[run.key] += 1
        if self._deaths[run.key] < ATTEMPTS:
            self._engine.tell(f"worker {worker} died in run {run.number}; the run is made once more")
            waiting.append(run)
            return
        self._engine.tell(f"worker {worker} died in run {run.number} too; the run has failed")
        yield SweepResult(run.key, reason=DIED, worker=worker)

    def _arrived(self, waiting: list[SweepRun]) -> Iterator[SweepResult]:
        """Wait a little and yield what has come."""
        futures = {e.future: e for e in self._errands.values()}
        if not futures:
            time.sleep(_LOOK)
            return
        try:
            done = wait(list(futures), timeout=_LOOK, return_when="FIRST_COMPLETED").done
        except TimeoutError:
            return
        except _GONE:
            self._look()
            return
        for future in done:
            yield from self._settled(futures[future], waiting)

    def _settled(self, errand: _Errand, waiting: list[SweepRun]) -> Iterator[SweepResult]:
        if errand.future.status != "finished":
            error = errand.future.exception() if errand.future.status == "error" else None
            if error is None or type(error).__name__ in ("KilledWorker", "CommClosedError"):
                self._look()
                yield from self._lost(errand, waiting)
                return
            raise MasterError(f"worker {errand.worker} failed: {type(error).__name__}: {error}") from error
        try:
            found: MadeRun = errand.future.result(timeout=_FETCH)
        except _GONE:  # the worker has died with it
            self._look()
            yield from self._lost(errand, waiting)
            return
        del self._errands[errand.run.key]
        if self._engine.scheduler is None and found.made >= self._engine.renew_after:
            self._renew(errand.worker)
        yield found.result

    def _renew(self, worker: str) -> None:
        """Replace a process of this computer by a new one: what FMUs keep for ever ends with it."""
        self._known.pop(worker, None)
        with contextlib.suppress(*_GONE):
            self._client.restart_workers([worker], timeout=30.0)
        self._look()

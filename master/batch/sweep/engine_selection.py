"""Which engine makes the runs of a sweep: one process beside this one, or the workers of Dask if they are asked for."""

from __future__ import annotations

from collections.abc import Callable

from master.batch.sweep.child_engine import ChildEngine, can_start_processes
from master.batch.sweep.sweep_engines import HereEngine, SweepEngine
from master.errors import MasterError, UsageError


def engine_of(
    jobs: int | None,
    scheduler: str | None,
    tell: Callable[[str], None],
    memory_limit: str = "auto",
    renew_after: int = 200,
) -> SweepEngine:
    """Return what makes the runs.

    Parameters
    ----------
    jobs : int, optional
        How many processes of this computer.
    scheduler : str, optional
        Address of a Dask scheduler.
    tell : callable
        Shows the user what workers do.
    memory_limit, renew_after
        See `dask_engine.DaskEngine`.

    Raises
    ------
    UsageError
        If both are asked for, or a limit of processes that none starts.
    MasterError
        If Dask is not installed.
    """
    if jobs is None and memory_limit != "auto":
        raise UsageError("--memory-limit is of the processes that --jobs starts: give that too, or leave it out")
    if jobs is None and scheduler is None:
        return ChildEngine(tell, renew_after) if can_start_processes() else HereEngine()
    if jobs is not None and scheduler is not None:
        raise UsageError("--jobs starts processes of this computer, --scheduler uses those of a cluster: give one")
    try:
        from master.batch.sweep.dask_engine import DaskEngine
    except ImportError as error:
        raise MasterError("--jobs and --scheduler need Dask: pip install 'openpanto[scale]'") from error
    return DaskEngine(jobs, scheduler, memory_limit, renew_after, tell)

"""Which engine makes the runs of a sweep: one process beside this one, or the workers of Dask if they are asked for."""

from __future__ import annotations

from collections.abc import Callable

from master.batch.sweep.child_engine import ChildEngine, can_start_processes
from master.batch.sweep.lanes_engine import LanesEngine
from master.batch.sweep.sweep_engines import HereEngine, SweepEngine
from master.batch.sweep.sweep_plan import SweepRequest
from master.errors import MasterError, UsageError

#: What a script lacks whose processes end as they begin.
_GUARD = "a script that gives jobs is a file, and does its work under: if __name__ == '__main__':"


def engine_of(
    jobs: int | None,
    scheduler: str | None,
    tell: Callable[[str], None],
    memory_limit: str = "auto",
    renew_after: int = 200,
    request: SweepRequest | None = None,
    is_script: bool = False,
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
    request : SweepRequest, optional
        Says whether runs are made side by side, see `lanes_engine.LanesEngine`.
    is_script : bool
        Whether Python asks, not a command: processes then import its script.

    Raises
    ------
    UsageError
        If both are asked for, one of them with lanes, a limit of processes that none starts, or fewer than one.
    MasterError
        If Dask is not installed.
    """
    if jobs is not None and not (isinstance(jobs, int) and jobs > 0):
        raise UsageError(f"jobs: {jobs!r} is not a whole number above 0")
    if jobs is None and memory_limit != "auto":
        raise UsageError("--memory-limit is of the processes that --jobs starts: give that too, or leave it out")
    if request is not None and request.engine == "lanes":
        if jobs is not None or scheduler is not None:
            raise UsageError("--engine lanes makes its runs in one process: leave --jobs and --scheduler out")
        return LanesEngine(request.check, tell)
    if jobs is None and scheduler is None:
        return ChildEngine(tell, renew_after) if can_start_processes() else HereEngine()
    if jobs is not None and scheduler is not None:
        raise UsageError("--jobs starts processes of this computer, --scheduler uses those of a cluster: give one")
    try:
        from master.batch.sweep.dask_engine import DaskEngine
    except ImportError as error:
        raise MasterError("--jobs and --scheduler need Dask: pip install 'openpanto[scale]'") from error
    advice = {"advice": _GUARD} if is_script else {}
    return DaskEngine(jobs, scheduler, memory_limit, renew_after, tell, **advice)

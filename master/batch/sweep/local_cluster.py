"""Dask's processes of this computer, one thread and one run at a time each."""

from __future__ import annotations

import logging
import os
from contextlib import suppress
from typing import Final

import dask.utils
from distributed import LocalCluster

from master.errors import MasterError, one_line

#: What helps on a computer that had no room just then.
AGAIN: Final = "start the sweep again"


def local_cluster(jobs: int, memory_limit: str, advice: str = AGAIN) -> LocalCluster:
    """Return a cluster of so many processes.

    Parameters
    ----------
    jobs : int
    memory_limit : str
        Of every process, such as ``2GB``; ``auto`` for equal shares.
    advice : str
        What to do if they cannot be started.

    Raises
    ------
    MasterError
        If the limit is none, or the processes cannot be started.
    """
    if memory_limit != "auto":
        try:
            has_room = dask.utils.parse_bytes(memory_limit) > 0
        except ValueError:
            has_room = False
        if not has_room:
            raise MasterError(f"'{memory_limit}' is no size of memory, such as 2GB or 'auto'")
    before = set(LocalCluster._instances)
    try:
        return LocalCluster(
            n_workers=jobs,
            threads_per_worker=1,
            processes=True,
            memory_limit=memory_limit,
            dashboard_address=None,
            host="127.0.0.1",
            silence_logs=logging.CRITICAL,  # it is for us to say what they do
            env={**os.environ, "OMP_NUM_THREADS": "1"},
        )
    except (OSError, TimeoutError, RuntimeError) as error:  # one was ended as it began, or there is no room for it
        causes = error, error.__cause__, error.__context__
        why = next((str(c) for c in reversed(causes) if c is not None and str(c)), type(error).__name__)
        text = f"the {jobs} processes of --jobs cannot be started ({one_line(why)}); {advice}"
        raise MasterError(text) from error
    except BaseException:  # Ctrl-C while they start
        _drop(set(LocalCluster._instances) - before)
        raise


def _drop(half_made: set[LocalCluster]) -> None:
    """End clusters that have only begun: at the end of this process Dask would trip over them."""
    for cluster in half_made:
        with suppress(Exception):
            cluster.close(timeout=2.0)
        LocalCluster._instances.discard(cluster)

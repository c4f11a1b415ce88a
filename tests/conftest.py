"""What holds for the whole suite: long checks on request, groups of tests that share one process, the longest first."""

from __future__ import annotations

import compileall
import gc
import os
import signal
from pathlib import Path
from typing import Final

import pytest
from hypothesis import HealthCheck, settings

from tests.effort import IS_LONG

HERE: Final = Path(__file__).parent
#: Files whose tests share a process of pytest-xdist; elsewhere those of a file do, so that fixtures are made once.
TOGETHER: Final = {
    "robustness/": "inputs that are added up",
    "validation/test_cx_ln2.py": "whole runs",
    "validation/test_multibody_ln2.py": "whole runs",
    "models/commands/desk/": "statics",  # of whose page and tables one run is enough
    "models/commands/test_statics_command.py": "statics",
    "models/coupled/test_lanes.py": "lanes",  # whose kernels are compiled once, in a quarter of a minute
    "master/batch/sweep/test_lanes_engine.py": "lanes",
}
#: Groups that take longest: they begin first, so that no process is still at one when the other has finished.
LONGEST: Final = (
    "whole runs",
    "inputs that are added up",
    "lanes",
    "interop/test_standalone.py",
    "master/batch/sweep/test_dask_engine.py",
    "test_projects.py",
    "fmus/slave/test_library_fmus.py",
    "interop/test_paths.py",
    "models/catenary/condition/test_line_condition.py",
    "test_python_interface.py",
    "interop/test_tools.py",
    "interop/test_many_instances.py",
    "hostile/test_hostile_fmus.py",
    "models/catenary/test_line_model.py",
    "models/pantograph/multibody/test_generic.py",
)


def group(item: pytest.Item) -> str:
    """Return the name of the group whose tests run in one process."""
    place = item.path.relative_to(HERE).as_posix()
    return next((name for begin, name in TOGETHER.items() if place.startswith(begin)), place)


#: Processes of pytest-xdist, each with a thread of BLAS for every core, would wait for one another; set before NumPy is
#: there, and for what the tests start.
os.environ.setdefault("OMP_NUM_THREADS", "1")
#: Signals that ``nohup``, or the background of a script, has all ignore that tests start, too, would be tested in vain.
for _number in (signal.SIGINT, getattr(signal, "SIGHUP", signal.SIGINT)):
    if signal.getsignal(_number) == signal.SIG_IGN:
        signal.signal(_number, signal.SIG_DFL if _number != signal.SIGINT else signal.default_int_handler)
#: For how long other processes hold the processor is no fault of a test.
settings.register_profile("suite", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("suite")


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """Take a process more than there are cores: tests wait a tenth of their time, for processes, locks and clocks."""
    return len(os.sched_getaffinity(0)) + 1 if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1) + 1


def pytest_configure(config: pytest.Config) -> None:
    """Let pytest-xdist take the groups in our order; by itself it takes those of most tests first.

    The hundred processes that tests start would compile all modules, each for itself, where Python is told to write no
    bytecode (``PYTHONDONTWRITEBYTECODE``, as in many containers); it reads what is there.
    """
    if not hasattr(config, "workerinput"):
        for package in ("models", "fmus", "master"):
            compileall.compile_dir(HERE.parent / package, quiet=2)
    if hasattr(config.option, "loadscopereorder"):
        config.option.loadscopereorder = False


def pytest_collection() -> None:
    """Look for no garbage while modules are imported: nearly all that they make stays."""
    gc.disable()


def pytest_collection_finish() -> None:
    """Look for it again."""
    gc.enable()


@pytest.fixture(scope="module", autouse=True)
def _nothing_old_is_searched() -> None:
    """Let Python look for garbage among the objects of the file at hand alone, not among all modules and tests.

    Sweeps collect garbage after every run, which in a process of the whole suite takes half a second otherwise.
    """
    gc.collect()
    gc.freeze()


def pytest_itemcollected(item: pytest.Item) -> None:
    """Keep the tests of a group in one process of pytest-xdist."""
    item.add_marker(pytest.mark.xdist_group(group(item)))


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave the long checks out unless asked for, and begin with the longest groups."""
    if not IS_LONG:
        left_out = [item for item in items if item.get_closest_marker("long")]
        items[:] = [item for item in items if not item.get_closest_marker("long")]
        config.hook.pytest_deselected(items=left_out)
    rank = {name: i for i, name in enumerate(LONGEST)}
    items.sort(key=lambda item: rank.get(group(item), len(LONGEST)))

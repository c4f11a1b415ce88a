"""The packed reference scenario, unmodified, in other tools: the same contact force as in our own master."""

from __future__ import annotations

import numpy as np
import pytest

from tests import forked_commands
from tests.interop.support import STEP, require

#: Tool, the package it needs, largest difference of the contact force [N]. Asked for: 0.1 N in Ecos and libcosim.
#: libcosim counts time in nanoseconds, so its steps differ in the last digits; the others give the same numbers.
TOOLS = [
    ("ecos", "ecospy", 1e-9),
    ("libcosim", "libcosimpy", 1e-4),
    ("fmpy", "fmpy", 1e-9),
    ("cofmupy", "cofmupy", 1e-9),
]
WHOLE = 7.8
SHORT = 0.6


@pytest.fixture(scope="session")
def reference(packed, tmp_path_factory):
    """Function stop -> (times, forces) of our master's jacobi run, as it records them."""
    done = {}

    def run(stop):
        if stop not in done:
            folder = tmp_path_factory.mktemp("ours") / "results"
            command = ["master", packed, "--scheme", "jacobi", "--stop", stop, "--step", STEP]
            done_run = forked_commands.run(*command, "--out", folder, "--quiet", "--no-report")
            assert done_run.returncode == 0, done_run.stderr
            titles = (folder / "timeseries.csv").open().readline().strip().split(",")
            column = titles.index("catenary.pantograph[1].contact.force [N]")
            done[stop] = np.loadtxt(folder / "timeseries.csv", delimiter=",", skiprows=1, usecols=(0, column))[1:].T
        return done[stop]

    return run


def _compare(reference, tool_run, tool, package, stop, allowed):
    require(package)
    time, force = reference(stop)
    run = tool_run(tool, stop)
    assert len(run.force) == len(force) == round(stop / STEP)
    assert run.time == pytest.approx(time, abs=1e-9)
    assert force.max() > 100.0
    rounding = 1e-7  # of the recording's ten digits
    assert np.abs(run.force - force).max() < allowed + rounding


@pytest.mark.parametrize(("tool", "package", "allowed"), TOOLS)
def test_contact_force_of_the_beginning(reference, tool_run, tool, package, allowed):
    _compare(reference, tool_run, tool, package, SHORT, allowed)


@pytest.mark.long
@pytest.mark.parametrize(("tool", "package", "allowed"), TOOLS)
def test_contact_force_of_the_whole_run(reference, tool_run, tool, package, allowed):
    _compare(reference, tool_run, tool, package, WHOLE, allowed)

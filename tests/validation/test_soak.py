"""A long run stays as small and as right as it began; ``benchmarks/soak.py`` makes longer ones."""

from __future__ import annotations

import importlib
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
#: Simulated time, and that of a window [s].
STOP, WINDOW = 20.0, 2.0


@pytest.fixture
def soak(monkeypatch):
    """The script as a module."""
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    names = ("soak", "lines", "timing")
    yield importlib.import_module("soak")
    for name in names:
        sys.modules.pop(name, None)


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_a_multibody_pantograph_for_many_spans(soak):
    """At 30 m/s over twelve spans joints stay closed, nothing is kept, and the contact never opens after the raise."""
    # Only the general form has joints that could open.
    mechanism = replace(soak.load_pantograph("generic_multibody"), formulation="general")
    pantograph = soak.at_speed(mechanism, 30.0)
    system = soak.system_of(soak.line(STOP * 30.0), pantograph)
    windows = list(soak.run(system, STOP, WINDOW))
    assert len(windows) == round(STOP / WINDOW)
    violation = np.array([w.violation for w in windows])
    assert violation.max() < 1e-7
    assert violation.min() > 0.0  # it is measured
    assert windows[-1].memory - windows[6].memory < 0.5  # until then, what is kept about the line fills up
    settled = np.concatenate([w.force for w in windows[3:]])
    assert settled.min() > 0.0
    assert settled.mean() == pytest.approx(windows[-1].force.mean(), rel=0.05)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_a_lumped_pantograph_for_four_laps(soak):
    """Round ten spans at 300 km/h, a lap in six seconds: the third lap is the second within a newton, and so on."""
    pantograph = soak.at_speed(soak.load_pantograph("CX"), None)
    windows = list(soak.run(soak.system_of(soak.line(0.0, 10), pantograph), 24.0, 6.0))
    off = [float(soak.off(b.force, a.force)) for a, b in pairwise(windows)]
    assert off[0] > 100.0  # it is raised in the first
    assert off[1] < 1.0
    assert off[2] < 0.01
    assert windows[-1].memory - windows[1].memory < 1.0

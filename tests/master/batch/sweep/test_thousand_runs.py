"""Long counts: a thousand runs complete, and processes do not grow with them."""

import numpy as np
import pytest
from pythonfmu.builder import FmuBuilder
from scipy import stats

from tests.master.batch.sweep.conftest import journal
from tests.master.conftest import CATENARY, PANTOGRAPH

pytest.importorskip("distributed")

from master.batch.sweep.dask_engine import DaskEngine

pytestmark = pytest.mark.long
#: How far the memory of processes may lie apart, after their fiftieth run and after their last [MB].
GROWTH = 5.0
#: What the scripts of this project's FMUs end with: pythonfmu keeps the class that a script makes for every instance.
LASTING = """
import ctypes

ctypes.pythonapi.Py_IncRef(ctypes.py_object(globals()))
{name} = globals().setdefault("first", {name})
"""


@pytest.fixture
def lasting_toy(toy, tmp_path):
    """The toy scenario with FMUs that leave nothing in the process, as this project's do."""
    for name, source in (("ToyCatenary", CATENARY), ("ToyPantograph", PANTOGRAPH)):
        script = tmp_path / f"lasting_{name.lower()}.py"
        script.write_text(source + LASTING.format(name=name))
        FmuBuilder.build_FMU(script, dest=toy / "resources")


def test_a_thousand_runs_complete_and_no_process_grows(lasting_toy, swept, tmp_path):
    """Renewed as by default: what pythonfmu keeps of an instance, some 6 kB, would add up to 5.5 MB in 450 runs."""
    samples = {"vary": {"catenary.stiffness": "normal(5000, 100)"}, "samples": 1000}
    done = swept("out", DaskEngine(jobs=2), **samples)
    assert (len(done.rows), done.failures, done.status) == (1000, {}, "complete")
    runs = journal(tmp_path / "out")
    settled = []
    for worker in {run["worker"] for run in runs}:
        memory = [run["memory"] for run in runs if run["worker"] == worker]
        if len(memory) > 100:
            settled += [memory[49], memory[-1]]
    assert len(settled) >= 4
    assert max(settled) - min(settled) < GROWTH
    stiffness = [row["catenary.stiffness"] for row in done.rows]
    mean = sum(stiffness) / 1000
    assert abs(mean - 5000.0) < 2.576 * 100.0 / 1000**0.5


def test_the_published_indices_of_the_ishigami_function_by_workers(ishigami_swept):
    angles = {f"f.x{k}": "uniform(-3.141592653589793, 3.141592653589793)" for k in (1, 2, 3)}
    done = ishigami_swept("out", DaskEngine(jobs=2), vary=angles, samples=128, sensitivity="sobol")
    assert (len(done.rows), done.failures) == (640, {})
    (found,) = [i for i in done.sensitivity if i.figure == "f.y end"]
    published = {"first": (0.3139, 0.4424, 0.0), "total": (0.5576, 0.4424, 0.2437)}
    for kind, values in published.items():
        for value, (low, high) in zip(values, getattr(found, f"{kind}_interval"), strict=True):
            assert low <= value <= high
            assert high - low < 0.8


def test_a_normal_sample_comes_back_through_workers(swept):
    """99 % intervals of the mean and of the standard deviation, from the table of runs that workers made."""
    n, sd = 256, 100.0
    samples = {"vary": {"catenary.stiffness": f"normal(5000, {sd})"}, "samples": n, "seed": 11}
    values = np.array([row["catenary.stiffness"] for row in swept("out", DaskEngine(jobs=2), **samples).rows])
    assert abs(values.mean() - 5000.0) < 2.576 * sd / n**0.5
    low, high = stats.chi2.ppf([0.005, 0.995], n - 1)
    assert low < (n - 1) * values.var(ddof=1) / sd**2 < high

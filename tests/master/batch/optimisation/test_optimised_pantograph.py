"""Long counts: the head suspension of a pantograph on a line of the library, by workers; the same points as here."""

import pytest

from master.batch.optimisation.optimisation_goal import OptimisationRequest
from master.batch.optimisation.optimisation_page import page
from master.batch.optimisation.optimisation_session import PreparedOptimisation, optimise
from master.batch.sweep.sweep_engines import HereEngine
from master.scenario.open_scenario import open_scenario
from master.scenario.overrides import Overrides

pytest.importorskip("distributed")

from master.batch.sweep.dask_engine import DaskEngine

pytestmark = pytest.mark.long


def test_a_head_suspension_is_found_that_has_less_sigma_at_the_same_mean(tmp_path):
    asked = {"minimise": "sigma", "vary": {"pantograph.stage[3].stiffness": "2:20 kN/m"}, "max_runs": 9}
    with open_scenario("cx_ln2", Overrides()) as found:
        request = OptimisationRequest.read({**asked, "subject_to": ["mean=157.5 N"]})
        done = optimise(PreparedOptimisation.of(found.system, request), tmp_path, page, DaskEngine(jobs=2))
    assert (len(done.runs), done.failures) == (9, {})
    assert done.improvement > 0.0
    assert all(row["mean [N]"] == pytest.approx(157.5, abs=0.2) for row in done.rows)


def test_workers_try_the_same_points(optimised, tmp_path):
    optimised("here", HereEngine(), max_runs=20)
    optimised("two", DaskEngine(jobs=2), max_runs=20)
    assert (tmp_path / "two" / "optimise.csv").read_bytes() == (tmp_path / "here" / "optimise.csv").read_bytes()

"""Sensitivity indices: known ones are found, blocks with failed runs are left out, and what cannot be is a sentence."""

import builtins
import csv
import json
import math

import numpy as np
import pytest

from master.batch.sweep.distributions import Distribution
from master.batch.sweep.sweep_plan import SweepRequest, make_plan
from master.batch.sweep.swept_parameter import SweptParameter
from master.errors import MasterError, RequestError

salib = pytest.importorskip("SALib")

from master.batch.sweep.sensitivity import block_size, designed, indices_of  # noqa: E402 (it needs SALib)

#: Of the Ishigami function with a = 7, b = 0.1 (Ishigami and Homma 1990): first-order and total indices.
FIRST, TOTAL = (0.3139, 0.4424, 0.0), (0.5576, 0.4424, 0.2437)
ANGLES = {f"f.x{k}": "uniform(-3.141592653589793, 3.141592653589793)" for k in (1, 2, 3)}


def _uniform(low=0.0, high=1.0):
    return Distribution(SweptParameter("a", ("c.a",), ""), "uniform", (low, high))


def _normal(mean, sd):
    return Distribution(SweptParameter("a", ("c.a",), ""), "normal", (mean, sd))


def within(found, first=FIRST, total=TOTAL):
    """The published values that are not inside the intervals."""
    pairs = [*zip(first, found.first_interval, strict=True), *zip(total, found.total_interval, strict=True)]
    return [(value, interval) for value, interval in pairs if not interval[0] <= value <= interval[1]]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_indices_of_the_ishigami_function(seed):
    x = designed([_uniform(-math.pi, math.pi)] * 3, 1024, seed, "sobol")
    y = np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])
    found = indices_of("sobol", ["x1", "x2", "x3"], "y", "1", y, seed)
    assert within(found) == []
    assert max(high - low for low, high in (*found.first_interval, *found.total_interval)) < 0.3
    assert found.first == pytest.approx(FIRST, abs=0.06)
    assert found.total == pytest.approx(TOTAL, abs=0.06)
    assert (found.blocks, found.left_out) == (1024, 0)


def test_sobol_indices_are_shares_of_variance_whatever_the_distribution():
    """Of a sum of independent parameters each explains its own variance, alone."""
    x = designed([_normal(5.0, 2.0), _uniform(0.0, 12.0**0.5)], 1024, 4, "sobol")
    found = indices_of("sobol", ["a", "b"], "sum", "N", 100.0 + x.sum(axis=1), 4)
    assert found.first == pytest.approx((0.8, 0.2), abs=0.03)
    assert found.total == pytest.approx((0.8, 0.2), abs=0.03)


def test_elementary_effects_are_those_of_salib():
    from SALib.analyze import morris

    x = designed([_uniform()] * 3, 12, 5, "morris")
    y = 3.0 * x[:, 0] - 2.0 * x[:, 1] + 5.0 * x[:, 0] * x[:, 1]
    found = indices_of("morris", ["a", "b", "c"], "y", "N", y, 5)
    problem = {"num_vars": 3, "names": ["a", "b", "c"], "bounds": [[0.0, 1.0]] * 3}
    theirs = morris.analyze(problem, x, y, num_resamples=1000, seed=1)
    assert found.first == pytest.approx(tuple(theirs["mu_star"]), rel=1e-12)
    assert found.total == pytest.approx(tuple(theirs["sigma"]), rel=1e-12)
    halves = [0.5 * (high - low) for low, high in found.first_interval]
    assert halves == pytest.approx(list(theirs["mu_star_conf"]), rel=0.15)
    for value, (low, high) in zip(found.total, found.total_interval, strict=True):
        assert low <= value <= high * (1.0 + 1e-12)


def test_the_effect_of_a_straight_line_is_its_rise_over_the_range():
    x = designed([_uniform(10.0, 14.0), _uniform(0.0, 1.0)], 6, 1, "morris")
    found = indices_of("morris", ["a", "b"], "y", "N", 3.0 * x[:, 0], 1)
    assert found.first == pytest.approx((12.0, 0.0))
    assert found.total == pytest.approx((0.0, 0.0), abs=1e-9)


def test_trajectories_stay_in_the_central_part_of_what_has_no_bounds():
    x = designed([_normal(0.0, 1.0), _uniform(0.0, 1.0)], 20, 1, "morris")
    assert np.abs(x[:, 0]).max() == pytest.approx(1.959964, abs=1e-6)
    assert sorted(set(np.round(x[:, 1], 9))) == pytest.approx([0.0, 1 / 3, 2 / 3, 1.0])


@pytest.mark.parametrize(("method", "count"), [("sobol", 256), ("morris", 24)])
def test_a_block_with_a_failed_run_is_left_out(method, count):
    parts = [_uniform(-math.pi, math.pi)] * 3
    x = designed(parts, count, 1, method)
    y = np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2
    size = block_size(method, 3)
    y[[0, 1, 5 * size + 2]] = np.nan  # two blocks
    found = indices_of(method, ["x1", "x2", "x3"], "y", "1", y, 1)
    assert (found.blocks, found.left_out) == (count - 2, 2)
    assert found.total[2] == pytest.approx(0.0, abs=1e-12)
    assert found.total[1] > 0.3


def test_what_does_not_vary_has_no_indices():
    assert indices_of("sobol", ["a"], "y", "N", np.full(3 * 16, 5.0), 1) is None
    assert indices_of("sobol", ["a"], "y", "N", np.full(3 * 16, np.nan), 1) is None


def test_a_sweep_writes_the_indices_of_every_figure(ishigami_swept, tmp_path):
    told = []
    vary = {**ANGLES, "f.idle": "normal(0, 1)"}
    done = ishigami_swept(tell=told.append, vary=vary, samples=4, sensitivity="morris", seed=3)
    assert len(done.runs) == 20
    assert told[0] == "sensitivity: 4 Morris trajectories of 4 + 1 runs make 20 runs"
    rows = list(csv.DictReader((tmp_path / "out" / "sensitivity.csv").open()))
    assert {row["figure"] for row in rows} == {"f.y end", "f.y minimum", "f.y maximum", "f.y mean"}
    assert [row["parameter"] for row in rows[:4]] == list(vary)
    by_name = {row["parameter"]: float(row["first"]) for row in rows if row["figure"] == "f.y end"}
    assert by_name["f.idle"] == 0.0
    assert min(by_name[name] for name in ANGLES) > 1.0
    data = json.loads((tmp_path / "out" / "sensitivity.json").read_text())
    assert data["indices"][0]["first"][0] == by_name["f.x1"]
    points = "".join(f"{','.join(map(repr, point))}\n" for point in done.plan.points)
    (tmp_path / "t.csv").write_text(f"{','.join(vary)}\n{points}")
    ishigami_swept(table=tmp_path / "t.csv")  # the same runs, asked for without a design
    assert not (tmp_path / "out" / "sensitivity.csv").exists()


def test_failed_runs_are_told_and_their_blocks_counted(ishigami_swept):
    told = []
    vary = {"f.x1": "uniform(0, 1)", "f.fail_above": "uniform(0.7, 2)"}
    done = ishigami_swept(tell=told.append, vary=vary, samples=8, sensitivity="sobol")
    failed = len(done.failures)
    assert failed
    blocks = {(number - 1) // 4 for number in done.failures}
    assert done.sensitivity[0].left_out == len(blocks)
    text = f"sensitivity: {len(blocks)} of 8 blocks are left out, since {failed} runs failed or a figure is missing"
    assert told[-1] == text


@pytest.mark.parametrize(
    ("request_", "said"),
    [
        ({}, "--sensitivity needs --vary"),
        ({"vary": {"speed": "normal(50, 1)"}}, "samples need --samples"),
        ({"vary": {"speed": "normal(50, 1)"}, "samples": 4, "over": {"stop": "1,2"}}, "leave out --over"),
        ({"vary": {"speed": "normal(50, 1)"}, "samples": 4, "method": "lhs"}, "leave out --method"),
        ({"vary": {"speed": "normal(50, 1)"}, "samples": 100}, "take 128"),
        ({"vary": {"speed": "normal(50, 1)"}, "samples": 65536}, "that makes 196608 runs"),
    ],
)
def test_what_cannot_be_is_one_sentence(toy_system, request_, said):
    with pytest.raises(RequestError) as caught:
        make_plan(toy_system, SweepRequest.read({"sensitivity": "sobol", **request_}))
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_without_salib_it_says_what_to_install(toy_system, monkeypatch):
    true_import = builtins.__import__

    def without(name, *args, **kwargs):
        if name.startswith("SALib"):
            raise ImportError(name)
        return true_import(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", without)
    request = {"vary": {"speed": "normal(50, 1)"}, "samples": 4, "sensitivity": "sobol"}
    with pytest.raises(MasterError, match=r"need SALib: pip install 'openpanto\[scale\]'"):
        make_plan(toy_system, SweepRequest.read(request))

"""Verdicts: what passes, what is near, what fails and what is only reported."""

import math

import pytest

from master.batch.verification.case import Row
from master.batch.verification.judgement import Bounds, decide, judge_row, reference_text
from master.batch.verification.quantities import QUANTITIES, Measured
from master.errors import MasterError


def _row(quantity="sigma", **values):
    return Row.model_validate({"quantity": quantity, "source": "here", **values})


def _verdict(row, *values, others=None):
    judged = decide(row, QUANTITIES[row.quantity], Measured(values), others or {})
    return judged.verdict, judged.deviation


@pytest.mark.parametrize(
    ("value", "verdict", "deviation"),
    [
        (26.0, "passed", None),
        (31.0, "passed", None),
        (31.5, "near", 100 * 0.5 / 31),
        (31.62, "near", 2.0),
        (31.63, "failed", 100 * 0.63 / 31),
        (25.48, "near", -2.0),
        (25.47, "failed", -100 * 0.53 / 26),
        (math.nan, "failed", None),
    ],
)
def test_a_range_allows_a_share_of_its_nearer_limit(value, verdict, deviation):
    found, off = _verdict(_row(range=[26, 31], tolerance_percent=2), value)
    assert found == verdict
    assert off == (deviation if deviation is None else pytest.approx(deviation))


def test_the_share_is_of_the_limit_not_of_the_value_even_where_limits_have_signs():
    row = _row("statistical_minimum", range=[-5, 20], tolerance_percent=2)
    assert _verdict(row, -5.09)[0] == "near"
    assert _verdict(row, -5.11)[0] == "failed"
    assert _verdict(row, 20.39)[0] == "near"
    assert _verdict(row, 20.41)[0] == "failed"


def test_a_limit_of_zero_allows_nothing():
    row = _row("loss", maximum=0, tolerance_percent=50)
    assert _verdict(row, 0.0) == ("passed", None)
    assert _verdict(row, 0.01) == ("failed", None)


@pytest.mark.parametrize(
    ("value", "verdict"), [(157.0, "passed"), (158.0, "passed"), (158.1, "failed"), (156.9, "failed")]
)
def test_a_value_with_an_absolute_tolerance(value, verdict):
    assert _verdict(_row("mean", value=157.5, tolerance=0.5), value)[0] == verdict


def test_a_value_with_a_relative_tolerance_says_how_far_off_it_is():
    row = _row(value=40, tolerance_percent=8)
    assert _verdict(row, 36.8) == ("passed", pytest.approx(-8.0))
    assert _verdict(row, 36.7)[0] == "failed"


def test_the_worst_of_several_counts():
    row = _row("uplift_at", at=[1, 2, 3], value=[10, 20, 30], tolerance_percent=10)
    assert _verdict(row, 10.5, 20.0, 30.0) == ("passed", pytest.approx(5.0))
    assert _verdict(row, 10.5, 17.0, 30.0) == ("failed", pytest.approx(-15.0))
    judged = decide(row, QUANTITIES["uplift_at"], Measured((10.5, 17.0, 30.0), ("1 m", "2 m", "3 m")), {})
    assert "worst at 2 m" in judged.remark


@pytest.mark.parametrize("kind", ["report", "must hold", "indicative"])
def test_outside_its_band_a_row_fails_of_whatever_kind(kind):
    row = _row(value=38.9, tolerance_percent=8, band=[33, 40], kind=kind)
    inside, beside = ("agrees", "departs") if kind == "report" else ("passed", "failed")
    assert [_verdict(row, v)[0] for v in (38.0, 34.0, 33.0)] == [inside, beside, beside]
    assert [_verdict(row, v)[0] for v in (32.9, 40.1, 41.0, math.nan)] == ["failed"] * 4
    stated = decide(row, QUANTITIES["sigma"], Measured((41.0,)), {}).remark
    assert stated == "outside the band: untuned readings span 33 to 40 N"
    assert decide(row, QUANTITIES["sigma"], Measured((38.0,)), {}).remark == "untuned readings span 33 to 40 N"


def test_reported_rows_never_fail():
    row = _row("slack_share", within=5, minimum=100, kind="report")
    assert _verdict(row, 100.0)[0] == "agrees"
    assert _verdict(row, 40.0)[0] == "departs"
    near = _row(range=[1, 2], tolerance_percent=50, kind="report")
    assert _verdict(near, 2.5)[0] == "departs"


def test_indicative_rows_do_fail():
    row = _row("uplift_at", at=[1], value=45, tolerance_percent=15, kind="indicative")
    assert _verdict(row, 52.0)[0] == "failed"


def test_verdicts_of_a_run():
    row = _row("en50367", **{"is": True})
    assert _verdict(row, 1.0)[0] == "passed"
    assert _verdict(row, 0.0)[0] == "failed"


def test_below_and_above_mean_all_others_strictly():
    lowest = _row(below=["a", "b"])
    others = {"a": 36.0, "b": 35.0}
    assert _verdict(lowest, 34.9, others=others)[0] == "passed"
    assert _verdict(lowest, 35.0, others=others)[0] == "failed"
    assert _verdict(lowest, 35.5, others=others)[0] == "failed"
    highest = _row("minimum", above=["a", "b"])
    assert _verdict(highest, 36.1, others=others)[0] == "passed"
    assert _verdict(highest, 35.5, others=others)[0] == "failed"


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"value": 157.5, "tolerance": 0.5}, "157.5 \u00b10.5 N"),
        ({"value": 38.9, "tolerance_percent": 8}, "38.9 N \u00b18 %"),
        ({"range": [-5, 20], "tolerance_percent": 2}, "-5 to 20 N, \u00b12 %"),
        ({"range": [26, 31]}, "26 to 31 N"),
        ({"maximum": 0}, "at most 0 N"),
        ({"minimum": 3}, "at least 3 N"),
        ({"below": ["a", "b"]}, "below a, b"),
    ],
)
def test_references_as_printed(values, text):
    assert reference_text(_row(**values), QUANTITIES["sigma"]) == text


def test_a_run_that_failed_fails_its_rows_and_says_why():
    def broken(name):
        raise MasterError(f"run '{name}' failed")

    judged = judge_row(_row(run="main", maximum=1), broken)
    assert judged.fails
    assert judged.remark == "run 'main' failed"
    reported = judge_row(_row(run="main", maximum=1, kind="report"), broken)
    assert not reported.fails


def test_rounding_does_not_decide():
    assert Bounds(-math.inf, 0.3).place(0.1 + 0.2) == "inside"


def test_a_row_tells_its_band_that_it_is_recalled_and_what_other_filters_give():
    row = _row(value=38.9, tolerance=1, band=(33, 46), recalled=True)
    measured = Measured((38.0,), others=(("fft 20 Hz", 37.5),))
    remark = decide(row, QUANTITIES["sigma"], measured, {}).remark
    said = "reference recalled, not read; untuned readings span 33 to 46 N; with other filters 37.5 (fft 20 Hz)"
    assert remark == said
    plain = _row(value=38.9, tolerance=1)
    assert decide(plain, QUANTITIES["sigma"], measured, {}).remark == ""
    stated = Measured((38.0,), others=(("fft 20 Hz", 30.0),), depends_on_filter=True)
    assert decide(plain, QUANTITIES["sigma"], stated, {}).remark == "with other filters 30.0 (fft 20 Hz)"

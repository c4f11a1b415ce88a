"""Limits by supply system and speed, at their limits, and where the filter decides."""

import dataclasses
import io

import numpy as np
import pytest
from rich.console import Console

from master.evaluation.contact_assessment import Assessment
from master.evaluation.contact_quality import Filtered, assess
from master.evaluation.en50367_limits import LimitChoice, OwnLimits, judge, limits_at
from master.evaluation.filters import DEFAULT
from master.report.result_tables import verdict_table
from master.system.contacts import Contact

STEP = 1e-3
TIME = np.arange(8001) * STEP


def quality(mean, spread=20.0, speed=300.0):
    """Figures of a sine of 2 Hz about a mean."""
    v = speed / 3.6
    return assess(mean + spread * np.sin(4 * np.pi * TIME), v * TIME, STEP, DEFAULT, (v, 7.0 * v), 5.0 + 0.0 * TIME)


def row(found, name):
    return next(c for c in found if c.name == name)


@pytest.mark.parametrize(
    ("supply", "speed", "lower", "upper", "most", "nq"),
    [
        ("AC", 160, 72.03, 102.03, 300, 0.1),
        ("AC", 200, 78.8, 108.8, 300, 0.1),
        ("AC", 250, 89.375, 130.625, 350, 0.1),
        ("AC", 300, 102.3, 157.3, 350, 0.2),
        ("DC3", 160, 84.576, 134.832, 300, 0.2),
        ("DC3", 250, 120.0, 170.625, 400, 0.2),
        ("DC1.5", 160, 98.672, 164.832, 300, 0.2),
        ("DC1.5", 250, 140.0, 232.5, 400, 0.2),
    ],
)
def test_limits_by_supply_system_and_speed(supply, speed, lower, upper, most, nq):
    """Worked out by hand from the formulas of the specification, v in km/h."""
    found = limits_at(speed / 3.6, LimitChoice(supply))
    assert found.mean_lower.value == pytest.approx(lower, abs=5e-3)
    assert found.mean_upper.value == pytest.approx(upper, abs=5e-3)
    assert (found.maximum.value, found.nq.value) == (most, nq)
    assert (found.sigma_share.value, found.uplift.value, found.height_range.value) == (0.3, 0.120, 0.080)


@pytest.mark.parametrize("digits", [-1e-9, 1e-9])
def test_a_speed_at_which_limits_change_does_not_depend_on_rounding(digits):
    assert limits_at(200 / 3.6 + digits, LimitChoice()).maximum.value == 300.0
    assert limits_at(250 / 3.6 + digits, LimitChoice()).nq.value == 0.1


@pytest.mark.parametrize(
    ("mean", "word"),
    [(102.0, "failed"), (102.6, "passed"), (140.0, "passed"), (157.2, "passed"), (157.5, "at the limit"),
     (157.79, "at the limit"), (157.9, "failed"), (170.0, "failed")],
)  # fmt: skip
def test_the_mean_lies_between_two_limits(mean, word):
    found = row(judge(quality(mean), LimitChoice()), "mean force")
    assert (found.word, found.passed) == (word, word != "failed")
    assert found.limit == "102.3 to 157.3 N"


def test_the_longest_words_fit_into_80_columns():
    figures = quality(157.5)
    found = Assessment(Contact(1, "line", "train", "line.contact"), figures, judge(figures, LimitChoice(), [0.05]))
    console = Console(width=80, file=io.StringIO())
    console.print(verdict_table(found, LimitChoice()))
    assert "at the limit" in console.file.getvalue()
    assert "\N{HORIZONTAL ELLIPSIS}" not in console.file.getvalue()


def test_a_pair_that_fails_under_ac_may_pass_under_dc():
    figures = quality(200.0)
    assert not row(judge(figures, LimitChoice("AC")), "mean force").passed
    assert row(judge(figures, LimitChoice("DC1.5")), "mean force").passed
    assert LimitChoice("DC1.5").title == "EN 50367, DC 1.5 kV"


def test_own_limits_take_the_place_of_the_standards_and_are_strict():
    choice = LimitChoice("AC", OwnLimits(mean_upper=150.0, maximum=170.0, uplift=0.08))
    found = judge(quality(150.2), choice, [0.09])
    assert [c.name for c in found if not c.passed] == ["mean force", "maximum force", "uplift at supports"]
    assert row(found, "mean force").origin == "own, recalled"
    assert row(found, "uplift at supports").limit == "<= 80 mm"
    assert row(found, "uplift at supports").origin == "own"
    assert choice.title == "EN 50367, AC and own limits"


def test_every_limit_says_where_it_comes_from_and_only_sigma_was_read():
    found = judge(quality(150.0), LimitChoice(), [0.05])
    assert all(c.source for c in found)
    assert {c.name for c in found if c.origin == "read"} == {"sigma / mean"}
    assert {c.origin for c in found} == {"recalled", "read"}


def test_a_verdict_that_another_filter_would_turn_says_so():
    base = quality(150.0)
    other = Filtered("fft 20 Hz", base.mean, base.sigma, base.minimum, 352.0)
    near = dataclasses.replace(base, maximum=349.0, others=(other,))
    found = row(judge(near, LimitChoice()), "maximum force")
    assert found.passed
    assert found.remark == "the filter decides: failed at 352.0 N with fft 20 Hz"
    turned = dataclasses.replace(base, maximum=352.0, others=(dataclasses.replace(other, maximum=349.0),))
    assert row(judge(turned, LimitChoice()), "maximum force").remark.startswith("the filter decides: passed at 349.0 N")
    both = dataclasses.replace(base, maximum=352.0, others=(dataclasses.replace(other, maximum=353.0),))
    assert row(judge(both, LimitChoice()), "maximum force").remark == ""
    far = dataclasses.replace(base, maximum=300.0, others=(dataclasses.replace(other, maximum=310.0),))
    assert row(judge(far, LimitChoice()), "maximum force").remark == ""


def test_extremes_that_another_filter_moves_by_more_than_five_percent_are_told():
    """An impact of 30 ms: the wall rings, the smooth filter hardly does."""
    force = 150.0 + 400.0 * np.exp(-(((TIME - 4.0) / 0.01) ** 2))
    figures = assess(force, 80.0 * TIME, STEP, DEFAULT, (80.0, 560.0))
    assert {f.filter for f in figures.filter_dependent} == {f.short for f in DEFAULT.others}
    assert quality(150.0).filter_dependent == ()
    assert len(quality(150.0).others) == 2

"""What a verdict does not rest on is said: a part of a run, the raising, limits that nothing was held to."""

import dataclasses
import io
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from master.batch.study.family import Family, Interval, Settings, Variant
from master.batch.study.study_outcome import StudyOutcome, VariantResult, as_data
from master.batch.study.study_table import figures_table
from master.evaluation.interval_coverage import shortfall
from master.recording.recording import Recording
from master.report.comparison_page import comparison_page
from master.report.run_page import page
from master.results import run_difference, run_summary
from master.results.run_results import Results
from master.system.contacts import Contact

CONTACT = Contact(1, "catenary", "pantograph", "catenary.pantograph[1].contact")
PLACES = (50.0, 100.0, 150.0)


def made(status="complete", interval=(90.0, 160.0), mean=140.0, uplift=True, height=True, **settings):
    """A force of 1 Hz at 180 km/h, in contact from 10 m on, with three supports."""
    time = np.arange(4001) * 1e-3
    x = 50.0 * time
    force = np.where(x < 10.0, 0.0, mean + 20.0 * np.sin(2 * np.pi * time))
    names = [CONTACT.force, CONTACT.point("x"), *([CONTACT.point("z")] if height else [])]
    columns = [force, x, *([5.0 + 1e-4 * force] if height else [])]
    if uplift:
        names += [f"catenary.support[{i}].uplift" for i in (1, 2, 3)]
        columns += [0.05 * np.exp(-(((x - place) / 5.0) ** 2)) for place in PLACES]
    run = Recording(time, tuple(names), ("N",) + ("m",) * (len(names) - 1), np.column_stack(columns))
    known = {f"support[{i}].{axis}": v for i, p in enumerate(PLACES, 1) for axis, v in (("x", p), ("y", 0.2))}
    settings = {"start": 0.0, "interval": dict(zip(("start", "end"), interval, strict=True)), **settings}
    summary = {"status": status, "contacts": [dataclasses.asdict(CONTACT)], "settings": settings}
    return Results(Path("made_up"), summary, (run,), {"catenary": known})


LIMITS = {"limits": {"supply": "AC", "mean_upper": 200.0, "mean_lower": 50.0}}


@pytest.mark.parametrize("status", ["failed", "interrupted", "incomplete", "running"])
def test_a_run_that_is_not_complete_has_figures_and_no_verdict(status):
    done = made(status, **LIMITS)
    (found,) = done.assessments()
    assert found.quality.mean == pytest.approx(140.0, abs=5.0)
    assert "figures so far" in found.withheld
    (data,) = run_summary.figures(done)["quality"]
    assert (data["passed"], data["criteria"]) == (None, [])
    assert made(**LIMITS).assessments()[0].passed


def test_limits_that_nothing_was_held_to_are_named():
    whole, bare = (made(uplift=known, height=known, **LIMITS) for known in (True, False))
    assert whole.assessments()[0].warnings == ()
    (found,) = bare.assessments()
    assert found.passed
    assert found.unchecked.startswith("not checked: uplift at supports, because no support")
    assert "contact height range, because the height" in found.unchecked
    assert run_summary.figures(bare)["quality"][0]["unchecked"] == found.unchecked
    assert found.unchecked in page(bare)
    between = made(interval=(110.0, 140.0), **LIMITS).assessments()[0]
    assert "uplift at supports" in between.unchecked
    assert "height" not in between.unchecked


@pytest.mark.parametrize(("first", "is_early"), [(30.0, True), (59.0, True), (61.0, False), (None, False)])
def test_an_interval_that_takes_in_the_raising_is_warned_of(first, is_early):
    """Contact is made at 10 m, and has settled a second later, at 60 m."""
    (found,) = made(interval=(first, 160.0)).assessments()
    assert bool(found.early) == is_early
    if is_early:
        assert "the interval begin at 60 m or later" in found.early
        assert found.early in page(made(interval=(first, 160.0)))


def test_a_record_that_goes_on_with_a_run_has_no_raising():
    done = made(interval=(65.0, 160.0))
    rows = slice(1300, None)
    later = Recording(done.recordings[0].time[rows], done.recordings[0].names, done.recordings[0].units,
                      done.recordings[0].values[rows])  # fmt: skip
    assert dataclasses.replace(done, recordings=(later,)).assessments()[0].early == ""


def test_a_badge_says_what_is_only_at_its_limit():
    """The upper limit is that of AC at 180 km/h, 0.00047 v^2 + 90 = 105.2 N."""
    at, below = made(mean=105.0), made(mean=104.0)
    least = 105.228 - at.assessments()[0].quality.mean
    at, below = made(mean=105.0 + least + 0.2), made(mean=105.0 + least - 0.2)
    assert "passed, at the limit: mean force</span>" in page(at)
    assert "at the limit:" not in page(below)


def test_one_jump_of_a_position_does_not_stretch_the_end_of_an_interval():
    """A foreign pantograph whose first output is 0 m, 250 m off; it stops 40 m before the interval's end."""
    x = np.concatenate(([0.0], np.linspace(250.0, 760.0, 6000)))
    run = Recording(np.arange(6001) * 1e-3, (CONTACT.force, CONTACT.point("x")), ("N", "m"),
                    np.column_stack((np.ones(6001), x)))  # fmt: skip
    assert "at 760 m, before the end" in shortfall(run, [CONTACT], (551.0, 800.0))
    assert shortfall(run, [CONTACT], (551.0, 759.0)) == ""


def test_runs_that_are_evaluated_differently_are_not_compared_without_a_word():
    one, same = made(**LIMITS), made(**LIMITS)
    assert run_difference.setting_notes([one, same]) == ()
    elsewhere, otherwise = made(interval=(60.0, 160.0), **LIMITS), made(limits={"supply": "DC3"})
    (interval,) = run_difference.setting_notes([one, elsewhere])
    assert "90 m to 160 m" in interval
    assert "60 m to 160 m" in interval
    (limits,) = run_difference.setting_notes([one, otherwise])
    assert "EN 50367, DC 3 kV" in limits
    assert "the intervals of interest differ" in comparison_page([one, elsewhere])


@pytest.mark.parametrize(("statuses", "said"), [
    (("complete",), "all pass"), (("interrupted",), "none is judged"), (("complete", "interrupted"), "all others pass"),
])  # fmt: skip
def test_a_study_does_not_pass_what_it_has_not_judged(statuses, said):
    interval = Interval(name="i", start=90.0, end=160.0)
    variants = tuple(Variant(name=status, values={}) for status in statuses)
    done = tuple(VariantResult(status, made(status, **LIMITS)) for status in statuses)
    family = Family(name="f", folder=Path("f"), settings=Settings(title="t", interval=(interval,)), variants=variants)
    outcome = StudyOutcome(family, done, date="today", versions={}, status="complete")
    console = Console(width=120, file=io.StringIO())
    console.print(figures_table(interval, outcome.entries(interval), outcome))
    text = " ".join(console.file.getvalue().split())
    assert f": {said}" in text
    assert ("not judged: interrupted, pantograph" in text) == ("interrupted" in statuses)
    assert [bool(f["withheld"]) for f in as_data(outcome)["figures"]] == [s != "complete" for s in statuses]


def test_forces_at_equal_times_and_other_places_are_not_called_the_same():
    one = made(**LIMITS)
    moved, later = made(**LIMITS), made(**LIMITS)
    moved.recordings[0].values[:, 1] += 5.0
    (found,) = run_difference.compare(one, moved)
    assert found.apart == pytest.approx(5.0)
    assert "up to 5 m apart" in found.sentence
    assert "apart" not in run_difference.compare(one, made(**LIMITS))[0].sentence
    late = later.recordings[0]
    shifted = Recording(late.time + 10.0, late.names, late.units, late.values)
    (none,) = run_difference.compare(one, dataclasses.replace(later, recordings=(shifted,)))
    assert none.rms is None
    assert "no time in common" in none.sentence

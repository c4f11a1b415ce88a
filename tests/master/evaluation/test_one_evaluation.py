"""One filter, one interval, one set of figures: in tables, files, studies, verifications and older results."""

import csv
import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from master.batch.study.family import Interval
from master.batch.study.study_evaluation import entries
from master.batch.verification.quantities import QUANTITIES, Choice
from master.commands.main import main
from master.errors import MasterError
from master.evaluation.contact_assessment import assess_contacts
from master.evaluation.contact_quality import figures_of
from master.evaluation.contact_signals import EvaluationSettings, contact_signals
from master.evaluation.filters import BEFORE_CHOICE, DEFAULT, SETTLING, ForceFilter
from master.recording.recording import Recording, load
from master.report.charts.line_charts import interval_band
from master.report.result_tables import figure_rows
from master.results import results_folder, run_difference, run_results
from master.results.run_results import Results
from master.run_session import run
from master.scenario.open_scenario import open_scenario
from master.scenario.overrides import Overrides
from master.system.contacts import Contact
from models.catenary.line_model import CatenaryModel
from models.commands.couple_command import Evaluated, write_timeseries
from models.commands.physics_main import main as physics
from models.coupled.monolithic import CoupledModel
from models.library.catalogue import load_line, load_lumped

ROOT = Path(__file__).parents[3]
CONTACT = Contact(1, "catenary", "pantograph", "catenary.pantograph[1].contact")


def go(toy, folder, text, **overrides):
    (toy / "SystemStructure.ssd").write_text(text)
    with open_scenario(toy, Overrides(**overrides), build=False) as scenario:
        return run(scenario.system, folder)


def statistics(folder, name=CONTACT.prefix):
    """What a user makes of the results file, without this package."""
    with (folder / results_folder.FORCES).open(newline="") as file:
        rows = list(csv.DictReader(file))
    force = np.array([float(r[f"{name}.filtered_force [N]"]) for r in rows if r[f"{name}.in_interval"] == "1"])
    return {"mean": force.mean(), "sigma": force.std(), "maximum": force.max(), "minimum": force.min()}


@pytest.mark.parametrize("kind", ["", '<panto:Filter kind="fft"/>', '<panto:Filter phase="causal" cutoff="15"/>'])
def test_a_users_own_statistics_of_the_force_file_are_the_figures(toy, toy_text, tmp_path, kind):
    done = go(toy, tmp_path / "out", toy_text(f'<panto:Interval start="20" end="45"/>{kind}'))
    reported = json.loads((done.folder / "summary.json").read_text())["quality"][0]
    found = statistics(done.folder)
    assert {name: reported[name] for name in found} == found  # to the last bit
    (done.folder / results_folder.FORCES).unlink()
    assert main(["report", str(done.folder)]) == 0
    assert statistics(done.folder) == found


def test_the_filter_is_in_the_summary_and_changes_the_figures(toy, toy_text, tmp_path):
    interval = '<panto:Interval start="20" end="45"/>'
    given = ("", '<panto:Filter cutoff="3"/>', '<panto:Filter kind="fft"/>')
    runs = [go(toy, tmp_path / str(i), toy_text(f"{interval}{text}")) for i, text in enumerate(given)]
    read = [run_results.read(r.folder) for r in runs]
    assert [r.evaluation.filter for r in read] == [DEFAULT, ForceFilter(cutoff=3.0), ForceFilter("fft")]
    assert [r.summary["filter"] for r in read] == [r.evaluation.filter.sentence for r in read]
    assert len({r.summary["quality"][0]["sigma"] for r in read}) == 3


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('<panto:Filter kind="bessel"/>', "Filter kind"),
        ('<panto:Filter order="0"/>', "Filter order"),
        ('<panto:Filter cutoff="-1"/>', "Filter cutoff"),
        ('<panto:Filter kind="fft" order="6"/>', "the filter fft has no order"),
        ('<panto:Filter kind="fft" phase="causal"/>', "the filter fft has no phase"),
        ('<panto:Filter/><panto:Filter kind="fft"/>', "Filter is given 2 times"),
        ('<panto:Filter cutoff="500"/>', "is not below half the sampling frequency, 500 Hz"),
        ('<panto:Limits supply="3kV"/>', "Limits supply"),
        ('<panto:Limits maximum="0"/>', "Limits maximum"),
        ('<panto:Limits meanUpper="100" meanLower="120"/>', "must lie below"),
        ('<panto:Limits sigmaShare="30"/>', "Limits sigmaShare: Input should be less than or equal to 1"),
        ('<panto:Limits uplift="120"/>', "Limits uplift"),  # m, not mm
    ],
)
def test_mistakes_in_filter_and_limits_are_told(toy, toy_text, capsys, text, said):
    (toy / "SystemStructure.ssd").write_text(toy_text(text))
    assert main(["validate", str(toy), "--no-build"]) == 1
    assert said in " ".join(capsys.readouterr().err.split())


def test_the_terminal_says_filter_limits_and_target(toy, toy_text, in_folder, capsys):
    text = '<panto:Interval start="20" end="45"/><panto:Limits supply="DC3" maximum="170"/>'
    calibration = '<panto:Calibration parameter="pantograph.static_force" meanForce="150"/>'
    (toy / "SystemStructure.ssd").write_text(toy_text(text + calibration))
    assert main([str(toy), "--no-build", "--no-report"]) == 0
    out = capsys.readouterr().out
    for words in (DEFAULT.short, "DC 3 kV and own limits", "< 170 N", "recalled", "own", "whole run: largest"):
        assert words in out
    assert "target of the calibration (no limit): mean force 150 N; it is" in out


def test_without_an_interval_figures_begin_after_the_raising(toy, toy_text, tmp_path):
    done = go(toy, tmp_path / "out", toy_text("", stop="2.5"))
    (signals,) = done.signals
    first = int(np.argmax(signals.raw > 0.0))
    begin = signals.time[signals.inside][0]
    assert begin == pytest.approx(signals.time[first] + SETTLING, abs=1.5e-3)
    quality = done.assessments()[0].quality
    assert (quality.start, quality.end) == pytest.approx((50.0 * begin, 125.0), abs=0.1)
    (band,) = interval_band(done, (0.0, 125.0))  # drawn as it was evaluated
    assert (band.start, band.end) == pytest.approx((quality.start, quality.end))


def made_up(bump=0.05, where=(50.0, 100.0, 150.0), moment=0.3, slack=None):
    """A run at 50 m/s over 4 s; support 1 rises most while the strip is raised, before the interval of 90 to 160 m."""
    time = np.arange(4001) * 1e-3
    x, force = 50.0 * time, 150.0 + 20.0 * np.sin(2 * np.pi * 2.0 * time)
    fast = Recording(time, (CONTACT.force, CONTACT.point("x")), ("N", "m"), np.column_stack((force, x)))
    heights = (0.09, bump, 0.03)
    rises = [h * np.exp(-(((time - t) / 0.1) ** 2)) for h, t in zip(heights, (moment, 1.5, 3.6), strict=True)]
    dropper = np.where(np.abs(time - 2.4) < 0.05, 0.0, 60.0)
    names = [f"catenary.support[{i}].uplift" for i in (1, 2, 3)] + ["catenary.dropper[1].force"]
    slow = Recording(time[::5], tuple(names), ("m", "m", "m", "N"), np.column_stack((*rises, dropper))[::5])
    if slack is not None:
        reported = np.where(np.abs(time - slack) < 0.05, 1.0, 0.0)[::5, None]
        names, units = (*names, "catenary.dropper[1].slack"), ("m", "m", "m", "N", "1")
        slow = Recording(slow.time, tuple(names), units, np.hstack((slow.values, reported)))
    geometry = {f"support[{i}].x": x for i, x in enumerate(where, 1)} | {"dropper[1].x": 120.0}
    settings = {"start": 0.0, "interval": {"start": 90.0, "end": 160.0}}
    summary = {"status": "complete", "contacts": [dataclasses.asdict(CONTACT)], "settings": settings}
    return Results(Path("made_up"), summary, (fast, slow), {"catenary": geometry})


def test_run_study_and_verification_tell_the_same_uplift_and_slack():
    done = made_up()
    rows = {row[0]: row[1] for row in figure_rows(done.assessments())}
    (entry,) = entries("one", done, Interval(name="i", start=90.0, end=160.0))
    reported = [QUANTITIES[name].measure(done, Choice()).values[0] for name in ("uplift", "slack")]
    # 90 mm at the first support come from the raising, outside the interval.
    assert rows["uplift at supports, largest [mm]"] == "50.0"
    assert 1e3 * entry.uplift == pytest.approx(reported[0]) == pytest.approx(50.0, rel=1e-3)
    assert rows["slack droppers at passage [%]"] == "100"
    assert (entry.slack, reported[1]) == (1.0, 100.0)
    assert max(u.maximum for u in done.uplifts) == pytest.approx(0.09, rel=1e-3)


@pytest.mark.parametrize(("slack", "share"), [(None, 1.0), (2.4, 1.0), (3.9, 0.0)])
def test_droppers_are_slack_when_the_line_says_so(slack, share):
    """The force vanishes at 2.4 s, at the passage; 3.9 s are long after. Without the line's word the force counts."""
    done = made_up(slack=slack)
    (entry,) = entries("one", done, Interval(name="i", start=90.0, end=160.0))
    reported = [QUANTITIES[name].measure(done, choice).values[0] for name, choice in (
        ("slack", Choice()), ("slack_share", Choice(within=5.0)),
    )]  # fmt: skip
    assert (entry.slack, *reported) == (share, 100.0 * share, 100.0 * share)


def test_the_verdict_on_uplift_is_that_of_the_interval():
    for where, kept in (((50.0, 100.0, 150.0), False), ((50.0, 80.0, 150.0), True)):
        (found,) = made_up(bump=0.13, where=where).assessments()
        assert next(c.passed for c in found.criteria if c.name == "uplift at supports") is kept


def test_figures_of_older_results_are_made_with_the_filter_of_their_time(toy, toy_text, tmp_path, capsys):
    """A summary that says neither format nor filter is of the time of the brick wall; its figures stay."""
    interval = '<panto:Interval start="20" end="45"/>'
    old = go(toy, tmp_path / "old", toy_text(f'{interval}<panto:Filter kind="fft"/>'))
    sigma = old.summary["quality"][0]["sigma"]
    summary = {k: v for k, v in old.summary.items() if k not in ("format", "judged_by")}
    summary["settings"] = {k: v for k, v in summary["settings"].items() if k not in ("filter", "limits")}
    summary["filter"] = "zero-phase low-pass 0-20 Hz by discrete Fourier transform"
    results_folder.write_json(old.folder / "summary.json", summary)
    (old.folder / results_folder.FORCES).unlink()
    read = run_results.read(old.folder)
    assert read.evaluation.filter == BEFORE_CHOICE
    assert read.assessments()[0].quality.sigma == sigma
    new = go(toy, tmp_path / "new", toy_text(interval))
    assert "the filters differ (old: fft 20 Hz; new: butterworth" in run_difference.filter_note([read, new])
    assert run_difference.filter_note([new, new]) == ""
    capsys.readouterr()
    assert main(["compare", str(old.folder), str(new.folder), "--report", str(tmp_path / "c.html")]) == 0
    assert "the filters differ" in " ".join(capsys.readouterr().out.split())
    assert "the filters differ" in (tmp_path / "c.html").read_text()
    assert main(["compare", str(old.folder), str(new.folder), "--json"]) == 0
    (reported,) = json.loads(capsys.readouterr().out)
    assert (reported["same_filter"], reported["rms"]) == (False, 0.0)  # one force, one filter for the difference
    assert main(["report", str(old.folder)]) == 0
    again = json.loads((old.folder / "summary.json").read_text())
    assert (again["format"], again["quality"][0]["sigma"]) == (results_folder.FORMAT, sigma)
    assert run_results.read(old.folder).evaluation.filter == BEFORE_CHOICE


def test_results_of_a_newer_version_are_refused(toy, toy_text, tmp_path):
    done = go(toy, tmp_path / "out", toy_text(""))
    results_folder.write_json(done.folder / "summary.json", {**done.summary, "format": results_folder.FORMAT + 1})
    with pytest.raises(MasterError, match="has format 3, this version reads up to 2"):
        run_results.read(done.folder)


def test_spans_are_told_one_by_one_with_a_warning_where_sigma_drifts():
    time = np.arange(10001) * 1e-3
    x = 50.0 * time
    places = np.arange(0.0, 501.0, 50.0)
    geometry = {"catenary": {f"support[{i}].x": p for i, p in enumerate(places, 1)}}
    settings = EvaluationSettings(interval=(200.0, 400.0), begin=0.0)

    def assessed(spread):
        force = 150.0 + spread * np.sin(2 * np.pi * 2.0 * time)
        recording = Recording(time, (CONTACT.force, CONTACT.point("x")), ("N", "m"), np.column_stack((force, x)))
        (found,) = assess_contacts((recording,), (CONTACT,), geometry, settings)
        return found

    growing = assessed(20.0 + 0.05 * x)
    assert [(s.start, s.is_inside) for s in growing.spans] == [(p, 200 <= p < 400) for p in places[1:-1]]
    inside = [s.sigma for s in growing.spans if s.is_inside]
    assert inside == pytest.approx((20.0 + 0.05 * np.array([225.0, 275.0, 325.0, 375.0])) / np.sqrt(2.0), rel=0.01)
    assert "sigma still drifts" in growing.drift
    assert assessed(20.0).drift == ""
    assert assessed(20.0 + 5.0 * (np.floor(x / 50.0) % 2)).drift == ""  # spans that alternate do not drift


@pytest.fixture(scope="module")
def coupled():
    """A short line under CX as one system."""
    line = CatenaryModel(load_line("generic_simple"))
    pantograph = load_lumped("CX").with_values({"start_position": 300.0, "raise_duration": 0.1, "static_force": 170.0})
    return line, pantograph, CoupledModel(line, [pantograph]).run(3.0, 1e-3)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--filter", "fft", "--filter-order", "6"], "has neither order nor phase"),
        (["--filter-order", "0"], "--filter-order 0: must lie between 1 and 20"),
        (["--cutoff", "500"], "must lie below half the sampling frequency, 500 Hz"),
    ],
)
def test_a_filter_that_cannot_be_meant_ends_couple_before_its_run(capsys, options, said):
    assert physics(["couple", "generic_simple", "CX", *options]) != 0
    assert said in capsys.readouterr().err


@pytest.mark.parametrize("interval", [(None, None), (420.0, 520.0)])
@pytest.mark.parametrize("chosen", [DEFAULT, DEFAULT.others[0], BEFORE_CHOICE])
def test_couple_and_master_tell_the_same_figures_of_the_same_record(coupled, tmp_path, interval, chosen):
    line, pantograph, record = coupled
    ours = Evaluated.of(record, line, pantograph.strip_offset, interval, chosen)
    write_timeseries(tmp_path / "timeseries.csv", ours)
    touches = record.contact_force[:, 0] > 0.0
    assert ours.sampled.position[touches] == pytest.approx(record.contact_point[touches, 0, 0], abs=1e-12)
    assert ours.sampled.position == pytest.approx(300.0 + pantograph.speed * record.time, abs=1e-6)
    recording = load(tmp_path / "timeseries.csv")
    geometry = {"catenary": {f"support[{i}].x": float(x) for i, x in enumerate(ours.supports, 1)}}
    settings = EvaluationSettings(chosen, interval, begin=0.0)
    (theirs,) = assess_contacts((recording,), (CONTACT,), geometry, settings)
    mine = ours.figures
    for name in ("start", "end", "speed", "mean", "sigma", "maximum", "minimum", "statistical_minimum",
                 "contact_height_range"):  # fmt: skip
        assert getattr(mine, name) == pytest.approx(getattr(theirs.quality, name), abs=1e-9), name
    assert mine.sigma_bands == pytest.approx(theirs.quality.sigma_bands, abs=1e-9)
    assert mine.losses == theirs.quality.losses
    assert [(o.filter, o.maximum) for o in mine.others] == [(o.filter, o.maximum) for o in theirs.quality.others]
    assert ours.uplift(mine) == pytest.approx(theirs.uplift.maximum, abs=1e-12)
    column = recording["catenary.pantograph[1].contact.filtered_force"]
    inside = recording["catenary.pantograph[1].contact.in_interval"] == 1.0
    assert (column[inside].mean(), column[inside].max()) == pytest.approx((mine.mean, mine.maximum), abs=1e-9)


def test_a_run_that_goes_on_in_contact_need_not_settle_again():
    done = made_up()
    whole = done.recordings[0]
    later = Recording(whole.time[2000:], whole.names, whole.units, whole.values[2000:])
    signals = contact_signals(later, CONTACT, EvaluationSettings(begin=0.0))
    assert signals.inside.all()
    assert figures_of(signals.sampled, DEFAULT) is not None
    assert contact_signals(later, CONTACT, EvaluationSettings(begin=2.0)).inside.sum() == 2001 - 1000

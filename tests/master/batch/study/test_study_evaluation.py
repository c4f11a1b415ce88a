"""What a study reports of a pantograph."""

from dataclasses import asdict

import numpy as np
import pytest

from master.batch.study import study_charts
from master.batch.study.family import Family, Interval, Settings, Variant
from master.batch.study.study_evaluation import entries
from master.batch.study.study_outcome import StudyOutcome, VariantResult, as_csv, differences
from master.batch.study.study_page import page
from master.batch.verification.quantities import QUANTITIES, Choice
from master.evaluation.contact_assessment import slack_share
from master.recording.recording import Recording
from master.results.run_results import Results
from master.system.contacts import Contact

WHOLE = Interval(name="whole", start=60.0, end=120.0)


def test_the_leading_pantograph_comes_first(pair):
    assert [e.pantograph for e in entries("30 m", pair, WHOLE)] == ["leading", "trailing"]


def test_a_slack_dropper_counts_for_the_pantograph_that_passes(pair):
    leading, trailing = entries("30 m", pair, WHOLE)
    assert (leading.slack, trailing.slack) == (0.0, 0.5)


def test_uplift_is_that_of_the_intervals_supports(pair):
    assert entries("30 m", pair, WHOLE)[0].uplift == pytest.approx(0.05, rel=0.01)
    behind = Interval(name="behind", start=80.0, end=120.0)
    assert entries("30 m", pair, behind)[0].uplift is None


def test_change_of_wires(pair):
    for entry in entries("30 m", pair, WHOLE):
        sharing = entry.sharing
        assert sharing.start == pytest.approx(100.0, abs=0.1)
        assert sharing.end == pytest.approx(110.0, abs=0.1)
        assert sharing.duration == pytest.approx(0.2, abs=0.003)
        assert sharing.losses == (1, 0)
        assert sharing.least_force > 100.0


def test_followers_are_compared_with_the_one_ahead(pair):
    (following,) = pair.follower_effects
    assert (following.leading, following.trailing) == ("leading", "trailing")
    assert following.distance == pytest.approx(30.0)
    assert following.sigma < 0.0
    assert following.sentence.startswith("trailing 30 m behind leading: sigma -")


@pytest.fixture
def outcome(pair, tmp_path):
    settings = Settings(title="A <pair>", interval=(WHOLE,), histories={"variants": ("30 m",), "position": 71.0},
                        sharing={"variants": ("30 m",)})  # fmt: skip
    variants = (Variant(name="30 m", values={}), Variant(name="single", values={}))
    return StudyOutcome(
        Family(name="pair", folder=tmp_path, settings=settings, variants=variants),
        (VariantResult("30 m", pair), VariantResult("single", _without(pair, "trailing"))),
        {"60 m": "the wire <broke>"},
        date="today",
        versions={},
        status="complete",
    )


def _without(pair, pantograph):
    left = [c for c in pair.summary["contacts"] if c["pantograph"] != pantograph]
    return type(pair)(pair.folder, {**pair.summary, "contacts": left}, pair.recordings, pair.geometry)


def test_everyone_stands_beside_the_single_pantograph(outcome):
    rows = differences(outcome.entries(WHOLE))
    assert [r[:3] for r in rows] == [
        ("30 m", "trailing", "leading"),
        ("30 m", "leading", "single"),
        ("30 m", "trailing", "single"),
    ]
    assert rows[1][3] == pytest.approx((0.0, 0.0, 0.0))


def test_the_table_has_a_row_for_each(outcome):
    lines = as_csv(outcome).splitlines()
    assert len(lines) == 4
    assert lines[0].startswith("variant,interval,pantograph,mean [N],sigma [N]")
    assert all(line.count(",") >= lines[0].count(",") for line in lines[1:])


def test_the_page_shows_all_and_asks_for_nothing(outcome):
    text = page(outcome)
    for words in ("A &lt;pair&gt;", "60 m: the wire &lt;broke&gt;", "30 m, trailing", "From wire to wire", "Histories"):
        assert words in text
    assert "http://" not in text.split("<script>")[0]


def test_histories_are_drawn_at_the_nearest_support_and_dropper(outcome):
    uplift, dropper = study_charts.history_charts(outcome)
    assert uplift.title == "Uplift at the support at 75.0 m"
    assert dropper.title == "Force in the dropper at 70.0 m"


def test_wires_are_drawn_with_their_sum(outcome):
    made = study_charts.sharing_charts(outcome)
    assert [c.title for c in made] == [f"From wire to wire, 30 m, {p}" for p in ("leading", "trailing")]
    assert [part.name for part in made[0].parts] == ["section 1", "section 2", "total"]


def test_statistics_are_drawn_by_place_in_the_train_with_the_single_one(outcome):
    made = study_charts.interval_charts(outcome, WHOLE, outcome.entries(WHOLE))
    assert [c.title for c in made[:2]] == ["Statistics, leading", "Statistics, trailing"]
    assert [part.name for part in made[0].parts] == ["single", "30 m"]
    assert [c.title for c in made[2:]] == ["Contact force, 30 m", "Histogram, 30 m"]
    shares = [np.sum(bars.y) for bars in made[3].parts]
    assert shares == pytest.approx([100.0, 100.0])


def _lap(slack_at):
    """A pantograph twice round a ring of 100 m at 50 m/s; the dropper at 30 m is slack around one time."""
    time = np.arange(4001) * 1e-3
    x = 50.0 * time
    contact = Contact(1, "catenary", "train", "catenary.pantograph[1].contact")
    force = np.full(4001, 150.0)
    dropper = np.where(np.abs(time - slack_at) < 0.05, 0.0, 80.0)
    names = ("catenary.pantograph[1].contact.force", "catenary.pantograph[1].contact.x", "catenary.dropper[1].force")
    recording = Recording(time, names, ("N", "m", "N"), np.column_stack([force, x, dropper]))
    geometry = {"catenary": {"dropper[1].x": 30.0, "period": 100.0, "support[1].x": 0.0}}
    interval = {"start": 100.0, "end": 200.0}
    summary = {"contacts": [asdict(contact)], "settings": {"interval": interval}}
    return Results(None, summary, (recording,), geometry), contact


@pytest.mark.parametrize(("slack_at", "share"), [(2.6, 1.0), (0.6, 0.0), (1.6, 0.0)])
def test_droppers_of_a_later_lap_are_found(slack_at, share):
    """The dropper at 30 m is passed at 130 m, after 2.6 s, in the interval of the second lap."""
    done, contact = _lap(slack_at)
    geometry = done.geometry["catenary"]
    assert slack_share(done.recordings, geometry, contact, None, (100.0, 200.0)) == share
    measured = QUANTITIES["slack_share"].measure(done, Choice(within=5.0))
    assert measured.values == (100.0 * share,)

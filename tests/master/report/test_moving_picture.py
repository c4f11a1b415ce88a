"""The moving picture."""

import base64
import dataclasses
import json

import numpy as np
import pytest
from PIL import Image

from master.errors import MasterError
from master.report.film_file import FilmOptions, write_film
from master.report.moving_picture import DISPLACEMENT_UNIT, as_json, make_movie


@pytest.fixture
def movie(made_up):
    run = made_up()
    return make_movie(run, run.signals)


def test_frames_show_what_was_recorded(movie, made_up):
    _, slow = made_up().recordings
    assert movie.time[0] == 0.0
    assert movie.time[-1] == pytest.approx(2.0)
    (section,) = movie.sections
    assert section.points.tolist() == [50.0, 100.0, 150.0]
    for i in range(3):
        there = np.interp(movie.time, slow.time, slow[f"catenary.support[{i + 1}].uplift"])
        assert section.displacement[:, i] == pytest.approx(there)
    (rider,) = movie.riders
    assert rider.x == pytest.approx(60.0 * movie.time + 20.0, abs=0.07)
    # the made-up contact height is 5 m + 0.1 mm/N, the wire at rest stands at 5.05 to 5.08 m
    rest = np.interp(rider.x, *section.line.wire)
    assert rider.wire == pytest.approx(5.0 + 1e-4 * rider.force - rest)


def test_slack_droppers_are_known_per_frame(movie):
    slack = movie.sections[0].slack
    assert slack.any(axis=0).tolist() == [False, True, False, False]
    assert not slack[movie.time < 0.99].any()
    assert slack[movie.time > 1.01, 1].all()


def test_droppers_are_drawn_slack_when_the_line_says_so(made_up, told_slack):
    run = told_slack(made_up(), 3)
    section = make_movie(run, run.signals).sections[0]
    assert section.slack.any(axis=0).tolist() == [False, True, True, False]  # the second by its force
    assert section.slack[:, 2].all()


def test_json_holds_whole_frames(movie):
    data = json.loads(json.dumps(as_json(movie)))
    (section,) = data["sections"]
    numbers = np.frombuffer(base64.b64decode(section["displacement"]), dtype="<i2").reshape(data["count"], 3)
    assert DISPLACEMENT_UNIT * numbers == pytest.approx(movie.sections[0].displacement, abs=0.6 * DISPLACEMENT_UNIT)
    assert len(base64.b64decode(section["slack"])) == data["count"]  # four droppers, one byte


def test_in_an_overlap_the_pantograph_runs_on_the_lower_wire(made_up):
    """Supports 1, 2 and droppers 1, 2 form one section; the second begins at 80 m, 0.2 m higher."""
    run = made_up()
    values = dict(run.geometry["catenary"])
    for kind, n in (("support", 3), ("dropper", 4)):
        for i in range(1, n + 1):
            values[f"{kind}[{i}].section"] = 1.0 if i <= 2 else 2.0
    values |= {"support[3].z": 5.28, "dropper[3].lower.z": 5.25, "dropper[4].lower.z": 5.25}
    run = dataclasses.replace(run, geometry={"catenary": values})
    found = make_movie(run, run.signals)
    assert len(found.sections) == 2
    (rider,) = found.riders
    assert set(rider.section[rider.x < 99.0]) == {0}
    assert set(rider.section[rider.x > 106.0]) == {1}
    assert np.abs(rider.wire[rider.x < 100.0]).max() < 0.2


def test_without_uplift_or_geometry_there_is_no_picture(made_up):
    for run in (
        made_up(with_geometry=False),
        dataclasses.replace(made_up(), recordings=made_up().recordings[:1]),
    ):
        assert make_movie(run, run.signals) is None


def test_a_film_plays_the_interval(movie, tmp_path):
    path = write_film(movie, tmp_path / "run.gif", FilmOptions(start=50.0, end=65.0, speed=1.0))
    with Image.open(path) as film:
        assert film.n_frames == pytest.approx(5, abs=1)  # 15 m at 60 m/s, 20 frames per second
        assert film.size == (900, 500)


def test_an_unknown_kind_of_film_is_refused(movie, tmp_path):
    with pytest.raises(MasterError, match=r"\.gif or \.mp4"):
        write_film(movie, tmp_path / "run.avi", FilmOptions())


def test_a_line_that_closes_on_itself_is_drawn_for_every_lap(made_up):
    """Supports at 50 and 100 m and what lies between, every 100 m: the run from 20 to 140 m sees laps 0 and 1 ..."""
    run = made_up()
    gone = ("support[3]", "dropper[3]", "dropper[4]")
    values = {k: v for k, v in run.geometry["catenary"].items() if k[:10] not in gone}
    run = dataclasses.replace(run, geometry={"catenary": values | {"period": 100.0}})
    movie = make_movie(run, run.signals)
    (section,) = movie.sections
    assert section.points.tolist() == [-50.0, 0.0, 50.0, 100.0]  # ... of which lap 0 begins 50 m before the run's end
    assert section.line.droppers[0].tolist() == [-45.0, -20.0, 55.0, 80.0]
    assert (section.displacement[:, :2] == section.displacement[:, 2:]).all()
    assert section.slack.any(axis=0).tolist() == [False, True] * 2
    assert movie.riders[0].x[-1] == pytest.approx(140.0, abs=0.07)


def test_so_many_laps_are_not_drawn(made_up):
    run = made_up()
    run = dataclasses.replace(run, geometry={"catenary": run.geometry["catenary"] | {"period": 2.0}})
    assert make_movie(run, run.signals) is None

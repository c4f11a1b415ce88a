"""Bands of the force over the track, of series whose quantiles are known."""

import numpy as np
import pytest

from master.batch.sweep.pages.force_bands import force_band

CONTACT = "line.pantograph[1].contact"


def write_series(folder, position, force, counts):
    folder.mkdir(parents=True)
    heads = f"time [s],{CONTACT}.track_position [m],{CONTACT}.filtered_force [N],{CONTACT}.in_interval"
    rows = [f"{0.001 * k},{x},{f},{int(c)}" for k, (x, f, c) in enumerate(zip(position, force, counts, strict=True))]
    (folder / "contact_force.csv").write_text("\n".join([heads, *rows]) + "\n")


@pytest.fixture
def runs(tmp_path):
    """101 runs, the k-th with the force x + k N at x m, each sampled elsewhere; outside the interval nonsense."""
    folders = []
    for k in range(101):
        x = np.sort(np.append(np.linspace(0.0, 100.0, 300 + k), (20.0, 80.0)))
        inside = (x >= 20.0) & (x <= 80.0)
        folders.append(tmp_path / f"r{k}")
        write_series(folders[-1], x, np.where(inside, x + k, -999.0), inside)
    return folders


def test_the_quantiles_are_those_of_the_runs_at_each_position(runs):
    band = force_band(runs, CONTACT, (20.0, 80.0))
    assert band.runs == 101
    assert (band.position[0], band.position[-1]) == (20.0, 80.0)
    for quantile, above in zip(band.quantiles, (5.0, 50.0, 95.0), strict=True):
        assert quantile == pytest.approx(band.position + above)


def test_an_open_interval_is_that_of_the_samples_that_count(runs):
    band = force_band(runs, CONTACT, (None, None))
    assert (band.position[0], band.position[-1]) == (20.0, 80.0)


def test_where_fewer_than_two_runs_are_there_is_no_band(tmp_path):
    x = np.arange(0.0, 11.0)
    write_series(tmp_path / "a", x, x, np.ones(11))
    write_series(tmp_path / "b", x[:6], x[:6], np.ones(6))
    band = force_band([tmp_path / "a", tmp_path / "b"], CONTACT, (None, None))
    assert np.isfinite(band.quantiles[:, band.position <= 5.0]).all()
    assert np.isnan(band.quantiles[:, band.position > 5.0]).all()


def test_runs_that_left_nothing_are_passed_over(runs, tmp_path):
    (runs[3] / "contact_force.csv").write_text("time [s]\nbroken")
    assert force_band([*runs[:4], tmp_path / "gone"], CONTACT, (20.0, 80.0)).runs == 3
    assert force_band([tmp_path / "gone", runs[0]], CONTACT, (20.0, 80.0)) is None
    assert force_band(runs, "line.pantograph[2].contact", (20.0, 80.0)) is None

"""From a line with seeded errors over a measuring run back to these errors, and to a line that is corrected."""

import dataclasses

import numpy as np
import pytest

from models.catenary.condition.fitted_lengths import with_errors
from models.catenary.definition.condition_definition import Irregularity
from models.catenary.shape.kept_form import kept_form
from models.catenary.shape.line_mesh import build_mesh
from models.layout.as_built.as_built_line import find_as_built
from models.layout.as_built.as_built_outcome import AGREEMENT, judge_as_built
from models.layout.as_built.dropper_corrections import Allowed
from models.layout.as_built.leftover_surface import leftover_surface
from models.layout.as_built.measured_run import AsBuiltError
from tests.models.conftest import make_line
from tests.models.layout.as_built.measuring_vehicle import measured

COUNT, GAP = 42, (133.0, 149.0)
STAGGER = {"listed": [[0.2, -0.15, 0.25, -0.2, 0.1], "m", "test"]}


@pytest.fixture(scope="module")
def line():
    return make_line(6, stagger=STAGGER)


@pytest.fixture(scope="module")
def design(line):
    return kept_form(line, build_mesh(line))


@pytest.fixture(scope="module")
def errors():
    """Errors of up to 10 mm; the droppers in the gap of the run are as designed."""
    found = 0.01 * np.random.default_rng(11).uniform(-1.0, 1.0, COUNT)
    found[[19, 20]] = 0.0
    return found


@pytest.fixture(scope="module")
def outcome(line, design, errors):
    """Of a run with noise of 0.5 mm, another origin, a way that is 0.12 % too short, and a gap."""
    rng = np.random.default_rng(12)
    run, x = measured(with_errors(design, errors), rng, noise=5e-4, origin=7312.0, scale=0.0012, gaps=[GAP])
    told = []
    found = judge_as_built(line, run, 0.008, Allowed(5e-3, None, 0.25), lambda *what: told.append(what))
    assert np.abs(found.built.alignment.position(run.position) - x).max() < 0.2
    assert {what for what, _, _ in told} >= {"alignment", "influence of lengths", "uncertainty"}
    return found


def test_the_errors_are_found_within_their_uncertainty(outcome, errors):
    b = outcome.built
    assert np.flatnonzero(~b.is_measured).tolist() == [19, 20]
    assert not b.is_slack.any()
    off = ((b.error - errors) / b.uncertainty)[b.is_measured]
    assert np.abs(off).max() < 4.0
    assert 0.6 < np.sqrt(np.mean(off**2)) < 1.4
    assert np.nanmedian(b.uncertainty) < 1e-3


def test_both_ways_to_the_errors_agree(outcome):
    assert 1e-7 < outcome.built.difference < AGREEMENT


def test_droppers_beyond_the_tolerance_are_named(outcome, errors):
    sure = np.abs(np.abs(errors) - 0.008) > np.nan_to_num(3.0 * outcome.built.uncertainty)
    assert np.array_equal(outcome.is_beyond[sure], (np.abs(errors) > 0.008)[sure])
    words = np.array(outcome.verdicts)
    assert set(words[[19, 20]]) == {"not measured"}
    assert set(words[outcome.is_beyond & (errors > 0.0)]) == {"failed, too long"}
    assert set(words[outcome.is_beyond & (errors < 0.0)]) == {"failed, too short"}


def test_the_corrected_line_hangs_as_designed_within_a_step(outcome, design, errors):
    """The changes on the true line, whose errors the run showed with noise."""
    after = with_errors(design, errors + outcome.change)
    rise = 1e3 * (outcome.built.heights(after) - outcome.built.wanted)
    before = 1e3 * (outcome.built.heights(with_errors(design, errors)) - outcome.built.wanted)
    assert np.abs(rise).max() < 5.0 < np.abs(before).max()
    assert np.sqrt(np.mean(rise**2)) < 0.4 * np.sqrt(np.mean(before**2))
    expected = 1e3 * outcome.after[outcome.built.is_measured]
    assert np.abs(expected - rise[outcome.built.is_measured]).max() < 2.0
    assert outcome.change == pytest.approx(5e-3 * np.rint(outcome.change / 5e-3), abs=1e-12)


def test_noise_is_no_running_surface(outcome):
    assert outcome.surface.is_noise
    assert np.abs(outcome.surface.r).max() < 1e-3


def test_waves_of_the_wire_are_left_to_the_running_surface(line, design, errors):
    def wave(x):
        return 8e-4 * np.sin(2.0 * np.pi * x / 2.1)

    run, x = measured(with_errors(design, errors), np.random.default_rng(1), every=0.25, uneven=wave)
    found = find_as_built(line, run)
    assert np.abs(found.error - errors).max() < 1.5e-3
    surface = leftover_surface(found)
    inside = (x > 60.0) & (x < 240.0)
    r = np.interp(x[inside], surface.x, surface.r)
    assert not surface.is_noise
    assert np.corrcoef(r, wave(x[inside]))[0, 1] > 0.95
    assert np.std(r) == pytest.approx(np.std(wave(x[inside])), rel=0.15)


def test_worn_wire_is_not_taken_for_short_droppers(line, design, errors):
    """The underside stands 2 mm higher where 2 mm are worn off, on half of the line."""
    worn = dataclasses.replace(line, contact_wire=dataclasses.replace(line.contact_wire, diameter=0.0138))

    def off(x):
        return np.where(x > 150.0, 2e-3, 0.0)

    run, x = measured(with_errors(design, errors), np.random.default_rng(1), uneven=off)
    run = dataclasses.replace(run, thickness=0.0138 - off(x))
    with pytest.raises(AsBuiltError, match=r"run.csv: the thickness says .* give 'diameter' in \[contact_wire\]"):
        find_as_built(line, run)
    thick = dataclasses.replace(run, thickness=np.where(x > 150.0, 0.0146, 0.0138))
    with pytest.raises(AsBuiltError, match=r"at 15\d\.\d m the wire was measured 14\.60 mm .* has 13\.80 mm: check"):
        find_as_built(worn, thick)
    found = find_as_built(worn, run)
    assert np.abs(found.error - errors).max() < 1e-4
    surface = leftover_surface(found)
    assert np.interp([100.0, 200.0], surface.x, surface.r) == pytest.approx([0.0, 2e-3], abs=1e-4)


def test_heights_of_another_line_are_refused(line, design):
    run, _ = measured(design, np.random.default_rng(1))
    with pytest.raises(AsBuiltError, match=r"the heights differ by \+0\.42 m from those of the design"):
        find_as_built(line, dataclasses.replace(run, height=run.height + 0.42))
    nowhere = dataclasses.replace(run, stagger=np.full(len(run.position), np.nan), position=run.position + 9000.0)
    with pytest.raises(AsBuiltError, match=r"no row lies on the line, which reaches from 0\.0 to 300\.0 m; the run"):
        find_as_built(line, nowhere)
    with pytest.raises(AsBuiltError, match=r"the run names structures, and the design none"):
        find_as_built(line, dataclasses.replace(nowhere, structure=("M1",) * len(run.position)))
    few = dataclasses.replace(
        run, height=np.where(np.arange(len(run.height)) == 1, 5.1, np.nan), stagger=np.full(len(run.height), np.nan)
    )
    with pytest.raises(AsBuiltError, match="no dropper has enough measured heights"):
        find_as_built(line, few)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"irregularity": Irregularity(dropper_length_sigma=0.01)}, "has errors of its own"),
        ({"sections": "errors"}, r"has a table \[as_built\] already"),
        ({"sections": "periodic"}, "closes on itself"),
    ],
)
def test_what_is_no_design_is_refused(line, change, said):
    if isinstance(change.get("sections"), str):
        field = {"errors": {"length_errors": (0.01,) * COUNT}, "periodic": {"periodic": True}}[change["sections"]]
        change = {"sections": (dataclasses.replace(line.sections[0], **field),)}
    with pytest.raises(AsBuiltError, match=said):
        find_as_built(dataclasses.replace(line, **change), None)

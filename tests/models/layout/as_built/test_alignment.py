"""A run laid on the design: by staggers, whose shift and scale are known here, and by structures."""

import dataclasses
import math

import numpy as np
import pytest

from models.catenary.statics.wire_course import WireCourse
from models.layout.as_built import alignment
from models.layout.as_built.alignment import align
from models.layout.as_built.measured_run import AsBuiltError, MeasuredRun
from tests.models.conftest import make_line

#: Supports of a line of spans from 38 to 50 m, and a wire that alternates by 15 to 25 cm.
SPANS = np.array([50, 47, 44, 50, 38, 45, 50, 50, 41, 48, 50, 39], dtype=float)
SUPPORTS = np.concatenate([[0.0], np.cumsum(SPANS)])
STAGGER = 0.2 * (-1.0) ** np.arange(13) + 0.05 * np.sin(2.0 * np.arange(13))


def wire(x, y):
    return (WireCourse(np.asarray(x, dtype=float), np.asarray(y, dtype=float), np.zeros((len(x) - 1, 4))),)


def run_of(x, stagger, structure=None):
    nothing = np.full(len(x), np.nan)
    names = structure or ("",) * len(x)
    return MeasuredRun("run.csv", np.asarray(x, dtype=float), nothing + 5.0, stagger, nothing, tuple(names))


@pytest.fixture(scope="module")
def line():
    return make_line(4)


def vehicle(low, high, origin, scale, noise, seed=1):
    """Return a run between two places of the design, and these places."""
    x = np.arange(low, high, 0.5)
    y = np.interp(x, SUPPORTS, STAGGER) + noise * np.random.default_rng(seed).standard_normal(len(x))
    return run_of((x - 270.0) / (1.0 + scale) + 270.0 - origin, y), x


@pytest.mark.parametrize("part", [(1.0, 551.0), (120.0, 520.0)])
@pytest.mark.parametrize(("origin", "scale"), [(0.0, 0.0), (-73123.4, 0.0015), (88.8, -0.0018)])
def test_staggers_tell_shift_and_scale(line, origin, scale, part):
    for noise, allowed in ((0.0, 1e-3), (0.01, 0.4)):
        run, x = vehicle(*part, origin, scale, noise)
        found = align(run, line, wire(SUPPORTS, STAGGER))
        assert found.by == "staggers"
        assert np.abs(found.position(run.position) - x).max() < allowed
        assert found.correlation > 0.99
        middle = 0.5 * (run.position[0] + run.position[-1])
        assert found.shift == pytest.approx(0.5 * (x[0] + x[-1]) - middle, abs=allowed)
        assert found.scale == pytest.approx(scale, abs=2.0 * allowed / np.ptp(x))


def test_a_scale_beyond_the_vehicles_is_not_found(line):
    run, x = vehicle(1.0, 551.0, 0.0, 0.01, 0.0)
    found = align(run, line, wire(SUPPORTS, STAGGER))
    assert abs(found.scale) <= 0.0020001
    assert np.abs(found.position(run.position) - x).max() > 1.0


def test_a_run_with_gaps_and_rows_without_stagger(line):
    run, x = vehicle(1.0, 551.0, 500.0, 0.001, 0.005)
    some = ((x > 200.0) & (x < 260.0)) | (np.arange(len(x)) % 3 == 0)
    run = dataclasses.replace(run, stagger=np.where(some, np.nan, run.stagger))
    assert np.abs(align(run, line, wire(SUPPORTS, STAGGER)).position(run.position) - x).max() < 0.3


def test_equal_spans_fit_in_several_places_alike(line):
    supports, stagger = 50.0 * np.arange(13), 0.2 * (-1.0) ** np.arange(13)
    x = np.arange(110.0, 480.0, 0.5)
    with pytest.raises(AsBuiltError, match=r"fit the design in two places alike.*name the structures") as error:
        align(run_of(x, np.interp(x, supports, stagger)), line, wire(supports, stagger))
    assert "correlation 1.000" in str(error.value)


def test_staggers_of_another_line_are_refused(line):
    x = np.arange(0.0, 550.0, 0.5)
    noise = 0.2 * np.random.default_rng(2).standard_normal(len(x))
    with pytest.raises(AsBuiltError, match=r"at best they correlate with 0\.\d+, and 0\.8 is the least; check"):
        align(run_of(x, noise), line, wire(SUPPORTS, STAGGER))


def test_staggers_that_say_nothing_are_refused(line):
    x = np.arange(0.0, 550.0, 0.5)
    with pytest.raises(AsBuiltError, match="do not say where the run was: they are the same throughout"):
        align(run_of(x, np.full(len(x), 0.1)), line, wire(SUPPORTS, STAGGER))
    few = np.where(np.arange(len(x)) == 7, 0.1, np.nan)
    with pytest.raises(AsBuiltError, match="staggers are given over 0 m, and 100 m are needed"):
        align(run_of(x, few), line, wire(SUPPORTS, STAGGER))


def test_the_other_sign_is_recognised(line):
    x = np.arange(0.0, 550.0, 0.5)
    supports, stagger = SUPPORTS[[0, 2, 3, 5, 8, 9, 12]], 0.2 * np.array([1.0, -1.0, 0.3, 0.9, 0.2, -0.8, 1.0])
    with pytest.raises(AsBuiltError, match="with the opposite sign they would fit better: left"):
        align(run_of(x, -np.interp(x, supports, stagger)), line, wire(supports, stagger))

    x = np.arange(1.0, 551.0, 0.5)  # with that sign, at a span's distance, too
    with pytest.raises(AsBuiltError, match=r"in two places alike.* longer run; with the opposite sign .*\(1\.000\)$"):
        align(run_of(x, -np.interp(x, SUPPORTS, STAGGER)), line, wire(SUPPORTS, STAGGER))


def test_without_staggers_and_structures_positions_stay(line):
    x = np.arange(0.0, 100.0)
    found = align(run_of(x, np.full(100, np.nan)), line, wire(SUPPORTS, STAGGER))
    assert (found.by, found.shift, found.scale) == ("", 0.0, 0.0)
    assert np.array_equal(found.position(x), x)


@pytest.fixture(scope="module")
def named():
    return make_line(4, supports={"structure": ["M1", "M2", "M3"]})


def structures(*pairs):
    x = np.arange(0.0, 300.0)
    names = [""] * 300
    for place, name in pairs:
        names[place] = name
    return run_of(x, np.full(300, math.nan), names)


def test_structures_stretch_the_way_between_them(named, monkeypatch):
    """Spans of 50 m that the vehicle took for 51 and 49 m, or saw within a sample."""
    monkeypatch.setattr(alignment, "_SEEN", 0.1)
    run = structures((70, "M1"), (71, "M1"), (121, "M2"), (170, "M3"), (220, "other"))
    found = align(run, named, wire(SUPPORTS, STAGGER))
    assert (found.by, found.structures) == ("structures", 3)
    assert found.position(np.array([70.0, 95.5, 121.0, 145.5, 170.0])) == pytest.approx([50, 75, 100, 125, 150])
    assert found.position(np.array([60.0, 180.0])) == pytest.approx([50.0 - 10 * 50 / 51, 150.0 + 10 * 50 / 49])
    monkeypatch.setattr(alignment, "_SEEN", 0.7)
    straight = align(run, named, wire(SUPPORTS, STAGGER))
    assert straight.is_straight
    assert straight.structures == 3
    assert straight.position(np.array([70.0, 121.0, 170.0])) == pytest.approx(
        np.array([49.67, 100.67, 149.67]), abs=0.02
    )


def test_one_structure_shifts(named):
    found = align(structures((90, "M2")), named, wire(SUPPORTS, STAGGER))
    assert found.position(np.array([0.0, 90.0])) == pytest.approx([10.0, 100.0])
    assert found.shift == 10.0


@pytest.mark.parametrize(
    ("pairs", "said"),
    [
        (((70, "A"), (120, "B")), "structure 'A' and all others are none of the design's, which has M1, M2, M3"),
        (((70, "M2"), (120, "M1")), "structure 'M1' comes after 'M2', and before it in the design"),
        (((70, "M1"), (90, "M2"), (120, "M1")), "structure 'M1' stands at 70.00 m and at 120.00 m: it is in one place"),
        (((70, "M1"), (123, "M2")), "from structure 'M1' to 'M2' it is 53.00 m, and 50.00 m in the design"),
    ],
)
def test_structures_that_are_elsewhere_are_refused(named, pairs, said):
    with pytest.raises(AsBuiltError) as error:
        align(structures(*pairs), named, wire(SUPPORTS, STAGGER))
    assert said in str(error.value)

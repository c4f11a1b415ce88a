"""A line in the wind: the mesh beside the string, both sides, in curves and on straight track."""

import dataclasses

import numpy as np
import pytest

from models.catenary.definition.tensioning_definition import Tensioning, TensioningDevice
from models.catenary.definition.track_definition import Track
from models.catenary.definition.wind_definition import DesignWind
from models.catenary.line_model import CatenaryModel
from models.catenary.statics.blow_off import blow_off
from models.library.catalogue import load_line
from tests.models.conftest import make_fault

PRESSURE = 961.04


def blown(line, **changes):
    return blow_off(CatenaryModel(dataclasses.replace(line, **changes)), PRESSURE)


def test_the_mesh_stays_one_per_cent_below_the_string(ln2):
    """Of clamps that bend the wire; N/L takes another half a per cent of LN2, whose messenger wire is blown less."""
    free = dataclasses.replace(ln2.dynamics, geometric_stiffness=0)
    ratio = [(b := blown(ln2, dynamics=d)).blown / b.string_blown for d in (free, ln2.dynamics)]
    assert ratio[0][5:-5] == pytest.approx(0.99, abs=0.005)
    assert ratio[1][5:-5] == pytest.approx(0.984, abs=0.005)


def test_a_curve_changes_nothing_of_what_the_wind_moves(short_line):
    """Tensions stay: a wire that is bowed already is not held by its length."""
    straight = blown(short_line)
    curved = blown(short_line, track=Track(positions=(0.0,), curvature=(1 / 2500,)))
    np.testing.assert_allclose(curved.blown[2:4], straight.blown[2:4], rtol=5e-3)


def test_offsets_are_those_of_the_string_within_its_accuracy(short_line):
    for curvature in (0.0, -1 / 1500):
        found = blown(short_line, track=Track(positions=(0.0,), curvature=(curvature,)))
        np.testing.assert_allclose(found.offset[1:-1], found.string[1:-1], rtol=0.03)
        assert np.isnan(found.string[[0, -1]]).all()  # there the wire is free in plan at one end


def test_both_winds(short_line):
    found = blown(short_line)
    np.testing.assert_allclose(found.to_left + found.to_right, 2.0 * found.still)
    middle = np.interp(125.0, found.x, found.to_left) - np.interp(125.0, found.x, found.still)
    assert middle > 0.05
    assert found.lift.sum(axis=1) == pytest.approx(0.0, abs=1e-12)
    # An arm on the left, its end above the wire: wind to the left takes pull and with it lift from it.
    assert found.lift[0, 0] < -0.002
    assert found.lift[1, 0] > 0.002


def test_twice_the_pressure_moves_twice_as_far(short_line):
    model = CatenaryModel(short_line)
    once, twice = (blow_off(model, p) for p in (400.0, 800.0))
    np.testing.assert_allclose(twice.blown, 2.0 * once.blown)


def test_the_auxiliary_wire_takes_the_contact_wire_along():
    """Three strings over a span, held at its ends, that hang from one another by pendulums of w / L per length."""
    line = load_line("Shinkansen")
    model = CatenaryModel(line)
    static, mesh = model.static, model.mesh
    tied = [
        force.sum() / (mesh.points[:, 0].max() - mesh.points[:, 0].min()) / length.mean()
        for kind in (False, True)
        for force, length in [
            (static.dropper_force[mesh.is_hanger == kind], static.droppers.length[mesh.is_hanger == kind])
        ]
    ]
    span, n = 50.0, 200
    second = (np.eye(n, k=1) - 2.0 * np.eye(n) + np.eye(n, k=-1)) * ((n + 1) / span) ** 2
    wires = (line.contact_wire, line.auxiliary_wire, line.messenger_wire)
    ties = np.array([[tied[0], -tied[0], 0.0], [-tied[0], sum(tied), -tied[1]], [0.0, -tied[1], tied[1]]])
    K = np.kron(ties, np.eye(n)) - np.kron(np.diag([w.tension for w in wires]), second)
    load = [DesignWind().force(w.width, PRESSURE) for w in wires]
    strings = np.linalg.solve(K, np.repeat(load, n))[:n].max()
    found = blow_off(model, PRESSURE)
    assert found.blown[5:-5] == pytest.approx(strings, rel=0.02)
    assert strings > 1.1 * found.string_blown[10]


def test_contact_and_messenger_wire_are_two_strings_that_droppers_tie():
    """N / L of each dropper at its place: of CA160 it holds the wire back by 3.5 %, as the messenger is blown less."""
    line = load_line("CA160")
    model = CatenaryModel(line)
    static, mesh, span = model.static, model.mesh, line.sections[0].spans[10]
    x = mesh.points[mesh.droppers[:, 0], 0] - span.start
    inside = (x > 0.0) & (x < span.length)
    n = 239
    step = span.length / (n + 1)
    ties = np.zeros(n)
    places = np.rint(x[inside] / step).astype(int) - 1
    np.add.at(ties, places, (static.dropper_force / static.droppers.length)[inside] / step)
    second = (np.eye(n, k=1) - 2.0 * np.eye(n) + np.eye(n, k=-1)) / step**2
    wires = (line.contact_wire, line.messenger_wire)
    K = np.kron([[1.0, -1.0], [-1.0, 1.0]], np.diag(ties)) - np.kron(np.diag([w.tension for w in wires]), second)
    strings = np.linalg.solve(K, np.repeat([DesignWind().force(w.width, PRESSURE) for w in wires], n))[:n].max()
    found = blow_off(model, PRESSURE)
    assert found.blown[10] == pytest.approx(0.99 * strings, rel=5e-3)
    assert strings == pytest.approx(0.966 * found.string_blown[10], rel=2e-3)


def test_the_string_has_the_tension_of_the_day_and_the_curvature_of_its_span(short_line):
    """In the heat a wire between fixed ends is slacker; a curvature that jumps at the end of a span is not in it."""
    tensioning = Tensioning(
        temperature=293.15, reference_temperature=283.15, contact_wire=TensioningDevice(kind="fixed")
    )
    jump = Track(positions=(0.0, 150.0, 150.0), curvature=(0.0, 0.0, 1e-3))
    free = dataclasses.replace(short_line.dynamics, geometric_stiffness=0)
    found = blown(short_line, tensioning=tensioning, track=jump, dynamics=free)
    cold = blown(short_line, track=jump)
    assert found.string_blown[2] > 1.1 * cold.string_blown[2]
    np.testing.assert_allclose(found.blown[2:4] / found.string_blown[2:4], 0.99, atol=0.01)
    np.testing.assert_allclose(cold.offset[1:-1], cold.string[1:-1], rtol=0.02)


def test_spans_beside_a_loose_arm_are_no_strings_held_at_both_ends(short_line):
    plain = blow_off(CatenaryModel(short_line), 961.0)
    loose = blow_off(CatenaryModel(dataclasses.replace(short_line, fault=(make_fault("arm_loose", support=2),))), 961.0)
    beside = np.isnan(loose.string) & ~np.isnan(plain.string)
    spans, x = short_line.sections[0].spans, short_line.sections[0].inner_supports[1].x
    assert beside.tolist() == [x in (span.start, span.end) for span in spans]
    assert loose.offset[beside].max() > 1.5 * plain.offset[beside].max()

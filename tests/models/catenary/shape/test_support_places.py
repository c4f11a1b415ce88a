"""Where supports hold the wires: heights of their own, the messenger wire above cant, sides of arms."""

import dataclasses
import math

import numpy as np
import pytest

from models.catenary.definition.track_definition import Track
from models.catenary.line_advice import track_warning
from models.catenary.shape.form_finding import EquilibriumError, find_form
from models.catenary.shape.line_mesh import build_mesh
from models.catenary.shape.support_places import SupportPlaces

CURVE = {"positions": [[0.0], "m", "x"], "curvature": [[1 / 800], "1/m", "x"], "cant": [[60], "mm", "x"]}


def of(*values):
    return [list(values), "m", "test"]


def test_heights_and_encumbrances_of_supports(line_maker):
    heights, encumbrances = (5.3, 5.3, 5.25, 5.2, 5.2), (1.4, 1.4, 1.3, 1.2, 1.2)
    supports = {"contact_wire_height": of(*heights), "encumbrance": of(*encumbrances)}
    state = find_form(line := line_maker(supports=supports), mesh := build_mesh(line))
    z = state.positions[:, 2]
    at = mesh.points[mesh.sprung, 0]
    np.testing.assert_allclose(z[mesh.sprung], np.interp(at, [50, 100, 150, 200, 250], np.add(heights, encumbrances)))
    lower = mesh.droppers[:, 0]
    x, wanted = mesh.points[lower, 0], z[lower]
    inner = (x > 100.0) & (x < 200.0)
    share = (x % 50.0) / 50.0
    sag = 0.001 * 50.0 * 4.0 * share * (1.0 - share)
    straight = np.interp(x, [100.0, 150.0, 200.0], [5.3, 5.25, 5.2])
    np.testing.assert_allclose(wanted[inner], (straight - sag)[inner], atol=1e-9)


def test_one_value_for_all_supports_is_the_line_wide_value(line_maker):
    one = line_maker(supports={"contact_wire_height": of(5.3), "arm_length": of(1.1)})
    arm = dataclasses.replace(line_maker().steady_arm, length=1.1)
    profile = dataclasses.replace(line_maker().profile, contact_wire_height=5.3)
    wide = dataclasses.replace(line_maker(), profile=profile, steady_arm=arm)
    positions = [find_form(line, build_mesh(line)).positions for line in (one, wide)]
    np.testing.assert_allclose(*positions, atol=1e-12)


def test_the_messenger_wire_is_truly_above_the_contact_wire(line_maker):
    mesh = build_mesh(line := line_maker(track=CURVE))
    stagger = np.interp(mesh.points[mesh.sprung, 0], [s.x for s in line.sections[0].supports],
                        [s.stagger for s in line.sections[0].supports])  # fmt: skip
    lean = 1.4 * math.tan(math.asin(0.06 / 1.5))
    np.testing.assert_allclose(mesh.points[mesh.sprung, 1], stagger - lean)
    mesh = build_mesh(line_maker(track=CURVE, supports={"messenger_stagger": of(0.05)}))
    np.testing.assert_allclose(mesh.points[mesh.sprung, 1], 0.05)


def sides(line):
    mesh = build_mesh(line)
    end, node = mesh.arms.T
    return np.sign(mesh.points[end, 1] - mesh.points[node, 1]).tolist()


def test_arms_stand_where_they_pull(line_maker):
    straight = line_maker()
    assert sides(straight) == [1, -1, 1, -1, 1]
    flat = dataclasses.replace(straight, track=Track(positions=(0.0,), curvature=(0.0,)))
    assert sides(flat) == sides(straight)
    # To the left at R 800: the wire pulls to the left with 1250 N, the alternating stagger with 320 N either way.
    assert sides(line_maker(track=CURVE)) == [-1] * 5
    assert sides(line_maker(supports={"arm_side": [[1, -1, 1, -1, 1], "1", "x"]})) == sides(straight)


def test_an_arm_that_would_push_is_refused(line_maker):
    line = line_maker(track=CURVE, supports={"arm_side": [[-1, -1, 1, -1, -1], "1", "x"]})
    with pytest.raises(EquilibriumError, match=r"the arm at 150.00 m pushes with 9\d\d.\d N: an arm must pull"):
        find_form(line, build_mesh(line))


def test_the_lateral_force_by_formula_is_that_of_the_mesh(line_maker):
    """But for what inclined droppers take from wire to wire."""
    track = {"positions": of(40, 90, 170, 260), "curvature": [[0, 0.001, 0.001, 0], "1/m", "x"],
             "cant": [[0, 80, 80, 0], "mm", "x"]}  # fmt: skip
    line = line_maker(track=track)
    state, places = find_form(line, build_mesh(line)), SupportPlaces(line, line.sections[0])
    end, node = state.shape.mesh.arms.T
    along = state.shape.points[end] - state.shape.points[node]
    lateral = state.arm_force * along[:, 1] / np.linalg.norm(along, axis=1)
    expected = [places.lateral_force(s) for s in line.sections[0].supports if s.has_steady_arm]
    np.testing.assert_allclose(lateral, expected, atol=30.0)


def test_a_track_that_deserves_a_second_look(short_line):
    def said(**lists):
        return track_warning(dataclasses.replace(short_line, track=Track(positions=(10.0,), **lists)))

    assert said(curvature=(1 / 300,), cant=(0.15,)) == ""
    assert "at 10 m the cant is that of a curve to the other side" in said(curvature=(1 / 300,), cant=(-0.15,))
    assert "at 10 m the radius is 100 m" in said(curvature=(-1 / 100,))
    assert "at 10 m the cant is 200 mm" in said(cant=(0.2,))

"""Profile and plan as DXF, read back: layers, unit, lines where the line is, and a plan in which curves are curves."""

from __future__ import annotations

import io
import sys

import numpy as np
import pytest

from models.catenary.definition.track_definition import Track
from models.catenary.shape.kept_form import kept_form
from models.catenary.shape.line_mesh import build_mesh
from models.layout.drawing_export import _Axis, plan_drawing, profile_drawing
from models.layout.sheet_problems import LayoutError

SOURCE = "test"
RADIUS = 800.0


@pytest.fixture(scope="module")
def state(line_maker):
    track = {"positions": [[0.0], "m", SOURCE], "radius": [[RADIUS], "m", SOURCE]}
    line = line_maker(spans=4, track=track, stagger={"listed": [[0.2, 0.2, 0.2], "m", SOURCE]})
    return kept_form(line, build_mesh(line))


def opened(text):
    ezdxf = pytest.importorskip("ezdxf")
    document = ezdxf.read(io.StringIO(text))
    assert document.audit().errors == []
    assert document.units == ezdxf.units.M
    return document.modelspace()


def points(space, layer):
    """Return the lines of a layer, each an array of points (n, 2)."""
    return [np.array(line.get_points("xy")) for line in space.query(f'LWPOLYLINE[layer=="{layer}"]')]


def texts(space):
    return [text.dxf.text for text in space.query("TEXT")]


def test_the_profile_has_every_wire_and_dropper_where_it_hangs(state):
    space, mesh = opened(profile_drawing(state)), state.shape.mesh
    for chain in mesh.chains:
        (line,) = points(space, chain.component)
        np.testing.assert_allclose(line, state.positions[chain.nodes][:, [0, 2]], atol=1e-9)
    droppers = points(space, "droppers")
    np.testing.assert_allclose(droppers, state.positions[mesh.droppers][:, :, [0, 2]], atol=1e-9)
    written = texts(space)
    for length in state.unstrained_length:
        assert f"{1e3 * length:.0f}" in written
    assert written.count("50.00") == 4
    assert "x 150.00" in written
    assert len(points(space, "supports")) == 5


def test_wires_are_chords_in_the_plan_of_a_curve(state):
    """In space a wire is straight between its supports but for its stiffness at the arms; in arc length it is bowed."""
    space, mesh = opened(plan_drawing(state)), state.shape.mesh
    (line,) = points(space, "contact_wire")
    (chain,) = mesh.contact_chains()
    bowed = state.positions[chain.nodes][:, :2]
    x = mesh.points[chain.nodes, 0]  # before the wire is stretched
    inside = (x >= 100.0) & (x <= 150.0)
    sag = 50.0**2 / (8.0 * RADIUS)
    assert arrow(bowed[inside]) == pytest.approx(sag, rel=0.05)
    assert arrow(line[inside]) < 0.02 * sag
    (axis,) = points(space, "track")
    np.testing.assert_allclose(np.hypot(axis[:, 0], axis[:, 1] - RADIUS), RADIUS, atol=1e-6)
    assert arrow(axis) == pytest.approx(200.0**2 / (8.0 * RADIUS), rel=0.01)
    # Left of the track, so nearer to the middle of the curve, by the stagger where an arm holds the wire.
    at_arm = line[np.flatnonzero(x == 150.0)[0]]
    offset = RADIUS - np.hypot(at_arm[0], at_arm[1] - RADIUS)
    assert offset == pytest.approx(bowed[np.flatnonzero(x == 150.0)[0], 1], abs=1e-6)
    assert texts(space).count("+200") == 3
    assert len(points(space, "steady_arms")) == 3


def arrow(line):
    """Return how far a line is from its chord at most [m]."""
    chord = line[-1] - line[0]
    normal = np.array([-chord[1], chord[0]]) / np.hypot(*chord)
    return float(np.abs((line - line[0]) @ normal).max())


def test_the_axis_of_a_transition_is_a_clothoid():
    """Straight, a transition over 100 m, an arc: against the series of the clothoid, and a jump of curvature."""
    axis = _Axis(Track(positions=(0.0, 100.0), radius=(0.0, 400.0)), -50.0, 250.0)
    places = axis.beside(np.array([[-50.0, 0, 0], [0.0, 2.0, 0], [100.0, 0, 0]]))
    np.testing.assert_allclose(places[0], [-50.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(places[1], [0.0, 2.0], atol=1e-9)
    b = 1.0 / (2.0 * 100.0 * 400.0)  # angle = b s^2
    s = 100.0
    x = s - b**2 * s**5 / 10 + b**4 * s**9 / 216
    y = b * s**3 / 3 - b**3 * s**7 / 42 + b**5 * s**11 / 1320
    np.testing.assert_allclose(places[2], [x, y], atol=1e-8)
    jump = _Axis(Track(positions=(10.0, 10.0), curvature=(0.0, 0.002)), 0.0, 60.0)
    end = jump.beside(np.array([[60.0, 0.0, 0.0]]))[0]
    np.testing.assert_allclose(end, [10.0 + 500.0 * np.sin(0.1), 500.0 * (1.0 - np.cos(0.1))], atol=1e-8)


def test_wires_of_sections_have_layers_of_their_own(sections_maker, section_maker):
    line = sections_maker(section_maker(0.0, 4, [0.2, -0.2, 0.2]), section_maker(150.0, 4, [-0.2, 0.2, -0.2]))
    space = opened(plan_drawing(kept_form(line, build_mesh(line))))
    assert len(points(space, "contact_wire_1")) == len(points(space, "contact_wire_2")) == 1
    assert texts(space).count("x 150.00") == 1


def test_without_ezdxf_a_sentence_says_what_to_do(state, monkeypatch):
    for name in [name for name in sys.modules if name.split(".")[0] == "ezdxf"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "ezdxf", None)
    with pytest.raises(
        LayoutError, match=r"^--dxf: needs ezdxf, which is not installed: pip install 'openpanto\[dxf\]'"
    ):
        plan_drawing(state)

"""Room under bridges: heights node by node, and the lift by a solution of the whole line in nodal coordinates."""

import dataclasses

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve

from models.catenary.definition.overbridge_definition import Overbridge
from models.catenary.line_model import CatenaryModel
from models.catenary.shape.beam_elements import NODE_DOFS
from models.catenary.statics.elasticity import elasticity, rise_of_nodes
from models.catenary.statics.overbridge_room import highest_wires, overbridge_room
from tests.models.nodal_line import NodalLine

OVER = (
    Overbridge(name="wide", start=120.0, end=180.0, underside=7.0),
    Overbridge(name="narrow", start=171.3, end=171.4, underside=6.9, lift=0.08),
)


@pytest.fixture(scope="module")
def model(short_line):
    return CatenaryModel(dataclasses.replace(short_line, overbridge=OVER))


def test_heights_and_encumbrance_under_a_bridge(model):
    room = overbridge_room(model, 100.0)
    x, _, z = model.static.positions.T
    wide = (x > 119.9) & (x < 180.1)
    assert room.highest[0] == pytest.approx(z[wide].max(), abs=2e-3)
    assert room.highest[0] == pytest.approx(5.08 + 1.4, abs=2e-3)  # the messenger wire at the support at 150 m
    assert room.clearance == pytest.approx([7.0, 6.9] - room.highest)
    # In the middle of a span hangs its shortest dropper, from clamp to clamp.
    middle = np.abs(model.mesh.points[model.mesh.droppers[:, 0], 0] - 125.0).argmin()
    drop = np.diff(model.static.positions[model.mesh.droppers[middle], 2])[0]
    assert room.encumbrance[0] == pytest.approx(abs(drop), abs=2e-3)
    assert room.lift[1] == 0.08
    assert room.clearance_lifted[1] == pytest.approx(room.clearance[1] - 0.08)


def test_a_force_lifts_the_messenger_wire_as_in_nodal_coordinates(model):
    """A force that slackens nothing, at a node of the contact wire."""
    mesh, line = model.mesh, NodalLine(model)
    contact = next(c.nodes for c in mesh.contact_chains())
    node = contact[np.abs(mesh.points[contact, 0] - 171.0).argmin()]
    force = 5.0
    load = np.zeros(mesh.fixed.size)
    load[mesh.owner[node] * NODE_DOFS + 2] = force
    moved = np.zeros(mesh.fixed.size)
    moved[line.free] = spsolve(line.K, load[line.free])
    messenger = next(c.nodes for c in mesh.chains if c.component == "messenger_wire")
    x = float(model.static.positions[node, 0])
    found = rise_of_nodes(model, np.array([x]), force)[0, messenger]
    expected = moved[mesh.owner[messenger] * NODE_DOFS + 2]
    np.testing.assert_allclose(found, expected, atol=2e-3 * expected.max())
    assert expected.max() > 0.2 * elasticity(model, np.array([x]), force).value[0] * force


def test_the_lift_is_the_largest_rise_under_the_bridge(model):
    """Under 300 N droppers are slack: the contact wire rises by more."""
    messenger, contact = (
        next(c.nodes for c in model.mesh.chains if c.component == name) for name in ("messenger_wire", "contact_wire")
    )
    x = model.static.positions[messenger, 0]
    rises = rise_of_nodes(model, np.linspace(120.0, 180.0, 7), 300.0)
    highest = rises[:, messenger][:, (x > 120.0) & (x < 180.0)].max()
    assert overbridge_room(model, 300.0).lift[0] == pytest.approx(highest, rel=1e-3)
    assert rises[:, contact].max() > 1.05 * highest
    assert 0.02 < overbridge_room(model, 100.0).lift[0] < 0.06  # some of the 40 mm of the contact wire


def test_wires_of_other_sections_count_and_none_beyond_their_ends(sections_maker, section_maker):
    line = sections_maker(section_maker(0.0, 4, [0.2, -0.2, 0.2]), section_maker(150.0, 4, [-0.2, 0.2, -0.2]))
    over = [Overbridge(name=n, start=a, end=b, underside=8.0) for n, a, b in (("a", 10.0, 20.0), ("b", 160.0, 190.0))]
    static = CatenaryModel(dataclasses.replace(line, overbridge=tuple(over))).static
    found = highest_wires(static, over)
    ends = [c.nodes for c in static.shape.mesh.chains if c.component == "messenger_wire"]
    at = [np.interp(x, *static.positions[nodes][:, [0, 2]].T) for nodes, x in ((ends[0], 10.0), (ends[0], 190.0))]
    assert found[0] == pytest.approx(at[0], abs=0.02)
    assert found[1] >= at[1] - 1e-9
    beyond = (Overbridge(name="c", start=500.0, end=501.0, underside=8.0),)
    assert np.isnan(highest_wires(static, beyond)).all()

"""The mesh of every catenary type: wires, droppers, supports, arms."""

import itertools

import numpy as np
import pytest

from models.catenary.definition.line_definition import COMPONENTS
from models.catenary.shape.line_mesh import build_mesh, contact_wire_height
from models.catenary.shape.support_places import SupportPlaces
from models.library.catalogue import line_names, load_line


@pytest.fixture(scope="module", params=line_names())
def line_and_mesh(request):
    line = load_line(request.param)
    return line, build_mesh(line)


def chains(mesh, component):
    return [c for c in mesh.chains if c.component == component]


def test_nodes_are_numbered_along_the_track(line_and_mesh):
    _, mesh = line_and_mesh
    along = np.diff(mesh.points[:, 0]) >= 0.0
    assert (along | (np.diff(mesh.section) == 1)).all()
    assert (np.diff(mesh.section) >= 0).all()


def test_every_node_is_used_and_no_element_is_degenerate(line_and_mesh):
    _, mesh = line_and_mesh
    used = np.unique(mesh.beams)
    assert used.tolist() == list(range(len(mesh.points)))
    start, end = (mesh.points[mesh.beams[:, k]] for k in (0, 1))
    assert np.linalg.norm(end - start, axis=1).min() > 0.05


def test_wires_run_from_end_to_end_without_gap(line_and_mesh):
    line, mesh = line_and_mesh
    pairs = {(int(i), int(j)) for i, j in mesh.beams}
    for chain in mesh.chains:
        assert all((int(i), int(j)) in pairs for i, j in itertools.pairwise(chain.nodes))
        if chain.component != "stitch_wire":
            section = line.sections[chain.section]
            first, last = section.spans[0].start, section.spans[-1].end
            assert mesh.points[chain.nodes[0], 0] == pytest.approx(first)
            assert mesh.points[chain.nodes[-1], 0] == pytest.approx(last)
            if section.periodic:
                assert mesh.owner[chain.nodes[-1]] == chain.nodes[0]
            else:
                assert mesh.fixed[chain.nodes[[0, -1]], :3].all()


def test_six_elements_between_neighbouring_droppers(line_and_mesh):
    line, mesh = line_and_mesh
    for section, contact in zip(line.sections, chains(mesh, "contact_wire"), strict=True):
        x = mesh.points[contact.nodes, 0]
        for span in section.spans:
            for a, b in itertools.pairwise(span.droppers):
                assert ((x > a + 1e-6) & (x < b - 1e-6)).sum() == line.mesh.elements_between_droppers - 1


def test_droppers_hang_vertically_between_the_right_wires(line_and_mesh):
    line, mesh = line_and_mesh
    lower, upper = mesh.points[mesh.droppers[:, 0]], mesh.points[mesh.droppers[:, 1]]
    assert lower[:, 0] == pytest.approx(upper[:, 0])
    assert (upper[:, 2] > lower[:, 2]).all()
    spans = [span for section in line.sections for span in section.spans]
    assert sorted(lower[~mesh.is_hanger, 0]) == pytest.approx(sorted(x for s in spans for x in s.droppers))
    assert sorted(lower[mesh.is_hanger, 0]) == pytest.approx(sorted(x for s in spans for x in s.hangers))
    above = {"simple": "messenger_wire", "compound": "auxiliary_wire"}.get(line.type)
    for section, contact in enumerate(chains(mesh, "contact_wire")):
        own = mesh.droppers[~mesh.is_hanger & (mesh.section[mesh.droppers[:, 0]] == section)]
        assert np.isin(own[:, 0], contact.nodes).all()
        if above is not None:
            assert np.isin(own[:, 1], chains(mesh, above)[section].nodes).all()


def test_steady_arms_pull_the_wire_off_to_its_side(line_and_mesh):
    line, mesh = line_and_mesh
    arms = [s for section in line.sections for s in section.supports if s.has_steady_arm]
    assert len(mesh.arms) == len(arms)
    end, node = mesh.points[mesh.arms[:, 0]], mesh.points[mesh.arms[:, 1]]
    assert node[:, 1] == pytest.approx([s.stagger for s in arms])
    assert (np.sign(end[:, 1] - node[:, 1]) == np.sign(node[:, 1])).all()
    if line.steady_arm is not None:
        fall = np.arcsin((node[:, 2] - end[:, 2]) / line.steady_arm.length)
        assert fall == pytest.approx(np.full(len(arms), line.steady_arm.angle))


def test_stitch_wires_carry_the_droppers_next_to_the_supports():
    line = load_line("Re330")
    mesh = build_mesh(line)
    stitches = chains(mesh, "stitch_wire")
    (messenger,) = chains(mesh, "messenger_wire")
    supports = [s.x for s in line.sections[0].supports if s.has_steady_arm]
    assert len(stitches) == len(supports) == 14
    for stitch, x in zip(stitches, supports, strict=True):
        assert np.isin(stitch.nodes[[0, -1]], messenger.nodes).all()
        assert mesh.points[stitch.nodes[[0, -1]], 0] == pytest.approx([x - 9.0, x + 9.0])
        hung = mesh.droppers[np.isin(mesh.droppers[:, 1], stitch.nodes), 0]
        assert mesh.points[hung, 0] == pytest.approx([x - 5.0, x + 5.0])


def test_the_messenger_wire_is_relieved_between_the_clamps_of_a_stitch_wire():
    mesh = build_mesh(load_line("Re330"))
    relieved = mesh.beams[mesh.beside_stitch]
    assert set(mesh.component[mesh.beside_stitch]) == {COMPONENTS.index("messenger_wire")}
    length = np.abs(np.diff(mesh.points[relieved, 0], axis=1)).sum()
    assert length == pytest.approx(14 * 18.0)


def test_clamps_and_claws_are_counted_once():
    line = load_line("Re330")
    mesh = build_mesh(line)
    expected = 0.5 * len(mesh.droppers) + 0.25 * len(mesh.arms) + 2 * 0.25 * len(chains(mesh, "stitch_wire"))
    assert mesh.clamp_mass.sum() == pytest.approx(expected)


def test_rigid_and_elastic_supports_of_the_messenger_wire():
    rigid, elastic = (build_mesh(load_line(n)) for n in ("EN50318_2002", "EN50318_2018_AC_simple"))
    assert rigid.fixed[rigid.sprung, 1:3].all()
    assert elastic.fixed[elastic.sprung, 1].all()
    assert not elastic.fixed[elastic.sprung, 2].any()
    assert elastic.seat == pytest.approx(np.full(19, 6.28))


def test_pre_sag_begins_at_supports_or_at_the_first_dropper():
    ln2, ac = load_line("C270"), load_line("EN50318_2018_AC_simple")
    section = ln2.sections[0]
    middle = section.spans[12].start + 28.5
    assert contact_wire_height(SupportPlaces(ln2, section), middle) == pytest.approx(5.3 - 0.057)
    section = ac.sections[0]
    start = section.spans[10].start
    sags = [5.08 - contact_wire_height(SupportPlaces(ac, section), x) for x in section.spans[10].droppers[:5]]
    assert np.array(sags) == pytest.approx(np.array([0.0, 0.024, 0.041, 0.052, 0.055]), abs=5e-4)
    assert contact_wire_height(SupportPlaces(ac, section), start + 1.0) == 5.08


def test_measured_heights_replace_the_rule(line_maker):
    measured = {"positions": [[0.0, 150.0, 300.0], "m", "test"], "heights": [[5.2, 5.0, 5.1], "m", "test"]}
    line = line_maker(measured=measured)
    section = line.sections[0]
    heights = [contact_wire_height(SupportPlaces(line, section), x) for x in (75.0, 150.0, 225.0)]
    assert heights == pytest.approx([5.1, 5.0, 5.05])


def test_mesh_grows_in_proportion_to_the_line(line_maker):
    nodes = [len(build_mesh(line_maker(spans=n)).points) for n in (10, 20, 40)]
    assert nodes[2] - nodes[1] == pytest.approx(2 * (nodes[1] - nodes[0]), abs=2)

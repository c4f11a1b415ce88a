"""Lines of several sections: reading, geometry of the overlap, mechanical independence."""

import numpy as np
import pytest

from models.catenary.contact_and_slack.crossing import STRIP_EDGE
from models.catenary.line_model import CatenaryModel
from models.catenary.line_part import CatenaryPart
from models.catenary.line_state import StripMotion
from models.catenary.statics.rest_profile import arm_loads
from models.definition_files.toml_reader import DefinitionError
from models.library.catalogue import LIBRARY, load_line

#: Half of the pan-head's working length [m].
HALF_STRIP = 0.725


@pytest.fixture(scope="module")
def overlap():
    return CatenaryModel(load_line("LN2_overlap"))


@pytest.fixture(scope="module")
def pair(section_maker, sections_maker):
    """Two sections of four spans that share two of them."""
    left = section_maker(0.0, 4, [0.2, -0.2, 0.2])
    right = section_maker(100.0, 4, [0.2, -0.2, 0.2])
    return sections_maker(left, right)


def height(model, section, x):
    wire = model.wires[section]
    element, xi = wire.locate(x)
    return wire.interval(element).lift(element, xi)[1]


def lateral(model, section, x):
    nodes = model.mesh.contact_chains()[section].nodes
    return np.interp(x, *model.static.positions[nodes, :2].T)


def test_every_section_has_its_own_spans_stagger_and_ends(pair):
    assert [s.supports[0].x for s in pair.sections] == [0.0, 100.0]
    assert [s.supports[-1].x for s in pair.sections] == [200.0, 300.0]
    assert [len(s.spans) for s in pair.sections] == [4, 4]


def test_mistakes_name_their_section(section_maker, sections_maker):
    wrong = section_maker(100.0, 4, [0.2, -0.2])
    with pytest.raises(DefinitionError, match=r"section\[2\]\.stagger\.listed: has 2 values where 3 are needed"):
        sections_maker(section_maker(0.0, 4, [0.2, -0.2, 0.2]), wrong)


def test_spans_of_the_line_and_sections_exclude_each_other(section_maker, line_maker):
    with pytest.raises(DefinitionError, match="spans: every section has its own"):
        line_maker(section=[section_maker(0.0, 4, [0.2, -0.2, 0.2])])


def test_one_section_written_as_a_list_is_the_same_line(section_maker, sections_maker, line_maker):
    listed = sections_maker(section_maker(0.0, 4, [0.2, -0.2, 0.2]))
    assert listed.sections == line_maker(spans=4).sections


def test_a_listing_may_stand_for_several_spans(section_maker, sections_maker):
    section = section_maker(0.0, 4, [0.2, -0.2, 0.2])
    section["spans"]["listed"] = [{"span": 2, "to": 3, "positions": [[10.0, 40.0], "m", "test"]}]
    spans = sections_maker(section).sections[0].spans
    assert [len(s.droppers) for s in spans] == [7, 2, 2, 7]


def test_the_rise_may_begin_within_a_span(section_maker, sections_maker):
    line = sections_maker(section_maker(0.0, 6, [0.2, -0.2, 0.2, -0.2, 0.2], length=[75.0, "m", "test"]))
    ends = line.sections[0].ends
    assert ends.working == (75.0, 225.0)
    assert ends.rise_at(75.0) == 0.0
    assert ends.rise_at(50.0) == pytest.approx(0.1 / 9.0)
    assert [s.has_steady_arm for s in line.sections[0].supports] == [False, *[True] * 5, False]


def test_the_ends_may_differ(section_maker, sections_maker):
    ends = {"end": {"spans": 2, "rise": [0.3, "m", "test"]}}
    section = sections_maker(section_maker(0.0, 6, [0.2, -0.2, 0.2, -0.2], **ends)).sections[0]
    assert section.ends.working == (50.0, 200.0)
    assert section.ends.rise_at(0.0) == pytest.approx(0.1)
    assert section.ends.rise_at(300.0) == pytest.approx(0.3)
    assert [s.has_steady_arm for s in section.supports] == [False, True, True, True, True, False, False]


def test_sections_do_not_act_on_each_other(overlap):
    section = overlap.mesh.section[overlap.modes.attached // 6]
    for matrix in (overlap.modes.K, overlap.modes.M, overlap.modes.C):
        entries = matrix.tocoo()
        assert (section[entries.row] == section[entries.col]).all()


def test_the_section_touched_answers_as_if_it_were_alone(section_maker, sections_maker):
    left, right = section_maker(0.0, 4, [0.2, -0.2, 0.2]), section_maker(250.0, 4, [0.2, -0.2, 0.2])
    alone, both = CatenaryModel(sections_maker(left)), CatenaryModel(sections_maker(left, right))
    forces = [_pushed(model, 80.0) for model in (alone, both)]
    assert forces[0].max() > 50.0
    assert forces[1][:, 0] == pytest.approx(forces[0][:, 0], abs=1e-6)
    assert not forces[1][:, 1].any()


def _pushed(model, start, steps=200):
    state, forces = model.initial_state(), []
    for k in range(1, steps + 1):
        x = start + 0.08 * k
        strip = [[[x, side * HALF_STRIP, 5.07], [80.0, 0.0, 0.0]] for side in (1, -1)]
        forces.append(model.step(state, 1e-3, StripMotion(np.array([strip]), np.zeros(1))).force[0])
    return np.array(forces)


def test_overlap_has_the_supports_and_spans_that_are_printed():
    line = load_line("LN2_overlap")
    x = sorted(s.x for section in line.sections for s in section.supports)
    for wanted in (798.6, 1292.0, 1242.0, 1778.0):  # Table 5.10
        assert min(abs(a - wanted) for a in x) < 0.01
    for section in line.sections:  # Table 5.11 and the text of section 5.4
        assert 24 <= len(section.spans) <= 26
        assert all(45.0 <= s.length <= 54.0 for s in section.spans)
        assert 7 <= min(len(s.droppers) for s in section.spans) <= max(len(s.droppers) for s in section.spans) <= 8
        first, last = section.ends.working
        assert 21 <= sum(first <= s.start and s.end <= last for s in section.spans) <= 23
        assert section.spans[-1].end - section.spans[0].start < 1500.0
    for start, end in ((798.6, 1292.0), (1242.0, 1778.0)):
        between = {s.x for section in line.sections for s in section.supports if start - 0.01 < s.x < end + 0.01}
        assert len(between) == 11


def test_incoming_wire_comes_down_as_the_outgoing_one_rises(overlap):
    first, middle, last = 997.1, 1046.9, 1095.7
    assert height(overlap, 0, middle) == pytest.approx(height(overlap, 1, middle), abs=1e-3)
    x = np.linspace(first, last, 81)
    change = np.diff([height(overlap, 1, a) - height(overlap, 0, a) for a in x])
    assert (change < 2e-3).all()  # a sag between two droppers of one wire beside a dropper of the other
    for working, raised, at in ((0, 1, first), (1, 0, last)):
        assert height(overlap, working, at) == pytest.approx(5.08, abs=0.02)
        assert height(overlap, raised, at) == pytest.approx(5.58, abs=0.02)


def test_the_wires_cross_in_plan_within_the_strip_one_above_the_other(overlap):
    x = np.linspace(997.1, 1095.7, 199)
    y = np.array([[lateral(overlap, s, a) for a in x] for s in (0, 1)])
    assert np.abs(y).max() < HALF_STRIP - STRIP_EDGE
    crossings = x[np.flatnonzero(np.diff(np.sign(y[0] - y[1])))]
    assert crossings == pytest.approx([1046.9 - 33.2, 1046.9 + 32.5], abs=1.0)
    for at in crossings:
        assert abs(height(overlap, 0, at) - height(overlap, 1, at)) > 0.2
    assert lateral(overlap, 1, 1046.9) - lateral(overlap, 0, 1046.9) == pytest.approx(0.4, abs=0.03)


def test_every_dropper_and_every_arm_of_the_overlap_is_in_tension(overlap):
    assert overlap.static.dropper_force.min() > 0.0
    assert arm_loads(overlap).lateral.min() > 0.0


def test_supports_and_droppers_of_two_sections_have_different_names(pair):
    part = CatenaryPart(pair)
    for sites in (part.supports, part.droppers):
        names = [s.name for s in sites]
        assert len(set(names)) == len(names)
    assert [s.name for s in part.supports] == [f"{i} of section {s}" for s in (1, 2) for i in (1, 2, 3)]
    assert [s.section for s in part.supports] == [1, 1, 1, 2, 2, 2]
    assert part.geometry.support_section.tolist() == [1, 1, 1, 2, 2, 2]


def test_supports_of_one_section_are_plain_numbers(line_maker):
    assert [s.name for s in CatenaryPart(line_maker(spans=4)).supports] == ["1", "2", "3"]


def test_a_wire_that_is_not_near_would_not_be_met_either(pair):
    """What is known without searching, and what a search finds: strips before, at and beyond the ends of a wire."""
    model = CatenaryModel(pair)
    wire, state = model.wires[0], model.initial_state()
    first, last = wire.ends
    near = []
    for x in (first - 3.0, first - 0.5, first + 5.0, last - 5.0, last + 0.5, last + 3.0):
        strip = np.zeros((2, 2, 3))
        strip[:, 0] = [[x, 0.7, 5.0], [x, -0.7, 5.0]]
        met = wire.find(strip, lambda i: i.positions(i.local(state.motion)[0]), -1) is not None
        near.append(wire.is_near(strip))
        assert near[-1] or not met
    assert near == [False, True, True, True, True, False]


@pytest.mark.parametrize("name", ["spans", "stagger", "ends", "measured", "supports"])
def test_what_belongs_to_sections_is_told_where_to_go(tmp_path, name):
    text = (LIBRARY / "lines" / "LN2_overlap.toml").read_text(encoding="utf-8")
    (tmp_path / "wrong.toml").write_text(f"{text}\n[{name}]\nanything = 1\n", encoding="utf-8")
    with pytest.raises(DefinitionError) as caught:
        load_line(str(tmp_path / "wrong.toml"))
    assert f"{name}: every section has its own: write [section.{name}] below its [[section]]" in str(caught.value)
    assert "anything" not in str(caught.value)

"""Every line of the library says what its source says."""

import numpy as np
import pytest

from models.catenary.shape.line_mesh import build_mesh
from models.library.catalogue import line_names, line_path, load_line

SOURCE_LINES = ("C270", "LN1", "LN2", "LN6", "Re330", "Shinkansen", "generic_simple")


def test_all_lines_of_the_source_are_there():
    assert set(line_names()) >= {*SOURCE_LINES, "EN50318_2002", "EN50318_2018_AC_simple"}


@pytest.mark.parametrize("name", line_names())
def test_every_value_has_a_source_and_the_name_is_the_files(name):
    line = load_line(name)
    assert line.name == name == line_path(name).stem
    assert line.title
    for key, value in line.provenance.items():
        assert value.source.strip(), key
        if value.is_choice:
            assert len(value.source) > len("choice: "), f"{key}: a choice says why"


@pytest.mark.parametrize(
    ("name", "tensions"),
    [
        ("LN1", {"contact_wire": 15e3, "messenger_wire": 14e3}),  # figure 2.3
        ("LN2", {"contact_wire": 20e3, "messenger_wire": 14e3}),  # Table 5.2
        ("LN6", {"contact_wire": 26e3, "messenger_wire": 20e3}),  # Table 2.1
        ("C270", {"contact_wire": 20e3, "messenger_wire": 16e3}),  # Table 5.3
        ("Re330", {"contact_wire": 27e3, "messenger_wire": 21e3, "stitch_wire": 3500.0}),  # Table 5.4
        ("Shinkansen", {"contact_wire": 19.6e3, "messenger_wire": 21.6e3, "auxiliary_wire": 12.7e3}),  # Table 2.1
    ],
)
def test_tensions(name, tensions):
    line = load_line(name)
    assert {wire: getattr(line, wire).tension for wire in tensions} == tensions
    for wire in tensions:
        assert not line.provenance[f"{wire}.tension"].is_choice


@pytest.mark.parametrize(
    ("name", "first", "last", "count"),
    [("LN2", 86.9, 1046.9, 21), ("C270", 114.0, 1311.0, 22), ("Re330", 120.0, 937.0, 14)],  # Tables 5.6, 5.8, 5.9
)
def test_steady_arms_stand_where_the_printed_uplifts_are(name, first, last, count):
    mesh = build_mesh(load_line(name))
    x = mesh.points[mesh.arms[:, 1], 0]
    assert (len(x), x[0], x[-1]) == (count, pytest.approx(first), pytest.approx(last))


def test_all_steady_arms_of_LN2():
    printed = [86.9, 132.2, 177.7, 222.7, 267.7, 312.7, 357.7, 402.7, 452.2, 501.7, 551.2, 600.7, 650.2, 699.7]
    printed += [749.1, 798.6, 848.1, 897.6, 947.1, 997.1, 1046.9]
    mesh = build_mesh(load_line("LN2"))
    assert np.abs(mesh.points[mesh.arms[:, 1], 0] - printed).max() < 0.11


@pytest.mark.parametrize(("name", "length"), [("C270", 1425.0), ("Re330", 1057.0), ("LN2", 1140.0)])
def test_lengths_of_the_lines(name, length):
    supports = load_line(name).sections[0].supports
    assert supports[-1].x - supports[0].x == pytest.approx(length, abs=3.0)


def test_EN_50318_2002_is_plane_and_has_massless_droppers():
    line = load_line("EN50318_2002")
    assert line.steady_arm is None
    assert all(s.stagger == 0.0 for s in line.sections[0].supports)
    assert line.dropper.mass == 0.0
    spans = line.sections[0].spans
    assert len(spans) == 10
    assert [x - spans[4].start for x in spans[4].droppers] == pytest.approx([5, 10.5, 17, 23.5, 30, 36.5, 43, 49.5, 55])


def test_EN_50318_2018_droppers():
    spans = load_line("EN50318_2018_AC_simple").sections[0].spans
    assert len(spans) == 20
    assert [x - spans[7].start for x in spans[7].droppers] == pytest.approx([4.5 + 5.75 * i for i in range(9)])

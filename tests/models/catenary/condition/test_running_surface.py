"""Running surfaces: the height that was asked for, smooth, from measured points or from a spectrum."""

import dataclasses

import numpy as np
import pytest

from models.catenary.condition.running_surface import RunningSurface, SurfacePiece, running_surfaces
from models.catenary.definition.line_reading import load
from models.catenary.definition.surface_definition import RunningSurface as Surface
from models.definition_files.parameter import ParameterError
from models.definition_files.toml_reader import DefinitionError
from models.library.catalogue import load_line
from models.numerics.random_numbers import uniform_numbers
from tests.models.conftest import make_fault

GENERATED = {
    "sigma": [0.222486, "mm", "test"],
    "exponent": [2, "1", "test"],
    "from": [0.02, "1/m", "test"],
    "to": [2, "1/m", "test"],
    "seed": 3,
}


def _surface(line):
    (found,) = running_surfaces(line)
    return found


def test_a_line_without_has_none(short_line):
    assert running_surfaces(short_line) == (None,)


def test_pieces_are_level_beyond_their_ends_and_add_up():
    bump = SurfacePiece.bump(10.0, 2.0, 1e-3)
    worn = SurfacePiece.raised(8.0, 30.0, -5e-4, 1.0)
    both = RunningSurface((bump, worn))
    assert [both.height(x) for x in (0.0, 9.0, 10.0, 11.0, 20.0, 40.0)] == [0.0, -5e-4, 5e-4, -5e-4, -5e-4, 0.0]
    assert [both.slope(x) for x in (0.0, 9.0, 10.0, 11.0, 20.0, 30.0)] == [0.0] * 6
    whole = both.whole()
    assert [whole.at(x) for x in (0.0, 9.3, 10.4, 40.0)] == [pytest.approx(both.at(x)) for x in (0.0, 9.3, 10.4, 40.0)]
    x = np.linspace(7.0, 31.0, 2001)
    heights = np.array([both.height(v) for v in x])
    slopes = np.array([both.slope(v) for v in x])
    assert np.abs(np.gradient(heights, x) - slopes)[1:-1].max() < 3e-5
    assert np.abs(np.diff(slopes)).max() < 1e-4  # nowhere a kink


def test_a_piece_through_points_bulges_little_beside_a_kink_and_follows_waves():
    kink = SurfacePiece.through(np.array([0.0, 100.0, 100.5, 101.0, 300.0]), np.array([0.0, 0.0, 1e-3, 0.0, 0.0]))
    assert max(abs(kink.at(x)[0]) for x in np.linspace(0.0, 100.0, 401)) <= 4.0 / 27.0 * 1e-3
    x = np.arange(0.0, 10.01, 0.2)  # ten points a wave
    wave = SurfacePiece.through(x, np.cos(np.pi * x))
    between = np.linspace(2.0, 8.0, 1001)
    assert max(abs(wave.at(v)[0] - np.cos(np.pi * v)) for v in between) < 0.012


def test_a_ring_repeats_its_surface_after_a_lap():
    surface = RunningSurface((SurfacePiece.bump(5.0, 2.0, 1e-3),), start=-10.0, period=40.0)
    for lap in (-1, 1, 25):
        assert surface.at(5.3 + 40.0 * lap) == pytest.approx(surface.at(5.3))
    assert surface.height(5.0) == 1e-3


def test_a_generated_surface_is_the_printed_sum_of_waves(line_maker):
    """A = 1e-9, w = 2 from 0.02 to 2 1/m: sigma 0.2225 mm."""
    line = line_maker(spans=4, running_surface=GENERATED)
    A, k = 1e-9, 0.02 + 1.98 / 1024 * (np.arange(1024) + 0.5)
    assert line.running_surface.sigma == pytest.approx(np.sqrt(A * (1 / 0.02 - 1 / 2)), rel=2e-6)
    amplitude = np.sqrt(2.0 * A * k**-2.0 * 1.98 / 1024)
    assert np.sqrt(0.5 * amplitude @ amplitude) == pytest.approx(2.225e-4, rel=1e-3)
    phase = 2.0 * np.pi * uniform_numbers(3, 5, 1024)
    x = np.random.default_rng(1).uniform(0.0, 200.0, 50)
    turns = 2.0 * np.pi * np.outer(x, k) + phase
    surface = _surface(line)
    assert [surface.height(v) for v in x] == pytest.approx(np.cos(turns) @ amplitude, abs=2e-9)
    assert [surface.slope(v) for v in x] == pytest.approx(-np.sin(turns) @ (2.0 * np.pi * k * amplitude), abs=1e-6)


def test_an_exponent_of_one_has_its_sigma_too():
    from models.catenary.condition.running_surface import spectrum

    _, amplitude = spectrum(Surface(sigma=1e-4, exponent=1.0, from_=0.1, to=1.0, seed=0))
    assert np.sqrt(0.5 * amplitude @ amplitude) == pytest.approx(1e-4, rel=1e-4)


def test_seeds_differ_sigma_scales_and_sections_have_their_own(line_maker, sections_maker, section_maker):
    line = line_maker(spans=4, running_surface=GENERATED)
    once, other, twice = (
        _surface(line.with_values(values)).height(70.0)
        for values in ({}, {"running_surface.seed": 4}, {"running_surface.sigma": 4.44972e-4})
    )
    assert once != other
    assert twice == pytest.approx(2.0 * once, abs=2e-12)
    assert running_surfaces(line.with_values({"running_surface.sigma": 0.0})) == (None,)
    sections = [section_maker(x, 4, [0.2, -0.2, 0.2]) for x in (0.0, 150.0)]
    first, second = running_surfaces(sections_maker(*sections, running_surface=GENERATED))
    assert first.height(70.0) == once
    assert first.height(170.0) != second.height(170.0)


def test_waves_close_in_a_ring(ring_maker):
    surface = _surface(ring_maker(4, running_surface=GENERATED))
    before, after = surface.at(200.0 - 1e-7), surface.at(200.0)
    assert before == pytest.approx(after, abs=1e-8)


def test_what_generates_a_surface_is_a_parameter(line_maker):
    line = line_maker(spans=4, running_surface={k: v for k, v in GENERATED.items() if k != "seed"})
    found = {p.name: p.value for p in line.parameters() if p.name.startswith("running_surface")}
    assert found == {f"running_surface.{k}": v for k, v in {
        "sigma": pytest.approx(2.22486e-4), "exponent": 2.0, "from": 0.02, "to": 2.0, "seed": 0.0,
    }.items()}  # fmt: skip
    with pytest.raises(ParameterError, match=r"running_surface.to: 0.01 1/m must be greater than from, 0.02 1/m"):
        line.with_values({"running_surface.to": 0.01})


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ({}, "running_surface: says nothing of the surface: give profile, or sigma, exponent, from and to"),
        ({"sigma": GENERATED["sigma"]}, "running_surface.to: is missing: a generated surface takes sigma"),
        ({"from": GENERATED["from"]}, "running_surface.sigma: is missing"),
        ({**GENERATED, "profile": "wear.csv"}, "running_surface.profile: gives the surface, and so does sigma"),
        ({**GENERATED, "to": [0.01, "1/m", "test"]}, "running_surface.to: 0.01 1/m must be greater than from"),
        ({**GENERATED, "sigma": [0.2, "m", "test"]}, "running_surface.sigma: 0.2 m is outside 0 ... 0.01 m"),
        ({"profile": ""}, "running_surface.profile: is empty"),
        ({"profile": 3}, "running_surface.profile: 3 is not a text in quotation marks"),
        ({"profil": "wear.csv"}, "running_surface.profil: unknown key"),
    ],
)
def test_a_wrong_table_is_told(line_maker, table, said):
    with pytest.raises(DefinitionError) as caught:
        line_maker(spans=4, running_surface=table)
    assert said in str(caught.value)


@pytest.fixture
def profiled(tmp_path, line_maker):
    """Read a line of a file, with a profile beside it."""
    from models.library.catalogue import line_path

    def read(content, *, carried=False, name="wear.csv", library="LN2"):
        (tmp_path / ("running_surface.csv" if carried else name)).write_bytes(content)
        line = tmp_path / "worn.toml"
        text = line_path(library).read_text(encoding="utf-8")
        line.write_text(f'{text}\n[running_surface]\nprofile = "{name}"\n', encoding="utf-8")
        return load(line, carried=carried)

    return read


@pytest.mark.parametrize(
    "content",
    [
        b"position,height\n300,0\n300.5,0.001\n301,0\n",
        b"\xef\xbb\xbfheight [mm];position [cm]\n0;30000\n1,0;30050\n0;30100,0\n",
        b"Position [m]\tHEIGHT [mm]\r\n300\t0\r\n\r\n300.5\t1\r\n301\t0\r\n",
    ],
)
def test_a_profile_is_read(profiled, content):
    points = profiled(content).running_surface.points
    assert np.array(points) == pytest.approx(np.array([(300.0, 0.0), (300.5, 1e-3), (301.0, 0.0)]))


def test_a_profile_is_no_parameter_and_an_fmu_has_its_own_name_for_it(profiled):
    line = profiled(b"position,height\n300,0\n301,1e-3\n", carried=True)
    assert _surface(line).height(301.0) == 1e-3
    assert not [p for p in line.parameters() if p.name.startswith("running_surface")]


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "wear.csv, line 1: has no column 'position': write 'position [m],height [mm]'"),
        (b"x,height\n", "wear.csv, line 1, column 1: 'x' is none of the columns position and height"),
        (b"position [N],height\n0,0\n", "wear.csv, line 1, column 1: "),
        (b"position,height,height\n0,0\n", "wear.csv, line 1, column 3: 'height' is the name of a column before it"),
        (b"position,height\n0,0\n", "wear.csv: has 1 points where a surface takes at least 2"),
        (b"position,height\n0,0\n1,\n", "wear.csv, line 3: has no height"),
        (b"position,height\n0,0\n1,nan\n", "wear.csv, line 3, height: 'nan' is not a number that a wire can have"),
        (b"position,height\n0,0\n1,5.3\n", "line 3: a height of 5.3 m is more than 0.05 m from the static shape"),
        (b"position,height\n1,0\n0,0\n", "wear.csv, line 3: the position 0 m does not lie beyond that before it, 1 m"),
        (b"position,height\n0,0\n1,0,3\n", "wear.csv, line 3: has 3 values for 2 columns"),
        (b"position,height\n0,\xff\n", "wear.csv: is not UTF-8 text (line 2): save it as UTF-8"),
    ],
)
def test_a_wrong_profile_is_told(profiled, content, said):
    with pytest.raises(DefinitionError) as caught:
        profiled(content)
    assert said in str(caught.value)
    assert str(caught.value).startswith(str(caught.value.problems[0].file))
    assert "beside the line" not in str(caught.value), "where its other points are says nothing"


@pytest.mark.parametrize(
    ("ring", "points", "said"),
    [
        (False, "1200,0\n1210,0", "wear.csv: lies at 1200 ... 1210 m, beside the line, which is at -3.1 ... 1136.9 m"),
        (
            True,
            "900,0\n1000,0",
            "wear.csv: lies at 900 ... 1000 m: a line that closes on itself has one lap, 0 ... 990 m",
        ),
        (True, "0,0.0001\n990,0", "the last height must be the first, 0.1 mm, not 0 mm"),
    ],
)
def test_a_profile_of_another_place_is_told(profiled, ring, points, said):
    with pytest.raises(DefinitionError) as caught:
        profiled(f"position,height\n{points}\n".encode(), library="LN2_ring" if ring else "LN2")
    assert said in str(caught.value)


def test_all_mistakes_of_a_profile_are_told_at_once(profiled):
    with pytest.raises(DefinitionError) as caught:
        profiled(b"position,height\n0,x\n1,0\n0,0\n2,\n")
    assert [f"line {n}" in str(caught.value) for n in (2, 3, 4, 5)] == [True, False, True, True]


def test_a_profile_that_is_not_there_is_told(tmp_path, profiled):
    profiled(b"position,height\n0,0\n1,0\n")
    (tmp_path / "wear.csv").unlink()
    with pytest.raises(DefinitionError, match=rf"wear\.csv: there is no such file in {tmp_path}$"):
        load(tmp_path / "worn.toml")


WORN = {"section": 1, "from_": 100.0, "to": 150.0, "value": 0.1, "lost_thickness": 1e-3}
BUMP = {"position": 120.0, "value": 0.0, "height": -5e-4, "length": 2.0}


def test_faults_that_act_add_their_pieces(short_line):
    """Strips run higher where the wire is worn, and lower where something stands out; level at all ends."""
    both = make_fault("wear", **WORN), make_fault("hard_point", **BUMP)
    surface = _surface(dataclasses.replace(short_line, fault=both))
    places = {99.0: 0.0, 100.0: 0.0, 100.5: 5e-4, 101.0: 1e-3, 120.0: 5e-4, 121.0: 1e-3, 149.0: 1e-3, 150.0: 0.0}
    assert [surface.height(x) for x in places] == pytest.approx(list(places.values()), abs=1e-12)
    assert not any(surface.slope(x) for x in (100.0, 101.0, 120.0, 149.0, 150.0))
    dormant = tuple(dataclasses.replace(fault, active=0) for fault in both)
    assert running_surfaces(dataclasses.replace(short_line, fault=dormant)) == (None,)
    plain = make_fault("wear", **(WORN | {"lost_thickness": None})), make_fault("arm_loose", support=1)
    assert running_surfaces(dataclasses.replace(short_line, fault=plain)) == (None,)


def test_a_bump_at_the_seam_of_a_ring_is_whole():
    line = load_line("LN2_ring")
    (section,) = line.sections
    seam = section.spans[0].start
    surface = _surface(
        dataclasses.replace(line, fault=(make_fault("hard_point", **(BUMP | {"position": seam + 0.25})),))
    )
    assert surface.height(seam + 0.25) == pytest.approx(-5e-4)
    assert surface.height(seam) == pytest.approx(surface.height(seam + 0.5))
    assert surface.height(seam + section.period - 0.25) == pytest.approx(-2.5e-4)

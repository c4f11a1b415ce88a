"""A project as it is written: a scenario that reads as it is meant, and files that say what they are."""

from dataclasses import replace

import pytest

from master.errors import RequestError
from master.scenario.project.new_project import (
    Definition,
    Lift,
    Request,
    check_folder,
    new_project,
    project_files,
    project_name,
)
from master.scenario.project.stretch import Wire
from master.ssp.archive import SSD_NAME, Sources
from master.ssp.ssd import read_structure
from master.ssp.ssp_xml import Reader

WIRE = Wire("LN2", 100.0, 1300.0, tuple(range(100, 1301, 50)), 5.03, 5.08)
LINE = Definition("demo_LN2", 'name = "demo_LN2"\n', "copy of LN2 in the library")
CX = Definition("demo_CX", 'name = "demo_CX"\n', "copy of CX in the library")
MULTIBODY = Definition("demo_M", 'name = "demo_M"\n', "copy of M in the library")
LIFTS = {"demo_CX": Lift("static_force", "N", 168.0, True), "demo_M": Lift("static_moment", "N.m", 1313.7, False)}
ENDS = [f"{end}.{axis}" for end in "AB" for axis in ("x", "y", "z", "vx", "vy", "vz")]


def request(folder, **changes):
    given = {"line": LINE, "wire": WIRE, "pantographs": [CX], "lifts": LIFTS, "separations": []}
    return Request(folder=folder, **(given | {"speed": 50.0, "mean_force": 120.0} | changes))


def read(scenario):
    """Return the structure that our own reader finds, which must find nothing wrong."""
    reader = Reader(SSD_NAME)
    structure = read_structure(Sources(scenario, (), None), reader)
    assert (reader.problems, reader.warnings) == ([], [])
    return structure


def values(structure, name):
    (component,) = [c for c in structure.components if c.name == name]
    return {p.name: (p.value, p.unit) for b in component.bindings for p in b.parameters.parameters}


def test_a_project_holds_a_scenario_own_definitions_and_a_page_on_them(tmp_path):
    folder = tmp_path / "demo"
    scenario = new_project(request(folder))
    assert scenario == folder / "demo.ssp"
    files = {p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file()}
    own = {"lines/demo_LN2.toml", "pantographs/demo_CX.toml"}
    assert files == {"openpanto.toml", "README.md", "demo.ssp/SystemStructure.ssd", "demo.ssp/pantograph.ssv"} | own
    assert (folder / "lines" / "demo_LN2.toml").read_text() == LINE.text
    page = (folder / "README.md").read_text()
    assert all(f"| `{file}` | " in page for file in files - {"README.md"})
    assert "constant" in page  # what the model does not have is said


def test_the_scenario_says_what_was_asked_for(tmp_path):
    structure = read(new_project(request(tmp_path / "demo")))
    assert [c.source for c in structure.components] == [
        "resources/Catenary_demo_LN2.fmu",
        "resources/Pantograph_demo_CX.fmu",
    ]
    assert len(structure.connections) == 16
    settings = structure.annotations.settings
    assert (settings.interval.start, settings.interval.end, settings.interval.until) == (300.0, 800.0, "end")
    assert (settings.calibration.parameter, settings.calibration.mean_force) == ("pantograph.static_force", 120.0)
    found = values(structure, "pantograph")
    assert found["speed"] == (50.0, "m/s")
    assert found["start_position"] == (110.0, "m")
    assert found["reference_height"] == (5.02, "m")  # below the lowest wire
    # The spring follows the height, so that the strip presses with it wherever the wire is.
    assert found["static_force"] == (120.0, "N")
    assert found["follow_height"][0] == 1


def test_where_the_height_changes_the_reference_is_told_its_rate(tmp_path):
    wire = replace(WIRE, changes_height=True)
    train = {"pantographs": [CX, MULTIBODY, CX], "separations": [50.0]}
    structure = read(new_project(request(tmp_path / "demo", wire=wire, **train)))
    rates = [c for c in structure.connections if c.start_connector.endswith("nominal.vz")]
    assert [(c.start_connector, c.end_element, c.end_connector) for c in rates] == [
        ("pantograph[1].nominal.vz", "pantograph_1", "reference.vz"),
        ("pantograph[3].nominal.vz", "pantograph_3", "reference.vz"),
    ]


def test_a_moment_that_lifts_is_left_as_the_definition_has_it(tmp_path):
    structure = read(new_project(request(tmp_path / "demo", pantographs=[MULTIBODY])))
    assert values(structure, "pantograph")["static_moment"] == (1313.7, "N.m")
    assert structure.annotations.settings.calibration.parameter == "pantograph.static_moment"


def test_a_train_has_a_port_and_a_start_for_each_pantograph(tmp_path):
    structure = read(new_project(request(tmp_path / "demo", pantographs=[CX, MULTIBODY, CX], separations=[50.0])))
    names = ["pantograph_1", "pantograph_2", "pantograph_3"]
    assert [c.name for c in structure.components] == ["catenary", *names]
    assert structure.components[0].source == "resources/Catenary_demo_LN2_P3.fmu"
    assert len(structure.connections) == 48
    assert [values(structure, n)["start_position"][0] for n in names] == [210.0, 160.0, 110.0]
    assert not list((tmp_path / "demo" / "pantographs").glob("demo_CX_*"))


def test_two_pantographs_are_leading_and_trailing(tmp_path):
    structure = read(new_project(request(tmp_path / "demo", pantographs=[CX, CX], separations=[50.0])))
    assert [c.name for c in structure.components] == ["catenary", "leading", "trailing"]


def test_a_pantograph_from_elsewhere_is_brought_along_and_set_as_far_as_it_can_be(tmp_path, make_fmu):
    outputs = dict.fromkeys(ENDS, "m")
    theirs = make_fmu("Theirs.fmu", {"push": "N"}, outputs, {"speed": "", "start": "m", "lift": "N"})
    maps = [("start_position", "start"), ("static_force", "lift")]
    scenario = new_project(request(tmp_path / "demo", pantographs=[theirs], maps=maps))
    structure = read(scenario)
    assert (scenario / "resources" / "Theirs.fmu").read_bytes() == theirs.read_bytes()
    assert values(structure, "pantograph") == {"speed": (50.0, ""), "start": (110.0, "m"), "lift": (1.5, "N")}
    assert structure.annotations.settings.calibration.parameter == "pantograph.lift"
    # The master follows a pantograph by start_position and speed; of another it knows the stop time alone.
    assert structure.annotations.settings.interval.until is None
    assert structure.stop == pytest.approx(14.3)
    joined = {(c.end_element, c.end_connector) for c in structure.connections}
    assert ("pantograph", "push") in joined
    assert len(joined) == 13
    page = (tmp_path / "demo" / "README.md").read_text()
    assert "values of `pantograph`: speed, start, lifting force |" in page
    assert "follow_height" not in page  # nobody knows how it is lifted


def test_a_pantograph_that_nothing_can_be_set_of_runs_as_it_is(tmp_path, make_fmu):
    theirs = make_fmu("Theirs.fmu", ["push"], ENDS)
    structure = read(new_project(request(tmp_path / "demo", pantographs=[theirs])))
    assert values(structure, "pantograph") == {}
    assert structure.annotations.settings.calibration is None
    page = (tmp_path / "demo" / "README.md").read_text()
    assert "Nothing is calibrated" in page
    assert "no parameter that sets its start and its speed, which must be as said above by itself" in page
    assert "pantograph.ssv" not in page


def test_a_line_from_elsewhere_gets_what_it_takes(tmp_path, make_fmu):
    theirs = make_fmu("Line.fmu", ["A.x", "A.z", "B.z"], ["contact.force"])
    structure = read(new_project(request(tmp_path / "demo", line=theirs, wire=None, interval=(400.0, 600.0))))
    assert [c.name for c in structure.components[0].connectors] == ["A.x", "A.z", "B.z", "contact.force"]
    assert len(structure.connections) == 4
    assert "reference_height" not in values(structure, "pantograph")


def test_a_name_before_the_port_says_whose_it_is(tmp_path, make_fmu):
    line = make_fmu("Line.fmu", ["h"], ["F"])
    theirs = make_fmu("Theirs.fmu", ["push", "q"], ENDS)
    maps = [("catenary.A.z", "h"), ("pantograph[1].contact.force", "F"), ("contact.force", "push")]
    more = {"line": line, "wire": None, "interval": (400.0, 600.0), "pantographs": [theirs], "maps": maps}
    structure = read(new_project(request(tmp_path / "demo", **more)))
    joined = {(c.start_connector, c.end_connector) for c in structure.connections}
    assert joined == {("A.z", "h"), ("F", "push")}


@pytest.mark.parametrize(
    ("folder", "name"),
    [
        ("demo", "demo"),
        ("my-line 1", "my_line_1"),
        ("a" * 50, "a" * 30),
        ("\N{LATIN SMALL LETTER U WITH DIAERESIS}b", "ub"),
        ("u\N{COMBINING DIAERESIS}b", "ub"),
        ("\N{CJK UNIFIED IDEOGRAPH-7DDA}b", "b"),
    ],
)
def test_a_project_is_named_after_its_folder(tmp_path, folder, name):
    assert project_name(tmp_path / folder) == name


@pytest.mark.parametrize("target", ["nothing", "link"])
def test_a_link_that_leads_nowhere_is_no_folder(tmp_path, target):
    (tmp_path / "link").symlink_to(target)
    with pytest.raises(RequestError, match="link is a link that leads nowhere: name a new folder"):
        new_project(request(tmp_path / "link"))


def test_a_folder_without_a_letter_gives_no_name(tmp_path):
    with pytest.raises(RequestError, match="gives the project no name"):
        project_name(tmp_path / "...")


def test_a_folder_that_holds_anything_is_left_alone(tmp_path):
    check_folder(tmp_path)
    (tmp_path / "notes").write_text("mine")
    with pytest.raises(RequestError, match="exists and is not empty: name a new folder, or empty it"):
        new_project(request(tmp_path))
    with pytest.raises(RequestError, match="is a file: name a new folder"):
        new_project(request(tmp_path / "notes"))
    assert [p.name for p in tmp_path.iterdir()] == ["notes"]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"pantographs": [CX, CX]}, "2 pantographs: give --separation, the distance in m from one to the next, once"),
        ({"pantographs": [CX] * 4, "separations": [9.0, 9.0]}, "4 pantographs: give --separation, .* once, or 3 times"),
        ({"separations": [9.0]}, "--separation: there is one pantograph only"),
        ({"pantographs": [CX] * 17, "separations": [9.0]}, "a train has 1 to 16 pantographs, not 17"),
        ({"maps": [("A.x", "q")]}, "--map A.x=q: catenary is made from a definition"),
        ({"maps": [("pantograph.A.x", "q")]}, "--map pantograph.A.x=q: pantograph is made from a definition"),
        ({"speed": 0.0}, "--speed 0"),
    ],
)
def test_what_cannot_be_is_refused_before_anything_is_written(tmp_path, changes, said):
    with pytest.raises(RequestError, match=said):
        new_project(request(tmp_path / "demo", **changes))
    assert not (tmp_path / "demo").exists()


def test_fmus_from_elsewhere_are_there_readable_and_of_different_names(tmp_path, make_fmu):
    with pytest.raises(RequestError, match=r"nix\.fmu: there is no such FMU"):
        project_files(request(tmp_path / "demo", pantographs=[tmp_path / "nix.fmu"]))
    (tmp_path / "bad.fmu").write_text("no archive")
    with pytest.raises(RequestError, match=r"bad\.fmu is not a readable FMU"):
        project_files(request(tmp_path / "demo", pantographs=[tmp_path / "bad.fmu"]))
    theirs = make_fmu("Theirs.fmu", ["push"], ENDS)
    with pytest.raises(RequestError, match="as a train needs: name the parameters by --map start_position=NAME"):
        project_files(request(tmp_path / "demo", pantographs=[theirs, CX], separations=[50.0]))
    with pytest.raises(RequestError, match="has no parameter 'begin' that can be set"):
        project_files(request(tmp_path / "demo", pantographs=[theirs], maps=[("start_position", "begin")]))
    other = tmp_path / "other"
    other.mkdir()
    placed = make_fmu("P.fmu", ["push"], ENDS, ["speed", "start_position"])
    copy = other / "P.fmu"
    copy.write_bytes(placed.read_bytes())
    with pytest.raises(RequestError, match="have one name: rename one of these FMUs"):
        project_files(request(tmp_path / "demo", pantographs=[placed, copy], separations=[50.0]))

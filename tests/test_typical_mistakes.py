"""What the three readers get wrong at first: each mistake ends in one sentence that says what to do."""

from __future__ import annotations

import shlex
import shutil
import zipfile
from pathlib import Path
from typing import NamedTuple

import pytest

import openpanto
from models.library.catalogue import line_path
from tests.robustness.conftest import measured_run, scenario  # noqa: F401  fixtures
from tests.robustness.support import UNWORDED


class Mistake(NamedTuple):
    """A command line after ``openpanto``, the exit code, and what the sentence has to say.

    ``change`` is made in the file that the command names: first text, second text.
    """

    command: str
    code: int
    said: str
    change: tuple[str, str] = ("", "")


LINE_ENGINEER = {
    "a line by another name": Mistake("statics LN22", 1, "C270, CA160"),
    "a file for a name": Mistake("statics LN2.toml", 1, "called by its name, without .toml"),
    "a span that the line has not": Mistake("statics LN2 --span 40", 1, "the line has spans 1 to 24"),
    "a height of a run in millimetres": Mistake(
        "asbuilt LN2 m.csv --out built",
        1,
        "row 2, column B (height): 5080 is outside 2 ... 10 m",
        ("", "position,height\n0,5080\n1,5.081\n2,5.08\n"),
    ),
    "a run that was never laid on the line": Mistake(
        "asbuilt LN2 m.csv --out built",
        1,
        "no row lies on the line, which reaches from -3.1 to 1136.9 m",
        ("", "position [km],height [mm]\n84.1,5080\n84.2,5081\n84.3,5080\n"),
    ),
    "a step in metres": Mistake("asbuilt LN2 m.csv --out built --step 0.005", 1, "outside 0.1 ... 500 mm"),
    "no part before the parameter": Mistake(
        "statics LN2 --set contact_wire.tension=26kN", 2, "write line.PARAMETER=VALUE or pantograph.PARAMETER=VALUE"
    ),
    "a parameter mistyped": Mistake(
        "statics LN2 --set line.contact_wire.tention=26000", 1, "did you mean 'contact_wire.tension'?"
    ),
    "a number in kN for one in N": Mistake(
        "statics LN2 --set line.contact_wire.tension=26",
        1,
        "26 N is outside 500 ... 100000 N: check its size and its unit",
    ),
    "a unit that is none": Mistake("statics my.toml", 1, "(known for 'N': N, daN, kN)", ('20000, "N"', '2000, "kgf"')),
    "a key mistyped": Mistake(
        "statics my.toml", 1, "did you mean 'encumbrance'?", ("encumbrance = [1.4", "encumbrence = [1")
    ),
    "a decimal comma": Mistake("statics my.toml", 1, "have a decimal comma? write a point", ("[5.08,", "[5,08,")),
    "a decimal comma before a tenth": Mistake(
        "statics my.toml", 1, "has it a decimal comma? write 20.5", ('[20000, "N"', '[20,5, "kN"')
    ),
    "no source": Mistake(
        "statics my.toml", 1, 'must be written [value, "unit", "source"]', (', "N", "Table 5.2"]', ', "N"]')
    ),
    "a sum of spans that is another": Mistake(
        "statics my.toml",
        1,
        "the spans do not add up: they end at 1136.9 m, not at 1140 m; correct their lengths or this end",
        ("end = [1136.9", "end = [1140"),
    ),
    "droppers that fit no span": Mistake(
        "statics my.toml", 1, "(and 6 more like this)", ('count = [7, "1"', 'spacing = [6.61, "m"')
    ),
    "a decimal comma on the command line": Mistake(
        "statics LN2 --set 'line.contact_wire.tension=26,5 kN'", 1, "write a decimal point"
    ),
    "a speed with its unit": Mistake("couple LN2 DSA380 --speed 250km/h", 2, "write it without its unit"),
}
FMI_ENGINEER = {
    "a scenario mistyped": Mistake("run cx_lnn2", 1, "did you mean 'cx_ln2'?"),
    "a verb mistyped": Mistake("vaildate toy.ssp", 2, "did you mean 'validate'?"),
    "a folder that is no scenario": Mistake("validate run", 1, "give the folder NAME.ssp that has one"),
    "an FMU that is not there": Mistake(
        "validate toy.ssp", 1, "resources/Toy.fmu does not exist", ("ToyCatenary.fmu", "Toy.fmu")
    ),
    "a variable mistyped": Mistake(
        "validate toy.ssp",
        1,
        "did you mean 'contact.force'?",
        ('Connector="contact.force"', 'Connector="contact.forse"'),
    ),
    "a component mistyped": Mistake(
        "validate toy.ssp", 1, "did you mean 'catenary'?", ('endElement="catenary"', 'endElement="catenery"')
    ),
    "an output to an output": Mistake(
        "validate toy.ssp",
        1,
        "an output must be connected to an input",
        ('Element="pantograph" endConnector="contact.y"', 'Element="pantograph" endConnector="A.y"'),
    ),
    "a setting mistyped": Mistake(
        "validate toy.ssp", 1, "did you mean 'start'?", ("Interval start=", "Interval strat=")
    ),
    "a version to come": Mistake(
        "validate toy.ssp",
        1,
        "is not an SSP description of version",
        ('version="1.0" name="toy"', 'version="3.0" name="toy"'),
    ),
    "no stop time": Mistake("validate toy.ssp", 1, "give a stop time", (' stopTime="1.0"', "")),
    "a step that is none": Mistake("run toy.ssp --step 0", 2, "must be greater than 0"),
    "a scheme cut short": Mistake("run toy.ssp --scheme gauss", 2, "did you mean 'gauss-seidel'?"),
    "a speed of no train": Mistake(
        "new project --line LN2 --pantograph CX --speed 1e300", 1, "give the speed of the train in km/h"
    ),
    "line and pantograph exchanged": Mistake(
        "new project --line CX --pantograph LN2 --speed 300", 1, "it is a pantograph"
    ),
    "a port without its variable": Mistake(
        "new project --line LN2 --pantograph X.fmu --speed 300 --map contact.force", 2, "must be written PORT=VARIABLE"
    ),
    "an FMU of another name": Mistake("build LN3", 1, "known are Catenary_AC_curve"),
}
DATA_SCIENTIST = {
    "a parameter without its component": Mistake(
        "run toy.ssp --no-build --set static_force=120", 1, "did you mean 'pantograph.static_force'?"
    ),
    "a unit of something else": Mistake(
        "run toy.ssp --no-build --set 'pantograph.static_force=12 kg'", 1, "give it in N, daN, kN"
    ),
    "a parameter without a value": Mistake(
        "run toy.ssp --set pantograph.static_force", 2, "must be written COMPONENT.PARAMETER=VALUE"
    ),
    "an option mistyped": Mistake("run toy.ssp --stepp 0.001", 2, "did you mean '--step'?"),
    "a time with a decimal comma": Mistake("run toy.ssp --stop 1,5", 2, "write a decimal point"),
    "a time with its unit": Mistake("run toy.ssp --stop 10s", 2, "write it without its unit"),
    "a folder that no run has left": Mistake("report .", 1, "give the folder that a run printed"),
    "a comparison with nothing": Mistake("compare run", 2, "the following arguments are required: RUN"),
    "decimal commas between commas": Mistake(
        "report run --measured m.csv",
        1,
        "need columns separated by semicolons or tabs",
        ("", "x [m],force [N]\n1,5,120,0\n"),
    ),
    "a measurement without units that are known": Mistake(
        "report run --measured m.csv", 1, "m or km is needed", ("", "x [mile],force [N]\n1,120\n2,121\n3,122\n")
    ),
    "a measurement of another place": Mistake(
        "report run --measured m.csv",
        1,
        "--measured-offset D moves it",
        ("", "x [km],force [N]\n12,120\n13,121\n14,122\n"),
    ),
    "kilometrage that falls": Mistake(
        "report run --measured m.csv", 1, "give --measured-offset D", ("", "x [m],force [N]\n90,120\n50,121\n10,122\n")
    ),
    "a film of another kind": Mistake("report run --film run.avi", 1, "a film must be named .gif or .mp4"),
    "a contact too many": Mistake("report run --measured m.csv --contact 2", 1, "choose another with --contact"),
    "a study mistyped": Mistake("study cx_generic_pear", 1, "did you mean 'cx_generic_pair'?"),
    "a case mistyped": Mistake("verify cx_ln3", 1, "did you mean 'cx_ln2'? (--list names them all)"),
}
MISTAKES = {
    f"{reader}: {name}": mistake
    for reader, mistakes in (
        ("line engineer", LINE_ENGINEER), ("FMI engineer", FMI_ENGINEER), ("data scientist", DATA_SCIENTIST)
    )
    for name, mistake in mistakes.items()
}  # fmt: skip


@pytest.fixture
def workplace(tmp_path, monkeypatch, request):
    """A folder with a line, a scenario and the results of a run, in which the commands are given."""
    shutil.copytree(request.getfixturevalue("scenario"), tmp_path / "toy.ssp")
    shutil.copy(line_path("LN2"), tmp_path / "my.toml")
    request.getfixturevalue("measured_run")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def changed(place: Path, mistake: Mistake) -> None:
    """Make the mistake in the file that the command names."""
    words = mistake.command.split()
    name = next(word for word in ("my.toml", "m.csv", "toy.ssp") if word in words)
    file = place / (name if name != "toy.ssp" else "toy.ssp/SystemStructure.ssd")
    old, new = mistake.change
    text = file.read_text(encoding="utf-8") if old else ""
    assert old in text
    file.write_text(text.replace(old, new, 1) if old else new, encoding="utf-8")


def test_there_are_at_least_thirty():
    assert len(MISTAKES) >= 30
    assert min(map(len, (LINE_ENGINEER, FMI_ENGINEER, DATA_SCIENTIST))) >= 10


@pytest.mark.parametrize("mistake", MISTAKES.values(), ids=MISTAKES)
def test_a_mistake_ends_in_one_sentence_that_says_what_to_do(mistake, workplace, monkeypatch, capfd):
    if any(mistake.change):
        changed(workplace, mistake)
    monkeypatch.setattr(openpanto, "supervised", lambda work: work())  # in this process
    try:
        code = openpanto.main(shlex.split(mistake.command))
    except SystemExit as end:
        code = end.code
    said = capfd.readouterr().err
    assert code == mistake.code, said
    assert mistake.said in said
    assert not any(text in said for text in UNWORDED), said
    errors = [line for line in said.splitlines() if "warning: " not in line]
    assert len(errors) == 1, said
    assert "error: " in errors[0]


def test_an_fmu_of_another_fmi_is_named_by_its_version(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    with zipfile.ZipFile("Theirs.fmu", "w") as file:
        file.writestr(
            "modelDescription.xml",
            '<fmiModelDescription fmiVersion="3.0" modelName="x" instantiationToken="{1}">'
            '<CoSimulation modelIdentifier="x"/><ModelVariables><Float64 name="a" valueReference="1"/></ModelVariables>'
            "</fmiModelDescription>",
        )
    assert openpanto._worked(shlex.split("new project --line LN2 --pantograph Theirs.fmu --speed 300")) == 1
    assert capfd.readouterr().err == (
        "error: Theirs.fmu is an FMU of FMI 3.0; an FMI 2.0 co-simulation FMU is needed: "
        "let the tool that made it export one\n"
    )
    assert not (tmp_path / "project").exists()


def test_a_value_to_fix_that_is_mistyped_is_answered_by_the_nearest(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "r.csv").write_text("".join(f"{f / 2},{100 - f},{3 * f}\n" for f in range(1, 41)))
    assert openpanto._worked(shlex.split("identify r.csv --fix mm2=7.75")) == 1
    assert "did you mean 'm2'?" in capfd.readouterr().err

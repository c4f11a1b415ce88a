"""Paths that cannot be meant, in every place where a verb takes one: one sentence, a documented exit code.

Every option and argument that is declared as a path, or takes a name or a path, is given what is missing, what is
empty, a folder for a file and a file for a folder.
"""

from __future__ import annotations

import builtins
import errno
import io
import os
import re
import shlex
import shutil
from pathlib import Path
from typing import Final

import pytest

import openpanto
from fmus.__main__ import main as fmus_main
from master.commands.main import main as master_main
from models.commands.physics_main import main as models_main
from tests.effort import count
from tests.robustness.conftest import measured_run, scenario  # noqa: F401  fixtures
from tests.robustness.support import UNWORDED

#: Neither a file nor a folder; nothing; a way through a file; a folder that is empty.
INPUTS: Final = ("nope.{}", "no/pe.{}", "''", "afile/x.{}", "empty")
#: For a folder: a file, a way through a file, nothing.
FOLDERS: Final = ("afile", "afile/x", "''")
#: For a file: a folder, a way through a file, nothing, and a folder that is not there, which no verb makes for a file.
FILES: Final = ("empty", "afile/x.{}", "''")

#: The command lines: what stands for {in:SUFFIX}, {dir} or {file:SUFFIX} is replaced.
COMMANDS: Final = (
    "run {in:ssp}",
    "run toy.ssp --no-build --out {dir}",
    "run toy.ssp --no-build --resume {in:npz}",
    "run toy.ssp --no-build --allow-outside {gone:d}",
    "new {dir} --line EN50318_2002 --pantograph CX --speed 200",
    "new project --line {in:toml} --pantograph CX --speed 200",
    "new project --line {in:fmu} --pantograph CX --speed 200",
    "new project --line EN50318_2002 --pantograph {in:toml} --speed 200",
    "new project --line EN50318_2002 --pantograph {in:fmu} --speed 200",
    "new-line {gone:toml} --like LN2",
    "new-line mine --like {in:toml}",
    "new-pantograph {gone:toml} --like CX",
    "new-pantograph mine --like {in:toml}",
    "validate {in:ssp}",
    "validate toy.ssp --no-build --allow-outside {gone:d}",
    "pack {in:ssp}",
    "pack toy.ssp --no-build --out {file:ssp}",
    "calibrate {in:ssp}",
    "calibrate toy.ssp --no-build --allow-outside {gone:d}",
    "study {in:ssp}",
    "study cx_ln2_overlap --only {in:x}",
    "study cx_ln2_overlap --out {dir}",
    "sweep {in:ssp} --over speed=200:220:10",
    "sweep toy.ssp --no-build --from-csv {in:csv}",
    "sweep toy.ssp --no-build --over pantograph.static_force=100N,120N --allow-outside {gone:d}",
    "sweep toy.ssp --no-build --over pantograph.static_force=100N,120N --out {dir}",
    "optimise {in:ssp} --minimise sigma --vary pantograph.static_force=100:120N",
    "optimise toy.ssp --no-build --minimise sigma --vary pantograph.static_force=100:120N --allow-outside {gone:d}",
    "optimise toy.ssp --no-build --minimise sigma --vary pantograph.static_force=100:120N --out {dir}",
    "compare {in:run} run",
    "compare run {in:run}",
    "compare run run --report {file:html}",
    "report {in:run}",
    "report run --measured {in:csv}",
    "report run --film {file:gif}",
    "verify {in:toml}",
    "verify wave_speeds --out {dir}",
    "statics {in:toml}",
    "statics EN50318_2002 --out {dir}",
    "signal {in:csv}",
    "signal s.csv --out {dir}",
    "signal s.csv --standalone --runtime {in:d}",
    "spans {in:toml} --wind 29 --limit 0.5",
    "spans EN50318_2002 --wind 29 --limit 0.5 --out {dir}",
    "asbuilt {in:toml} m.csv --out built",
    "asbuilt EN50318_2002 {in:csv} --out built",
    "asbuilt EN50318_2002 m.csv --out {dir}",
    "import {in:xlsx} --out mine.toml",
    "import lay --design EN50318_2002 --out {file:toml}",
    "export EN50318_2002 --out {dir}",
    "pantograph {in:toml}",
    "pantograph CX --out {dir}",
    "identify {in:csv}",
    "identify r.csv --stages 1 --plot {file:png}",
    "couple {in:toml} CX",
    "couple EN50318_2002 {in:toml}",
    "couple EN50318_2002 CX --out {dir}",
    "build {in:toml}",
    "build Pantograph_CX --out {dir}",
    "build Pantograph_CX --library {gone:d}",
    "build Pantograph_CX --built-from {in:toml}",
    "build Pantograph_CX --standalone --runtime {in:d}",
    "doctor {in:fmu}",
)  # fmt: skip


def lines(command):
    """Return the command lines that a pattern stands for."""
    before, _, rest = command.partition("{")
    kind, _, after = rest.partition("}")
    kind, _, suffix = kind.partition(":")
    values = {"in": INPUTS, "gone": INPUTS[:-1], "dir": FOLDERS, "file": FILES}[kind]
    return [f"{before}{value.format(suffix)}{after}" for value in values]


#: Every run tries half of the values with a command, the other half with the next.
COMMAND_LINES: Final = [
    line for turn, command in enumerate(COMMANDS) for line in lines(command)[turn % 2 :: count(2, 1)]
]


@pytest.fixture
def workplace(tmp_path, monkeypatch, request):
    """A folder with a scenario, a run, a response, a file and an empty folder, in which the commands are given."""
    shutil.copytree(request.getfixturevalue("scenario"), tmp_path / "toy.ssp")
    request.getfixturevalue("measured_run")
    (tmp_path / "afile").write_text("a file\n")
    (tmp_path / "empty").mkdir()
    (tmp_path / "m.csv").write_text("position,height\n" + "".join(f"{x},5.08\n" for x in range(9)))
    (tmp_path / "r.csv").write_text("".join(f"{f / 2},{100 - f},{3 * f}\n" for f in range(1, 41)))
    (tmp_path / "s.csv").write_text("time [s],base.z [m]\n0,0\n1,0.01\n")
    (tmp_path / "lay").mkdir()
    (tmp_path / "lay" / "supports.csv").write_text("position\n0\n60\n120\n")
    (tmp_path / "lay" / "droppers.csv").write_text("span,position\n1,30\n2,30\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path


#: How the system says it, which helps nobody.
BARE: Final = re.compile(r"\[Errno|(No such file or directory|(File exists|Not a directory|Is a directory))\)?$")
REMEDY: Final = re.compile(
    r"choose|name |copy|give|known|check|write|take|must be|by its name|named|list|another|is needed|is no "
)


@pytest.mark.parametrize("line", COMMAND_LINES)
def test_a_bad_path_ends_in_one_sentence(line, workplace, monkeypatch, capfd):
    monkeypatch.setattr(openpanto, "supervised", lambda work: work())
    try:
        code = openpanto.main(shlex.split(line))
    except SystemExit as end:
        code = end.code
    said = capfd.readouterr()
    assert code == (2 if "''" in line else 1), said
    errors = [text for text in said.err.splitlines() if re.search(r"error: ", text)]
    errors += [text for text in said.out.splitlines() if text.startswith("missing ")]  # the doctor's findings
    assert len(errors) == 1, said
    assert not any(text in said.err + said.out for text in UNWORDED)
    assert not BARE.search(errors[0])
    assert REMEDY.search(errors[0]), errors
    assert Path.cwd() == workplace
    assert not (workplace / "project").exists()


#: Places that the user may not write into. A study builds its FMUs first, and a film needs more than the run here has.
LOCKED: Final = (
    *(re.sub(r"{dir}", "locked/x", c) for c in COMMANDS if "{dir}" in c and "study" not in c),
    *(re.sub(r"{file:(\w+)}", r"locked/x.\1", c) for c in COMMANDS if "{file:" in c and "--film" not in c),
    "report locked",
    "new-line mine --like CA160",
)


@pytest.fixture
def locked(workplace, monkeypatch):
    """A folder with a run in it that nobody may write into; who runs the tests may well be allowed to."""
    folder = workplace / "locked"
    shutil.copytree(workplace / "run", folder)

    def guarded(what, writes):
        def call(path, *more, **named):
            if isinstance(path, str | Path) and folder in Path(path).absolute().parents and writes(*more, **named):
                raise PermissionError(errno.EACCES, "Permission denied", str(path))
            return what(path, *more, **named)

        return call

    def opens_to_write(mode="r", *_, **__):
        return mode.strip("rbt") != ""

    for module in (builtins, io):
        monkeypatch.setattr(module, "open", guarded(open, opens_to_write))
    changes = os.O_WRONLY | os.O_RDWR | os.O_CREAT
    monkeypatch.setattr(os, "open", guarded(os.open, lambda flags, *_, **__: bool(flags & changes)))
    monkeypatch.setattr(os, "mkdir", guarded(os.mkdir, lambda *_, **__: True))
    access = os.access
    monkeypatch.setattr(os, "access", lambda path, mode: Path(path).absolute() != folder and access(path, mode))
    return folder


@pytest.mark.parametrize("line", LOCKED)
def test_what_permissions_forbid_ends_in_one_sentence(line, locked, monkeypatch, capfd):
    if line.startswith("new-line"):
        monkeypatch.chdir(locked)
    monkeypatch.setattr(openpanto, "supervised", lambda work: work())
    before = sorted(locked.rglob("*"))
    code = openpanto.main(shlex.split(line))
    said = capfd.readouterr().err
    errors = [text for text in said.splitlines() if "error: " in text]
    assert code == 1, said
    assert len(errors) == 1, said
    assert not any(text in said for text in UNWORDED)
    assert "ermission" in errors[0]
    assert REMEDY.search(errors[0])
    assert sorted(locked.rglob("*")) == before
    for option in re.findall(r"--\w+", errors[0]):  # one that the verb has
        assert option in openpanto._verbs(openpanto.command_line())[line.split()[0]].format_help()


MAINS: Final = {"python -m master": master_main, "python -m models": models_main, "python -m fmus": fmus_main}


@pytest.mark.parametrize(
    ("given", "what"),
    [
        ([""], "the first argument"),
        (["x", " "], "what comes after 'x'"),
        (["x", "--out="], "what comes after '--out='"),
    ],
)
@pytest.mark.parametrize("program", ["openpanto", *MAINS])
def test_an_empty_argument_is_told_alike_by_every_program(program, given, what, capfd):
    with pytest.raises(SystemExit) as end:
        MAINS.get(program, openpanto._worked)(given)
    assert end.value.code == 2
    said = f"{program}: error: {what} is empty: write it out, or set the shell variable that stands there\n"
    assert capfd.readouterr().err.endswith(said)


def test_every_place_for_a_path_is_tried():
    tried = [command.split() for command in COMMANDS]
    for name, verb in openpanto._verbs(openpanto.command_line()).items():
        for action in verb._actions:
            if action.type is Path:
                place = action.option_strings[-1:] or [name]
                given = [words for words in tried if words[0] == name and place[0] in words]
                assert given, f"{name} {place[0]}"

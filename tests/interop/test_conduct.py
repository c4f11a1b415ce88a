"""A host that changes its folder, moves the FMU away, leaves out pointers: it lives, and keeps what is its own."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import fmpy
import pytest

from fmus.builder.fmu_build import build
from tests.fmus.support import toy_recipe
from tests.interop.test_host import linux, order, run_host, unpack

pytestmark = linux


def _compiled(name, folder):
    headers = Path(fmpy.__file__).parent / "c-code"
    source = Path(__file__).parent / "host" / f"{name}.c"
    command = [os.environ.get("CC", "cc"), "-std=gnu11", "-O1", "-Wall", "-Werror", f"-I{headers}", str(source)]
    subprocess.run([*command, "-o", str(folder / name), "-ldl", "-lpthread"], check=True)
    return folder / name


@pytest.fixture(scope="module")
def obedient(tmp_path_factory):
    """A host that takes orders one by one."""
    return _compiled("orders", tmp_path_factory.mktemp("host"))


@pytest.fixture
def part(tmp_path):
    return unpack(build(toy_recipe(), tmp_path), tmp_path / "unpacked")


def _load(part, location=None):
    return "load " + order(part.library, part.guid, location or part.folder / "resources")


def _ask(program, *orders, **environment):
    """Return what the host printed, line by line; every order was obeyed, and the host ended by itself."""
    done = run_host(program, "\n".join(orders) + "\n", **{"OPENPANTO_PYTHON": sys.executable, **environment})
    assert done.returncode == 0, done.stderr[-2000:]
    lines = done.stdout.splitlines()
    printed = [line.rpartition(" ")[0] for line in lines if line.rpartition(" ")[2].isdigit()]
    assert [o.partition(" ")[0] for o in orders] == [t for t in printed if " " not in t]
    return lines, done.stderr


def test_what_the_host_has_not_read_yet_stays_its_own(obedient, part):
    """PYTHONUNBUFFERED=1, as containers set it, has Python take the buffers from standard input and output."""
    lines, _ = _ask(obedient, _load(part), "start", "step 0", "free", PYTHONUNBUFFERED="1")
    assert lines == ["load 0", "start 0", "step 0", "free 0"]


def test_a_reset_finds_a_relative_place_from_another_folder(obedient, part):
    orders = [f"folder {part.folder}", _load(part, "resources"), "folder /", "start", "reset", "start", "step 0"]
    lines, _ = _ask(obedient, *orders)
    assert lines == ["folder 0", "load 0", "folder 0", "start 0", "reset 0", "start 0", "step 0"]


def test_a_reset_after_the_fmu_was_moved_away_is_refused_in_words(obedient, part):
    away = "rename " + order(part.folder, part.folder.with_name("away"))
    lines, printed = _ask(obedient, _load(part), "start", away, "reset", "step 0", "free")
    assert lines[:3] == ["load 0", "start 0", "rename 0"]
    assert lines[3].startswith("it cannot be reset: the FMU's resources in")
    assert lines[4:] == ["reset 3", "step 0", "free 0"]  # the instance is as it was
    assert lines[3] in printed


def test_a_state_that_the_host_has_no_room_for_is_refused(obedient, part):
    lines, printed = _ask(obedient, _load(part), "start", "save", "serialise 0", "serialise 1")
    assert lines[3] == "serialise 0"
    assert "the host has room for" in lines[4]
    assert lines[5] == "serialise 3"
    assert lines[4] in printed


@pytest.mark.parametrize(
    ("call", "text"),
    [
        ("get-nowhere 0", "fmi2GetReal was called with a null pointer"),
        ("cancel", "the FMU has no fmi2CancelStep, and says so in its model description"),
        ("get 4000000", "the FMU has no variable with value reference 4000000"),
    ],
)
def test_a_call_that_cannot_be_served_is_a_sentence(obedient, part, call, text):
    lines, printed = _ask(obedient, _load(part), "start", call)
    assert text in lines[2]
    assert lines[3] == f"{call.partition(' ')[0]} 3"
    assert text in printed


def test_a_python_that_does_not_know_its_own_place_is_named_by_the_command(obedient, part, tmp_path):
    """sys.executable is empty where PATH is not set."""
    python = tmp_path / "python"
    python.write_text("#!/bin/sh\nprintf 'openpanto_probe:\\n\\n3.11\\n\\nlacks the packages numpy and scipy\\n'\n")
    python.chmod(0o755)
    lines, _ = _ask(obedient, _load(part), OPENPANTO_PYTHON=str(python))
    assert lines[0].startswith(f"{python} lacks the packages numpy and scipy;")


def test_what_a_sites_own_code_prints_is_no_answer(obedient, part, tmp_path):
    (tmp_path / "site").mkdir()
    (tmp_path / "site" / "sitecustomize.py").write_text("print('welcome to the cluster')\n")
    lines, _ = _ask(obedient, _load(part), "start", PYTHONPATH=str(tmp_path / "site"))
    assert lines[-2:] == ["load 0", "start 0"]


@pytest.mark.parametrize("where", ["both are links", "one is a link"])
def test_links_to_the_libraries_are_followed(obedient, part, tmp_path, where):
    """A store of files by their hashes, as package managers have it: the files' names say nothing."""
    links = tmp_path / "links"
    links.mkdir()
    for n, library in enumerate(sorted(part.library.parent.iterdir())):
        if where == "both are links":
            library = library.rename(tmp_path / f"stored{n}")
            (links / [part.library.with_suffix(".pythonfmu.so").name, part.library.name][n]).symlink_to(library)
        elif library == part.library:
            (links / library.name).symlink_to(library)
    orders = ["load " + order(links / part.library.name, part.guid, part.folder / "resources"), "start"]
    assert _ask(obedient, *orders)[0] == ["load 0", "start 0"]


def test_several_fmus_start_python_once_in_threads_at_the_same_time(tmp_path):
    """Each brings its own loader: what locks out the others has to be one for the process."""
    host = _compiled("together", tmp_path)
    parts = [unpack(build(toy_recipe(name=f"Toy{n}"), tmp_path), tmp_path / "unpacked") for n in range(4)]
    words = [str(word) for p in parts for word in (p.library, p.guid, p.folder / "resources")]
    for _ in range(3):
        done = run_host([host, *words], "", OPENPANTO_PYTHON=sys.executable)
        assert done.returncode == 0, done.stderr[-2000:]

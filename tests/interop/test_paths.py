"""Wherever a tool unpacks an FMU to, and however it writes that place: the same bits; a wrong place is refused."""

from __future__ import annotations

import os
import shutil
import string
import subprocess
import sys
from pathlib import Path
from urllib.parse import quote

import pytest

from fmus.builder.fmu_build import build
from fmus.builder.recipe import recipe
from tests.effort import IS_LONG, count
from tests.fmus.support import short_line_recipe
from tests.interop.test_host import linux, order, run_host, unpack

pytestmark = linux
#: Where an FMU lies is nothing to its kernels, which would take half of every process.
PLAIN = {"OPENPANTO_KERNEL": "numpy"}
HERE = {"OPENPANTO_PYTHON": sys.executable, **PLAIN}
_PUNCTUATION = [c for c in string.punctuation if c != "/"]
_SCRIPTS = [
    "Oberleitung äöüß",
    "caténaire",
    "контактная сеть",
    "架線とパンタグラフ",
    "接触网",
    "전차선",
    "εναέρια γραμμή",
    "شبكة التماس",
    "रेलवे",
    "e\u0301 combined",
    "🚄",
    "ﬁ ǆ İ",
]
_ODD = ["a%20b", "100%", "%C3%A4", "%2F", "%25%20%00", "file:", "file:/x", "$ORIGI", "two  blanks", " ", "…", "a" * 200]
#: Every printable character, several scripts, and what looks like a part of a URI.
NAMES = [
    *("[a]{b} (c) #1 +2 &3;4=5,6", "".join(_PUNCTUATION), *_SCRIPTS, *_ODD),
    *(f"x{c}y" for c in _PUNCTUATION),
    string.ascii_letters,
    string.digits + " \t",
    os.fsdecode(b"no UTF-8 \xe4\xff"),
]


def test_there_are_sixty_paths_and_every_printable_character():
    assert len(NAMES) >= 60
    assert set("".join(NAMES)) >= set(string.printable) - set("/\n\r\x0b\x0c")


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    """A short line and a pantograph, as files."""
    folder = tmp_path_factory.mktemp("pair")
    return [build(short_line_recipe(folder), folder), build(recipe("Pantograph_CX"), folder)]


def _orders(folder, pair, write):
    """Orders for the host: unpack into the folder, name the resources as ``write`` does."""
    parts = [unpack(fmu, folder) for fmu in pair]
    lines = [order("fmu", p.library, p.guid, write(p.folder / "resources")) + "\n" for p in parts]
    return "".join(lines) + _coupling(parts)


def _coupling(parts):
    line, pantograph = (p.references for p in parts)
    ends = [f"{end}.{axis}" for end in "AB" for axis in ("x", "y", "z", "vx", "vy", "vz")]
    force = "pantograph[1].contact.force"
    orders = [f"connect 1 {pantograph[e]} 0 {line['pantograph[1].' + e]}" for e in ends]
    orders += [f"connect 0 {line['pantograph[1].contact.' + axis]} 1 {pantograph['contact.' + axis]}" for axis in "xyz"]
    orders += [f"connect 0 {line[force]} 1 {pantograph['contact.force']}", f"observe 0 {line[force]}"]
    orders += [f"parameter 1 {pantograph[n]} {v}" for n, v in (("start_position", 100.0), ("reference_height", 5.09))]
    return "\n".join([*orders, "run 40 0.001"]) + "\n"


def _uri(path):
    return "file://" + quote(os.fsencode(path))


@pytest.fixture(scope="module")
def expected(host, pair, tmp_path_factory):
    done = run_host(host, _orders(tmp_path_factory.mktemp("plain"), pair, _uri), **HERE)
    assert done.returncode == 0, done.stderr
    assert max(float.fromhex(line) for line in done.stdout.split()) > 50.0
    return done.stdout


def _sample(names, whole):
    step = max(1, len(names) // count(whole, len(names)))
    return names[::step]


@pytest.mark.parametrize("name", _sample(NAMES, 2))
def test_the_host_finds_the_same_bits_at_every_path(host, pair, expected, tmp_path, name):
    done = run_host(host, _orders(tmp_path / name, pair, _uri), **HERE)
    assert done.returncode == 0, done.stderr
    assert done.stdout == expected


#: How tools write a place.
WRITTEN = {
    "file:/": lambda p: "file:" + quote(str(p)),
    "localhost": lambda p: "file://localhost" + quote(str(p)),
    "capitals": lambda p: "FILE://LocalHost" + quote(str(p)) + "/",
    "all escaped": lambda p: "file://" + "".join(f"%{b:02x}" if b != 47 else "/" for b in str(p).encode()),
    "not escaped": lambda p: f"file://{p}",
    "plain": str,
    "slashes": lambda p: f"{p}//",
}


@pytest.mark.parametrize("how", WRITTEN if IS_LONG else ("capitals", "all escaped", "plain"))
def test_the_host_finds_the_same_bits_however_the_place_is_written(host, pair, expected, tmp_path, how):
    done = run_host(host, _orders(tmp_path / "ä 100% #1", pair, WRITTEN[how]), **HERE)
    assert done.returncode == 0, done.stderr
    assert done.stdout == expected


_FMPY = """
import sys, fmpy
for folder in sys.argv[1:]:
    start = {"pantograph[1].%s.%s" % (e, a): v for e, y in (("A", 0.7), ("B", -0.7))
             for a, v in (("x", 120.0), ("y", y), ("z", 5.09))}
    names = {v.name for v in fmpy.read_model_description(folder).modelVariables}
    start = start if "Catenary" in folder.rsplit("/", 1)[1] else {"contact.force": 90.0}
    rows = fmpy.simulate_fmu(folder, stop_time=0.02, step_size=1e-3, output_interval=1e-3, start_values=start)
    print([float(v) for v in rows[-1]])
"""


def _in_fmpy(folder, pair):
    folders = [str(unpack(fmu, folder).folder) for fmu in pair]
    command = [sys.executable, "-c", _FMPY, *folders]
    environment = {**os.environ, "OMP_NUM_THREADS": "1", **PLAIN}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout


@pytest.fixture(scope="module")
def expected_in_fmpy(pair, tmp_path_factory):
    found = _in_fmpy(tmp_path_factory.mktemp("plain"), pair)
    assert "nan" not in found
    return found


#: FMPy itself reads no model description from a path that is not UTF-8.
_FOR_FMPY = [name for name in NAMES if "\udce4" not in name]


@pytest.mark.parametrize("name", _sample(_FOR_FMPY, 2))
def test_fmpy_finds_the_same_bits_at_every_path(pair, expected_in_fmpy, tmp_path, name):
    assert _in_fmpy(tmp_path / name, pair) == expected_in_fmpy


# What cannot work is refused, and the host lives.


def _spoil(part, how):
    """Take something away from an unpacked FMU; return the text that is to be said."""
    resources = part.folder / "resources"
    script = resources / ((resources / "slavemodule.txt").read_text() + ".py")
    if how == "no slavemodule":
        (resources / "slavemodule.txt").unlink()
        return "slavemodule.txt"
    if how == "no script":
        script.unlink()
        return "the script that it names, is missing"
    if how == "a script that is none":
        script.write_text("def (:\n")
        return "the FMU cannot be loaded: "
    if how == "a module is missing":
        next(resources.glob("openpanto_*/models/definition_files/parameter.py")).unlink()
        return "the FMU is incomplete: No module named"
    if how == "a module is cut":
        path = next(resources.glob("openpanto_*/fmus/slave/adapter.py"))
        path.write_bytes(path.read_bytes()[:3000])
        return "the FMU cannot be loaded: "
    if how == "no definition":
        (resources / "definition.toml").unlink()
        return "definition.toml"
    if how == "no mark":
        (resources / "openpanto.txt").unlink()
        return "openpanto.txt is missing"
    if how == "no pythonfmu":
        part.library.with_suffix(".pythonfmu.so").unlink()
        return "pythonfmu's library beside the FMU's own cannot be loaded"
    part.library.with_suffix(".pythonfmu.so").write_bytes(b"\x7fELF nothing")
    return "pythonfmu's library beside the FMU's own cannot be loaded"


_SPOILT = [
    "no slavemodule",
    "no script",
    "a script that is none",
    "a module is missing",
    "a module is cut",
    "no definition",
    "no mark",
    "no pythonfmu",
    "pythonfmu is none",
]


@pytest.mark.parametrize("how", _SPOILT)
def test_a_broken_fmu_makes_no_instance_and_the_host_lives(host, pair, tmp_path, how):
    part = unpack(pair[1], tmp_path)
    text = _spoil(part, how)
    orders = order("refuse", part.library, part.guid, _uri(part.folder / "resources")) + "\n"
    _refused(run_host(host, orders, **HERE), text)


@pytest.mark.parametrize(
    ("location", "text"),
    [
        ("file:///nowhere/resources", "is not a folder that exists"),
        ("/nowhere", "is not a folder that exists"),
        ("file://elsewhere/tmp", "names another machine"),
        ("http://example.org/x", "is not a file URI"),
        ("file:", "is not a folder that exists"),
        ("file:///etc/passwd", "is not a folder that exists"),
        ("file:///tmp%00/x", "is not a folder that exists"),
        ("%", "is not a folder that exists"),
        ("file:///%E4%FF%zz" + 3000 * "x", "is not a folder that exists"),
        ("file:///", "slavemodule.txt"),
        ("-", "did not say where"),
    ],
)
def test_a_wrong_location_is_refused_in_words(host, pair, tmp_path, location, text):
    part = unpack(pair[1], tmp_path)
    orders = order("refuse", part.library, part.guid, location) + "\n"
    _refused(run_host(host, orders, **HERE), text)


@pytest.mark.parametrize("guid", ["00000000-0000", "-"])
def test_a_wrong_guid_is_refused_in_words(host, pair, tmp_path, guid):
    part = unpack(pair[1], tmp_path)
    orders = order("refuse", part.library, guid, _uri(part.folder / "resources")) + "\n"
    _refused(run_host(host, orders, **HERE), "is not that of the FMU in")


def test_a_missing_package_is_named(host, pair, tmp_path):
    """numpy is there, scipy is not: found when the code is loaded or before."""
    shutil.copytree(Path(sys.prefix), tmp_path / "env", symlinks=True, ignore=shutil.ignore_patterns("lib*"))
    part = unpack(pair[1], tmp_path)
    orders = order("refuse", part.library, part.guid, _uri(part.folder / "resources")) + "\n"
    python = tmp_path / "env" / "bin" / "python"
    _refused(run_host(host, orders, OPENPANTO_PYTHON=str(python), **PLAIN), "lacks the packages numpy and scipy")


def test_an_initialisation_that_fails_is_an_error(host, pair, tmp_path):
    part = unpack(pair[0], tmp_path)
    orders = order("fmu", part.library, part.guid, _uri(part.folder / "resources"))
    # Each within its range, but together they sag too far.
    for name, value in (("contact_wire.tension", 500.0), ("contact_wire.mass", 20.0)):
        orders += f"\nparameter 0 {part.references[name]} {value}"
    orders += "\n"
    done = run_host(host, orders + "run 2 0.001\n", **HERE)
    assert done.returncode == 1
    assert "no static equilibrium of the wanted shape" in done.stderr
    assert "leaving initialization: status 3" in done.stderr


def _refused(done, text):
    """The host said that there is no instance, gave the reason once through its logger, and ended by itself."""
    assert done.returncode == 0, done.stderr
    assert done.stdout == "NULL\nNULL\n"  # tried twice
    logged = [line for line in done.stderr.splitlines() if line.startswith("[part, status 3]")]
    assert len(logged) == 2
    assert text in logged[0], done.stderr
    assert "Traceback" not in done.stderr

"""The generated pages of the documentation site: every key of a definition, every verb, every room."""

from __future__ import annotations

import ast
import importlib
import inspect
import re
import shlex
import sys
import tomllib
from pathlib import Path

import pytest

from models.library.catalogue import (
    line_names,
    line_path,
    load_line,
    load_pantograph,
    pantograph_names,
    pantograph_path,
)

ROOT = Path(__file__).parents[1]
BUILD_SITE = ROOT / "docs" / "build_site"


@pytest.fixture(scope="module")
def definition_keys():
    return _module("definition_keys")


@pytest.fixture(scope="module")
def references(definition_keys):
    return {
        "line": definition_keys.line_reference(),
        "lumped": definition_keys.pantograph_reference("lumped"),
        "multibody": definition_keys.pantograph_reference("multibody"),
    }


def _module(name):
    sys.path.insert(0, str(BUILD_SITE))
    try:
        return importlib.import_module(name)
    finally:
        sys.path.remove(str(BUILD_SITE))


def _paths(data, prefix=""):
    """Every dotted path of a parsed file."""
    for key, value in data.items():
        yield prefix + key
        if isinstance(value, dict):
            yield from _paths(value, f"{prefix}{key}.")
        elif isinstance(value, list) and value and all(isinstance(v, dict) for v in value):
            for number, inner in enumerate(value, 1):
                yield from _paths(inner, f"{prefix}{key}[{number}].")


FILES = [line_path(n) for n in line_names()] + [pantograph_path(n) for n in pantograph_names()]


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.stem)
def test_every_key_of_the_library_is_named(path, references, definition_keys):
    data = tomllib.loads(path.read_text(encoding="utf-8"))
    sort = data["type"] if data["type"] in references else "line"
    used = {definition_keys.generic(p) for p in _paths(data)} - {""}
    assert used <= set(references[sort].keys)


#: Calls that ask a table for a key, of the table itself and of the readers' helpers.
ASKING = re.compile(
    r"^_?(quantity|quantities|integer|text|flag|table|tables|required_table|number|triple|plain_triple|axis)$"
)


def _asked(module):
    """Texts that a module's readers ask a table for, as far as they stand in the call."""
    for node in ast.walk(ast.parse(inspect.getsource(module))):
        if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Attribute):
            continue
        if ASKING.match(node.func.attr):
            texts = [a.value for a in node.args[:2] if isinstance(a, ast.Constant) and isinstance(a.value, str)]
            yield from texts[:1]


def _readers(definition):
    """The modules that a definition's reader is in: all of the package of its class."""
    package = type(definition).__module__.rpartition(".")[0]
    return [m for name, m in sorted(sys.modules.items()) if name.startswith(f"{package}.")]


@pytest.mark.parametrize(
    ("sort", "load", "name"),
    [
        ("line", load_line, "LN2"),
        ("lumped", load_pantograph, "CX"),
        ("multibody", load_pantograph, "generic_multibody"),
    ],
)
def test_every_key_that_a_reader_writes_out_is_named(sort, load, name, references):
    asked = {key for module in _readers(load(name)) for key in _asked(module)}
    assert asked
    missing = asked - {key.name for key in references[sort].keys.values()}
    assert not missing, f"no definition and no file in docs/build_site/probes makes the reader ask for {missing}"


def test_every_parameter_is_named(references):
    for sort, reference in references.items():
        names = {re.sub(r"\.(x|y|z|xx|yy|zz|leading|trailing)$", "", name) for name in reference.parameters}
        assert names <= set(reference.keys), sort
    assert len(references["line"].keys) > 130


def test_every_key_has_a_meaning_and_none_is_described_in_vain(references, definition_keys):
    described = definition_keys.described()
    for sort, reference in references.items():
        without = [
            k.path for k in reference.keys.values() if not definition_keys.meaning(k, reference, described[sort])
        ]
        assert not without, f"describe these in docs/build_site/key_descriptions.toml, [{sort}]"
        assert set(described[sort]) <= set(reference.keys)


def test_units_ranges_and_defaults_are_the_readers_own(references, definition_keys):
    page = definition_keys.page("Keys", "", [("", "line", references["line"])])
    tension = "| `tension` | value | `N` (`daN`, `kN`) | from 500 to 100000 | **required** | tension |"
    assert page.count(tension) == 4  # contact, messenger, stitch and auxiliary wire
    assert "| `exponent` | value | `1` (`%`) | from 1 to 3 | 1 | exponent n of the penetration |" in page
    assert all(f"| `{key.name}` |" in page for key in references["line"].keys.values())


def test_what_depends_on_something_else_is_not_called_required(references, definition_keys):
    line, multibody = references["line"], references["multibody"]
    required = {k.path for k in line.keys.values() if definition_keys.is_required(k, line)}
    assert {"name", "type", "profile.encumbrance", "spans.start", "damping.alpha"} <= required
    assert (
        not {"ends", "spans.length", "spans.droppers.first", "dropper.stiffness", "profile.auxiliary_height"} & required
    )
    required = {k.path for k in multibody.keys.values() if definition_keys.is_required(k, multibody)}
    assert {"joint.NAME.point_i", "force.NAME.joint"} <= required
    assert not {"static_force", "static_moment", "force.NAME.shortest", "force.NAME.force"} & required


def test_the_library_page_has_all_of_it():
    page = _module("reference_pages").pages()["reference/library.md"]
    assert all(f"| `{name}` |" in page for name in (*line_names(), *pantograph_names()))


def test_every_verb_is_in_the_command_reference():
    command_pages = _module("command_pages")
    page = command_pages.page()
    for call, verbs in {
        "python -m master": ("run", "validate", "pack", "calibrate", "study", "compare", "report", "verify"),
        "python -m models": ("statics", "pantograph", "identify", "couple"),
        "python -m fmus": ("build", "signal", "doctor", "list"),
    }.items():
        found = command_pages.verbs(command_pages.parser_of(call))
        assert set(verbs) <= set(found)
        assert all(f"### {call} {verb}\n" in page for verb in found)
    assert "| `--set COMPONENT.PARAMETER=VALUE` | change a parameter |" in page


def test_every_room_has_a_page():
    room_pages = _module("room_pages")
    rooms = room_pages.rooms(ROOT)
    assert {"models.catenary.shape", "fmus.slave", "master.coupling"} <= set(rooms)
    page = room_pages.page(ROOT, "master.coupling", rooms["master.coupling"])
    assert "::: master.coupling.network" in page


def test_the_guide_to_lines_names_keys_that_there_are(references):
    text = (ROOT / "docs" / "lines.md").read_text(encoding="utf-8")
    table = re.search(r"\| table \| key \| meaning \|\n\|---\|---\|---\|\n(.*?)\n\n", text, re.DOTALL)[1]
    rows = [row.split("|")[1:3] for row in table.splitlines()]
    named = {key for _, keys in rows for key in re.findall(r"`(\w+)`", keys)}
    named |= {name.split(".")[-1] for tables, _ in rows for name in re.findall(r"`\[+([\w.]+)\]+`", tables)}
    assert len(named) > 50
    assert named <= {key.name for key in references["line"].keys.values()}


def _tutorial_lines():
    """Every call of the command in the tutorials: file and line."""
    for path in sorted((ROOT / "docs" / "tutorials").glob("*.md")):
        for block in re.findall(r"```sh\n(.*?)```", path.read_text(encoding="utf-8"), re.DOTALL):
            lines = block.replace("\\\n", " ").splitlines()
            yield from ((path.stem, line.strip()) for line in lines if line.strip().startswith("openpanto "))


def test_every_command_of_the_tutorials_is_understood():
    parser = _module("command_pages").parser_of("openpanto")
    calls = [shlex.split(line, comments=True)[1:] for _, line in _tutorial_lines()]
    assert len(calls) > 15
    for call in calls:
        parser.parse_args(call)

"""Broken definitions of lines and pantographs: every value, key and table, and blindly changed files."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, fields
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from models.catenary.definition.line_reading import read
from models.catenary.definition.support_reading import QUANTITIES as SUPPORT_KEYS
from models.catenary.definition.tensioning_definition import Tensioning, TensioningDevice
from models.catenary.definition.track_definition import Track
from models.catenary.definition.wind_definition import DesignWind
from models.commands.physics_main import main
from models.definition_files.toml_reader import DefinitionError, Table
from models.library.catalogue import line_path, load_line, load_pantograph, pantograph_path
from tests.effort import IS_LONG, count
from tests.robustness.mutation import changes
from tests.robustness.support import ANSWER_SECONDS, PROFILE, TRIED, ask, assert_quick, assert_worded, put_file

LINES = ("LN2", "Re330", "Shinkansen", "LN2_overlap", "LN2_ring")
PANTOGRAPHS = ("CX", "CX_multibody", "generic_multibody")
#: A line with the tables that no line of the library has.
ROUTE = Path(__file__).parents[2] / "docs" / "build_site" / "probes" / "line_route.toml"
#: A lumped pantograph with the keys that none of the library has.
HELD = Path(__file__).parent / "pantograph_held.toml"
FILES = {
    **{f"line {n}": line_path(n) for n in LINES},
    "line route": ROUTE,
    "pantograph held": HELD,
    **{f"pantograph {n}": pantograph_path(n) for n in PANTOGRAPHS},
}
#: One value with unit and source on a line of its own.
VALUE = re.compile(r'^(?P<key>\w+) = \[(?P<value>\[[^"]*\]|[^",]+), "(?P<unit>[^"]*)", (?P<source>"[^\n]*")\]$')
#: A number or a word that stands alone; words of the user's choice are none of them.
BARE = re.compile(r'^(?P<key>(?!(?:name|title)\b)\w+) = (?P<value>\d+|"[^"]*")(?: *#.*)?$')
NO_COUNTS = ("1.5", "-999999", '"one"', "nan", "[]", "{}", "true", "9" * 5000)
NO_WORDS = ('"zzz"', '""', "1", "[]", "true", '["zzz"]', '"' + "z" * 5000 + '"')
#: What may not stand in the place of a number.
NO_NUMBERS = (
    "nan", "inf", "-inf", "1e300", "-1e300", "true", '"12"', "{}", "[]", "[[1]]", "1979-05-27", "''", '[1, "2"]',
    "9" * 4000, "9" * 5000, "0x" + "f" * 5000, "[" * 500 + "]" * 500, "[" * 5000 + "]" * 5000,
)  # fmt: skip
#: Tables whose tables have names of the user's choice.
NAMED = ("body", "joint", "force")
NO_UNITS = ("", "degF", "furlong", "m/", "M", "kg.m3", "N m", "µm", "m" * 1000)


@dataclass(frozen=True)
class Case:
    """A broken file: its text, what the message must say."""

    text: str
    parts: tuple[str, ...]


def load(kind: str, path: Path):
    return load_line(str(path)) if kind.startswith("line") else load_pantograph(str(path))


def places(text: str) -> Iterator[tuple[int, list[str], re.Match[str]]]:
    lines = text.splitlines()
    # Of a mechanism's many points and axes a quarter is enough.
    step = 4 if 'type = "multibody"' in text and not IS_LONG else 1
    for i, line in enumerate(lines):
        if (found := VALUE.match(line)) and not (found["value"].startswith("[") and i % step):
            yield i, lines, found


def with_line(lines: list[str], index: int, *new: str) -> str:
    return "\n".join([*lines[:index], *new, *lines[index + 1 :]]) + "\n"


def of_turn(turn: int, every: tuple[str, ...]) -> tuple[str, ...]:
    """Return what is tried in a place: all in `.ci/long`; else a twelfth of it, at least one, the next in the next."""
    parts = min(12, len(every))
    return every if IS_LONG else every[turn % parts :: parts]


def wrong_values(text: str) -> Iterator[Case]:
    for turn, (i, lines, m) in enumerate(places(text)):
        for bad in of_turn(turn, NO_NUMBERS):
            yield Case(with_line(lines, i, f'{m["key"]} = [{bad}, "{m["unit"]}", {m["source"]}]'), ("broken.toml",))


def wrong_units(text: str) -> Iterator[Case]:
    for turn, (i, lines, m) in enumerate(places(text)):
        for bad in of_turn(turn, NO_UNITS):
            new = f'{m["key"]} = [{m["value"]}, "{bad}", {m["source"]}]'
            yield Case(with_line(lines, i, new), (m["key"], "unit"))


def wrong_shapes(text: str) -> Iterator[Case]:
    for turn, (i, lines, m) in enumerate(places(text)):
        key, value, unit, source = m["key"], m["value"], f'"{m["unit"]}"', m["source"]
        shapes = (
            f"{key} = [{value}, {unit}]", f"{key} = [{value}]", f"{key} = []", f"{key} = {source}",
            f'{key} = [{value}, {unit}, ""]', f"{key} = [{value}, {unit}, 1]", f"{key} = [{unit}, {value}, {source}]",
            f"{key} = [{value}, {unit}, {source}, {source}]", f"{key} = {{value = {value}}}",
        )  # fmt: skip
        for new in of_turn(turn, shapes):
            yield Case(with_line(lines, i, new), (key,))


def wrong_keys(text: str) -> Iterator[Case]:
    for turn, (i, lines, m) in enumerate(places(text)):
        yield Case(with_line(lines, i, lines[i].replace(m["key"], f"{m['key']}_", 1)), (f"{m['key']}_", "unknown key"))
        for new in of_turn(turn, (f"{lines[i]}\n{lines[i]}", lines[i].replace("=", ":", 1))):
            yield Case(with_line(lines, i, new), ("broken.toml", "line"))
    lines = text.splitlines()
    for i, line in enumerate(lines):
        if line.startswith("["):
            open_, close = ("[[", "]]") if line.startswith("[[") else ("[", "]")
            name = line.strip("[]")
            if name.partition(".")[0] not in NAMED:
                said = "broken.toml" if close == "]]" else f"{name.rpartition('.')[2]}_"
                yield Case(with_line(lines, i, f"{open_}{name}_{close}"), (said,))
            yield Case(with_line(lines, i, line, "zzz = 1"), ("zzz", "unknown key"))


def wrong_bare(text: str) -> Iterator[Case]:
    lines = text.splitlines()
    for turn, (i, m) in enumerate((i, m) for i, line in enumerate(lines) if (m := BARE.match(line))):
        for bad in of_turn(turn, NO_COUNTS if m["value"].isdigit() else NO_WORDS):
            yield Case(with_line(lines, i, f"{m['key']} = {bad}"), ("broken.toml",))


MAKERS = (wrong_values, wrong_units, wrong_shapes, wrong_keys)
#: Another way to say what `line_route.toml` says, and a line that takes what it does not: text in place of text.
OTHER_WAYS = {
    "radius": (
        ROUTE,
        '[track]\npositions = [[0, 50, 150], "m", "probe"]\ncurvature = [[0, 0.001, 0.0015], "1/m", "probe"]',
        '[track]\npositions = [[0, 50, 150], "m", "probe"]\nradius = [[0, 1000, 700], "m", "probe"]',
    ),
    "as built": (
        ROUTE,
        "[ends]",
        f'[as_built]\ndropper_length_errors = [{[*range(-10, 10)]}, "mm", "probe"]\n[ends]',
    ),
    "auxiliary wire": (
        line_path("Shinkansen"),
        "[dropper]",
        """[tensioning]
temperature = [300, "K", "probe"]
reference_temperature = [288, "K", "probe"]
[tensioning.auxiliary_wire]
kind = "spring"
stiffness = [15000, "N/m", "probe"]
expansion = [1.7e-5, "1/K", "probe"]
[tensioning.messenger_wire]
ratio = [3, "1", "probe"]
efficiency = [0.95, "1", "probe"]
[dropper]""",
    ),
}


def refusal(kind: str, path: Path, text: str) -> str:
    put_file(path, text)
    with pytest.raises(DefinitionError) as caught:
        load(kind, path)
    assert_worded(caught.value, "broken.toml")
    return str(caught.value)


@pytest.mark.parametrize("kind", FILES)
@pytest.mark.parametrize("maker", MAKERS, ids=lambda m: m.__name__)
def test_every_value_and_key(tmp_path, kind, maker):
    text = FILES[kind].read_text(encoding="utf-8")
    cases = list(maker(text))
    assert len(cases) > 10
    for case in cases:
        TRIED["definition, value by value"] += 1
        said = refusal(kind, tmp_path / "broken.toml", case.text)
        for part in case.parts:
            assert part in said, (part, said)


@pytest.mark.parametrize("kind", FILES)
def test_every_count_and_word(tmp_path, kind):
    for case in wrong_bare(FILES[kind].read_text(encoding="utf-8")):
        TRIED["definition, value by value"] += 1
        refusal(kind, tmp_path / "broken.toml", case.text)


@pytest.mark.parametrize("way", OTHER_WAYS)
def test_every_value_that_is_said_in_another_way(tmp_path, way):
    path, old, new = OTHER_WAYS[way]
    text = path.read_text(encoding="utf-8")
    assert text.count(f"{old}\n") == 1
    text = text.replace(f"{old}\n", f"{new}\n")
    put_file(tmp_path / "sound.toml", text)
    load_line(str(tmp_path / "sound.toml"))
    added = set(new.splitlines()) - set(old.splitlines())
    for maker in (*MAKERS, wrong_bare):
        for case in maker(text):
            if added <= set(case.text.splitlines()):
                continue  # broken elsewhere, where other tests break it
            TRIED["definition, value by value"] += 1
            said = refusal("line", tmp_path / "broken.toml", case.text)
            for part in case.parts:
                assert part in said, (part, said)


def test_every_key_of_track_supports_tensioning_and_wind_is_tried():
    """Not one can be added to these tables without a line in a file that is broken key by key."""
    tried = set()
    for text in (*(p.read_text(encoding="utf-8") for p in FILES.values()), *(new for *_, new in OTHER_WAYS.values())):
        table = ""
        for line in text.splitlines():
            if line.startswith("["):
                table = line.strip("[]").removeprefix("section.")
            elif VALUE.match(line) or BARE.match(line):
                tried.add(f"{table}.{line.partition(' ')[0]}")
    devices = ("contact_wire", "messenger_wire", "auxiliary_wire")
    keys = {f"track.{f.name}" for f in fields(Track)}
    keys |= {f"supports.{name}" for name in (*SUPPORT_KEYS, "stagger", "arm_side")}
    keys |= {f"tensioning.{f.name}" for f in fields(Tensioning)} - {f"tensioning.{name}" for name in devices}
    keys |= {f"wind.design.{f.name}" for f in fields(DesignWind)}
    of_device = {f.name for f in fields(TensioningDevice)}
    assert keys <= tried, keys - tried
    assert of_device <= {key.rpartition(".")[2] for key in tried if key.startswith("tensioning.")}
    assert all(f"tensioning.{name}.kind" in tried or f"tensioning.{name}.ratio" in tried for name in devices)


#: Keys whose values must be positive or, as a damping, not negative.
SIGNED = {"start", "end", "angle", "listed", "anchor", "strip_offset", "position", "pre_sag", "amplitude", "heights",
          "positions", "point_i", "point_j", "axis_i", "axis_j", "euler", "height", "start_position", "force", "moment",
          "static_force", "static_moment", "free_length", "shortest", "longest", "direction", "gravity", "rise",
          "minimum", "maximum", "spans", "beta", "messenger_stagger", "arm_angle", "mast_side",
          "fixed_point", "value"}  # fmt: skip


@pytest.mark.parametrize("kind", FILES)
def test_negative_values_of_what_has_none(tmp_path, kind):
    text = FILES[kind].read_text(encoding="utf-8")
    for i, lines, m in places(text):
        if m["key"] not in SIGNED and "[" not in m["value"]:
            TRIED["definition, negative value"] += 1
            new = f'{m["key"]} = [-{m["value"]}, "{m["unit"]}", {m["source"]}]'
            if float(m["value"]) != 0.0:
                assert m["key"] in refusal(kind, tmp_path / "broken.toml", with_line(lines, i, new))


def table_of(lines: list[str], index: int) -> str:
    """Return the dotted name of the table that a line is in; arrays of tables are numbered from 1."""
    heads = [line for line in lines[:index] if line.startswith("[")]
    if not heads:
        return ""
    name = heads[-1].strip("[]")
    return f"{name}[{heads.count(heads[-1])}]" if heads[-1].startswith("[[") else name


@pytest.mark.parametrize("kind", FILES)
def test_a_value_changed_within_its_limits_is_there(tmp_path, kind):
    """Sound inputs are taken as they are: the number as written is that of the definition."""
    text, path = FILES[kind].read_text(encoding="utf-8"), tmp_path / "sound.toml"
    parameters = {p.name: p for p in load(kind, FILES[kind]).parameters()}
    found = 0
    for i, lines, m in places(text):
        full = f"{table_of(lines, i)}.{m['key']}".lstrip(".")
        if full not in parameters or parameters[full].is_integer or not float(m["value"]):
            continue
        p = parameters[full]
        factor = 0.97 if p.minimum is None or 0.97 * p.value >= p.minimum else 1.03
        TRIED["definition, sound change"] += 1
        new = f'{m["key"]} = [{float(m["value"]) * factor!r}, "{m["unit"]}", {m["source"]}]'
        put_file(path, with_line(lines, i, new))
        after = {p.name: p.value for p in load(kind, path).parameters()}
        assert [n for n in parameters if after[n] != parameters[n].value] == [full]
        assert after[full] == pytest.approx(factor * p.value)
        found += 1
    assert found > 5


def numbers(data) -> list:
    """All that a file says, in order, for comparing what was read."""
    if isinstance(data, dict):
        return [x for k in sorted(data) for x in (k, *numbers(data[k]))]
    return [x for v in data for x in numbers(v)] if isinstance(data, list) else [data]


@settings(PROFILE, max_examples=count(90, 900))
@given(kind=st.sampled_from(sorted(FILES)), change=changes())
def test_blindly(tmp_path_factory, kind, change):
    TRIED["definition, blindly"] += 1
    path = tmp_path_factory.getbasetemp() / "broken.toml"
    put_file(path, change(FILES[kind].read_bytes()))
    try:
        definition = load(kind, path)
    except DefinitionError as error:
        assert_worded(error, "broken.toml")
        return
    data = tomllib.loads(path.read_text(encoding="utf-8"))
    assert definition.name == data["name"]
    provenance = getattr(definition, "provenance", {})
    for key, quantity in provenance.items():
        if "[" not in key:
            node = data
            for part in key.split("."):
                node = node[part]
            written = list(quantity.value) if isinstance(quantity.value, tuple) else [quantity.value]
            assert written == numbers([node[0]])


@pytest.mark.parametrize(("verb", "kind"), [("statics", "line LN2"), ("pantograph", "pantograph CX_multibody")])
def test_the_commands_say_the_same(tmp_path, verb, kind):
    text, path = FILES[kind].read_text(encoding="utf-8"), tmp_path / "broken.toml"
    cases = [c for maker in MAKERS for c in maker(text)][::5]
    assert len(cases) > 20
    for case in cases:
        TRIED[f"models {verb}"] += 1
        put_file(path, case.text)
        answer = ask(main, verb, path)
        assert_quick(answer)
        assert (answer.code, answer.err.startswith("error: ")) == (1, True), answer


@pytest.mark.parametrize("name", ["Re330", "LN2", "C270"])
def test_huge_lines_are_read_or_refused_at_once(name):
    """Ten thousand spans are 500 km: slow to compute, not to read; ten million droppers are nothing."""
    data = tomllib.loads(line_path(name).read_text(encoding="utf-8"))
    data["spans"] |= {"length": [50, "m", "x"], "count": 10_000}
    for unwanted in ("lengths", "end", "listed"):
        data["spans"].pop(unwanted, None)
    data["stagger"] = {"amplitude": [0.2, "m", "x"]}
    answer = ask(lambda _: len(read(Table.from_dict(data)).sections[0].spans) - 10_000)
    assert (answer.code, answer.seconds < 5 * ANSWER_SECONDS) == (0, True)
    data["spans"]["droppers"] = {"first": [4.5, "m", "x"], "count": 1000}
    with pytest.raises(DefinitionError, match="more than 100000 droppers"):
        read(Table.from_dict(data))

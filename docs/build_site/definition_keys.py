"""Key references of lines and pantographs, from what their readers ask a definition file for.

Every definition of the library and every probe beside this file (`probes/`) is read by the real reader, while each
question it asks (key, unit, range, default) is noted. Meanings come from the declared fields; `key_descriptions.toml`
has those of keys that no field declares.
"""

from __future__ import annotations

import dataclasses
import inspect
import math
import re
import tomllib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from models.definition_files.si_units import SI
from models.definition_files.toml_reader import DefinitionError, Table
from models.library.catalogue import (
    line_names,
    line_path,
    load_line,
    load_pantograph,
    pantograph_names,
    pantograph_path,
)

HERE: Final = Path(__file__).parent
_FORMS: Final = {
    "quantity": "value",
    "quantities": "list of values",
    "integer": "whole number",
    "text": "text",
    "texts": "list of texts",
    "flag": "`true` or `false`",
    "table": "table",
    "required_table": "table",
    "tables": "array of tables",
}
_TABLES: Final = ("table", "required_table", "tables")


@dataclass
class Key:
    """What the readers ask for under one key of one table.

    Attributes
    ----------
    table, name : str
        Generic path of the table (`spans.droppers`, `joint.NAME`) and the key in it.
    method : str
        Which method of the table read it.
    given : dict
        What the reader said of it: unit, range, default, choices.
    kinds : set of str
        Of joints, forces and faults: the kinds that have the key.
    others : list of dict
        What the reader said of it in tables of other kinds, where that differs.
    read_from : set of str
        The tables, of all files, that it was read from.
    defaults : list
        What the reader took where the key was absent; several where that depends on something else.
    """

    table: str
    name: str
    method: str
    given: dict[str, Any]
    kinds: set[str] = field(default_factory=set)
    others: list[dict[str, Any]] = field(default_factory=list)
    read_from: set[str] = field(default_factory=set)
    defaults: list[Any] = field(default_factory=list)

    @property
    def path(self) -> str:
        """Dotted path from the root of the file."""
        return f"{self.table}.{self.name}" if self.table else self.name

    @property
    def is_table(self) -> bool:
        """Whether it is a table, with keys of its own."""
        return self.method in _TABLES


@dataclass
class Reference:
    """All keys of one sort of file, in the order in which they are read, their meanings, and the FMU's parameters.

    `tables` has every table that was read, with the kind of joint or force it was, by generic path and place.
    """

    keys: dict[str, Key] = field(default_factory=dict)
    tables: dict[str, dict[str, str]] = field(default_factory=dict)
    meanings: dict[str, str] = field(default_factory=dict)
    parameters: set[str] = field(default_factory=set)


def line_reference() -> Reference:
    """Return the keys of lines."""
    files = [line_path(name) for name in line_names()] + probes("line")
    return _reference(files, load_line)


def pantograph_reference(kind: str) -> Reference:
    """Return the keys of pantographs of the type `lumped` or `multibody`."""
    files = [pantograph_path(name) for name in pantograph_names()] + probes("pantograph")
    return _reference([p for p in files if _type(p) == kind], load_pantograph)


def probes(kind: str) -> list[Path]:
    """Return the files that ask for what no definition of the library has."""
    return sorted((HERE / "probes").glob(f"{kind}_*.toml"))


def described() -> dict[str, dict[str, str]]:
    """Return the meanings that no field declares, by sort of file and path."""
    return tomllib.loads((HERE / "key_descriptions.toml").read_text(encoding="utf-8"))


def generic(path: str) -> str:
    """Return a dotted path without the numbers and names that a file gives.

    Examples
    --------
    >>> generic("section[2].spans.listed[3].first"), generic("joint.hinge.axis_i"), generic("stage[1].mass")
    ('spans.listed[].first', 'joint.NAME.axis_i', 'stage[].mass')
    """
    path = re.sub(r"\[\d+\]", "[]", _outside_sections(path))
    return re.sub(r"^(body|joint|force)\.[^.]+", r"\1.NAME", path)


def _outside_sections(path: str) -> str:
    """Return a path as it is in a line of one section: a table `[[section]]` has what is else at the top."""
    return re.sub(r"^section\[\d+\](\.|$)", "", path)


def _type(path: Path) -> str:
    return str(tomllib.loads(path.read_text(encoding="utf-8")).get("type"))


def _reference(files: list[Path], load: Callable[[str], Any]) -> Reference:
    found = Reference()
    for path in files:
        with _listening(found):
            try:
                definition = load(str(path))
            except DefinitionError:  # of a probe, which asks for more than goes together
                continue
        found.meanings |= dict(_declared(definition)) | found.meanings
        found.parameters |= {generic(p.name) for p in definition.parameters()}
    return found


@contextmanager
def _listening(found: Reference) -> Iterator[None]:
    """Note what is asked of the first table that anything is asked of, and of the tables in it."""
    originals = {name: getattr(Table, name) for name in _FORMS}
    root: list[Table] = []

    def heard(method: str, original: Callable[..., Any]) -> Callable[..., Any]:
        signature = inspect.signature(original)

        def ask(table: Table, *args: Any, **kwargs: Any) -> Any:
            root[:] = root or [table]
            if table.provenance is root[0].provenance:
                given = dict(signature.bind(table, *args, **kwargs).arguments)
                del given["self"]
                _note(found, root[0], table.key(given.pop("name")), method, given)
            return original(table, *args, **kwargs)

        return ask

    for name, original in originals.items():
        setattr(Table, name, heard(name, original))
    try:
        yield
    finally:
        for name, original in originals.items():
            setattr(Table, name, original)


def _note(found: Reference, root: Table, path: str, method: str, given: dict[str, Any]) -> None:
    where, _, name = path.rpartition(".")
    kind = _kind(root, where)
    place = f"{root.file}: {_outside_sections(where)}"
    found.tables.setdefault(generic(where), {})[place] = kind
    table, _, name = generic(path).rpartition(".")
    key = found.keys.setdefault(generic(path), Key(table, name, method, given))
    if method == "required_table":
        key.method = method
    key.kinds |= {kind} - {""}
    if where.startswith("fault[") and given not in (key.given, *key.others):
        key.others.append(given)
    key.read_from.add(place)
    if given.get("default") not in key.defaults:
        key.defaults.append(given.get("default"))


def _kind(root: Table, where: str) -> str:
    """Return the kind of the joint, the force or the fault whose table stands at a path, else nothing."""
    if match := re.fullmatch(r"fault\[(\d+)\]", where):
        return str(root.data["fault"][int(match[1]) - 1].get("kind", ""))
    section, _, element = where.partition(".")
    return str(root.data[section][element].get("kind", "")) if section in ("joint", "force") and element else ""


def _declared(definition: Any) -> Iterator[tuple[str, str]]:
    """Yield path and meaning of every declared field and parameter of a definition."""
    yield from _fields(definition, "")
    for parameter in definition.parameters():
        path = re.sub(r"\.(x|y|z|xx|yy|zz)$", "", parameter.name)
        name = path.split(".")[1] if path.startswith(("body.", "joint.", "force.")) else ""
        text = re.sub(r"(, | )?\b(x|y|z|xx|yy|zz)$", "", parameter.description) if path != parameter.name else ""
        text = text or parameter.description
        yield generic(path), re.sub(rf"^{re.escape(name)}: | of {re.escape(name)}\b", "", text) if name else text


def _fields(obj: Any, prefix: str) -> Iterator[tuple[str, str]]:
    for declared in dataclasses.fields(obj):
        value = getattr(obj, declared.name)
        spec = next((s for s in declared.metadata.values() if hasattr(s, "description")), None)
        if spec is not None:
            yield prefix + declared.name.rstrip("_"), spec.description
        elif dataclasses.is_dataclass(value):
            yield from _fields(value, f"{prefix}{declared.name}.")
        elif isinstance(value, tuple):
            for item in value:
                if dataclasses.is_dataclass(item):
                    yield from _fields(item, f"{prefix}{declared.name}[].")


def meaning(key: Key, reference: Reference, own: dict[str, str]) -> str:
    """Return what a key means: as described beside this file, else as declared, else nothing."""
    return own.get(key.path) or reference.meanings.get(key.path, "")


def is_required(key: Key, reference: Reference) -> bool:
    """Whether a file without the key is refused: it has no default, and whatever else is in the table, it is read."""
    if key.method in ("table", "tables") or key.defaults != [None]:
        return False
    tables = reference.tables[key.table]
    return key.read_from == {place for place, kind in tables.items() if not key.kinds or kind in key.kinds}


def page(title: str, intro: str, parts: list[tuple[str, str, Reference]]) -> str:
    """Return a page of Markdown: for each part (heading, sort of file, keys) a list of its tables."""
    lines = [f"# {title}", "", intro, ""]
    own = described()
    for heading, sort, reference in parts:
        if heading:
            lines += [f"## {heading}", ""]
        for table in _in_order(reference, ""):
            keys = [k for k in reference.keys.values() if k.table == table]
            level = "###" if heading else "##"
            lines += [f"{level} {_title(table, reference)}", "", *_rows(keys, reference, own[sort]), ""]
    return "\n".join(lines)


def _title(table: str, reference: Reference) -> str:
    if not table:
        return "Top of the file"
    key = reference.keys.get(table)
    brackets = "[[{}]]" if table.endswith("[]") or (key is not None and key.method == "tables") else "[{}]"
    return f"`{brackets.format(table.replace('[]', ''))}`"


def _in_order(reference: Reference, table: str) -> Iterator[str]:
    """Yield a table and the tables in it, in the order in which they are asked for."""
    yield table
    for key in reference.keys.values():
        inside = next((t for t in (key.path, f"{key.path}[]") if t in reference.tables), None)
        if key.table == table and key.is_table and inside is not None:
            yield from _in_order(reference, inside)


def _rows(keys: list[Key], reference: Reference, own: dict[str, str]) -> Iterator[str]:
    """Yield the rows of a table of keys; columns that would be empty are left out."""
    every = {kind for key in keys for kind in key.kinds}
    columns = {
        "key": [f"`{key.name}`" for key in keys],
        "form": [_FORMS[key.method] for key in keys],
        "unit": [_unit(key) for key in keys],
        "range": [_range(key) for key in keys],
        "default": [_default(key, reference) for key in keys],
        "meaning": [_cell(meaning(key, reference, own)) + _choices(key) for key in keys],
        "of kind": [_kinds(key, every) for key in keys],
    }
    shown = {head: cells for head, cells in columns.items() if any(cells)}
    yield f"| {' | '.join(shown)} |"
    yield f"|{'---|' * len(shown)}"
    for cells in zip(*shown.values(), strict=True):
        yield f"| {' | '.join(cells)} |"


def _kinds(key: Key, every: set[str]) -> str:
    return "all" if key.kinds and key.kinds == every else ", ".join(f"`{k}`" for k in sorted(key.kinds))


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


def _unit(key: Key) -> str:
    units = dict.fromkeys(given.get("unit", "") for given in (key.given, *key.others))
    return "; ".join(_one_unit(unit) for unit in units if unit)


def _one_unit(unit: str) -> str:
    others = [name for name, (si, _) in SI.items() if si == unit and name != unit]
    return f"`{unit}`" + (f" ({', '.join(f'`{o}`' for o in others)})" if others else "")


def _range(key: Key) -> str:
    return "; ".join(dict.fromkeys(filter(None, (_one_range(key, given) for given in (key.given, *key.others)))))


def _one_range(key: Key, given: dict[str, Any]) -> str:
    low, high = given.get("minimum", -math.inf), given.get("maximum", math.inf)
    if key.method == "integer" and "minimum" not in given:
        low = 0
    parts = []
    if given.get("positive") and not low > 0.0:
        parts.append("above 0")
    elif math.isfinite(low):
        parts.append(f"from {low:g}")
    if math.isfinite(high):
        parts.append(f"to {high:g}")
    length = given.get("length")
    count = f"{length} values" if length == 3 else ""  # of others it is that of another list
    return ", ".join(filter(None, [" ".join(parts), count]))


def _default(key: Key, reference: Reference) -> str:
    if is_required(key, reference):
        return "**required**"
    value = key.defaults[0] if len(key.defaults) == 1 else None
    if value is None or value in ("", ()):
        return ""
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    if isinstance(value, tuple):
        return ", ".join(f"{v:g}" for v in value)
    if isinstance(value, float):
        return f"{value:.6g}"
    return f"`{value}`" if isinstance(value, str) else str(value)


def _choices(key: Key) -> str:
    choices = key.given.get("choices")
    return f": one of {', '.join(f'`{c}`' for c in choices)}" if choices else ""

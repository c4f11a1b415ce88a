"""A definition in the making: its values by dotted keys, where each stands in a layout, and its text as TOML."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from models.layout.sheet_problems import Place

_STEP: Final = re.compile(r"([A-Za-z_][A-Za-z0-9_]*)(?:\[(\d+)\])?")
_WIDTH: Final = 110


class KeyFormError(ValueError):
    """A key that is none, or has no place; says why."""


@dataclass
class DefinitionDraft:
    """Values of a definition, with the places that they come from.

    Attributes
    ----------
    data : dict
        As a TOML file gives it.
    places : dict of str to Place
        Dotted key -> where its value stands, or should.
    told : set of str
        Keys whose values are known to be wrong.
    """

    data: dict[str, Any]
    places: dict[str, Place] = field(default_factory=dict)
    told: set[str] = field(default_factory=set)

    def put(self, key: str, value: Any, place: Place) -> None:
        """Set the value of a dotted key, ``fault[1].span``, as it stands in a file.

        Raises
        ------
        KeyFormError
            If it is no key, or a table is needed where a value is.
        """
        *steps, last = key.split(".")
        table = self.data
        for k, step in enumerate(steps):
            table = _inside(table, step, ".".join(steps[: k + 1]))
        if not _STEP.fullmatch(last) or "[" in last:
            raise KeyFormError(f"'{key}' is no key: write it with its tables, as damping.alpha or fault[1].span")
        if isinstance(table.get(last), dict):
            raise KeyFormError(f"'{key}' is a table: name a value in it")
        table[last] = value
        self.places[key] = place

    def has(self, key: str) -> bool:
        """Return whether a dotted key without numbers has a value."""
        table: Any = self.data
        for step in key.split("."):
            if not isinstance(table, dict) or step not in table:
                return False
            table = table[step]
        return True

    def place(self, key: str) -> Place | None:
        """Return where the value of a key stands, or the table that it is in, or its first key; None: in no sheet."""
        whole = key
        while key:
            if key in self.places:
                return self.places[key]
            key = key.rpartition(".")[0]
        inside = (p for k, p in self.places.items() if k.startswith(f"{whole}.") and p.sheet == "line")
        return next(inside, None)


def _inside(table: dict[str, Any], step: str, path: str) -> dict[str, Any]:
    """Return a table in a table, or one of an array of tables, made if it is not there."""
    match = _STEP.fullmatch(step)
    if match is None:
        raise KeyFormError(f"'{path}' names no table")
    name, number = match[1], int(match[2] or 0)
    if match[2] and not number:
        raise KeyFormError(f"there is no '{path}': they are counted from 1")
    inner = table.setdefault(name, [] if number else {})
    if not number:
        if not isinstance(inner, dict):
            raise KeyFormError(f"'{path}' is a value, and no table with keys in it")
        return inner
    if not isinstance(inner, list) or not all(isinstance(entry, dict) for entry in inner):
        raise KeyFormError(f"'{path}' is no array of tables")
    if not 1 <= number <= len(inner) + 1:
        raise KeyFormError(f"'{path}' comes before {name}[{len(inner) + 1}]: they are counted from 1")
    if number > len(inner):
        inner.append({})
    found: dict[str, Any] = inner[number - 1]
    return found


def flattened(data: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield every value of a definition with its dotted key, as ``put`` takes them."""
    for name, value in data.items():
        key = f"{path}.{name}" if path else name
        if isinstance(value, dict):
            yield from flattened(value, key)
        elif isinstance(value, list) and value and all(isinstance(entry, dict) for entry in value):
            for number, entry in enumerate(value, 1):
                yield from flattened(entry, f"{key}[{number}]")
        else:
            yield key, value


def toml_text(data: Mapping[str, Any], heading: str) -> str:
    """Return the text of a definition file, below a comment."""
    lines = [f"# {line}".rstrip() for line in heading.splitlines()]
    return "\n".join([*lines, "", *_table_lines(data, "")]).rstrip() + "\n"


def _table_lines(data: Mapping[str, Any], path: str) -> Iterator[str]:
    """Yield the lines of a table: its values, then the tables in it."""
    inner: list[tuple[str, Any]] = []
    for name, value in data.items():
        is_tables = isinstance(value, list) and bool(value) and all(isinstance(entry, dict) for entry in value)
        if isinstance(value, dict) or is_tables:
            inner.append((name, value))
        else:
            yield f"{name} = {_value(value, len(name))}"
    if data and len(inner) < len(data):
        yield ""
    for name, value in inner:
        key = f"{path}.{name}" if path else name
        if isinstance(value, dict):
            yield f"[{key}]"
            yield from _table_lines(value, key)
        else:
            for entry in value:
                yield f"[[{key}]]"
                yield from _table_lines(entry, key)


def _value(value: Any, indent: int) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007F")
    if isinstance(value, list):
        inner = ", ".join(_value(entry, indent) for entry in value)
        if len(inner) + indent > _WIDTH and all(isinstance(entry, (int, float)) for entry in value):
            return "[\n" + "\n".join(_rows(value)) + "\n]"
        return f"[{inner}]"
    return f"{value:.15g}" if isinstance(value, float) else str(value)


def _rows(numbers: list[float]) -> Iterator[str]:
    """Yield a long list of numbers in lines."""
    line = "   "
    for number in numbers:
        text = f" {_value(number, 0)},"
        if len(line) + len(text) > _WIDTH:
            yield line
            line = "   "
        line += text
    yield line

"""The definitions that a run was computed from: copied out of its FMUs into its folder, read back, compared.

An FMU is built again when its definition is edited, so neither of them can say later what an earlier run was made of.
"""

from __future__ import annotations

import tomllib
import zipfile
import zlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from master.errors import one_line
from master.results.run_results import Results
from master.safety.safe_files import write_atomically
from master.system.components import Component

#: Where our FMUs hold theirs; the slave reads the same (`fmus.slave.adapter`).
_IN_FMU: Final = "resources/definition.toml"
#: Larger ones are not kept [bytes]; those of the library have 30 kB at most.
_LARGEST: Final = 4 << 20
_UNREADABLE: Final = (OSError, KeyError, EOFError, RuntimeError, NotImplementedError, zipfile.BadZipFile, zlib.error)
#: How the files are called.
PATTERN: Final = "definition_*.toml"


def write_definitions(folder: Path, components: Sequence[Component]) -> None:
    """Copy the definition out of every FMU that has one, as ``definition_N.toml`` for the Nth component.

    Raises
    ------
    MasterError
        If a file cannot be written.
    """
    for number, component in enumerate(components, 1):
        if data := _definition_in(component.fmu.path):
            write_atomically(folder / PATTERN.replace("*", str(number)), data)


def _definition_in(path: Path) -> bytes:
    try:
        with zipfile.ZipFile(path) as file:
            return file.read(_IN_FMU) if file.getinfo(_IN_FMU).file_size <= _LARGEST else b""
    except _UNREADABLE:
        return b""  # of another tool; whatever is wrong with it, loading it says so


def differing_definitions(runs: Sequence[Results]) -> list[tuple[str, ...]]:
    """Return which keys of the components' definitions differ: component and key, then value and unit for each run.

    Where the definitions differ but that of a run was not kept, a row says so.
    """
    names = dict.fromkeys(c["name"] for run in runs for c in run.summary.get("components", []))
    return [row for name in names for row in _rows(name, runs)]


def _rows(name: str, runs: Sequence[Results]) -> Iterator[tuple[str, ...]]:
    hashes = {str(_component(run, name).get("sha256")) for run in runs}
    tables = [_definition_of(run, name) for run in runs]
    if len(hashes) == 1 or not any(tables):
        return
    if not all(tables):
        if all(_component(run, name) for run in runs):  # one that a run does not have is listed as such
            yield f"{name}: definition", *("kept" if table else "not kept with the run" for table in tables)
        return
    for key in dict.fromkeys(key for table in tables for key in table):
        values = [table.get(key, "-") for table in tables]
        if len(set(values)) > 1:
            yield f"{name}: {key}", *values


def _component(run: Results, name: str) -> Mapping[str, Any]:
    found: list[Mapping[str, Any]] = [c for c in run.summary.get("components", []) if c["name"] == name]
    return found[0] if found else {}


def _definition_of(run: Results, name: str) -> dict[str, str]:
    """Return the values in the definition of a component, by their keys; empty if it was not kept."""
    numbers = [i for i, c in enumerate(run.summary.get("components", []), 1) if c["name"] == name]
    if not numbers:
        return {}
    try:
        text = (run.folder / PATTERN.replace("*", str(numbers[0]))).read_text(encoding="utf-8-sig")
        return dict(_values("", tomllib.loads(text)))
    except (OSError, ValueError, RecursionError):
        return {}


def _values(key: str, data: Any) -> Iterator[tuple[str, str]]:
    """Yield keys and values with unit of a definition; sources and comments are none.

    Examples
    --------
    >>> dict(_values("", {"wire": {"tension": [20, "kN", "Table 5.2"]}, "lengths": [[[45, 54], "m", "choice"]]}))
    {'wire.tension': '20 kN', 'lengths[1][1]': '45 m', 'lengths[1][2]': '54 m'}
    """
    if isinstance(data, dict):
        for name, value in data.items():
            yield from _values(f"{key}.{name}" if key else name, value)
    elif _has_unit(data):
        unit = "" if data[1] == "1" else f" {data[1]}"
        yield from ((place, f"{value}{unit}") for place, value in _values(key, data[0]))
    elif isinstance(data, list):
        for i, value in enumerate(data, 1):
            yield from _values(f"{key}[{i}]", value)
    else:
        yield key, one_line(str(data))


def _has_unit(data: Any) -> bool:
    """Whether it is written [value, "unit", "source"]."""
    return isinstance(data, list) and len(data) in (2, 3) and all(isinstance(x, str) for x in data[1:])

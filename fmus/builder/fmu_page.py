"""The page inside every FMU: what it models, its ports and parameters, their sources, its limits."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from typing import Final

from fmus.slave.ports import Signal, Table, Variable
from models.definition_files.parameter import Parameter

_INDEX: Final = re.compile(r"\[(\d+)\]")
_CAUSALITIES: Final = (
    ("input", "Inputs"),
    ("output", "Outputs"),
    ("local", "Further variables"),
    ("calculatedParameter", "Calculated when initialization ends"),
)
_STYLE: Final = """body{font:15px/1.5 sans-serif;max-width:64em;margin:2em auto;padding:0 1em;color:#222}
table{border-collapse:collapse;margin:0 0 1.5em}
td,th{border:1px solid #ccc;padding:.2em .6em;text-align:left;vertical-align:top}
th{background:#f0f0f0}td:first-child{font-family:monospace;white-space:nowrap}
pre{background:#f6f6f6;padding:1em;overflow:auto}"""
_AXES: Final = "Axes: x along the track, y to the left, z up. Values are SI. Uplift is positive upwards."
_RUNNING: Final = (
    "This FMU contains Python code. The machine needs Python 3.11 or newer with numpy and scipy "
    "(<code>resources/requirements.txt</code>). On Linux (x86-64) the FMU's library brings Python into tools that are "
    "not Python themselves: the interpreter that the environment variable <code>OPENPANTO_PYTHON</code> names, or "
    "<code>python3</code> on PATH; elsewhere such a tool needs libpython in its process. "
    "<code>python -m fmus doctor FILE.fmu</code> says what is missing. "
    "Parameters may be set until initialization mode ends. The state can be saved, restored and serialised."
)


@dataclass(frozen=True)
class About:
    """What the page says in addition to what it takes from the variables.

    Attributes
    ----------
    name, title, fingerprint : str
        Model name, one line, GUID.
    models : str
        What is modelled, a paragraph.
    limits : sequence of str
        What is not.
    definition : str
        The definition file's text.
    """

    name: str
    title: str
    fingerprint: str
    models: str
    limits: Sequence[str]
    definition: str


@dataclass(frozen=True)
class Row:
    """Variables that differ only in their indices, on one line."""

    name: str
    unit: str
    text: str
    start: str


def page(about: About, table: Table, parameters: Sequence[Parameter]) -> bytes:
    """Return ``documentation/index.html``."""
    parts = [
        f"<h1>{escape(about.title)}</h1>",
        f"<p>{escape(about.name)}, FMI 2.0 co-simulation; GUID <code>{about.fingerprint}</code></p>",
        f"<h2>What it models</h2><p>{escape(about.models)}</p>",
        f"<h2>Ports</h2><p>{_AXES}</p>",
        *(_ports(table.variables, *kind) for kind in _CAUSALITIES),
        f"<h2>Parameters</h2>{_parameters(parameters)}",
        f"<h2>Limits</h2>{_list(about.limits)}",
        f"<h2>Running it</h2><p>{_RUNNING}</p>",
        "<h2>Licence</h2><p>MIT; see <code>documentation/licenses/</code>.</p>",
        "<h2>The definition that it was built from</h2><p>Also in <code>resources/definition.toml</code>.</p>",
        f"<pre>{escape(about.definition)}</pre>",
    ]
    head = f'<meta charset="utf-8"><title>{escape(about.title)}</title><style>{_STYLE}</style>'
    body = "\n".join(parts)
    return f'<!DOCTYPE html>\n<html lang="en"><head>{head}</head><body>\n{body}\n</body></html>\n'.encode()


def rows(signals: Iterable[Signal]) -> list[Row]:
    """Return signals as rows; those that differ only in an index share one.

    Examples
    --------
    >>> uplift = [Signal(f"support[{i}].uplift", "m", f"uplift at support {i}") for i in (1, 2, 3)]
    >>> [row.name for row in rows(uplift)]
    ['support[1 ... 3].uplift']
    """
    groups: dict[tuple[str, str], list[Signal]] = {}
    for s in signals:
        groups.setdefault((_INDEX.sub("[]", s.name), s.unit), []).append(s)
    return [_row(group) for group in groups.values()]


def _row(group: Sequence[Signal]) -> Row:
    first, last = group[0], group[-1]
    text = first.description
    name = first.name
    if len(group) > 1:
        highest = iter(_INDEX.findall(last.name))
        name = _INDEX.sub(lambda m: _span(m[1], next(highest)), name)
        text += " (and so on)"
    start = "" if first.start is None else f"{first.start:g}"
    return Row(name, first.unit, text, start)


def _span(first: str, last: str) -> str:
    return f"[{first}]" if first == last else f"[{first} ... {last}]"


def _ports(variables: Iterable[Variable], causality: str, title: str) -> str:
    found = rows(v.signal for v in variables if v.causality == causality)
    if not found:
        return ""
    body = [(r.name, r.unit, r.start, r.text) for r in found]
    return f"<h3>{title}</h3>{_table(('name', 'unit', 'start', 'meaning and sign'), body)}"


def _parameters(parameters: Iterable[Parameter]) -> str:
    body = [(p.name, f"{p.value:.10g}", p.unit, _range(p), p.description, p.source) for p in parameters]
    return _table(("name", "start", "unit", "range", "meaning", "source"), body)


def _range(p: Parameter) -> str:
    if p.minimum is None and p.maximum is None:
        return ""
    low = "" if p.minimum is None else f"{p.minimum:g}"
    high = "" if p.maximum is None else f"{p.maximum:g}"
    return f"{low} ... {high}".strip()


def _table(heads: Sequence[str], body: Iterable[Sequence[str]]) -> str:
    head = "".join(f"<th>{escape(h)}</th>" for h in heads)
    lines = ("".join(f"<td>{escape(cell)}</td>" for cell in row) for row in body)
    return f"<table><tr>{head}</tr>\n" + "\n".join(f"<tr>{line}</tr>" for line in lines) + "</table>"


def _list(items: Iterable[str]) -> str:
    return "<ul>" + "".join(f"<li>{escape(item)}</li>" for item in items) + "</ul>"

"""The pages of the reference that are made from definitions: keys of lines and pantographs, and the library."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import definition_keys

from models.library.catalogue import line_names, load_line, load_pantograph, pantograph_names

_QUANTITY = (
    'A value is written with its unit and its source, `[20, "kN", "Table 5.2"]`, a list of values as '
    '`[[1.2, 3.4], "m", "drawing 7"]`. Ranges and defaults below are in the unit named first; the units in brackets '
    "are understood too. A source that begins with `choice:` marks what no source states. Keys that are not listed are "
    "refused. This page is made from what the readers ask for."
)


def pages() -> dict[str, str]:
    """Return the generated pages by their path in the documentation."""
    line, lumped, multibody = (
        definition_keys.line_reference(),
        definition_keys.pantograph_reference("lumped"),
        definition_keys.pantograph_reference("multibody"),
    )
    return {
        "reference/line-keys.md": definition_keys.page(
            "Keys of a line",
            f"{_QUANTITY} How they work together: [Describe a line](../lines.md).",
            [("", "line", line)],
        ),
        "reference/pantograph-keys.md": definition_keys.page(
            "Keys of a pantograph",
            _QUANTITY,
            [("Lumped masses", "lumped", lumped), ("Multibody", "multibody", multibody)],
        ),
        "reference/library.md": _library(),
    }


def _library() -> str:
    lines = ["# Library", "", "## Lines", ""]
    lines += _table(line_names(), load_line, lambda d: d.type)
    lines += ["", "## Pantographs", ""]
    lines += _table(
        pantograph_names(), load_pantograph, lambda d: f"{len(d.stage)} masses" if hasattr(d, "stage") else "multibody"
    )
    return "\n".join(lines)


def _table(names: Sequence[str], load: Callable[[str], Any], kind: Callable[[Any], str]) -> list[str]:
    rows = ["| name | kind | what it is |", "|---|---|---|"]
    for name in names:
        definition = load(name)
        rows.append(f"| `{name}` | {kind(definition)} | {definition.title} |")
    return rows

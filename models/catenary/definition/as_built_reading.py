"""Reading the table [as_built]: what a section's droppers were found to be longer than designed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from models.catenary.definition.section_definition import Span
from models.definition_files.toml_reader import Table

#: Largest error of a length that can be meant [m].
LARGEST_ERROR: Final = 1.0


def read_length_errors(table: Table, spans: Sequence[Span]) -> tuple[float, ...]:
    """Return what every dropper is too long, in the order of the track [m]; empty without a table [as_built]."""
    own = table.table("as_built")
    if own is None:
        return ()
    count = sum(len(span.droppers) for span in spans)
    errors = own.quantities("dropper_length_errors", "m", minimum=-LARGEST_ERROR, maximum=LARGEST_ERROR)
    entry = own.data.get("dropper_length_errors")
    is_empty = isinstance(entry, list) and entry[:1] == [[]]
    if (errors or is_empty) and len(errors) != count:
        text = f"gives {len(errors)} values for {count} droppers: one for each, in the order of the track"
        own.problem("dropper_length_errors", text)
        return ()
    return errors

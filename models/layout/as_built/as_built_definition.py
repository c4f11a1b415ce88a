"""A design's definition file with what was found of the line: the text of the line as built, or as corrected."""

from __future__ import annotations

import re
import textwrap
import tomllib
from collections.abc import Sequence
from typing import Final

import numpy as np

from models.arrays import FloatArray
from models.catenary.condition.fitted_lengths import droppers_along
from models.catenary.definition.line_reading import read
from models.catenary.shape.form_finding import StaticState
from models.definition_files.toml_reader import DefinitionError, Table
from models.layout.as_built.measured_run import AsBuiltError
from models.library.definition_copy import CopyError, renamed

_SECTION: Final = re.compile(r"^[ \t]*\[\[[ \t]*section[ \t]*\]\]", re.MULTILINE)


def as_built_text(
    design_text: str, name: str, design: StaticState, error: FloatArray, source: str, remark: str, surface: str = ""
) -> str:
    """Return the text of a definition: the design's under another name, with errors of its droppers' lengths.

    Parameters
    ----------
    design_text : str
        Of the design's file.
    error : ndarray, shape (n_droppers,)
        What each dropper is longer than designed, in the order of the mesh [m].
    source : str
        Where the values are from, for each table.
    remark : str
        What the file is, in a sentence.
    surface : str
        Name of the file with the running surface beside it; empty for none.

    Raises
    ------
    AsBuiltError
        If the design's file is written so that tables cannot be added.
    """
    mesh = design.shape.mesh
    tables = [
        _table(error[droppers_along(mesh, k)], source, several=len(design.shape.definition.sections) > 1)
        for k in range(len(design.shape.definition.sections))
    ]
    try:
        text = _with_tables(renamed(design_text, name), tables)
    except CopyError as problem:
        raise AsBuiltError(f"the design's file cannot be copied: {problem}") from problem
    if surface:
        text += f'\n[running_surface]\nprofile = "{surface}"\n'
    text = "".join(f"# {line}\n" for line in textwrap.wrap(remark, 116)) + text
    _check(text, name, [error[droppers_along(mesh, k)] for k in range(len(tables))], with_surface=bool(surface))
    return text


def _table(errors: FloatArray, source: str, *, several: bool) -> str:
    values = ", ".join(f"{round(1e3 * e, 3) + 0.0:.7g}" for e in errors.tolist())
    wrapped = textwrap.fill(values, 116, initial_indent="    ", subsequent_indent="    ")
    head = "[section.as_built]" if several else "[as_built]"
    return f'\n{head}\ndropper_length_errors = [[\n{wrapped},\n], "mm", "{source}"]\n'


def _with_tables(text: str, tables: Sequence[str]) -> str:
    """Return the text with a table for every section, at the end of each."""
    text = text.rstrip("\n") + "\n"
    if len(tables) == 1 and not _SECTION.search(text):
        return text + tables[0]
    starts = [match.start() for match in _SECTION.finditer(text)]
    pieces = [text[a:b] for a, b in zip([0, *starts], [*starts, len(text)], strict=True)]
    joined = zip(pieces[1:], tables, strict=False)  # _check sees whether each section has its own
    return pieces[0] + "".join(piece.rstrip("\n") + "\n" + table + "\n" for piece, table in joined)


def _check(text: str, name: str, wanted: Sequence[FloatArray], *, with_surface: bool) -> None:
    """Refuse a text that does not say what it should; comments and unusual ways of writing could be the cause."""
    try:
        data = tomllib.loads(text)
        if with_surface:
            del data["running_surface"]  # its file is written together with this one
        sections = read(Table.from_dict(data, f"{name}.toml")).sections
        right = all(np.allclose(s.length_errors, w, atol=1e-6) for s, w in zip(sections, wanted, strict=True))
    except (tomllib.TOMLDecodeError, DefinitionError, ValueError):
        right = False
    if not right:
        raise AsBuiltError(
            "the design's file is written so that tables cannot be added at its end, or at the end of each [[section]]"
        )

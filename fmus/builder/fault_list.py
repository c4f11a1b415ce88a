"""A line FMU that lists an inactive fault for every dropper of some spans: one FMU to study what each one does."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Final

from models.library.search_path import definition_files

#: Catenary_LN2_F14F15: faults in the spans 14 and 15.
_NAME: Final = re.compile(r"Catenary_(?P<stem>.+)_F(?P<spans>\d{1,4}(?:F\d{1,4})*)", re.ASCII)


def split_faults(name: str, folders: Iterable[Path]) -> tuple[str, tuple[int, ...]]:
    """Return an FMU's name without the faults that it asks for, and their spans; a definition of the whole name wins.

    Examples
    --------
    >>> split_faults("Catenary_LN2_P2_F14F15", [])
    ('Catenary_LN2_P2', (14, 15))
    """
    match = _NAME.fullmatch(name)
    if match is None or definition_files("lines", name.removeprefix("Catenary_"), list(folders)):
        return name, ()
    return f"Catenary_{match['stem']}", tuple(int(n) for n in match["spans"].split("F"))


def fault_tables(definition: Path, spans: Iterable[int]) -> str:
    """Return tables ``[[fault]]`` for a line's definition: a broken dropper each, none of them active.

    Parameters
    ----------
    definition : Path
    spans : iterable of int
        Of the first section, from 1.

    Raises
    ------
    ValueError
        If the line cannot be read, or has no such span, or none with droppers.
    """
    from models.catenary.definition.line_reading import load  # NumPy, which names alone do without

    section = load(definition).sections[0]
    tables = []
    for number in dict.fromkeys(spans):
        if not 1 <= number <= len(section.spans):
            raise ValueError(f"{definition.name} has no span {number}: its first section has 1 to {len(section.spans)}")
        droppers = section.spans[number - 1].droppers
        if not droppers:
            raise ValueError(f"span {number} of {definition.name} has no droppers that could break")
        tables += [_table(number, k) for k in range(1, len(droppers) + 1)]
    return "".join(tables)


def _table(span: int, dropper: int) -> str:
    return f'\n[[fault]]\nkind = "dropper_broken"\nspan = {span}\ndropper = {dropper}\nactive = 0\n'

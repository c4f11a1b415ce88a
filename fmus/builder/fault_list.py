"""A line FMU that lists an inactive fault for every dropper, or arm, of some spans: one FMU for what each one does."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final

from models.library.search_path import definition_files

if TYPE_CHECKING:
    from models.catenary.definition.section_definition import Section

#: Catenary_LN2_F14F15: droppers of the spans 14 and 15; Catenary_LN2_A14: arms at both ends of span 14.
_NAME: Final = re.compile(r"Catenary_(?P<stem>.+)_(?P<marks>(?P<of>[FA])\d{1,4}(?:(?P=of)\d{1,4})*)", re.ASCII)
_ARMS: Final = "A"


def split_faults(name: str, folders: Iterable[Path]) -> tuple[str, str]:
    """Return an FMU's name without the faults that it asks for, and the mark of these; a whole name's definition wins.

    Examples
    --------
    >>> split_faults("Catenary_LN2_P2_F14F15", [])
    ('Catenary_LN2_P2', 'F14F15')
    """
    match = _NAME.fullmatch(name)
    if match is None or definition_files("lines", name.removeprefix("Catenary_"), list(folders)):
        return name, ""
    return f"Catenary_{match['stem']}", match["marks"]


def fault_tables(definition: Path, mark: str) -> str:
    """Return tables ``[[fault]]`` for a line's definition: a broken dropper or a loose arm each, none of them active.

    Parameters
    ----------
    definition : Path
    mark : str
        ``F14F15``: droppers of these spans of the first section, from 1; ``A14``: arms at their ends.

    Raises
    ------
    ValueError
        If the line cannot be read, or has no such span, or none with droppers or arms.
    """
    from models.catenary.definition.line_reading import load  # NumPy, which names alone do without

    section = load(definition).sections[0]
    tables: dict[str, None] = {}
    for number in map(int, mark[1:].split(mark[0])):
        if not 1 <= number <= len(section.spans):
            raise ValueError(f"{definition.name} has no span {number}: its first section has 1 to {len(section.spans)}")
        found = list(_arms(section, number) if mark[0] == _ARMS else _droppers(section, number))
        if not found:
            what = "steady arms at its ends that could come off" if mark[0] == _ARMS else "droppers that could break"
            raise ValueError(f"span {number} of {definition.name} has no {what}")
        tables |= dict.fromkeys(found)
    return "".join(tables)


def _droppers(section: Section, span: int) -> Iterator[str]:
    for dropper in range(1, len(section.spans[span - 1].droppers) + 1):
        yield f'\n[[fault]]\nkind = "dropper_broken"\nspan = {span}\ndropper = {dropper}\nactive = 0\n'


def _arms(section: Section, span: int) -> Iterator[str]:
    ends = {section.spans[span - 1].start, section.spans[span - 1].end}
    for number, support in enumerate(section.inner_supports, 1):
        is_seam = section.periodic and number == 1 and section.spans[-1].end in ends
        if support.has_steady_arm and (support.x in ends or is_seam):
            yield f'\n[[fault]]\nkind = "arm_loose"\nsupport = {number}\nactive = 0\n'

"""The sections of a layout: its rows of supports and droppers, checked against each other, span by span."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from models.arrays import FloatArray
from models.catenary.definition.section_reading import MAX_DROPPERS, MAX_HUNG, MAX_SPANS
from models.definition_files.message_text import hint, shown_value
from models.layout.layout_sheets import ANCHOR, HANGER, SEAM, SUPPORT, UNREGISTERED
from models.layout.sheet_problems import Place, SheetProblems
from models.layout.sheet_table import SheetTable

#: Shortest and longest span [m].
SHORTEST, LONGEST = 1.0, 200.0
#: Lengths of spans and positions agree within this [m].
_AGREES: Final = 2e-3
#: Droppers stand at least this far from each other [m].
_APART: Final = 1e-3


@dataclass(frozen=True)
class HungRows:
    """The droppers (or hangers) of a span.

    Attributes
    ----------
    rows : tuple of int
        Indices of their rows in the sheet.
    offsets : ndarray, shape (n,)
        Places from the span's start [m]; NaN where they have been told to be wrong.
    lengths : ndarray, shape (n,) or (0,)
        Unstrained lengths, if they are given [m].
    """

    rows: tuple[int, ...]
    offsets: FloatArray
    lengths: FloatArray


@dataclass(frozen=True)
class SectionRows:
    """One section of a layout.

    Attributes
    ----------
    name : str
    rows : tuple of int
        Indices of its rows in the sheet supports, from end to end.
    kinds : tuple of str
        What each is, one of ``KINDS``.
    x : ndarray, shape (n,)
        Where they stand [m].
    droppers, hangers : tuple of HungRows
        For each span.
    """

    name: str
    rows: tuple[int, ...]
    kinds: tuple[str, ...]
    x: FloatArray
    droppers: tuple[HungRows, ...]
    hangers: tuple[HungRows, ...]

    @property
    def is_ring(self) -> bool:
        """Return whether the section closes on itself."""
        return self.kinds[0] == SEAM

    @property
    def inner(self) -> range:
        """Return the places in ``rows`` of the supports that a definition lists: without anchors and a ring's end."""
        return range(0 if self.is_ring else 1, len(self.rows) - 1)

    @property
    def free(self) -> tuple[int, int]:
        """Return how many supports without an arm follow the first anchor, and precede the last."""
        registered = [k for k, kind in enumerate(self.kinds) if kind == SUPPORT] or [len(self.kinds) // 2]
        return registered[0] - 1, len(self.kinds) - 2 - registered[-1]


def read_sections(supports: SheetTable, droppers: SheetTable, problems: SheetProblems) -> tuple[SectionRows, ...]:
    """Return the sections, or those that are right, having told all problems of the others."""
    names = list(dict.fromkeys(supports.texts("section")))
    _check_names(supports, droppers, names, problems)
    if len(droppers) > MAX_DROPPERS:
        problems.add(Place(droppers.name), f"has {len(droppers)} droppers, and {MAX_DROPPERS} are the most")
        return ()
    found = (_section(name, supports, droppers, problems) for name in names)
    return tuple(section for section in found if section is not None)


def _check_names(supports: SheetTable, droppers: SheetTable, names: Sequence[str], problems: SheetProblems) -> None:
    """Check that every row belongs to a section that there is."""
    if len(names) > 1 and "" in names:
        for k, name in enumerate(supports.texts("section")):
            if not name:
                problems.add(supports.place(k, "section"), "is empty, and other rows name their section")
    if len(droppers) and not droppers.has("section") and "" not in names:
        text = f"the column 'section' is missing: which of the sections {', '.join(names)} is each dropper of?"
        problems.add(droppers.heading(), text)
        return
    for k, name in enumerate(droppers.texts("section")):
        if name not in names:
            what = f"there is no section {shown_value(name)} in the sheet supports" if name else "is empty"
            near = hint(name, names) if name else f": which of the sections {', '.join(names)} is it of?"
            problems.add(droppers.place(k, "section"), what + near)


def _section(name: str, supports: SheetTable, droppers: SheetTable, problems: SheetProblems) -> SectionRows | None:
    """Return a section, None if its supports are not where its spans and droppers could be told from them."""
    rows = tuple(k for k, own in enumerate(supports.texts("section")) if own == name)
    before = len(problems.found)
    kinds = _kinds(supports, rows, problems)
    x = supports.numbers("position")[list(rows)]
    right = len(problems.found) == before
    sound = _check_positions(supports, rows, x, problems)
    if len(rows) < 3 or len(rows) > MAX_SPANS + 1:
        text = f"has {len(rows)} supports: two anchors and at least one support between them are needed"
        if len(rows) > 3:
            text = f"has {len(rows) - 1} spans, and {MAX_SPANS} are the most"
        problems.add(Place(supports.name), (f"section '{name}' " if name else "") + text)
        sound = False
    own = [k for k, section in enumerate(droppers.texts("section")) if section == name]
    groups = _Spans(droppers, own, x, sound, problems)
    hung = groups.of(HANGER, are=False)
    hangers = groups.of(HANGER, are=True)
    if not sound:
        return None
    _check_span_lengths(supports, rows, x, problems)
    if not right:
        return None
    return SectionRows(name, rows, kinds, x, hung, hangers)


def _kinds(supports: SheetTable, rows: Sequence[int], problems: SheetProblems) -> tuple[str, ...]:
    """Return what the rows of a section are."""
    written = supports.texts("kind")
    last = len(rows) - 1
    kinds = [written[row] or (ANCHOR if k in (0, last) else SUPPORT) for k, row in enumerate(rows)]
    for k, row in enumerate(rows):
        place, kind = supports.place(row, "kind"), kinds[k]
        if (k in (0, last)) != (kind in (ANCHOR, SEAM)):
            where = "the first and the last row of a section are anchors" if k in (0, last) else "it lies between them"
            problems.add(place, f"'{kind}' cannot be here: {where}")
        elif k == last and kind != kinds[0]:
            problems.add(
                place, f"is '{kind}', and the first row of the section '{kinds[0]}': both are one or the other"
            )
        elif kind == UNREGISTERED and SUPPORT in kinds[:k] and SUPPORT in kinds[k:]:
            problems.add(place, "'unregistered' is for supports beside an anchor: this one has arms on both sides")
    if len(rows) > 2 and SUPPORT not in kinds and not supports.told("kind").any():
        problems.add(supports.heading("kind"), "no support of the section is registered: one must have a steady arm")
    return tuple(kinds)


def _check_positions(supports: SheetTable, rows: Sequence[int], x: FloatArray, problems: SheetProblems) -> bool:
    """Tell of supports in the wrong order or too far from each other; return whether there are none."""
    if len(x) > 2 and (np.diff(x) < 0.0).all():
        text = (
            f"the kilometrage falls, from {x[0]:g} to {x[-1]:g} m: list supports and spans the other way round, with "
            "stagger, curves and cant as seen along the rising kilometrage"
        )
        problems.add(supports.place(rows[1], "position"), text)
        return False
    count = len(problems.found)
    for (a, b), row in zip(pairwise(x), rows[1:], strict=False):
        place = supports.place(row, "position")
        if b < a:
            problems.add(place, f"{b:g} m comes after {a:g} m: positions rise along the track")
        elif b - a < SHORTEST:
            problems.add(place, f"{b:g} m is the place of the row before, or less than {SHORTEST:g} m from it")
        elif b - a > LONGEST:
            text = f"the span from {a:g} to {b:g} m is {b - a:g} m long, and {LONGEST:g} m are the most"
            problems.add(place, f"{text}: is a support missing, or the unit another?")
    _check_structures(supports, rows, problems)
    return bool(np.isfinite(x).all()) and len(problems.found) == count


def _check_structures(supports: SheetTable, rows: Sequence[int], problems: SheetProblems) -> None:
    names = supports.texts("structure")
    seen: dict[str, int] = {}
    for row in rows:
        if names[row] and (first := seen.setdefault(names[row], row)) != row:
            text = f"'{names[row]}' is the structure of row {supports.rows[first]} already"
            problems.add(supports.place(row, "structure"), text)


def _check_span_lengths(supports: SheetTable, rows: Sequence[int], x: FloatArray, problems: SheetProblems) -> None:
    lengths = supports.numbers("span_length")
    for (a, b), row in zip(pairwise(x), rows[:-1], strict=True):
        length = lengths[row]
        if length == length and abs(length - (b - a)) > _AGREES:
            text = f"a span of {length:g} m ends at {a + length:.10g} m, and the next support stands at {b:.10g} m"
            problems.add(supports.place(row, "span_length"), f"{text}: correct one of them")
    if lengths[rows[-1]] == lengths[rows[-1]]:
        problems.add(supports.place(rows[-1], "span_length"), "no span begins at the last support: empty the cell")


@dataclass(frozen=True)
class _Spans:
    """The rows of droppers of a section, ``own``, to be sorted into its spans between ``x``."""

    sheet: SheetTable
    own: Sequence[int]
    x: FloatArray
    sound: bool
    problems: SheetProblems

    def of(self, kind: str, *, are: bool) -> tuple[HungRows, ...]:
        """Return the droppers of every span, those that are of a kind, or are not."""
        kinds, spans = self.sheet.texts("kind"), self.sheet.numbers("span")
        count = len(self.x) - 1
        groups: dict[int, list[int]] = {}
        for row in self.own:
            if (kinds[row] == kind) != are or spans[row] != spans[row]:
                continue
            number = int(spans[row])
            if self.sound and number > count:
                text = f"there is no span {number}: the supports of the section make {count}"
                self.problems.add(self.sheet.place(row, "span"), text)
            groups.setdefault(number, []).append(row)
        if self.sound and self.own and not are:
            self._check_gaps(groups, count)
        numbers = range(1, count + 1) if self.sound else sorted(groups)
        return tuple(self._span(number, groups.get(number, [])) for number in numbers)

    def _check_gaps(self, groups: dict[int, list[int]], count: int) -> None:
        for number in range(1, count + 1):
            if number not in groups and not self.sheet.told("span").any():
                a, b = self.x[number - 1 : number + 1]
                text = f"span {number}, {a:g} ... {b:g} m, has no dropper: add its rows"
                self.problems.add(self.sheet.heading("span"), text)

    def _span(self, number: int, rows: list[int]) -> HungRows:
        offsets = self.sheet.numbers("position")[rows]
        usable = offsets.copy()
        length = self.x[number] - self.x[number - 1] if self.sound and number < len(self.x) else np.inf
        for k, (row, x, before) in enumerate(zip(rows, offsets, [np.nan, *offsets], strict=False)):
            place = self.sheet.place(row, "position")
            if not (0.0 < x < length or x != x):
                reach = f"of {length:g} m" if np.isfinite(length) else "that begins at 0"
                text = f"{x:g} m lies outside span {number} {reach}: positions count from the span's start"
                self.problems.add(place, text)
                usable[k] = np.nan
            elif x - before < _APART:
                self.problems.add(place, f"{x:g} m comes after {before:g} m: droppers of a span are in rising order")
                usable[k] = np.nan
        self._check_numbers(rows)
        if len(rows) > MAX_HUNG:
            text = f"span {number} has {len(rows)} droppers, and {MAX_HUNG} are the most"
            self.problems.add(self.sheet.place(rows[MAX_HUNG], "span"), text)
        return HungRows(tuple(rows), usable, self._lengths(number, rows))

    def _check_numbers(self, rows: Sequence[int]) -> None:
        numbers = self.sheet.numbers("dropper")
        for expected, row in enumerate(rows, 1):
            if numbers[row] == numbers[row] and numbers[row] != expected:
                text = (
                    f"is {numbers[row]:g}, and it is dropper {expected} of its span: is a row missing, or one too many?"
                )
                self.problems.add(self.sheet.place(row, "dropper"), text)

    def _lengths(self, number: int, rows: Sequence[int]) -> FloatArray:
        """Return the lengths of a span's droppers, none if they have none."""
        lengths = self.sheet.numbers("length")[list(rows)]
        empty = [row for row, value in zip(rows, lengths, strict=True) if value != value]
        if len(empty) == len(rows):
            return np.zeros(0)
        for row in empty:
            if not self.sheet.told("length")[row]:
                text = f"is empty, and other droppers of span {number} have a length: give all of a span one, or none"
                self.problems.add(self.sheet.place(row, "length"), text)
        return lengths


def spanned(table: SheetTable, indices: Sequence[int]) -> str:
    """Return the rows of a sheet that values stand in, for their source: `supports, rows 2-26`."""
    numbers = sorted(table.rows[k] for k in indices)
    return f"{table.name}, {'row' if len(numbers) == 1 else 'rows'} {'-'.join(_ends(numbers))}"


def _ends(numbers: Sequence[int]) -> Iterator[str]:
    yield str(numbers[0])
    if len(numbers) > 1:
        yield str(numbers[-1])

"""The sheets supports and droppers of a layout as the tables of a definition: spans, heights, stagger, ends, arms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from models.arrays import BoolArray, FloatArray
from models.catenary.definition.line_definition import CatenaryDefinition
from models.layout.definition_draft import DefinitionDraft
from models.layout.layout_sections import HungRows, SectionRows, spanned
from models.layout.layout_sheets import ANCHOR, SEAM, SUPPORT, UNREGISTERED
from models.layout.sheet_problems import SheetProblems
from models.layout.sheet_table import SheetTable

#: Column -> the line-wide key in whose place [supports] has values, and the key there.
_LINE_WIDE: Final = {
    "height": ("profile.contact_wire_height", "contact_wire_height"),
    "encumbrance": ("profile.encumbrance", "encumbrance"),
    "arm_length": ("steady_arm.length", "arm_length"),
    "arm_angle": ("steady_arm.angle", "arm_angle"),
}
_UNITS: Final = {"arm_angle": "rad", "arm_side": "1"}
#: Columns of what only a support with a steady arm has.
_OF_ARMS: Final = ("arm_length", "arm_angle", "arm_side")
#: Columns that a layout has, unless a design stands behind it.
_WANTED: Final = ("height", "encumbrance", "stagger")
#: Largest stagger at a support, and height of the contact wire there [m].
_LARGEST_STAGGER, _LARGEST_HEIGHT = 1.0, 10.0
#: Heights that differ by less are the same [m].
_SAME: Final = 1e-9


def put_sections(
    draft: DefinitionDraft,
    sections: Sequence[SectionRows],
    sheets: tuple[SheetTable, SheetTable],
    file: str,
    design: CatenaryDefinition | None,
    problems: SheetProblems,
) -> None:
    """Put the sections of a layout into a definition, and what all their supports have alike as line-wide values.

    Parameters
    ----------
    sheets : (SheetTable, SheetTable)
        Supports and droppers.
    file : str
        Name of the layout, for sources.
    design : CatenaryDefinition, optional
        Of which what the sheets do not have is taken.
    """
    supports = sheets[0]
    for name in _WANTED:
        if design is None and not supports.has(name):
            problems.add(supports.heading(), f"the column '{name}' is missing")
    writers = [_SectionWriter(draft, section, sheets, file, problems) for section in sections]
    for number, writer in enumerate(writers, 1):
        writer.put(f"section[{number}]." if len(writers) > 1 else "", design)
    for name, (wide, own) in _LINE_WIDE.items():
        values = [writer.values.get(name) for writer in writers]
        found = [v for v in values if v is not None]
        if not found:
            continue
        every = np.concatenate(found)
        alike = len(found) == len(writers) and np.ptp(every) <= _SAME
        source = f"{file}, {spanned(supports, [r for w in writers for r in w.section.rows])}"
        draft.put(wide, [_plain(every[0]), _UNITS.get(name, "m"), source], supports.heading(name))
        if not alike:
            for writer in writers:
                writer.put_list(own, name)


@dataclass
class _SectionWriter:
    """Writes one section; ``values`` are those of its inner supports, by column."""

    draft: DefinitionDraft
    section: SectionRows
    sheets: tuple[SheetTable, SheetTable]
    file: str
    problems: SheetProblems

    def __post_init__(self) -> None:
        self.supports, self.droppers = self.sheets
        self.values: dict[str, FloatArray] = {}
        self.prefix = ""

    def put(self, prefix: str, design: CatenaryDefinition | None) -> None:
        """Put the tables of the section below a prefix."""
        self.prefix = prefix
        self._put_spans()
        rises = self._heights(design)
        if not self.section.is_ring:
            self._put_ends(rises)
        self._check_encumbrance()
        for name in ("messenger_stagger", *_OF_ARMS):
            self._optional(name)
        self._put_stagger()
        for name in ("messenger_stagger", "arm_side"):
            self.put_list(name, name)
        self._put_structures()

    def put_list(self, key: str, column: str) -> None:
        """Put the values of the inner supports into the table [supports]."""
        if (values := self.values.get(column)) is not None:
            entry = [[_plain(v) for v in values], _UNITS.get(column, "m"), self._source()]
            self.draft.put(f"{self.prefix}supports.{key}", entry, self.supports.heading(column))

    def _source(self) -> str:
        return f"{self.file}, {spanned(self.supports, self.section.rows)}"

    def _put_spans(self) -> None:
        section, place = self.section, self.supports.heading("position")
        key = f"{self.prefix}spans."
        if section.is_ring:
            self.draft.put(f"{key}periodic", True, place)
        self.draft.put(f"{key}start", [_plain(section.x[0]), "m", self._source()], place)
        lengths = [_plain(round(b - a, 9)) for a, b in pairwise(section.x)]
        self.draft.put(f"{key}lengths", [lengths, "m", self._source()], place)
        self.draft.put(f"{key}end", [_plain(section.x[-1]), "m", self._source()], place)
        has_hangers = self._check_hangers(f"{key}hangers")
        for name, groups in (("listed", section.droppers), ("listed_hangers", section.hangers))[: 1 + has_hangers]:
            filled = ((number, hung) for number, hung in enumerate(groups, 1) if hung.rows)
            for entry, (number, hung) in enumerate(filled, 1):
                self._put_hung(f"{key}{name}[{entry}]", number, hung)

    def _check_hangers(self, key: str) -> bool:
        """Return whether the line has hangers, having told where they lack, or hang though it has none."""
        has_hangers = self.draft.data.get("type") == "compound"
        for number, (hung, (a, b)) in enumerate(zip(self.section.hangers, pairwise(self.section.x), strict=True), 1):
            if has_hangers and not hung.rows and not self.droppers.told("kind").any():
                text = f"span {number}, {a:g} ... {b:g} m, has no hanger, and the line an auxiliary wire: add its rows"
                self.problems.add(self.droppers.heading("kind"), text)
                self.draft.told.add(key)
            elif hung.rows and not has_hangers:
                text = "'hanger' is between auxiliary and messenger wire, and the line has no row 'auxiliary_wire'"
                self.problems.add(self.droppers.place(hung.rows[0], "kind"), text)
        return has_hangers

    def _put_hung(self, key: str, number: int, hung: HungRows) -> None:
        source = f"{self.file}, {spanned(self.droppers, hung.rows)}"
        first = hung.rows[0]
        self.draft.put(f"{key}.span", number, self.droppers.place(first, "span"))
        is_wrong = np.isnan(hung.offsets).any() or np.isnan(hung.lengths).any()
        for name, values in (("position", hung.offsets), ("length", hung.lengths)):
            if is_wrong:
                self.draft.told.add(f"{key}.{name}s")  # of the sheet
            elif len(values):
                entry = [[_plain(x) for x in values], "m", source]
                self.draft.put(f"{key}.{name}s", entry, self.droppers.place(first, name))

    def _heights(self, design: CatenaryDefinition | None) -> tuple[float, float]:
        """Note the heights of the inner supports, without the rise, and return that at both anchors [m]."""
        section = self.section
        if not self.supports.has("height"):
            return (0.0, 0.0) if design is None else design.sections[0].ends.rises
        needed = np.array([kind != UNREGISTERED for kind in section.kinds])
        heights = self._column("height", needed)
        if heights is None:
            return 0.0, 0.0
        if section.is_ring:
            self.values["height"] = heights[:-1]
            return 0.0, 0.0
        base = heights.copy()
        rises = tuple(self._end_heights(base, reverse=reverse) for reverse in (False, True))
        for k in section.inner:
            if base[k] > _LARGEST_HEIGHT:
                self._tell(k, "height", f"{base[k]:g} m is more than {_LARGEST_HEIGHT:g} m: check its unit")
        self.values["height"] = base[1:-1]
        return rises[0], rises[1]

    def _end_heights(self, base: FloatArray, *, reverse: bool) -> float:
        """Take the rise to an anchor off the heights of the supports beside it, and return it [m]."""
        section = self.section
        free = section.free[1 if reverse else 0]
        order = list(range(len(base)))[:: -1 if reverse else 1]
        anchor, beside, working = order[0], order[1 : 1 + free], order[1 + free]
        x = section.x
        share = ((x[working] - x) / (x[working] - x[anchor])) ** 2
        given = [k for k in beside if not np.isnan(base[k])]
        if given:
            first = given[0]
            rise = (base[anchor] - base[first]) / (1.0 - share[first])
        else:
            rise = base[anchor] - base[working]
        for k in beside:
            base[k] = base[k] - rise * share[k] if k in given else base[working]
        if rise < -_SAME or rise > 5.0:
            level = base[anchor] - rise
            text = f"{base[anchor]:g} m: a wire rises to its anchor by 0 ... 5 m, here from {level:g} m"
            self._tell(anchor, "height", text)
        return round(float(rise), 9) if rise > _SAME else 0.0

    def _put_ends(self, rises: tuple[float, float]) -> None:
        spans = len(self.section.x) - 1
        for name, row, free, rise in zip(("start", "end"), (0, -1), self.section.free, rises, strict=True):
            if (count := free + 1 if free or rise else 0) > (spans - 1) // 2:
                text = f"{spans} spans are too few for wires that rise over the last {count} at each end"
                self._tell(row, "height", f"{text}: {2 * count + 1} are the least")
            place = self.supports.place(self.section.rows[row], "height")
            key = f"{self.prefix}ends.{name}."
            self.draft.put(f"{key}spans", count, place)
            self.draft.told.add(f"{key}spans")
            source = f"{self.file}, {spanned(self.supports, [self.section.rows[row]])}"
            self.draft.put(f"{key}rise", [_plain(rise), "m", source], place)

    def _check_encumbrance(self) -> None:
        """Note the encumbrances; an anchor has that of the support beside it."""
        if not self.supports.has("encumbrance"):
            return
        kinds = self.section.kinds
        values = self._column("encumbrance", np.array([kind != ANCHOR for kind in kinds]))
        if values is None:
            return
        for anchor, beside in ((0, 1), (-1, -2)):
            if kinds[anchor] == ANCHOR and abs(values[anchor] - values[beside]) > 1e-6:  # not if it is empty
                text = f"{values[anchor]:g} m: at an anchor it is that of the support beside it, {values[beside]:g} m"
                self._tell(anchor, "encumbrance", f"{text}; write that, or empty the cell")
        self.values["encumbrance"] = values[self._inner]

    def _optional(self, name: str) -> None:
        """Note a column that all supports have, or none: of arms those that have one."""
        if not self.supports.has(name):
            return
        column = self.supports.numbers(name)[list(self.section.rows)]
        if np.isnan(column).all() and not self.supports.told(name).any():
            return
        kinds = self.section.kinds
        needed = np.array([k == SUPPORT or (k == UNREGISTERED and name not in _OF_ARMS) for k in kinds])
        needed |= np.array(kinds) == SEAM
        self._check_others(name, needed, column)
        values = self._column(name, needed)
        if values is None:
            return
        if name == "arm_side":
            for k in np.flatnonzero(needed & ~np.isnan(values) & (np.abs(values) != 1.0)):
                self._tell(int(k), name, f"{values[k]:g}: a side is 1, left of the wire, or -1")
        filled = np.interp(np.arange(len(values)), np.flatnonzero(needed), values[needed])
        self.values[name] = np.where(needed, values, np.rint(filled) if name == "arm_side" else filled)[self._inner]

    def _check_others(self, name: str, needed: BoolArray, column: FloatArray) -> None:
        """Tell of values where there is nothing to have them; a column filled with one value to its ends is none."""
        held = needed & ~np.isnan(column)
        beside = np.interp(np.arange(len(column)), np.flatnonzero(held), column[held]) if held.any() else column
        for k in np.flatnonzero(~needed & ~np.isnan(column)):
            if name not in _OF_ARMS:
                self._tell(int(k), name, f"{self.section.kinds[k]} has both wires in one place: empty the cell")
            elif abs(column[k] - beside[k]) > _SAME:
                text = f"{self.section.kinds[k]} has no steady arm: empty the cell, or write what the next one has"
                self._tell(int(k), name, text)

    @property
    def _inner(self) -> slice:
        return slice(self.section.inner.start, self.section.inner.stop)

    def _put_stagger(self) -> None:
        """Put the stagger of every inner support; where no arm holds the wire it lies straight, unless it is given."""
        if not self.supports.has("stagger"):
            return
        kinds = np.array(self.section.kinds)
        values = self._column("stagger", (kinds != ANCHOR) & (kinds != UNREGISTERED))
        if values is None:
            return
        anchors = kinds == ANCHOR
        values[anchors & np.isnan(values)] = 0.0
        held = ~np.isnan(values)
        values = np.where(held, values, np.interp(self.section.x, self.section.x[held], values[held]))
        for k in self.section.inner:
            if abs(values[k]) > _LARGEST_STAGGER:
                self._tell(k, "stagger", f"{values[k]:g} m is outside -1 ... 1 m: check its size and its unit")
        self.values["stagger"] = values[self._inner]
        self.put_list("stagger", "stagger")
        if anchors.any() and values[anchors].any():
            key, place = f"{self.prefix}stagger.anchor", self.supports.heading("stagger")
            self.draft.put(key, [[_plain(v) for v in values[[0, -1]]], "m", self._source()], place)

    def _put_structures(self) -> None:
        names = [self.supports.texts("structure")[row] for row in self.section.rows]
        if self.section.is_ring:
            names = names[:-1]
        if any(names):
            key = f"{self.prefix}supports.structure"
            self.draft.put(key, names, self.supports.heading("structure"))

    def _column(self, name: str, needed: BoolArray) -> FloatArray | None:
        """Return a column of the section, having told of empty cells where it is needed; None if it has wrong ones."""
        rows = list(self.section.rows)
        values, told = self.supports.numbers(name)[rows].copy(), self.supports.told(name)[rows]
        for k in np.flatnonzero(np.isnan(values) & needed & ~told):
            self._tell(int(k), name, "is empty: every support needs a value")
        if told.any() or np.isnan(values[needed]).any():
            return None
        if self.section.is_ring and abs(values[-1] - values[0]) > 1e-6:
            text = f"a ring ends as it begins, with {values[0]:g}: it has {values[-1]:g}"
            self._tell(-1, name, text)
        return values

    def _tell(self, k: int, name: str, text: str) -> None:
        self.draft.told.add(f"{self.prefix}supports.{_LINE_WIDE.get(name, ('', name))[1]}")
        self.problems.add(self.supports.place(self.section.rows[k], name), text)


def _plain(value: float) -> float:
    """Return a number without the rounding errors of its unit's conversion."""
    return float(f"{value:.15g}")

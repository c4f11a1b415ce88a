"""The page of ``asbuilt``: the line as it hangs, which droppers to change, and what that is expected to do."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from models.commands import as_built_tables
from models.commands.desk import page_markup as markup
from models.commands.desk.inline_figure import inline_figure
from models.commands.desk.page_markup import Part
from models.layout.as_built.as_built_outcome import AsBuiltOutcome

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def page(found: AsBuiltOutcome, file: str, doubts: tuple[str, ...], drawn: Mapping[str, Figure]) -> str:
    """Return the page of a line as built; ``drawn`` has its figures by name, whose size is changed."""
    definition = found.built.definition
    head = [
        f"<h1>{markup.text(definition.title or definition.name)}</h1>",
        markup.note(f"the line {definition.name} as it hangs, by the measuring run {found.built.run.source}"),
        _badge(found),
        *(markup.warning(words) for words in doubts),
        markup.pairs([("design", file), *as_built_tables.summary(found)]),
    ]
    return markup.document(f"{definition.name} as built", head, [part for part in _parts(found, drawn) if part.body])


def _badge(found: AsBuiltOutcome) -> str:
    measured, beyond = int(found.built.is_measured.sum()), int(found.is_beyond.sum())
    kind = "fail" if beyond else "pass"
    words = f"{measured - beyond} of {measured} droppers passed, limit {1e3 * found.tolerance:g} mm"
    words += f"; {beyond} failed" if beyond else ""
    return f"<p><span class='badge {kind}'>{markup.text(words)}</span></p>"


def _parts(found: AsBuiltOutcome, drawn: Mapping[str, Figure]) -> Iterator[Part]:
    before, after = (rise[found.built.is_measured] for rise in (found.before, found.after))
    error = found.built.error[found.built.is_measured]
    yield Part("figures", "In figures", (markup.tiles([
        ("largest error of a length", f"{1e3 * np.abs(error).max():.1f}", "mm"),
        ("droppers beyond the tolerance", str(int(found.is_beyond.sum())), ""),
        ("heights off the design, r.m.s.", f"{1e3 * np.sqrt(np.mean(before**2)):.1f}", "mm"),
        ("expected with the changes", f"{1e3 * np.sqrt(np.mean(after**2)):.1f}", "mm"),
        ("droppers to change", str(int(found.corrections.is_changed.sum())), ""),
    ]),))  # fmt: skip
    errors = inline_figure(drawn["errors"], "errors", "error of the length of every dropper")
    yield Part("errors", "Lengths as fitted", (
        markup.figure("Length as fitted less designed", errors, "Dashed: the tolerance."),
        markup.note(
            "As fitted: what a dropper must be long for the wire to hang as measured, with supports where the design "
            "has them. A support that has sunk shows as droppers beside it that are too long."
        ),
    ))  # fmt: skip
    heights = inline_figure(drawn["heights"], "heights", "heights before, and expected after the changes")
    yield Part("heights", "Heights before and after", (
        markup.figure("Height of the contact wire over that of the design", heights),
    ))  # fmt: skip
    rows = list(as_built_tables.dropper_rows(found))
    changed = [row for row, change in zip(rows, found.change, strict=True) if change]
    yield Part("changes", "Droppers to change", (_sheet(changed),) if changed else ("<p>None.</p>",), is_sheet=True)
    yield Part("droppers", "All droppers", (_sheet(rows),), is_sheet=True)


def _sheet(rows: list[tuple[str, ...]]) -> str:
    return markup.table(as_built_tables.COLUMNS, rows, leading=2, group=0)

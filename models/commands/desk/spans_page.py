"""The page of ``spans``: smallest radius for a span, largest span for a radius."""

from __future__ import annotations

from collections.abc import Sequence

from models.catenary.definition.line_definition import CatenaryDefinition
from models.commands import spans_report
from models.commands.desk import page_markup as markup
from models.commands.desk.inline_figure import inline_figure
from models.commands.desk.page_markup import Part
from models.interface.line_spans import SpanTable


def page(definition: CatenaryDefinition, found: SpanTable, file: str, asked: Sequence[tuple[str, str]]) -> str:
    """Return the page of a line's span tables."""
    head = [
        f"<h1>{markup.text(definition.title or definition.name)}</h1>",
        markup.note(f"spans and radii of the line {definition.name} in the wind, for its designer"),
        *map(markup.warning, spans_report.warnings(definition, found)),
        markup.pairs([
            ("file", file),
            ("contact wire", f"{found.tension:g} N, diameter {1e3 * definition.contact_wire.width:.2f} mm"),
            ("wind", f"{found.pressure:.2f} Pa, {found.force:.3f} N/m on the contact wire"),
            ("permissible offset from the middle of the track", spans_report.permissible(found)),
            *asked,
        ]),
    ]  # fmt: skip
    columns = [f"stagger {name}" for name in found.names]
    drawn = inline_figure(spans_report.figure(found), "spans", "smallest radius over the length of the span")
    parts = [
        Part("radii", "Smallest radius for a span [m]", (
            markup.figure("Smallest radius over the length of the span", drawn),
            markup.table(("span [m]", *columns), spans_report.rows(found.lengths, found.smallest_radius, 0), leading=0),
            markup.note("Radii in steps of 5 m; none: the span keeps within the limit in no curve."),
        )),
        Part("spans", "Largest span for a radius [m]", (
            markup.table(spans_report.span_heads(found, "stagger "), spans_report.span_rows(found), leading=0),
            markup.note(
                "None: the staggers alone are beyond the limit; any: no wind moves the wire that far. Staggers are "
                "those at both ends of a span, positive to the outside of the curve; the contact wire as a string."
            ),
        )),
    ]  # fmt: skip
    return markup.document(f"{definition.name}: spans in the wind", head, parts)

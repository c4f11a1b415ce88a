"""The pieces of HTML of which a page consists. All text from outside goes through `text`."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib import resources
from typing import Final

from models.interface.norm_judgement import Judgement

#: The browser itself prevents the page from requesting or running anything.
_SEALED: Final = (
    "<meta http-equiv='Content-Security-Policy' content=\"default-src 'none'; style-src 'unsafe-inline'; "
    'img-src data:">'
)
#: What stands in a cell without a value.
NOTHING: Final = "\u2013"


@dataclass(frozen=True)
class Part:
    """A part of a page: its heading, by which the page's list of contents names it, and what is in it.

    Attributes
    ----------
    key : str
        Identifier on the page.
    title : str
    body : tuple of str
        Markup.
    is_sheet : bool
        Whether it begins a new sheet of paper.
    """

    key: str
    title: str
    body: tuple[str, ...]
    is_sheet: bool = False


def document(title: str, head: Sequence[str], parts: Sequence[Part]) -> str:
    """Return a complete page that needs no other file."""
    style = resources.files("models.commands.desk").joinpath("desk.css").read_text(encoding="utf-8")
    links = "".join(f"<a href='#{p.key}'>{text(p.title)}</a>" for p in parts)
    return "\n".join([
        "<!doctype html>\n<html lang='en'><head><meta charset='utf-8'>",
        _SEALED,
        "<meta name='viewport' content='width=device-width, initial-scale=1'>",
        f"<link rel='icon' href='data:,'><title>{text(title)}</title><style>{style}</style></head><body><main>",
        *head,
        f"<nav>{links}</nav>",
        *(_section(part) for part in parts),
        "</main></body></html>\n",
    ])  # fmt: skip


def _section(part: Part) -> str:
    kind = " class='sheet'" if part.is_sheet else ""
    return f"<section id='{part.key}'{kind}><h2>{text(part.title)}</h2>" + "\n".join(part.body) + "</section>"


def text(value: object) -> str:
    """Return text escaped for HTML; characters that no page shows are shown as their codes.

    Examples
    --------
    >>> text("<b>&'")
    '&lt;b&gt;&amp;&#x27;'
    """
    shown = "".join(c if c.isprintable() or c.isspace() else repr(c)[1:-1] for c in str(value))
    return html.escape(shown, quote=True)


def note(words: str) -> str:
    """Return a remark in small type."""
    return f"<p class='note'>{text(words)}</p>"


def warning(words: str) -> str:
    """Return what deserves a second look."""
    return f"<p class='warning'>{text(words)}</p>"


def pairs(rows: Iterable[tuple[str, str]]) -> str:
    """Return names with their values."""
    return "<dl>" + "".join(f"<dt>{text(name)}</dt><dd>{text(value)}</dd>" for name, value in rows) + "</dl>"


def tiles(rows: Iterable[tuple[str, str, str]]) -> str:
    """Return figures that are seen first: what, value, unit."""
    return (
        "<div class='tiles'>"
        + "".join(
            f"<div class='tile'><div class='name'>{text(name)}</div>"
            f"<div class='value'>{text(value)} <small>{text(unit)}</small></div></div>"
            for name, value, unit in rows
        )
        + "</div>"
    )


def table(heads: Sequence[str], rows: Iterable[Sequence[str]], leading: int = 1, group: int | None = None) -> str:
    """Return a table whose columns after the leading ones hold numbers; its head is repeated on every sheet.

    Parameters
    ----------
    group : int, optional
        Column whose changes begin groups of rows, which are set apart.
    """
    head = "".join(f"<th{'' if i < leading else _RIGHT}>{text(h)}</th>" for i, h in enumerate(heads))
    lines, before = [], None
    for row in rows:
        begins = group is not None and row[group] != before
        before = None if group is None else row[group]
        cells = "".join(f"<td{'' if i < leading else _RIGHT}>{text(c)}</td>" for i, c in enumerate(row))
        lines.append(f"<tr{_FIRST if begins else ''}>{cells}</tr>")
    kind = " class='short'" if len(lines) <= _SHORT else ""
    inside = f"<thead><tr>{head}</tr></thead><tbody>{''.join(lines)}</tbody>"
    return f"<div class='scroll'><table{kind}>{inside}</table></div>"


#: Rows that stay together on one sheet of paper.
_SHORT: Final = 15
_RIGHT: Final = " class='n'"
_FIRST: Final = " class='first'"


_WORST_FIRST: Final = ("failed", "with proof", "passed")
#: Class in the style sheet and sign of a verdict.
_SIGNS: Final = {"passed": ("pass", "\u2713"), "with proof": ("near", "!"), "failed": ("fail", "\u2717")}


def verdicts(judged: Sequence[Judgement]) -> str:
    """Return the table of what was held against limits, the worst first."""
    ordered = sorted(judged, key=lambda j: _WORST_FIRST.index(j.word))
    rows = "".join(
        f"<tr><td>{mark(j)}</td><td class='words'>{text(j.what)}</td><td>{text(j.figure)}</td>"
        f"<td class='words'>{text(j.limit)}<div class='note'>{text(j.source)}</div></td></tr>"
        for j in ordered
    )
    heads = "<th>verdict</th><th>what</th><th>figure</th><th>limit, and where it is from</th>"
    return f"<table class='verdicts'><thead><tr>{heads}</tr></thead><tbody>{rows}</tbody></table>"


def mark(judged: Judgement) -> str:
    """Return a verdict as a sign and a word, not by colour alone."""
    kind, sign = _SIGNS[judged.word]
    return f"<span class='{kind}'>{sign} {text(judged.word)}</span>"


def badge(judged: Sequence[Judgement]) -> str:
    """Return how many figures passed, in a line."""
    passed, proof, failed = (sum(j.word == word for j in judged) for word in ("passed", "with proof", "failed"))
    kind = "fail" if failed else "near" if proof else "pass"
    words = f"{passed} of {len(judged)} limits passed" + (f", {proof} with proof" if proof else "")
    words += f", {failed} failed" if failed else ""
    return f"<p><span class='badge {kind}'>{text(words)}</span></p>" if judged else note("no limit was asked for")


def figure(title: str, drawing: str, remark: str = "") -> str:
    """Return a drawing with its caption."""
    under = note(remark) if remark else ""
    return f"<figure><figcaption>{text(title)}</figcaption><div class='scroll'>{drawing}</div>{under}</figure>"

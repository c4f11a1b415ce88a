"""Figures as drawings within a page: SVG that scales with it, its letters left to the reader's fonts."""

from __future__ import annotations

import io
import re
from typing import TYPE_CHECKING, Final

from models.commands.desk.page_markup import text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Width of a figure [in]: what a sheet of A4 holds, so that letters are printed as large as they are meant.
_WIDTH: Final = 7.3
_METADATA: Final = re.compile(r"<metadata>.*?</metadata>", re.DOTALL)
_STYLE: Final = re.compile(r"<defs>\s*<style[^>]*>.*?</style>\s*</defs>", re.DOTALL)
_OPENING: Final = re.compile(r"<svg [^>]*>", re.DOTALL)
_IDENTIFIER: Final = re.compile(r' id="([^"]*)"')
_USED: Final = re.compile(r"#([\w.:-]+)")
_BOX: Final = re.compile(r'viewBox="([^"]*)"')


def inline_figure(figure: Figure, key: str, name: str) -> str:
    """Return a figure as SVG that is part of a page.

    Parameters
    ----------
    figure : Figure
        Its size is changed to that of a page.
    key : str
        Another one for every figure of a page, so that what they name within themselves does not collide.
    name : str
        What it shows, for readers who do not see it.
    """
    import matplotlib

    width, height = figure.get_size_inches()
    figure.set_size_inches(_WIDTH, height * (_WIDTH / width) ** 0.8)
    buffer = io.StringIO()
    with matplotlib.rc_context({"svg.fonttype": "none", "svg.hashsalt": key}):
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    drawn = _STYLE.sub("", _METADATA.sub("", buffer.getvalue()))
    opening = _OPENING.search(drawn)
    assert opening is not None
    box = _BOX.search(opening[0])
    assert box is not None
    inside = drawn[opening.end() :]
    used = set(_USED.findall(inside))
    inside = _IDENTIFIER.sub(lambda found: found[0] if found[1] in used else "", inside)
    head = "xmlns='http://www.w3.org/2000/svg' xmlns:xlink='http://www.w3.org/1999/xlink' role='img'"
    return f"<svg {head} viewBox='{box[1]}' aria-label='{text(name)}'>{inside}"

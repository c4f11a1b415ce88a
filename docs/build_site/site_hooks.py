"""What mkdocs calls while it builds: generated pages, formulas as MathML; nothing is loaded from outside."""

from __future__ import annotations

import html
import re
import sys
from pathlib import Path
from typing import Any, Final

from latex2mathml.converter import convert
from mkdocs.structure.files import File, Files

HERE: Final = Path(__file__).parent
ROOT: Final = HERE.parents[1]
_PATHS: Final = [str(ROOT), str(HERE)]
sys.path[:0] = _PATHS

import command_pages  # noqa: E402
import reference_pages  # noqa: E402
import room_pages  # noqa: E402

_FORMULA: Final = re.compile(r'<(span|div) class="arithmatex">\\([(\[])(.*?)\\[)\]]</\1>', re.DOTALL)
#: What lets a page opened from a folder search; the theme would load it from a server.
_SHIM: Final = "https://unpkg.com/iframe-worker/shim"
_API: Final = "reference/api"


def on_files(files: Files, config: Any) -> Files:
    """Add the generated pages, and those of the Python reference to the navigation."""
    sys.path[:0] = _PATHS  # mkdocs takes back what a hook's import has put there
    pages = {f"{_API}/{room}.md": room_pages.page(ROOT, room, m) for room, m in room_pages.rooms(ROOT).items()}
    pages |= reference_pages.pages() | {"reference/commands.md": command_pages.page()}
    for path, text in pages.items():
        files.append(File.generated(config, path, content=text))
    entry = next(e["Reference"] for e in config["nav"] if "Reference" in e)
    python = next(e for e in entry if "Python, room by room" in e)
    python["Python, room by room"] = [f"{_API}/{room}.md" for room in room_pages.rooms(ROOT)]
    return files


def on_page_content(content: str, **_: Any) -> str:
    """Write the formulas of a page as MathML."""
    return _FORMULA.sub(_mathml, content)


def on_post_page(output: str, page: Any, **_: Any) -> str:
    """Let a page load what lies beside it instead of what lies on a server."""
    return output.replace(_SHIM, f"{'../' * page.file.dest_uri.count('/')}assets/iframe-worker.js")


def on_post_template(output_content: str, **_: Any) -> str:
    """Do so for pages that are no page of the documentation, such as 404."""
    return output_content.replace(_SHIM, "/assets/iframe-worker.js")


def _mathml(found: re.Match[str]) -> str:
    tag, bracket, formula = found.groups()
    display = "block" if bracket == "[" else "inline"
    return f'<{tag} class="formula">{convert(html.unescape(formula), display=display)}</{tag}>'

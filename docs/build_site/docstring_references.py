"""References of docstrings, which numpydoc writes as reStructuredText, in Markdown."""

from __future__ import annotations

import re
from typing import Any, Final

import griffe

_HEADING: Final = re.compile(r"^References\n-+\n", re.MULTILINE)
_ENTRY: Final = re.compile(r"^\.\. \[(\d+)\] ", re.MULTILINE)
_MARK: Final = re.compile(r"\[(\d+)\]_")
#: Brackets beside brackets are no link: an invisible character between them says so, in code too.
_BESIDE: Final = re.compile(r"\](?= ?\[)")


class DocstringReferences(griffe.Extension):
    """Turns `[1]_` and the entries under "References" into text that Markdown leaves as it is."""

    def on_instance(self, *, obj: griffe.Object, **_: Any) -> None:
        """Rewrite the docstring of anything that has one."""
        if obj.docstring is not None:
            text = _HEADING.sub("**References**\n\n", obj.docstring.value)
            text = _MARK.sub(r"\\[\1\\]", _ENTRY.sub(r"\\[\1\\] ", text))
            obj.docstring.value = _BESIDE.sub("]\u2060", text)

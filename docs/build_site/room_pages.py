"""The Python reference: a page for each room (folder) of the packages, its modules one after the other."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import Final

PACKAGES: Final = ("models", "fmus", "master")
#: Described elsewhere: in the command reference, and in docs/python.md.
_LEFT_OUT: Final = ("commands", "interface")


def rooms(root: Path) -> dict[str, list[str]]:
    """Return the modules of every room by the room's dotted name, in the order of their names."""
    found: dict[str, list[str]] = {}
    for package in PACKAGES:
        for init in sorted((root / package).rglob("__init__.py")):
            folder = init.parent.relative_to(root)
            modules = sorted(p.stem for p in init.parent.glob("*.py") if not p.stem.startswith("__"))
            if modules and not set(folder.parts) & set(_LEFT_OUT):
                dotted = ".".join(folder.parts)
                found[dotted] = [f"{dotted}.{module}" for module in modules]
    return found


def page(root: Path, room: str, modules: list[str]) -> str:
    """Return a room's page: its duty, then every module, documented by mkdocstrings."""
    init = root.joinpath(*room.split("."), "__init__.py").read_text(encoding="utf-8")
    duty = ast.get_docstring(ast.parse(init)) or ""
    # Of what a reader looks for the rooms come last.
    parts = ["---", "search:", "  boost: 0.3", "---", "", f"# {room}", "", duty.partition("\n\n")[0], ""]
    for module in modules:
        parts += [f"::: {module}", ""]
    return "\n".join(parts)

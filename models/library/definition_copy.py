"""A definition under another name: a copy that keeps every comment and source."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Final

from models.catenary.definition.surface_reading import named_profile

_NAME: Final = re.compile(r"""^(\s*name\s*=\s*)("[^"\n]*"|'[^'\n]*')""", re.MULTILINE)
_TABLE: Final = re.compile(r"^\s*\[", re.MULTILINE)
_ALLOWED: Final = re.compile(r"[A-Za-z0-9_]{1,60}")


class CopyError(ValueError):
    """A definition that cannot be copied, or a name that no definition can have; says why."""


def checked_name(name: str) -> str:
    """Return a name that a definition can have; it names its file, and its FMU.

    Raises
    ------
    CopyError
        If it has other characters than letters, digits and _, or is too long.
    """
    if not _ALLOWED.fullmatch(name):
        raise CopyError(
            f"'{name}' cannot name a definition, its file and its FMU: take letters, digits and _ (1 to 60)"
        )
    return name


def profile_of_copy(path: Path, copy: Path) -> tuple[Path, bytes] | None:
    """Return where a copy of a line's definition looks for its running surface, and what must be there.

    None if the line names no file for it, or that is there already.

    Parameters
    ----------
    path, copy : Path
        The definition and its copy, both there.

    Raises
    ------
    CopyError
        If another file is there already.
    """
    source, target = named_profile(path), named_profile(copy)
    if source is None or target is None or source.resolve() == target.resolve():
        return None
    data = source.read_bytes()
    if not target.exists():
        return target, data
    if target.read_bytes() != data:
        raise CopyError(f"{target} is there already, and is not {source}, the running surface of {path.stem}")
    return None


def renamed(text: str, name: str) -> str:
    r"""Return the text of a definition with another name, all else as it is.

    Examples
    --------
    >>> print(renamed('# LN2\nname = "LN2"  # short\ntype = "simple"', "demo_LN2"))
    # LN2
    name = "demo_LN2"  # short
    type = "simple"

    Raises
    ------
    CopyError
        If the definition has no line ``name = "..."`` before its first table.
    """
    head = text[: found.start()] if (found := _TABLE.search(text)) else text
    changed, number = _NAME.subn(rf'\g<1>"{name}"', head, count=1)
    copy = changed + text[len(head) :]
    try:
        before, after = tomllib.loads(text), tomllib.loads(copy)
    except ValueError as error:
        raise CopyError(f"it is not a TOML file ({error})") from error
    if number != 1 or after != {**before, "name": name}:
        raise CopyError('it has no line name = "..." of its own before its first table')
    return copy

"""Having the FMUs that a scenario names: asks ``python -m fmus`` for those that are missing or stale.

This is the only thing the master wants from ``fmus``, and it does without: a foreign FMU, of which ``fmus``
knows nothing, is used as it is.
"""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Final
from xml.etree import ElementTree

#: Seconds after which asking for a fingerprint, or building, is given up.
_ASK_SECONDS: Final = 60
_BUILD_SECONDS: Final = 600
#: What a damaged, encrypted or exotically compressed archive raises.
_UNREADABLE: Final = (
    OSError,
    EOFError,
    KeyError,
    ValueError,
    RuntimeError,
    NotImplementedError,
    zipfile.BadZipFile,
    zlib.error,
    ElementTree.ParseError,
)


def ensure(path: Path, tell: Callable[[str], None]) -> None:
    """Build the FMU at ``path`` if it is missing, or older than the sources it is built from.

    Raises
    ------
    ValueError
        With the builder's own words, if an FMU that is missing cannot be built.
    """
    if not has_builder():
        return
    wanted = fingerprint(path.stem)
    if wanted is None or (path.is_file() and _matches(wanted, stored_guid(path))):
        return
    tell(f"building {path.name}" + (" again: its sources have changed" if path.is_file() else ""))
    build(path)


def has_builder() -> bool:
    """Whether ``python -m fmus`` can be asked; finds out without importing it."""
    spec = importlib.util.find_spec("fmus")
    folders = (spec.submodule_search_locations or ()) if spec is not None else ()
    return any((Path(folder) / "__main__.py").is_file() for folder in folders)


def fingerprint(name: str) -> str | None:
    """Return the content hash that a build of ``name`` would have, None if ``fmus`` does not know it.

    Raises
    ------
    ValueError
        With the builder's own words, if it knows the name but cannot tell.
    """
    try:
        answer = _fmus("fingerprint", "--if-known", "--", name, seconds=_ASK_SECONDS)
    except subprocess.TimeoutExpired:
        return None
    if answer.returncode != 0:
        raise ValueError(f"cannot be built: {_last_line(answer)}")
    lines = answer.stdout.split()
    return lines[-1] if lines else None


def stored_guid(path: Path) -> str:
    """Return the guid in the FMU's modelDescription.xml, empty if there is none."""
    try:
        with zipfile.ZipFile(path) as file, file.open("modelDescription.xml") as xml:
            for _, node in ElementTree.iterparse(xml, events=("start",)):
                return node.get("guid") or ""
    except _UNREADABLE:
        return ""
    return ""


def build(path: Path) -> None:
    """Build ``path`` from the definition of the same name."""
    try:
        answer = _fmus("build", "--out", str(path.parent), "--", path.stem, seconds=_BUILD_SECONDS)
    except subprocess.TimeoutExpired as error:
        raise ValueError(f"could not be built: no answer within {_BUILD_SECONDS} s") from error
    if answer.returncode != 0 or not path.is_file():
        raise ValueError(f"could not be built: {_last_line(answer)}")


def _last_line(answer: subprocess.CompletedProcess[str]) -> str:
    said = (answer.stderr.strip() or answer.stdout.strip()).splitlines()
    return said[-1].removeprefix("error: ") if said else "the builder gave no reason"


def _matches(fingerprint: str, guid: str) -> bool:
    wanted, stored = (text.strip("{}").replace("-", "").lower() for text in (fingerprint, guid))
    return bool(stored) and (stored in wanted or wanted in stored)


def _fmus(*arguments: str, seconds: float) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "fmus", *arguments]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    return subprocess.run(command, capture_output=True, text=True, timeout=seconds, check=False, env=environment)

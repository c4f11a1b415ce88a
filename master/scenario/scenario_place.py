"""Where a scenario lies: a path, a project folder, or a name in the library; and where FMUs of the library are built.

The library's scenarios lie next to the packages, in a checkout and when installed alike. An installed library is left
as it is: it may be read-only and belongs to all its users, so that its FMUs are built into the user's cache.
"""

from __future__ import annotations

import hashlib
import os
from pathlib import Path
from typing import Final

from master.errors import Problem, RequestError, ScenarioError, hint
from master.ssp.archive import SSD_NAME

LIBRARY: Final = Path(__file__).resolve().parents[2] / "ssp_scenarios"
_SUFFIX: Final = ".ssp"


def scenario_names() -> tuple[str, ...]:
    """Return the names of all scenarios in the library."""
    return tuple(sorted(path.parent.name.removesuffix(_SUFFIX) for path in LIBRARY.glob(f"*{_SUFFIX}/{SSD_NAME}")))


def located(place: Path | str) -> Path:
    """Return the folder or archive of a scenario.

    Parameters
    ----------
    place : Path or str
        Its path, with or without ``.ssp``; or a project folder, which holds no other scenario; or the name of one in
        the library. What lies in the working folder comes first.

    Raises
    ------
    ScenarioError
        If there is none, with the name that may have been meant; or if a folder holds several.
    """
    path = Path(place)
    if path.is_file() or (path / SSD_NAME).is_file():
        return path
    inside = sorted(p for p in path.glob(f"*{_SUFFIX}") if (p / SSD_NAME).is_file() or p.is_file())
    if len(inside) == 1:
        return inside[0]
    if len(inside) > 1:
        text = f"holds {len(inside)} scenarios; name one of them: {', '.join(map(str, inside))}"
        raise ScenarioError([Problem(str(place), 0, "scenario", text)])
    beside = path.with_name(path.name + _SUFFIX) if path.name else path
    if beside.exists():
        return beside
    names = scenario_names()
    if str(place) in names:
        return LIBRARY / f"{place}{_SUFFIX}"
    if path.is_dir():
        return path  # opening it says what it lacks
    known = [*names, *(scenario.parent.name for scenario in path.parent.glob(f"*/*{_SUFFIX}"))]  # projects beside it
    text = f"there is no such folder or .ssp archive, nor such a scenario in the library{hint(path.stem, known)}"
    raise ScenarioError([Problem(str(place), 0, "scenario", text)])


def fmu_cache(root: Path) -> Path | None:
    """Return the folder that a scenario's FMUs are built into, None if that is its own."""
    if not _is_installed(root):
        return None
    home = os.environ.get("XDG_CACHE_HOME")
    cache = Path(home) if home else Path.home() / ".cache"
    # Two installations of different versions would build the same FMUs again and again.
    installation = hashlib.sha256(os.fsencode(LIBRARY)).hexdigest()[:8]
    return cache / "openpanto" / "fmus" / installation / root.name.removesuffix(_SUFFIX)


def refuse_installed(folder: Path) -> None:
    """Refuse to store values in a scenario of the installed library.

    Raises
    ------
    RequestError
    """
    if _is_installed(folder.resolve()):
        raise RequestError(f"{folder} belongs to the installed library; copy the folder and store values in the copy")


def _is_installed(root: Path) -> bool:
    """Whether a scenario belongs to the library, and that is installed rather than part of a checkout."""
    return root.is_relative_to(LIBRARY) and not (LIBRARY.parent / "pyproject.toml").is_file()

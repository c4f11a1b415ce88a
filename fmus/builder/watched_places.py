"""What an FMU's fingerprint depends on: while none of it has changed, neither has the fingerprint."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from fmus.builder.recipe import PYTHONFMU, REPOSITORY
from models.catenary.definition.surface_reading import named_profile
from models.library.search_path import PROJECT_FILE


def watched_places(starts: Iterable[Path], folders: Sequence[Path], definitions: Iterable[Path]) -> list[Path]:
    """Return files and folders, with all that is below them, that decide about a fingerprint; some may be missing.

    Parameters
    ----------
    starts : iterable of Path
        Folders that are looked up from, to the project's.
    folders : sequence of Path
        Where definitions are looked up before the library (`models.library.search_path`).
    definitions : iterable of Path
        Definitions that were named, or found; the files that they name count as well.
    """
    packages = [REPOSITORY / "models", REPOSITORY / "fmus", PYTHONFMU, REPOSITORY / "LICENSE"]
    licences = [*REPOSITORY.glob("openpanto-*.dist-info"), *PYTHONFMU.parent.glob("pythonfmu-*.dist-info")]
    projects = [folder / PROJECT_FILE for start in starts for folder in (start.resolve(), *start.resolve().parents)]
    libraries = [folder / kind for folder in folders for kind in ("lines", "pantographs")]
    lines = list(definitions)
    profiles = [path for line in lines if (path := named_profile(line)) is not None]
    found = [path.absolute() for path in (*packages, *licences, *projects, *libraries, *lines, *profiles)]
    return list(dict.fromkeys(found))

"""Standalone FMUs, which bring the Python that they run in: where that comes from, whether an FMU has it."""

from __future__ import annotations

import io
import tempfile
import zipfile
from functools import cache
from pathlib import Path
from typing import Final

from fmus.builder.fmu_build import RUNTIME, archive
from fmus.builder.recipe import BuildError, recipe
from fmus.loader.loader_build import DESCRIPTION
from fmus.loader.python_installation import InstallationError, installed_at, own
from fmus.loader.runtime import Runtime, RuntimeBuildError, make_runtime, write_files

#: An FMU of each kind: what their runs load is what a runtime holds, the same for all FMUs.
_KINDS: Final = ("Pantograph_CX", "Pantograph_CX_multibody", "Catenary_generic_simple")


@cache
def runtime_of(folder: Path | None = None) -> Runtime:
    """Return the runtime taken from the Python in a folder, from the present one for None.

    Raises
    ------
    BuildError
        If something is missing there, or an FMU does not run with what was taken.
    """
    try:
        source = own() if folder is None else installed_at(folder)
        with tempfile.TemporaryDirectory(prefix="openpanto_") as name:
            resources = [_extracted(kind, Path(name)) for kind in _KINDS]
            return make_runtime(source, resources)
    except (InstallationError, RuntimeBuildError) as error:
        raise BuildError(f"no runtime for standalone FMUs: {error}") from error


def _extracted(kind: str, folder: Path) -> Path:
    with zipfile.ZipFile(io.BytesIO(archive(recipe(kind), loader=False))) as file:
        file.extractall(folder / kind)
    return folder / kind / "resources"


def write_runtime(runtime: Runtime, folder: Path) -> Path:
    """Write a runtime into a folder for several FMUs (OPENPANTO_RUNTIME); return the folder.

    Raises
    ------
    BuildError
        If the folder holds something else.
    """
    if folder.is_dir() and any(folder.iterdir()) and not (folder / DESCRIPTION).is_file():
        raise BuildError(f"{folder} holds files that are no runtime; name another folder")
    write_files(runtime.files, folder)
    return folder


def bundled_platform(fmu: Path) -> str:
    """Return the system (``linux64``, ``win64``) for which an FMU brings its own Python, empty if it brings none."""
    try:
        with zipfile.ZipFile(fmu) as file:
            text = file.read(f"{RUNTIME}/{DESCRIPTION}").decode()
    except (OSError, KeyError, ValueError, RuntimeError, NotImplementedError, zipfile.BadZipFile):
        return ""
    settings = dict(line.split("=", 1) for line in text.splitlines() if "=" in line)
    return settings.get("platform", "")

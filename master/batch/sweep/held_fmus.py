"""The FMUs of a sweep as they are when it begins: who builds them anew while it runs changes no run."""

from __future__ import annotations

import hashlib
import shutil
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from master.errors import MasterError
from master.results.results_folder import WORK
from master.safety.safe_files import cannot_write
from master.system.components import Component, System


@contextmanager
def held_fmus(base: System, folder: Path) -> Iterator[System]:
    """Yield a system with copies of its FMUs, which are in the folder as long.

    Parameters
    ----------
    base : System
    folder : Path
        Exists; every worker must see it.

    Raises
    ------
    MasterError
        If there is no room for the copies, or an FMU is no longer the one that was read.
    """
    own = folder.absolute() / f"{WORK}{uuid.uuid4().hex}"  # workers have working folders of their own
    copies: dict[Path, Path] = {}
    try:
        yield replace(base, components=tuple(_held(c, own, copies) for c in base.components))
    finally:
        shutil.rmtree(own, ignore_errors=True)


def _held(component: Component, own: Path, copies: dict[Path, Path]) -> Component:
    """Return a component with a copy of its FMU, one for all that share it."""
    path = component.fmu.path
    if path not in copies:
        copies[path] = _copied(component, own / str(len(copies)) / path.name)
    return replace(component, fmu=replace(component.fmu, path=copies[path]))


def _copied(component: Component, copy: Path) -> Path:
    try:
        copy.parent.mkdir(parents=True)
        shutil.copyfile(component.fmu.path, copy)
    except OSError as error:
        if not component.fmu.path.is_file():
            raise MasterError(f"{component.fmu.path} is gone; start the sweep again") from error
        raise cannot_write(copy, error) from error
    if hashlib.sha256(copy.read_bytes()).hexdigest() != component.fmu.sha256:
        raise MasterError(f"{component.fmu.path} has been built anew just now; start the sweep again")
    return copy

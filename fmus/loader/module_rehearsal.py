"""Which modules Python loads for FMUs: those of every kind are run for a few steps."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

_SECONDS: Final = 300
_NO_FRONTS: Final[Mapping[str, str]] = {}
_SCRIPT: Final = """
import importlib, importlib.util, json, os, sys
answer, search_path, preload, imports, fronts, *folders = sys.argv[1:]
if preload:
    import ctypes
    for path in preload.split(os.pathsep):
        ctypes.CDLL(path)
if search_path:
    sys.path[:] = search_path.split(os.pathsep)
for name, text in json.loads(fronts).items():
    spec = importlib.util.find_spec(name)
    module = sys.modules[name] = importlib.util.module_from_spec(spec)
    exec(text, module.__dict__)
    parent, _, child = name.rpartition(".")
    setattr(sys.modules[parent], child, module)
for name in imports.split():
    importlib.import_module(name)
for folder in folders:
    sys.path.insert(0, folder)
    with open(os.path.join(folder, "slavemodule.txt"), encoding="utf-8") as file:
        script = file.read().strip()
    make = getattr(importlib.import_module(script), script.rpartition("_")[0])
    slave, other = (make(instance_name=name, resources=folder) for name in ("one", "other"))
    for part in (slave, other):
        part.setup_experiment(0.0)
        part.enter_initialization_mode()
        part.exit_initialization_mode()
    for n in range(5):
        if not slave.do_step(n * 1e-3, 1e-3):
            sys.exit(f"{script} refused a step")
    saved = slave._fmu_state_to_bytes(slave._get_fmu_state())
    other._set_fmu_state(slave._fmu_state_from_bytes(saved))
    if not other.do_step(5e-3, 1e-3):
        sys.exit(f"{script} refused a step")
files = {name: getattr(module, "__file__", None) for name, module in sys.modules.items()}
with open(answer, "w", encoding="utf-8") as file:
    json.dump({name: path for name, path in files.items() if path}, file)
"""


class RehearsalError(ValueError):
    """An FMU that does not run here, or not with what a runtime holds."""


@dataclass(frozen=True)
class LoadedModules:
    """Modules that runs of the FMUs loaded: name -> file."""

    files: Mapping[str, Path]

    def of_package(self, package: str, folder: Path) -> list[Path]:
        """Return the files that were loaded of a package, relative to the folder that the package lies in."""
        inside = [f for f in self.files.values() if f.is_relative_to(folder / package)]
        return sorted({f.relative_to(folder) for f in inside})


def rehearse(
    resources: Sequence[Path],
    work: Path,
    fronts: Mapping[str, str] = _NO_FRONTS,
    imports: Sequence[str] = (),
    search_path: Sequence[Path] = (),
    preload: Sequence[Path] = (),
) -> LoadedModules:
    """Run unpacked FMUs one after the other in one fresh Python, and return what it loaded.

    Parameters
    ----------
    resources : sequence of Path
        The ``resources`` folders of the FMUs.
    work : Path
        Folder for temporary files.
    fronts : mapping
        Name of a module -> source that stands in its place.
    imports : sequence of str
        Modules that are loaded besides.
    search_path : sequence of Path
        What replaces ``sys.path``, so that modules come from nowhere else; unchanged if empty.
    preload : sequence of Path
        Libraries that are opened first.

    Raises
    ------
    RehearsalError
        With the last line that Python printed.
    """
    answer = work / "modules.json"
    joined = [os.pathsep.join(str(path) for path in paths) for paths in (search_path, preload)]
    settings = [str(answer), *joined, " ".join(imports), json.dumps(dict(fronts))]
    command = [sys.executable, "-I", "-B", "-c", _SCRIPT, *settings, *map(str, resources)]
    # A runtime has no numba, so what the plain step loads is what counts.
    environment = {**os.environ, "OPENPANTO_KERNEL": "numpy", "OMP_NUM_THREADS": "1"}
    done = subprocess.run(command, capture_output=True, text=True, timeout=_SECONDS, check=False, env=environment)
    if done.returncode != 0:
        said = done.stderr.strip().splitlines() or ["no reason given"]
        raise RehearsalError(said[-1])
    files = json.loads(answer.read_text(encoding="utf-8"))
    return LoadedModules({name: Path(path).resolve() for name, path in files.items()})

"""Single faults for the code, and a copy of the code to put them into.

`faults.toml` lists them: a file, the text that is replaced, the faulty text, and the fast tests near it, one of which
must fail. A fault says in words what is wrong with the physics or the coupling.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).resolve().parents[2]
LIST: Final = Path(__file__).with_name("faults.toml")
#: What the tests need of the repository.
_COPIED: Final = ("models", "fmus", "master", "tests", "ssp_scenarios", "docs", "pyproject.toml", "README.md")
#: Longest time for the tests near a fault [s]; a fault that makes them hang is caught as well.
_PATIENCE: Final = 300.0
#: pytest's exit code when tests ran and some failed.
_TESTS_FAILED: Final = 1


@dataclass(frozen=True)
class Fault:
    """One fault.

    Attributes
    ----------
    says : str
        What is wrong.
    file : str
        Where, from the root of the repository.
    old, new : str
        What stands there, once in the file, and what is put in its place.
    tests : tuple of str
        The nearest fast tests, as pytest takes them.
    """

    says: str
    file: str
    old: str
    new: str
    tests: tuple[str, ...]

    @property
    def key(self) -> str:
        """Return a name for reports."""
        return f"{Path(self.file).stem}: {self.says}"


def read(path: Path = LIST) -> tuple[Fault, ...]:
    """Return the faults of a list."""
    listed = tomllib.loads(path.read_text(encoding="utf-8"))["fault"]
    return tuple(Fault(f["says"], f["file"], f["old"], f["new"], tuple(f["tests"])) for f in listed)


class Copy:
    """A copy of the repository that faults are put into, one at a time.

    Parameters
    ----------
    folder : Path
        Where to make it; must not exist.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir()
        leave_out = shutil.ignore_patterns("__pycache__", ".*")
        for name in _COPIED:
            source = ROOT / name
            if source.is_dir():
                shutil.copytree(source, folder / name, ignore=leave_out)
            else:
                shutil.copy2(source, folder / name)

    @contextmanager
    def with_fault(self, fault: Fault) -> Iterator[None]:
        """Put a fault in, and take it out again."""
        path = self.folder / fault.file
        text = path.read_text(encoding="utf-8")
        path.write_text(text.replace(fault.old, fault.new), encoding="utf-8")
        try:
            yield
        finally:
            path.write_text(text, encoding="utf-8")

    def catches(self, fault: Fault) -> tuple[bool, str]:
        """Return whether one of the tests near a fault fails, and what pytest says at the end."""
        with self.with_fault(fault):
            command = [sys.executable, "-B", "-m", "pytest", "-x", "-m", "not slow", "--tb=no", *fault.tests]
            environment = {k: v for k, v in os.environ.items() if k != "OPENPANTO_LONG"}
            environment |= {"PYTHONPATH": str(self.folder), "OMP_NUM_THREADS": "1"}
            try:
                run = subprocess.run(
                    command, cwd=self.folder, env=environment, capture_output=True, text=True, timeout=_PATIENCE
                )
            except subprocess.TimeoutExpired:
                return True, f"still running after {_PATIENCE:g} s"
        return run.returncode == _TESTS_FAILED, "\n".join(run.stdout.strip().splitlines()[-3:])

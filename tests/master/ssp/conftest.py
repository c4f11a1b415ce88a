"""Scenarios of small FMUs in C."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.foreign_fmus import compile_library, description, write_fmu


@pytest.fixture(scope="session")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return compile_library(tmp_path_factory.mktemp("foreign"))


@pytest.fixture
def scenario(tmp_path, library):
    """Function that writes a scenario; keywords are other FMUs than ``panel``, by name."""

    def write(text, files=None, **others):
        folder = tmp_path / "foreign.ssp"
        for name, reported in {"panel": description(), **others}.items():
            write_fmu(folder / f"resources/{name}.fmu", library, reported)
        for name, content in (files or {}).items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(content)
        (folder / "SystemStructure.ssd").write_text(text)
        return folder

    return write

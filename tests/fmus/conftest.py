"""The toy FMU, built once, and instances of it that are freed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from fmus.builder.fmu_build import build
from tests.fmus.support import Instance, toy_recipe


@pytest.fixture(scope="session")
def toy_fmu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(toy_recipe(), tmp_path_factory.mktemp("toy"))


@pytest.fixture
def instantiate(toy_fmu: Path) -> Iterator[Callable[..., Instance]]:
    made: list[Instance] = []

    def make(path: Path = toy_fmu, name: str = "part") -> Instance:
        made.append(Instance(path, name))
        return made[-1]

    yield make
    for instance in made:
        instance.free()

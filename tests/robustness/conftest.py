"""A scenario whose FMUs are descriptions only: enough for everything but stepping."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.master.conftest import ENDS, POINT, SSV, ssd_text
from tests.robustness.support import make_fmu

VELOCITIES = tuple(n for n in ENDS if ".v" in n)


@pytest.fixture(scope="session")
def scenario(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The toy scenario; whoever changes its files rewrites all of them."""
    folder = tmp_path_factory.mktemp("robustness") / "toy.ssp"
    (folder / "resources").mkdir(parents=True)
    catenary = [(f"pantograph[1].{n}", "input", "m/s" if n in VELOCITIES else "m") for n in ENDS]
    catenary += [(f"pantograph[1].contact.{n}", "output", "N" if n == "force" else "m") for n in POINT]
    catenary += [("dropper[1].force", "local", "N"), ("stiffness", "parameter", "N/m")]
    pantograph = [(n, "output", "m/s" if n in VELOCITIES else "m") for n in ENDS]
    pantograph += [(f"contact.{n}", "input", "N" if n == "force" else "m") for n in POINT]
    pantograph += [(n, "parameter", u) for n, u in (("static_force", "N"), ("ripple", "N"), ("speed", "m/s"))]
    make_fmu(folder / "resources" / "ToyCatenary.fmu", catenary)
    make_fmu(folder / "resources" / "ToyPantograph.fmu", pantograph)
    (folder / "SystemStructure.ssd").write_text(ssd_text(), encoding="utf-8")
    (folder / "parameters.ssv").write_text(SSV, encoding="utf-8")
    return folder


@pytest.fixture
def measured_run(tmp_path: Path) -> Path:
    """A results folder with one contact, as a run of two seconds leaves it."""
    folder = tmp_path / "run"
    folder.mkdir()
    prefix = "catenary.pantograph[1].contact"
    contact = {"index": 1, "catenary": "catenary", "pantograph": "pantograph", "prefix": prefix}
    settings = {"start": 0.0, "stop": 2.0, "step": 0.001, "interval": {"start": None, "end": None}}
    summary = {"generator": "openpanto master", "status": "complete", "scenario": "toy", "settings": settings,
               "contacts": [contact], "components": []}  # fmt: skip
    (folder / "summary.json").write_text(json.dumps(summary), encoding="utf-8")
    head = f"time [s],{prefix}.force [N],{prefix}.x [m]"
    rows = [f"{t / 1000},{150 + 10 * math.sin(t / 50)},{t * 0.05}" for t in range(2001)]
    (folder / "timeseries.csv").write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
    return folder


@pytest.fixture(scope="module", autouse=True)
def _outside(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Work in an empty folder: no command can touch the repository's."""
    before = Path.cwd()
    os.chdir(tmp_path_factory.mktemp("work"))
    yield
    os.chdir(before)


@pytest.hookimpl(trylast=True)  # pytest itself brings tests that share a parametrized fixture together
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put the sum of all inputs behind the inputs."""
    items.sort(key=lambda item: item.name == "test_at_least_5000_inputs_were_tried")

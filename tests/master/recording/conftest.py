"""A run of the toy scenario that has left a checkpoint."""

from __future__ import annotations

import pytest

from master.commands.main import main
from master.recording import checkpoint


def go(scenario, folder, *options):
    assert main([str(scenario), "--no-build", "--quiet", "--no-report", "--out", str(folder), *options]) == 0
    return (folder / "timeseries.csv").read_text().splitlines()


@pytest.fixture
def saved(toy, tmp_path):
    rows = go(toy, tmp_path / "whole", "--checkpoint", "0.1", "--stop", "0.3")
    return rows, tmp_path / "whole" / checkpoint.NAME

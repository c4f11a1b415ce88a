"""Whole reference runs, each made once."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from tests import forked_commands

ROOT = Path(__file__).parents[2]


@dataclass(frozen=True)
class Run:
    """A run of the master as its files show it."""

    summary: dict
    time: np.ndarray
    columns: dict

    def __getitem__(self, name):
        return self.columns[name]

    @property
    def quality(self):
        return self.summary["quality"][0]


def _read(path):
    with path.open(encoding="utf-8") as file:
        header = file.readline().strip().split(",")
    data = np.genfromtxt(path, delimiter=",", skip_header=1)
    return {name.partition(" [")[0]: data[:, i] for i, name in enumerate(header)}


@pytest.fixture(scope="session")
def simulate(tmp_path_factory):
    """Return a function that runs a scenario through the command line and reads what it leaves."""
    done = {}

    def run(scenario, *options):
        key = (scenario, *options)
        if key not in done:
            folder = tmp_path_factory.mktemp("run") / "results"
            path = scenario if isinstance(scenario, Path) else ROOT / "ssp_scenarios" / f"{scenario}.ssp"
            answer = forked_commands.run("master", path, "--out", folder, "--quiet", "--no-report", *options)
            assert answer.returncode == 0, answer.stderr
            columns = _read(folder / "timeseries.csv")
            summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
            done[key] = Run(summary, columns["time"], columns)
        return done[key]

    return run

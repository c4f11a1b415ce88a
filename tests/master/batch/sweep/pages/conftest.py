"""Tables of sweeps written by hand: no run is needed to draw what a table says."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from master.batch.sweep.pages.sweep_view import view_of

SETTING = {
    "interval": [500.0, 600.0],
    "limits": {"supply": "AC", "own": {}},
    "speeds": {"front": 300.0, "rear": 300.0},
    "contacts": {"front": "line.pantograph[1].contact"},
    "places": {},
}


def row(run, inputs, *, mean=150.0, sigma=40.0, maximum=260.0, failed="", **others):
    """A row of the table, complete, with a verdict."""
    figures = {
        "mean [N]": mean,
        "sigma [N]": sigma,
        "sigma / mean [1]": None if mean is None or sigma is None else sigma / mean,
        "maximum [N]": maximum,
        "uplift [mm]": 50.0,
    }
    head = {"run": float(run), **inputs, "stop time [s]": 7.0, "key": f"k{run}", "status": "complete", "reason": ""}
    verdict = {"verdict": f"fails: {failed}" if failed else "passes", "passed": "false" if failed else "true"}
    return {**head, "pantograph": "front", **figures, **verdict, "failed limits": failed, "remarks": "", **others}


def failure(run, inputs, reason):
    """The row of a run that failed."""
    return {"run": float(run), **inputs, "stop time [s]": 7.0, "key": f"k{run}", "status": "failed", "reason": reason}


def view(rows, parameters, over=(), folder=None, status="complete", indices=(), **more):
    """The view of a table; parameters by title: the distribution, or an empty text."""
    described = [
        {"name": t.split(" [")[0], "column": t, "targets": [f"front.{t.split(' [')[0]}"], "sampled": d or None}
        for t, d in parameters.items()
    ]
    failures = {f"{r['run']:.0f}": r["reason"] for r in rows if r["status"] == "failed"}
    runs = len({r["run"] for r in rows})
    data = {
        "scenario": "toy",
        "status": status,
        "date": "2026-01-01",
        "parameters": described,
        "request": {"over": dict.fromkeys(over, "")},
        "runs": runs,
        "finished": runs,
        "failures": failures,
        "setting": SETTING,
        **more,
    }
    return view_of(data, rows, folder, indices)


def grid_rows(speeds, tensions):
    """A row for each speed and tension, sigma growing with the speed; beyond 0.3 of the mean it fails."""
    rows = []
    for run, (v, t) in enumerate(itertools.product(speeds, tensions), 1):
        sigma = 0.15 * v - (t - 20.0)
        failed = "sigma / mean" if sigma >= 45.0 else ""
        rows.append(row(run, {"speed [km/h]": v, "tension [kN]": t}, sigma=sigma, failed=failed))
    return rows


@pytest.fixture
def grid():
    """A grid of 5 speeds and 3 tensions."""
    rows = grid_rows([200.0, 225.0, 250.0, 275.0, 300.0], [18.0, 20.0, 22.0])
    return view(rows, {"speed [km/h]": "", "tension [kN]": ""}, over=("speed", "tension"))


def sample_rows(count, seed=1):
    """Samples of two parameters: sigma = 40 + 2 a - b, with a and b normal of deviation 1."""
    a, b = np.random.default_rng(seed).normal(size=(2, count))
    return [
        row(
            k,
            {"a [1]": float(a[k - 1]), "b [1]": float(b[k - 1])},
            sigma=float(40.0 + 2.0 * a[k - 1] - b[k - 1]),
            failed="sigma / mean" if k % 10 == 0 else "",
        )
        for k in range(1, count + 1)
    ]


SAMPLED = {"a [1]": "normal(0, 1)", "b [1]": "normal(0, 1)"}

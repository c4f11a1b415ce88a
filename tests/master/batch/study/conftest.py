"""A family on the toy scenario, and a made-up run of two pantographs on two sections."""

import dataclasses

import numpy as np
import pytest

from master.recording.recording import Recording
from master.results.run_results import Results
from master.system.contacts import Contact

STUDY = """
title = "Toys"
source = "made up"

[[interval]]
name = "whole"
start = 10.0
end = 45.0

[calibration]
mean_force = 150.0
tolerance = 0.5
interval = "whole"

[histories]
variants = ["soft"]
position = 26.0
"""
VARIANTS = """variant,catenary.stiffness,pantograph.static_force,stop
soft,4000,140,1
"hard, heavy",8000,160,1
"""


@pytest.fixture
def family_folder(toy):
    """The toy scenario with a study's files."""
    (toy / "study.toml").write_text(STUDY)
    (toy / "variants.csv").write_text(VARIANTS)
    return toy


def _contact(number, pantograph):
    return Contact(number, "catenary", pantograph, f"catenary.pantograph[{number}].contact")


@pytest.fixture
def pair(tmp_path):
    """Two pantographs 30 m apart at 50 m/s; each passes from wire to wire between 100 m and 110 m."""
    time = np.arange(4001) * 1e-3
    names, columns = [], []
    for number, pantograph, start in ((1, "trailing", 0.0), (2, "leading", 30.0)):
        x = start + 50.0 * time
        force = 150.0 + 10.0 * number * np.sin(2 * np.pi * 1.0 * time)
        share = np.clip((110.0 - x) / 10.0, 0.0, 1.0)
        prefix = f"catenary.pantograph[{number}]"
        names += [f"{prefix}.contact.force", f"{prefix}.contact.x", f"{pantograph}.A.x", f"{pantograph}.B.x"]
        names += [f"{prefix}.section[{s}].force" for s in (1, 2)]
        columns += [force, x, x, x, force * share, force * (1.0 - share)]
    recording = Recording(time, tuple(names), ("N", "m", "m", "m", "N", "N") * 2, np.column_stack(columns))
    passes = [(70.0 - start) / 50.0 for start in (0.0, 30.0)]
    dropper = np.where(np.abs(time - passes[0]) < 0.05, 0.0, 60.0)
    bump = 0.05 * np.exp(-(((time - passes[1]) / 0.1) ** 2))
    slow = Recording(
        time[::5],
        ("catenary.dropper[1].force", "catenary.dropper[2].force", "catenary.support[1].uplift"),
        ("N", "N", "m"),
        np.column_stack([dropper, np.full_like(time, 60.0), bump])[::5],
    )
    geometry = {"dropper[1].x": 70.0, "dropper[2].x": 80.0, "support[1].x": 75.0, "support[1].section": 1.0}
    contacts = (_contact(1, "trailing"), _contact(2, "leading"))
    summary = {
        "status": "complete",
        "scenario": "pair",
        "settings": {"interval": {"start": 60.0, "end": 120.0}},
        "contacts": [dataclasses.asdict(c) for c in contacts],
    }
    return Results(tmp_path / "pair", summary, (recording, slow), {"catenary": geometry})

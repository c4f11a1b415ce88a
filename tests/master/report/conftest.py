"""A made-up run: 60 m/s, a force of 2 Hz and 60 Hz, three supports, four droppers."""

import dataclasses

import numpy as np
import pytest

from master.recording.recording import Recording
from master.results.run_results import Results
from master.system.contacts import Contact

CONTACT = Contact(1, "catenary", "pantograph", "catenary.pantograph[1].contact")
GEOMETRY = {
    f"support[{i}].{name}": value
    for i in (1, 2, 3)
    for name, value in (("x", 50.0 * i), ("y", 0.2 * (-1) ** i), ("z", 5.08), ("messenger_wire.z", 6.48))
} | {
    f"dropper[{i}].{name}": value
    for i in (1, 2, 3, 4)
    for name, value in (("x", 30.0 + 25.0 * i), ("lower.y", 0.0), ("lower.z", 5.05), ("upper.z", 6.2))
}


def _made_up(status="complete", with_geometry=True, folder=None):
    time = np.arange(2001) * 1e-3
    x = 60.0 * time + 20.0
    force = 157.0 + 30.0 * np.sin(2 * np.pi * 2.0 * time) + 60.0 * np.sin(2 * np.pi * 60.0 * time)
    names = (CONTACT.force, CONTACT.point("x"), CONTACT.point("z"), "pantograph.A.x", "pantograph.B.x")
    fast = Recording(time, names, ("N", "m", "m", "m", "m"), np.column_stack((force, x, 5.0 + 1e-4 * force, x, x)))
    uplifts = np.column_stack([0.04 * np.exp(-(((time - 0.3 * i) / 0.1) ** 2)) for i in (1, 2, 3)])
    droppers = np.column_stack([np.maximum(0.0, 60.0 - 70.0 * (i == 2) * (time > 1.0)) for i in (1, 2, 3, 4)])
    slow_names = [f"catenary.support[{i}].uplift" for i in (1, 2, 3)]
    slow_names += [f"catenary.dropper[{i}].force" for i in (1, 2, 3, 4)]
    slow = np.column_stack((uplifts, droppers))[::5]
    coarse = Recording(time[::5], tuple(slow_names), ("m",) * 3 + ("N",) * 4, slow)
    summary = {
        "scenario": "<made> & up",
        "status": status,
        "reason": "the wire <broke>",
        "time_reached": 1.0,
        "settings": {"interval": {"start": 50.0, "end": 110.0}, "step": 1e-3, "coupling": {"scheme": "jacobi"}},
        "contacts": [dataclasses.asdict(CONTACT)],
        "interface_power": [{"contact": 1, "energy": 0.5, "transferred": 20.0, "rms": 1.0}],
    }
    return Results(folder, summary, (fast, coarse), {"catenary": GEOMETRY} if with_geometry else {})


@pytest.fixture
def made_up():
    """Function that makes the run."""
    return _made_up


@pytest.fixture
def told_slack():
    """Function that returns a run in which the line says that a dropper is slack all the time."""

    def with_slack(run, number):
        fast, slow = run.recordings
        names, units = (*slow.names, f"catenary.dropper[{number}].slack"), (*slow.units, "1")
        reported = Recording(slow.time, names, units, np.column_stack((slow.values, np.ones(len(slow.time)))))
        return dataclasses.replace(run, recordings=(fast, reported))

    return with_slack


@pytest.fixture
def line_geometry():
    """Calculated parameters of its catenary."""
    return dict(GEOMETRY)

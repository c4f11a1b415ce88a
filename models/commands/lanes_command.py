"""``python -m models lanes JOB --out FOLDER``: many runs of one line side by side, for the master's sweeps."""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterator
from itertools import chain
from pathlib import Path

from models.catenary.definition.line_definition import CatenaryDefinition
from models.catenary.line_model import CatenaryModel
from models.catenary.line_part import CatenaryPart, LineGeometry
from models.commands.lanes_files import FORMAT, read_job, write_arrays
from models.commands.physics_options import show_log, warn
from models.coupled.lanes import Lane, LanePlan, LaneRecord, run_lanes, run_singly
from models.numerics.kernel_cache import SWITCH, KernelError

#: What `LineGeometry` holds, by the names of the FMU's calculated parameters.
_GEOMETRY = {
    "support": {"x": "support_x", "y": "support_y", "z": "support_z", "messenger_wire.z": "support_messenger_z"},
    "dropper": {
        "x": "dropper_x",
        "lower.y": "dropper_lower_y",
        "lower.z": "dropper_lower_z",
        "upper.z": "dropper_upper_z",
        "length": "dropper_length",
    },
}


def run(arguments: argparse.Namespace) -> int:
    """Make the runs of a job; a line of output says what has become of each, as soon as its file is there."""
    job = read_job(arguments.job)
    show_log(lambda text: print(f"note {text}", flush=True))  # for the master, which passes it on
    arguments.out.mkdir(parents=True, exist_ok=True)
    part = CatenaryPart(job.line, len(job.lanes[0].pantographs))
    write_arrays(arguments.out / "line.arrays", {"format": FORMAT, "geometry": geometry(part)}, {})
    print(f"line {len(job.lanes)}", flush=True)
    for record in _runs(part.model, job.lanes, job.plan):
        _write(arguments.out, record, job.lanes[record.number])
        print(f"lane {record.number} {'failed' if record.failure else 'complete'}", flush=True)
    return 0


def _runs(model: CatenaryModel, lanes: tuple[Lane, ...], plan: LanePlan) -> Iterator[LaneRecord]:
    """Return what yields the runs: kernels, or where there are none the parts themselves, one run after the other."""
    wanted = os.environ.get(SWITCH, "auto")
    if wanted == "numpy":
        return run_singly(model, lanes, plan)
    found = run_lanes(model, lanes, plan)
    try:
        first = next(found)
    except ImportError as error:
        if wanted == "numba":
            raise KernelError(f"{SWITCH} is 'numba', but {error}") from error
        warn([f"{error}; the runs are made one after the other, which takes several times as long"])
        return run_singly(model, lanes, plan)
    return chain([first], found)


def _write(folder: Path, record: LaneRecord, lane: Lane) -> None:
    ends = [[p.strip_offset + 0.5 * p.strip_length, p.strip_offset - 0.5 * p.strip_length] for p in lane.pantographs]
    header = {"format": FORMAT, "lane": record.number, "failure": record.failure, "ends": ends}
    names = ("contact", "strip", "uplift", "slack", "dropper_force")
    write_arrays(folder / f"lane_{record.number}.arrays", header, {name: getattr(record, name) for name in names})


def geometry(part: CatenaryPart) -> dict[str, float]:
    """Return the static geometry of a line by the names of the FMU's calculated parameters [m]."""
    found: LineGeometry = part.geometry
    result = {
        f"{thing}[{i}].{name}": value
        for thing, names in _GEOMETRY.items()
        for name, attribute in names.items()
        for i, value in enumerate(getattr(found, attribute).tolist(), 1)
    }
    if part.section_count > 1:
        for thing in _GEOMETRY:
            values = getattr(found, f"{thing}_section").tolist()
            result |= {f"{thing}[{i}].section": value for i, value in enumerate(values, 1)}
    return result | _extent(part, part.definition)


def _extent(part: CatenaryPart, definition: CatenaryDefinition) -> dict[str, float]:
    if any(section.period for section in definition.sections):
        return {"period": float(part.period[0])}
    begin, end = part.contact_wire_ends.tolist()
    return {"contact_wire.begin": begin, "contact_wire.end": end}

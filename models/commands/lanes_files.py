"""The files of ``python -m models lanes``: the job that it reads, and the arrays that it writes.

Arrays are in the layout of ``master/safety/array_container.py``, which reads them; neither package imports the other's
tools, so the few lines that write it stand here as well as in ``fmus/slave/saved_state.py``.
"""

from __future__ import annotations

import hashlib
import json
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from models.catenary.definition.line_definition import CatenaryDefinition
from models.catenary.definition.line_reading import load as load_line
from models.commands.physics_files import write_atomically
from models.coupled.lanes import Lane, LanePlan
from models.definition_files.parameter import ParameterError
from models.pantograph.lumped.held_forces import held_forces
from models.pantograph.lumped.lumped_definition import LumpedDefinition, load_lumped

#: Version of the job and of what is written.
FORMAT: Final = 1
_MAGIC: Final = b"openpanto arrays 1\n"
_KEYS: Final = {"format", "line", "line_values", "pantographs", "start", "step", "every", "dropper_forces", "lanes"}


@dataclass(frozen=True)
class LaneJob:
    """What is to be computed.

    Attributes
    ----------
    line : CatenaryDefinition
    lanes : tuple of Lane
    plan : LanePlan
    """

    line: CatenaryDefinition
    lanes: tuple[Lane, ...]
    plan: LanePlan


def read_job(path: Path) -> LaneJob:
    """Return the job in a JSON file, whose definition files are named from its own folder.

    Raises
    ------
    ParameterError
        If the file is no job, or asks for what lanes do not have.
    DefinitionError
        If a definition is not right.
    """
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise ParameterError(f"{path} is not a job for lanes: {error}") from error
    if not isinstance(data, dict) or set(data) != _KEYS or data["format"] != FORMAT:
        keys = ", ".join(sorted(_KEYS))
        raise ParameterError(
            f"{path} is not a job for lanes of format {FORMAT}: it must hold {keys}, no more and no less"
        )
    try:
        return _job(path, data)
    except (TypeError, ValueError, KeyError, AttributeError) as error:
        if isinstance(error, ParameterError):
            raise
        raise ParameterError(f"{path} is not a job for lanes: {type(error).__name__}: {error}") from error


def _job(path: Path, data: Mapping[str, Any]) -> LaneJob:
    line = load_line(path.parent / data["line"], carried=True).with_values(_values(data["line_values"]))
    given = [load_lumped(path.parent / name) for name in data["pantographs"]]
    plan = LanePlan(float(data["start"]), float(data["step"]), int(data["every"]), bool(data["dropper_forces"]))
    if not plan.step > 0.0 or plan.every < 0:
        raise ParameterError(f"{path}: step must be above 0 s and every 0 or more")
    lanes = tuple(_lane(path, number, entry, given) for number, entry in enumerate(data["lanes"]))
    if not lanes or not given:
        raise ParameterError(f"{path}: there is no lane, or no pantograph")
    monitored = [line.name] if line.monitor_energy else []
    monitored += [p.name for lane in lanes for p in lane.pantographs if p.monitor_energy]
    followed = [p.name for lane in lanes for p in lane.pantographs if p.follow_height]
    for pantograph in (p for lane in lanes for p in lane.pantographs):
        pantograph.refuse_varying_speed("a run in lanes")
    if followed:
        raise ParameterError(f"{followed[0]}: in lanes no pantograph follows the height; set follow_height to 0")
    held = [p.name for lane in lanes for p in lane.pantographs if len(held_forces(p)) or p.start_height is not None]
    if held:
        text = "in lanes pantographs have no stops, no friction and no start_height; leave these out"
        raise ParameterError(f"{held[0]}: {text}")
    if monitored:
        raise ParameterError(f"{monitored[0]}: lanes keep no balance of energy; set monitor_energy to 0")
    return LaneJob(line, lanes, plan)


def _lane(path: Path, number: int, entry: Mapping[str, Any], given: Sequence[LumpedDefinition]) -> Lane:
    steps, values = int(entry["steps"]), entry["pantographs"]
    if steps < 1 or len(values) != len(given):
        text = f"lane {number} must have steps above 0 and the values of {len(given)} pantograph(s)"
        raise ParameterError(f"{path}: {text}")
    return Lane(tuple(d.with_values(_values(v)) for d, v in zip(given, values, strict=True)), steps)


def _values(given: Mapping[str, Any]) -> dict[str, float]:
    return {name: float(value) for name, value in given.items()}


def write_arrays(path: Path, header: Mapping[str, Any], arrays: Mapping[str, np.ndarray[Any, Any]]) -> None:
    """Write a header and arrays of plain numbers in one go."""
    listed = [{"name": n, "dtype": a.dtype.str, "shape": list(a.shape)} for n, a in arrays.items()]
    text = json.dumps({"header": dict(header), "arrays": listed}, allow_nan=False).encode()
    body = b"".join((_MAGIC, struct.pack("<Q", len(text)), text, *(a.tobytes() for a in arrays.values())))
    write_atomically(path, body + hashlib.sha256(body).digest())

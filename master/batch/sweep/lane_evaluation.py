"""What lanes have computed of a run, evaluated as if FMUs had made it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from master.arrays import BoolArray, FloatArray
from master.batch.sweep.lane_system import dropper_rate
from master.coupling.contact_loss_stop import ContactLossStop
from master.coupling.macro_steps import RunOutcome, TimeGrid
from master.coupling.network import Network
from master.coupling.off_wire_stop import OffWireStop
from master.errors import MasterError, RunError
from master.evaluation.interval_coverage import not_judgeable
from master.recording.recording import Recording
from master.recording.recording_plan import RecordingPlan, recording_plans
from master.results import run_summary
from master.results.run_results import Results
from master.safety.array_container import unpack
from master.system.components import System

_NUMBERED: Final = re.compile(r"(support|dropper)\[(\d+)\]\.(uplift|slack|force)")


@dataclass(frozen=True)
class LaneOutput:
    """A file of ``python -m models lanes``: its header and its arrays."""

    header: Mapping[str, Any]
    arrays: Mapping[str, Any]

    @classmethod
    def read(cls, path: Path) -> LaneOutput:
        """Return what is in a file.

        Raises
        ------
        MasterError
            If it is missing or damaged.
        """
        try:
            return cls(*unpack(path.read_bytes()))
        except (OSError, ValueError) as error:
            raise MasterError(f"{path.name} of python -m models lanes cannot be read: {error}") from error

    @property
    def forces(self) -> FloatArray:
        """Return the contact forces [N], shape (n, P)."""
        contact: FloatArray = self.arrays["contact"]
        return contact[:, :, 0] if contact.ndim == 3 else np.zeros((0, 0))


def evaluated_run(system: System, output: LaneOutput, geometry: Mapping[str, float]) -> Results:
    """Return a run as results, its figures to be taken from them as from those of FMUs.

    Parameters
    ----------
    system : System
        Of the run.
    output : LaneOutput
    geometry : dict
        Static geometry of the line.

    Raises
    ------
    RunError
        If the run has not come to its end, or a run of FMUs would have been stopped.
    """
    if failure := output.header["failure"]:
        raise RunError(str(failure))
    contacts = sorted(system.contacts, key=lambda c: c.index)
    line = contacts[0].catenary
    plans = recording_plans(system)
    recordings = tuple(_recordings(system, output, plans))
    known = {line: dict(geometry)}
    _watch(system, recordings[0], known)
    interval = system.settings.interval
    not_judged = not_judgeable(recordings[0], system.contacts, (interval.start, interval.end))
    if not_judged and not system.may_stop_early:
        raise RunError(f"{not_judged}; run it longer, or ask for a part of it with --stop")
    grid = TimeGrid(system.start, system.step, system.step_count)
    ending = run_summary.ending(RunOutcome("complete", grid.count, grid.stop))
    summary = {**run_summary.describe(system, "lanes"), **ending, **({"not_judged": not_judged} if not_judged else {})}
    return Results(Path(), summary, recordings, known)


def _recordings(system: System, output: LaneOutput, plans: Sequence[RecordingPlan]) -> Iterator[Recording]:
    """Yield what a run of FMUs would have recorded and figures are taken from, that of every step first."""
    line = system.contacts[0].catenary
    count = len(output.arrays["contact"])
    time: FloatArray = system.start + np.arange(count, dtype=np.float64) * system.step
    rate = dropper_rate(plans, line)
    for plan in plans:
        columns = dict(_exchanged(system, output)) if plan.every == 1 else {}
        for name in plan.names.get(line, ()):
            if match := _NUMBERED.fullmatch(name):
                columns[f"{line}.{name}"] = _numbered(output, match, plan.every, rate)
        if columns or plan.every == 1:
            units = tuple(_unit(system, name) for name in columns)
            values = np.stack(list(columns.values()), axis=1)
            yield Recording(time[:: plan.every], tuple(columns), units, values)


def _numbered(output: LaneOutput, match: re.Match[str], every: int, rate: int) -> FloatArray:
    """Return a value of a support or a dropper; droppers were recorded after every ``rate`` steps."""
    number, kind = int(match[2]) - 1, match[3]
    if kind == "uplift":
        uplift: FloatArray = output.arrays["uplift"][::every, number]
        return uplift
    values = output.arrays["slack" if kind == "slack" else "dropper_force"]
    found: FloatArray = values[:: max(every // rate, 1), number].astype(np.float64)
    return found


def _exchanged(system: System, output: LaneOutput) -> Iterator[tuple[str, FloatArray]]:
    """Yield the exchanged values that figures are taken from, by name."""
    for p, contact in enumerate(sorted(system.contacts, key=lambda c: c.index)):
        force, *point = output.arrays["contact"][:, p, :4].T
        yield contact.force, force
        yield from ((contact.point(axis), values) for axis, values in zip("xyz", point, strict=True))
        x, z, vx, vz = output.arrays["strip"][:, p].T
        for end, y in zip("AB", output.header["ends"][p], strict=True):
            values = {"x": x, "y": np.full_like(x, y), "z": z, "vx": vx, "vy": np.zeros_like(x), "vz": vz}
            yield from ((contact.end(end, axis), column) for axis, column in values.items())


def _unit(system: System, name: str) -> str:
    component, _, variable = name.partition(".")
    return system.component(component).fmu.variables[variable].unit


class _Replayed(Network):
    """A network that shows recorded values, for observers of a run."""

    def __init__(self, recording: Recording) -> None:
        super().__init__((), ())
        self.output_names = recording.names
        self.outputs = np.zeros(len(recording.names))


def _watch(system: System, recording: Recording, geometry: dict[str, dict[str, float]]) -> None:
    """Let the observers that end a run of FMUs see what was recorded.

    They act where there is no contact: other rows than those, and the ones before, tell them nothing.

    Raises
    ------
    RunError
        As they do.
    """
    network = _Replayed(recording)
    observers = (
        ContactLossStop(system.contacts, network),
        OffWireStop(system, system.contacts, network, lambda: geometry),
    )
    network.outputs[:] = recording.values[0]
    for observer in observers:
        observer.begin(system.start, network)
    forces = np.stack([recording[c.force] for c in system.contacts], axis=1)
    open_now: BoolArray = np.min(forces, axis=1) <= 0.0
    shown = open_now | np.concatenate([open_now[1:], [True]])
    shown[0] = False  # the start is no step
    for index in np.flatnonzero(shown).tolist():
        network.outputs[:] = recording.values[index]
        for observer in observers:
            observer.observe(index, float(recording.time[index]), network)

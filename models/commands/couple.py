"""``python -m models couple LINE PANTOGRAPH``: the monolithic reference run."""

from __future__ import annotations

import argparse
import math
import time
from pathlib import Path

import numpy as np
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from models.catenary import limits
from models.catenary.model import CatenaryModel
from models.catenary.parameters import SHORTEST_STEP
from models.catenary.part import CatenaryPart
from models.commands.options import add_settings, finite, new_folder, positive, print_table, settings, warn
from models.coupled import CoupledModel, CoupledRecord
from models.library import load_line, load_lumped
from models.pantograph.parameters import LumpedDefinition
from models.part import ParameterError
from models.statistics import ContactFigures, contact_figures

#: Longest step of the monolithic run [s]: a contact lasts longer than it.
LONGEST_STEP = 0.1
#: Steps of a run: enough for the 0-20 Hz filter, and not more than fit into memory.
FEWEST_STEPS, MOST_STEPS = 100, 10**7


def add(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Register the verb."""
    parser = subparsers.add_parser(
        "couple", help="run a lumped pantograph on a line as one system, without co-simulation"
    )
    parser.add_argument("line", help="name in the library, or a definition file")
    parser.add_argument("pantograph", help="name in the library, or a definition file")
    parser.add_argument("--speed", type=positive, default=300.0, help="km/h (default 300)")
    parser.add_argument("--start", type=finite, default=None, help="where the pantograph is raised [m]")
    parser.add_argument("--end", type=finite, default=None, help="where the run ends [m]")
    parser.add_argument(
        "--interval", type=finite, nargs=2, metavar=("FROM", "TO"), help="interval of interest [m]"
    )
    parser.add_argument("--step", type=positive, default=1e-3, help="time step [s] (default 0.001)")
    parser.add_argument("--out", type=Path, default=None, help="folder for timeseries.csv")
    parser.add_argument("--quiet", action="store_true", help="no progress bar")
    add_settings(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Run and print the contact-force figures."""
    _check_step(arguments)
    definition = load_line(arguments.line).with_values(settings(arguments.set, "line"))
    line = CatenaryModel(definition)
    span = _span_of(arguments, line)
    _check_length(arguments, span)
    speed = arguments.speed / 3.6
    wanted = {"speed": speed, "start_position": span[0]} | settings(arguments.set, "pantograph")
    pantograph = load_lumped(arguments.pantograph).with_values(wanted)
    warn(_limits(line, pantograph, arguments.step))
    coupled = CoupledModel(line, [pantograph])
    stop = (span[1] - span[0]) / speed
    begin = time.perf_counter()
    with Progress(
        TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn(), disable=arguments.quiet
    ) as bar:
        task = bar.add_task(f"{arguments.line} + {arguments.pantograph}, monolithic", total=stop)
        record = coupled.run(stop, arguments.step, lambda t: bar.update(task, completed=t))
    wall = time.perf_counter() - begin
    _print(arguments, record, span, stop / wall)
    if arguments.out is not None:
        write_timeseries(new_folder(arguments.out) / "timeseries.csv", record)
    return 0


def _limits(line: CatenaryModel, pantograph: LumpedDefinition, step: float) -> tuple[str, ...]:
    """Return what deserves a second look, empty texts where nothing does."""
    return (
        limits.speed_warning(line.definition, pantograph.speed),
        limits.step_warning(line.definition, step, pantograph.stage[-1].mass),
        limits.slack_warning(CatenaryPart(line.definition).droppers, line.static.dropper_force),
        limits.slack_law_warning(line.definition),
    )


def write_timeseries(path: Path, record: CoupledRecord) -> None:
    """Write a record as CSV: first column time, then quantity with unit, one row per time."""
    names = ["time [s]"]
    columns = [record.time]
    for p in range(record.contact_force.shape[1]):
        names += [f"catenary.pantograph[{p + 1}].contact.{n}" for n in ("force [N]", "x [m]", "y [m]", "z [m]")]
        columns += [record.contact_force[:, p], record.position[:, p], *record.contact_point[:, p, 1:].T]
    names += [f"catenary.support[{i + 1}].uplift [m]" for i in range(record.uplift.shape[1])]
    columns += list(record.uplift.T)
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=",".join(names), comments="", fmt="%.9g")


def _span_of(arguments: argparse.Namespace, line: CatenaryModel) -> tuple[float, float]:
    """Return where the run begins and ends: as given, or well inside the line."""
    first, last = line.wires[0].ends
    length = last - first
    start = arguments.start if arguments.start is not None else first + 0.2 * length
    end = arguments.end if arguments.end is not None else last - 0.2 * length
    furthest = math.inf if line.wires[0].period else last  # one that closes on itself is travelled on and on
    if not first <= start < end <= furthest:
        text = f"the run from {start:g} m to {end:g} m does not lie on the line, {first:g} m to {last:g} m"
        raise ParameterError(f"--start, --end: {text}")
    return start, end


def _check_length(arguments: argparse.Namespace, span: tuple[float, float]) -> None:
    """Refuse a run of too few or too many steps, or with nothing in the interval of interest."""
    start, end = span
    if arguments.interval is not None and not start <= arguments.interval[0] < arguments.interval[1] <= end:
        low, high = arguments.interval
        raise ParameterError(f"--interval {low:g} {high:g}: must lie within the run, {start:g} m to {end:g} m")
    steps = (end - start) / (arguments.speed / 3.6 * arguments.step)
    if not FEWEST_STEPS <= steps <= MOST_STEPS:
        text = f"from {start:g} m to {end:g} m at {arguments.speed:g} km/h takes {steps:.3g} steps"
        raise ParameterError(f"--step {arguments.step:g}: {text}, not {FEWEST_STEPS} to {MOST_STEPS:g}")


def _check_step(arguments: argparse.Namespace) -> None:
    """Refuse steps that no run can be made of, before the line is built."""
    if arguments.step > LONGEST_STEP or arguments.step < SHORTEST_STEP:
        raise ParameterError(f"--step {arguments.step:g}: must lie between {SHORTEST_STEP:g} and {LONGEST_STEP:g} s")


def _print(arguments: argparse.Namespace, record: CoupledRecord, span: tuple[float, float], factor: float) -> None:
    start, end = arguments.interval or (span[0] + 0.45 * (span[1] - span[0]), span[0] + 0.85 * (span[1] - span[0]))
    figures = contact_figures(record.position[:, 0], record.contact_force[:, 0], arguments.step, start, end)
    rows = [(label, f"{value:.2f}") for label, value in _rows(figures)]
    rows.append(("largest uplift at a support [mm]", f"{1e3 * record.uplift.max():.1f}"))
    print_table(f"Contact force, 0-20 Hz, {start:g} ... {end:g} m", ("quantity", "value"), rows)
    print(f"{factor:.2f} times real time; peak of the record: {record.contact_force.max():.1f} N unfiltered")


def _rows(figures: ContactFigures) -> list[tuple[str, float]]:
    return [
        ("mean [N]", figures.mean),
        ("standard deviation [N]", figures.sigma),
        ("maximum [N]", figures.maximum),
        ("minimum [N]", figures.minimum),
        ("loss of contact [%]", figures.loss),
    ]

"""``python -m models couple LINE PANTOGRAPH``: the monolithic reference run."""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from master.evaluation.contact_quality import Quality, Sampled, early_warning, figures_of
from master.evaluation.filters import SETTLING, ForceFilter, evaluated, low_pass, stands_in
from models.arrays import FloatArray
from models.catenary import line_advice as limits
from models.catenary.definition.line_definition import SHORTEST_STEP
from models.catenary.line_model import CatenaryModel
from models.catenary.line_part import CatenaryPart, wires_at_rest
from models.catenary.strip_checks import check_strips, start_warning
from models.commands.physics_files import write_csv
from models.commands.physics_options import (
    add_filter,
    add_settings,
    chosen_filter,
    finite,
    new_folder,
    positive,
    print_table,
    settings,
    warn,
)
from models.coupled.monolithic import CoupledModel, CoupledRecord
from models.definition_files.parameter import ParameterError
from models.library.catalogue import load_line, load_lumped
from models.pantograph.lumped.lumped_advice import working_height_warning
from models.pantograph.lumped.lumped_definition import LumpedDefinition

#: Longest step of the monolithic run [s]: a contact lasts longer than it.
LONGEST_STEP = 0.1
#: Time after the uplift acts fully in which a strip that can reach the wire has reached it [s].
LONGEST_RISE = 1.0
#: Steps of a run: enough for the filter, and not more than fit into memory.
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
    text = f"interval of interest [m] (default: from {SETTLING:g} s after the first contact to the end)"
    parser.add_argument("--interval", type=finite, nargs=2, metavar=("FROM", "TO"), help=text)
    parser.add_argument("--step", type=positive, default=1e-3, help="time step [s] (default 0.001)")
    parser.add_argument("--out", type=Path, default=None, help="folder for timeseries.csv")
    parser.add_argument("--quiet", action="store_true", help="no progress bar")
    add_filter(parser)
    add_settings(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Run and print the contact-force figures."""
    _check_step(arguments)
    chosen = chosen_filter(arguments)
    definition = load_line(arguments.line)
    definition = definition.with_values(settings(arguments.set, "line", definition))
    line = CatenaryModel(definition)
    span = _span_of(arguments, line)
    _check_length(arguments, span)
    speed = arguments.speed / 3.6
    pantograph = load_lumped(arguments.pantograph)
    given = settings(arguments.set, "pantograph", pantograph)
    _check_given(given)
    pantograph = pantograph.with_values({"speed": speed, "start_position": span[0]} | given)
    coupled = CoupledModel(line, [pantograph])
    warn([*_limits(line, pantograph, arguments.step), *_at_start(coupled)])
    stop = (span[1] - span[0]) / speed
    begin = time.perf_counter()
    with Progress(TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn(), disable=arguments.quiet) as bar:
        task = bar.add_task(f"{arguments.line} + {arguments.pantograph}, monolithic", total=stop)
        record = coupled.run(stop, arguments.step, lambda t: bar.update(task, completed=t))
    wall = time.perf_counter() - begin
    _check_touched(record, pantograph)
    run_of = Evaluated.of(record, line, pantograph.strip_offset, tuple(arguments.interval or (None, None)), chosen)
    if arguments.out is not None:
        write_timeseries(new_folder(arguments.out) / "timeseries.csv", run_of)
    warn([early_warning(run_of.sampled)])
    _print(run_of, stop / wall)
    return 0


def _limits(line: CatenaryModel, pantograph: LumpedDefinition, step: float) -> tuple[str, ...]:
    """Return what deserves a second look, empty texts where nothing does."""
    return (
        limits.speed_warning(line.definition, pantograph.speed),
        limits.step_warning(line.definition, step, pantograph.stage[-1].mass),
        limits.slack_warning(CatenaryPart(line.definition).droppers, line.static.is_slack),
        limits.slack_law_warning(line.definition),
    )


def _at_start(coupled: CoupledModel) -> tuple[str, ...]:
    """Refuse a strip that the line cannot be meant for; return what deserves a second look in how it starts."""
    wires, strips = wires_at_rest(coupled.line), coupled.strips
    force, point = coupled.contact_at_rest()
    forces = force.sum(axis=1)
    check_strips(wires, strips, forces)
    heights = (
        working_height_warning(p.definition, float(x), float(z))
        for p, (x, _, z) in zip(coupled.pantographs, point, strict=True)
    )
    return (start_warning(wires, strips, forces), *heights)


def _check_touched(record: CoupledRecord, pantograph: LumpedDefinition) -> None:
    """Refuse a run in which the strip had time to reach the wire, and never did."""
    latest = pantograph.raise_start + pantograph.raise_duration + LONGEST_RISE
    if record.contact_force.any() or record.time[-1] <= latest:
        return
    raise ParameterError(
        f"'{pantograph.name}' never touches the wire (its strip ends at z = {record.strip_height[-1, 0]:.3f} m): "
        "check static_force, reference_height, strip_length and strip_offset against the wire's height and stagger"
    )


def _check_given(values: Mapping[str, float]) -> None:
    """Refuse values of the pantograph that the command has options for, or with which nothing would happen."""
    for name, option in (("speed", "--speed"), ("start_position", "--start")):
        if name in values:
            raise ParameterError(f"--set pantograph.{name}: the run's own options say that; give {option}")
    if values.get("static_force", 1.0) <= 0.0:
        raise ParameterError("pantograph.static_force = 0 N never lifts the strip to the wire: give it more than 0")


@dataclass(frozen=True)
class Evaluated:
    """A record of one pantograph with what its figures are made of, by the functions that the master uses.

    Attributes
    ----------
    record : CoupledRecord
    sampled : Sampled
        Force and contact point, and which samples count.
    filter : ForceFilter
    supports : ndarray, shape (n_supports,)
        Where they stand [m].
    period : float
        Length after which the line repeats [m]; 0 if it does not.
    interval : (float or None, float or None)
        Interval of interest as asked for [m].
    """

    record: CoupledRecord
    sampled: Sampled
    filter: ForceFilter
    supports: FloatArray
    period: float
    interval: tuple[float | None, float | None]

    @classmethod
    def of(
        cls,
        record: CoupledRecord,
        line: CatenaryModel,
        strip_offset: float,
        interval: tuple[float | None, float | None],
        chosen: ForceFilter,
    ) -> Evaluated:
        """Return a record of a line with its first pantograph as it is evaluated."""
        force, point = record.contact_force[:, 0], record.contact_point[:, 0]
        touches, step = force > 0.0, float(record.time[-1] - record.time[0]) / (len(record.time) - 1)
        position = np.where(touches, point[:, 0], record.position[:, 0])
        inside = evaluated(force, position, step, interval)
        height, lateral = (np.where(touches, values, np.nan) for values in (point[:, 2], point[:, 1] - strip_offset))
        sampled = Sampled(force, position, step, inside, height, lateral)
        supports = line.static.positions[line.mesh.support_nodes, 0]
        return cls(record, sampled, chosen, supports, line.wires[0].period, interval)

    @property
    def figures(self) -> Quality | None:
        """The figures in the interval; None if the run does not reach it, or does not settle."""
        return figures_of(self.sampled, self.filter)

    def uplift(self, quality: Quality) -> float | None:
        """Return the largest uplift of the interval's supports over the whole run [m]; None if there is none in it."""
        low, high = min(quality.start, quality.end), max(quality.start, quality.end)
        start, end = self.interval
        limits = (low if start is None else start, high if end is None else end)
        inside = [stands_in(float(x), limits, self.period) for x in self.supports]
        return float(self.record.uplift[:, inside].max()) if any(inside) else None


def write_timeseries(path: Path, run_of: Evaluated) -> None:
    """Write a record as CSV: first column time, then quantity with unit, one row per time.

    Statistics of ``filtered_force`` where ``in_interval`` is 1 are the figures that are printed.
    """
    record, sampled = run_of.record, run_of.sampled
    prefix = "catenary.pantograph[1].contact"
    names = ["time [s]", *(f"{prefix}.{n}" for n in ("force [N]", "x [m]", "y [m]", "z [m]"))]
    columns = [record.time, sampled.force, sampled.position, *record.contact_point[:, 0, 1:].T]
    names += [f"{prefix}.filtered_force [N]", f"{prefix}.in_interval"]
    columns += [low_pass(sampled.force, sampled.step, run_of.filter), sampled.inside.astype(np.float64)]
    names += [f"catenary.support[{i + 1}].uplift [m]" for i in range(record.uplift.shape[1])]
    columns += list(record.uplift.T)
    write_csv(path, names, columns, 17)


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


def _print(run_of: Evaluated, factor: float) -> None:
    q = run_of.figures
    if q is None:
        print(f"no figures: the run ends less than {SETTLING:g} s after the first contact, or makes none")
        return
    rows = [(label, f"{value:.2f}") for label, value in _rows(q)]
    uplift, whole = run_of.uplift(q), run_of.record.uplift.max()
    rows.append(("largest uplift of the interval's supports [mm]", "-" if uplift is None else f"{1e3 * uplift:.1f}"))
    print_table(f"Contact force, {run_of.filter.band}, {q.start:.0f} ... {q.end:.0f} m", ("quantity", "value"), rows)
    print(f"filter: {run_of.filter.sentence}")
    for other in q.filter_dependent:
        extremes = f"maximum {other.maximum:.1f} N, minimum {other.minimum:.1f} N"
        print(f"the extremes depend on the filter: {extremes} with {other.filter}")
    peak = run_of.sampled.force.max()
    print(f"whole run: largest uplift of a support {1e3 * whole:.1f} mm, peak {peak:.1f} N unfiltered")
    print(f"{factor:.2f} times real time")


def _rows(q: Quality) -> list[tuple[str, float]]:
    return [
        ("mean [N]", q.mean),
        ("standard deviation [N]", q.sigma),
        ("maximum [N]", q.maximum),
        ("minimum [N]", q.minimum),
        ("loss of contact [%]", q.losses.percentage),
    ]

"""``python -m models couple LINE PANTOGRAPH``: the monolithic reference run."""

from __future__ import annotations

import argparse
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from master.evaluation.contact_quality import Quality, Sampled, early_warning, figures_of
from master.evaluation.filters import SETTLING, ForceFilter, evaluated, low_pass, stands_in
from models.arrays import FloatArray
from models.catenary.line_model import CatenaryModel
from models.commands.physics_files import write_csv
from models.commands.physics_options import (
    check_folder,
    chosen_filter,
    new_folder,
    print_table,
    settings,
    warn,
)
from models.coupled.monolithic import CoupledModel, CoupledRecord
from models.definition_files.parameter import ParameterError
from models.interface.coupled_run import (
    advice,
    advice_at_start,
    check_length,
    check_step,
    check_touched,
    contact_point,
    travelled,
)
from models.library.catalogue import doubts, load_line, load_lumped


def run(arguments: argparse.Namespace) -> int:
    """Run and print the contact-force figures."""
    check_folder(arguments.out)
    check_step(arguments.step)
    chosen = chosen_filter(arguments)
    definition = load_line(arguments.line)
    warn([*doubts("lines", arguments.line), *doubts("pantographs", arguments.pantograph)])
    definition = definition.with_values(settings(arguments.set, "line", definition))
    line = CatenaryModel(definition)
    way, speed = travelled(line, arguments.start, arguments.end), arguments.speed / 3.6
    _check_interval(arguments.interval, way)
    check_length(way, speed, arguments.step)
    pantograph = load_lumped(arguments.pantograph)
    given = settings(arguments.set, "pantograph", pantograph)
    _check_given(given)
    if pantograph.speed_profile is not None:
        raise ParameterError(
            f"pantograph '{pantograph.name}' has a [speed_profile], and couple runs at the one speed of --speed: "
            "take it out, or run a scenario, which follows it"
        )
    pantograph = pantograph.with_values({"speed": speed, "start_position": way[0]} | given)
    coupled = CoupledModel(line, [pantograph])
    warn([*advice(line, pantograph, arguments.step), *advice_at_start(coupled)])
    stop = (way[1] - way[0]) / speed
    begin = time.perf_counter()
    with Progress(TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn(), disable=arguments.quiet) as bar:
        task = bar.add_task(f"{arguments.line} + {arguments.pantograph}, monolithic", total=stop)
        record = coupled.run(stop, arguments.step, lambda t: bar.update(task, completed=t))
    wall = time.perf_counter() - begin
    check_touched(record, pantograph)
    run_of = Evaluated.of(record, line, pantograph.strip_offset, tuple(arguments.interval or (None, None)), chosen)
    if arguments.out is not None:
        write_timeseries(new_folder(arguments.out) / "timeseries.csv", run_of)
    warn([early_warning(run_of.sampled)])
    _print(run_of, stop / wall)
    return 0


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
        force, step = record.contact_force[:, 0], float(record.time[-1] - record.time[0]) / (len(record.time) - 1)
        position, height, lateral = contact_point(record, strip_offset)
        inside = evaluated(force, position, step, interval)
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


def _check_interval(interval: Sequence[float] | None, way: tuple[float, float]) -> None:
    """Refuse an interval of interest that the run does not cover."""
    if interval is not None and interval[0] >= interval[1]:
        raise ParameterError(f"--interval {interval[0]:g} {interval[1]:g}: the first number must be the smaller one")
    if interval is not None and not way[0] <= interval[0] < interval[1] <= way[1]:
        text = f"must lie within the run, {way[0]:g} m to {way[1]:g} m"
        raise ParameterError(f"--interval {interval[0]:g} {interval[1]:g}: {text}")


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

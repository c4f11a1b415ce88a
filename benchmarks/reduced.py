"""What a line without its fast modes saves, and what that costs: ``python benchmarks/reduced.py [LINE] [PANTOGRAPH]``.

A line with all modes and with those up to several frequencies, 1 ms a step: modes, start-up, time of a step bare and
under a pantograph with each kernel; and how far a run along the middle of the line is from that with all modes.
``--elements 12`` has that many elements between droppers instead of the definition's, which comes as a last row.
"""

from __future__ import annotations

import argparse
import importlib.util
import math
import os
import time
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from line_step import STEP, STEPS, under_pantograph, without_load
from timing import by_turns, on_one_thread, table

from master.evaluation.contact_quality import assess
from master.evaluation.filters import ForceFilter, low_pass
from models.catenary.definition.line_definition import CatenaryDefinition
from models.catenary.line_model import CatenaryModel
from models.coupled.monolithic import CoupledModel, CoupledRecord
from models.library.catalogue import load_line, load_lumped

CUTS = (1000.0, 500.0, 300.0, 200.0, 150.0, 100.0, 70.0, 50.0, 30.0, 20.0)
#: The run: shares of the line's length where it begins, where figures begin, and where both end.
BEGIN, FROM, TO = 0.2, 0.4, 0.8


def main() -> None:
    on_one_thread()
    options = _options()
    lines = variants(options.line, options.cuts, options.elements)
    kernels = ("numpy", "numba") if importlib.util.find_spec("numba") else ("numpy",)
    costs = {kernel: [*measured(lines, kernel, options.pantograph)] for kernel in kernels}
    runs = {name: run(line, options.pantograph) for name, line in lines.items()}
    title = f"{options.line} under {options.pantograph}, steps of {1e3 * STEP:g} ms"
    print_costs(title, lines, costs)
    print_forces(title, runs, costs[kernels[-1]], kernels[-1])
    print_figures(title, runs)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("line", nargs="?", default="LN2")
    parser.add_argument("pantograph", nargs="?", default="CX", help="a lumped one")
    parser.add_argument("--cuts", nargs="+", type=float, default=CUTS, help="highest frequencies [Hz]")
    parser.add_argument("--elements", type=int, help="elements between droppers")
    return parser.parse_args()


def variants(name: str, cuts: Sequence[float], elements: int | None) -> dict[str, CatenaryDefinition]:
    """Return the line with all modes, with those up to each frequency, and as it is defined if its mesh is another."""
    own = load_line(name)
    line = own if elements is None else own.with_values({"mesh.elements_between_droppers": elements})
    result = {"all": line}
    result |= {f"{cut:g} Hz": line.with_values({"dynamics.highest_frequency": cut}) for cut in cuts}
    return result if line == own else result | {f"all, {own.mesh.elements_between_droppers} elements": own}


@dataclass(frozen=True)
class Cost:
    """What a variant takes: start-up to the end of the first step [s], a step bare and under a pantograph [s]."""

    modes: int
    built: float
    bare: float
    under: float


def measured(lines: dict[str, CatenaryDefinition], kernel: str, pantograph: str) -> Sequence[Cost]:
    """Return the cost of every variant with a kernel."""
    os.environ["OPENPANTO_KERNEL"] = kernel
    built, models = [], []
    without_load(CatenaryModel(next(iter(lines.values()))))()  # kernels are loaded once, whatever the line
    for line in lines.values():
        begin = time.process_time()
        models.append(CatenaryModel(line))
        models[-1].push(models[-1].initial_state(), STEP, ())
        built.append(time.process_time() - begin)
    bare = by_turns({name: without_load(model) for name, model in zip(lines, models, strict=True)})
    under = by_turns({n: under_pantograph(model, pantograph) for n, model in zip(lines, models, strict=True)})
    return [
        Cost(len(model.modes.eigenvalue), start, bare[name] / STEPS, under[name] / STEPS)
        for name, model, start in zip(lines, models, built, strict=True)
    ]


@dataclass(frozen=True)
class Run:
    """A run along the middle of a line; ``rows`` are those that count."""

    highest: float
    record: CoupledRecord
    rows: slice

    @property
    def force(self) -> np.ndarray:
        """Return the contact force [N]."""
        return self.record.contact_force[self.rows, 0]

    @property
    def filtered(self) -> np.ndarray:
        """Return the contact force up to 20 Hz [N]."""
        return low_pass(self.record.contact_force[:, 0], STEP, ForceFilter("fft"))[self.rows]


def run(line: CatenaryDefinition, pantograph: str) -> Run:
    """Run a pantograph along the middle of a line, at its own speed."""
    model, given = CatenaryModel(line), load_lumped(pantograph)
    first, last = model.wires[0].ends
    begin, start, end = (first + share * (last - first) for share in (BEGIN, FROM, TO))
    steps = [round((x - begin) / given.speed / STEP) for x in (start, end)]
    record = CoupledModel(model, [given.with_values({"start_position": begin})]).run(steps[1] * STEP, STEP)
    return Run(line.dynamics.highest_frequency or math.inf, record, slice(*steps))


def print_costs(title: str, lines: dict[str, CatenaryDefinition], costs: dict[str, list[Cost]]) -> None:
    """Print what each variant takes."""
    columns = ["modes up to", "modes", "start s"]
    for kernel in costs:
        columns += [f"{kernel}: bare ms", "ratio", "under ms", "ratio"]
    rows = []
    for i, name in enumerate(lines):
        some = next(iter(costs.values()))[i]
        row = [name, str(some.modes), f"{some.built:.2f}"]
        for each in costs.values():
            cost, full = each[i], each[0]
            row += [f"{1e3 * cost.bare:.3f}", f"{cost.bare / full.bare:.2f}"]
            row += [f"{1e3 * cost.under:.3f}", f"{cost.under / full.under:.2f}"]
        rows.append(row)
    table(f"{title}: what a step costs", columns, rows)


def print_forces(title: str, runs: dict[str, Run], costs: Sequence[Cost], kernel: str) -> None:
    """Print how far contact forces are from those with all modes, and how much faster that is."""
    full, *_ = runs.values()
    errors = [(r.force - full.force, r.filtered - full.filtered) for r in runs.values()]
    orders = ["", *(_order(*pair) for pair in pairwise(zip(runs.values(), errors, strict=True)))]
    rows = []
    for name, (raw, slow), order, cost in zip(runs, errors, orders, costs, strict=True):
        speed = [f"{costs[0].bare / cost.bare:.2f}", f"{costs[0].under / cost.under:.2f}"]
        sizes = [f"{value:.1e}" for e in (raw, slow) for value in (np.abs(e).max(), _rms(e))]
        rows.append([name, *speed, *sizes, order])
    columns = ("modes up to", f"{kernel}: bare, times as fast", "under", "largest N", "rms N", "0-20 Hz: largest N",
               "rms N", "order")  # fmt: skip
    table(f"{title}: difference in contact force, and speed", columns, rows)


def _order(one: tuple[Run, tuple[np.ndarray, ...]], other: tuple[Run, tuple[np.ndarray, ...]]) -> str:
    """Return the power of the frequency that the rms falls by from one variant to the next."""
    (a, (small, _)), (b, (large, _)) = one, other
    if not (math.isfinite(a.highest) and math.isfinite(b.highest)) or not _rms(small):
        return ""
    return f"{math.log(_rms(large) / _rms(small)) / math.log(a.highest / b.highest):.1f}"


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def print_figures(title: str, runs: dict[str, Run]) -> None:
    """Print the figures of the contact force, 0-20 Hz, and the largest differences in uplift and dropper forces."""
    full, *_ = runs.values()
    rows = []
    for name, each in runs.items():
        record, own = each.record, each.record.position[each.rows, 0]
        f = assess(record.contact_force[:, 0], record.position[:, 0], STEP, ForceFilter("fft"), (own[0], own[-1]))
        uplift, dropper = (
            np.abs(getattr(record, what) - getattr(full.record, what)).max() for what in ("uplift", "dropper_force")
        )
        figures = [f"{value:.3f}" for value in (f.mean, f.sigma, f.maximum, f.minimum)]
        rows.append([name, *figures, f"{1e3 * record.uplift.max():.3f}", f"{1e3 * uplift:.1e}", f"{dropper:.1e}"])
    columns = ("modes up to", "mean N", "sigma N", "max N", "min N", "uplift mm", "difference mm",
               "droppers: difference N")  # fmt: skip
    table(f"{title}: figures", columns, rows)


if __name__ == "__main__":
    main()

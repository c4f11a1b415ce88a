"""The same line in OpenSees: do both agree, and how many steps does each do in the same time?

    python benchmarks/opensees.py [--line LN2] [--speed 300] [--seconds 2]

Needs ``pip install openseespy``. Nodes, beams under tension, droppers, steady arms, supports, clamps, consistent
masses, damping and the trapezoidal rule at 1 ms are the same (``opensees_line.py``); a constant vertical force runs
along the contact wire, in both. First OpenSees' own solvers are compared, each in a process of its own because some
crash, and the fastest is taken; then both lines run by turns; then their results are compared.

All of it twice: with droppers that carry compression too, so that the line is linear and OpenSees may factorise once
and solve once a step, and with droppers that slacken, which it must iterate for.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from unittest import mock

import numpy as np
from opensees_line import Formulation, OpenSeesLine, Solver
from timing import by_turns, on_one_thread, rounds_of, table

from models.arrays import FloatArray
from models.catenary.line_model import CatenaryModel
from models.catenary.shape import line_matrices
from models.catenary.statics.elasticity import elasticity, positions_in_span
from models.library.catalogue import load_line

STEP = 1e-3
#: Steps to a round, and rounds, of a timing.
STEPS, ROUNDS = 50, 12
#: Those of a solver of OpenSees that is only tried.
TRIED_STEPS, TRIED_ROUNDS = 20, 4
#: How many of the fastest are tried once more.
FINALISTS = 3
#: Seconds after which a solver is given up.
PATIENCE = 60.0
#: Solvers of equations and the numberings that they are tried with. AMD is for sparse ones: it fills a band.
SYSTEMS = {
    "BandSPD": ("RCM", "Plain"),
    "ProfileSPD": ("RCM", "Plain"),
    "BandGeneral": ("RCM",),
    "SparseSYM": ("RCM", "Plain", "AMD"),
    "SuperLU": ("RCM", "Plain", "AMD"),
    "UmfPack": ("RCM", "Plain", "AMD"),
    "Mumps": ("RCM", "Plain", "AMD"),
}
#: Forces of the static elasticity [N].
STATIC_FORCES = (100.0, 200.0)


@dataclass(frozen=True)
class Case:
    """What runs along which line.

    Attributes
    ----------
    title : str
    compression_ratio : float
        Of the droppers; with 1 they are linear.
    force : float
        [N].
    algorithms : tuple of str
        OpenSees' algorithms that solve it to the end, the first one for the choice of the system.
    """

    title: str
    compression_ratio: float
    force: float
    algorithms: tuple[str, ...]


CASES = {
    "linear": Case("linear droppers", 1.0, 160.0, ("Linear -factorOnce",)),
    "slack": Case("droppers that slacken", 0.0, 250.0, ("ModifiedNewton -factorOnce", "Newton", "KrylovNewton")),
}


@dataclass(frozen=True)
class Run:
    """A line, and a force that runs along it.

    Attributes
    ----------
    path : ndarray, shape (n,)
        Where the force is at the end of each step [m].
    force : float
        [N].
    """

    model: CatenaryModel
    path: FloatArray
    force: float


@dataclass(frozen=True)
class History:
    """What a run leaves.

    Attributes
    ----------
    uplift : ndarray, shape (n, n_supports)
        Rise of the contact wire at the supports [m].
    dropper_force : ndarray, shape (n, n_droppers)
        [N].
    """

    uplift: FloatArray
    dropper_force: FloatArray


def main() -> None:
    on_one_thread()
    options = _options()
    if options.solver is not None:
        print(tried(_run(options, options.case, TRIED_STEPS * (TRIED_ROUNDS + 1)), _solver(options.solver)))
        return
    fastest = {case: fastest_solver(case, options) for case in CASES}
    speeds(options, fastest)
    agreement(options, fastest)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--line", default="LN2")
    parser.add_argument("--speed", type=float, default=300.0, help="of the moving force [km/h]")
    parser.add_argument("--seconds", type=float, default=2.0, help="simulated time of the comparison of results")
    # The arguments of a process that tries one solver.
    parser.add_argument("--case", choices=CASES, default="linear", help=argparse.SUPPRESS)
    parser.add_argument("--solver", help=argparse.SUPPRESS)
    return parser.parse_args()


def _run(options: argparse.Namespace, case: str, steps: int) -> Run:
    """Return a run whose middle is the middle of the line."""
    wanted = {"dropper.compression_ratio": CASES[case].compression_ratio}
    model = CatenaryModel(load_line(options.line).with_values(wanted))
    spans = model.definition.sections[0].spans
    way = np.arange(1, steps + 1) * options.speed / 3.6 * STEP
    return Run(model, (spans[0].start + spans[-1].end) / 2.0 + way - way[-1] / 2.0, CASES[case].force)


# Which of OpenSees' solvers is the fastest


def fastest_solver(case: str, options: argparse.Namespace) -> Solver:
    """Try OpenSees' solvers, print what they took, return the fastest."""
    algorithms = CASES[case].algorithms
    systems = [Solver(algorithms[0], system, numberer) for system, numbers in SYSTEMS.items() for numberer in numbers]
    times = {solver: try_apart(solver, case, options) for solver in systems}
    for other in _variants(_ranked(times)[0], algorithms[1:]):
        times[other] = try_apart(other, case, options)
    for finalist in _ranked(times)[:FINALISTS]:
        times[finalist] = min(times[finalist], try_apart(finalist, case, options))
    best = _ranked(times)[0]
    rows = [(*_words(s), _ms(times[s]), _ratio(times[s] / times[best])) for s in _ranked(times)]
    columns = ("algorithm", "system", "numberer", "damping by", "test", "ms per step", "ratio")
    table(f"OpenSees' solvers, {CASES[case].title}", columns, rows)
    return best


def _ranked(times: dict[Solver, float]) -> list[Solver]:
    return sorted(times, key=lambda solver: times[solver])


def _variants(best: Solver, algorithms: tuple[str, ...]) -> list[Solver]:
    """Return the fastest so far with what else it could be changed in."""
    others = [replace(best, algorithm=a) for a in algorithms]
    if algorithms:  # it iterates
        others.append(replace(best, test="NormDispIncr"))
    return [*others, replace(best, damping="committed")]


def try_apart(solver: Solver, case: str, options: argparse.Namespace) -> float:
    """Return what a step takes [s], measured in a process of its own; infinite if it fails or takes too long."""
    command = [sys.executable, __file__, "--case", case, "--line", options.line, "--speed", str(options.speed)]
    command += ["--solver", ";".join(_words(solver))]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        return float("inf")
    if done.returncode != 0:
        return float("inf")
    return float(done.stdout.split()[0])


def tried(run: Run, solver: Solver) -> float:
    """Return what a step takes OpenSees [s]."""
    best = by_turns({"": _opensees_steps(run, solver, Formulation.CONSISTENT, TRIED_STEPS)}, TRIED_ROUNDS)
    return best[""] / TRIED_STEPS


def _words(solver: Solver) -> tuple[str, ...]:
    return solver.algorithm, solver.system, solver.numberer, solver.damping, solver.test


def _solver(words: str) -> Solver:
    return Solver(*words.split(";"))


# How many steps in the same time


def speeds(options: argparse.Namespace, fastest: dict[str, Solver]) -> None:
    """Run both by turns, over the same way in every round, and print how much longer OpenSees takes."""
    rows = []
    for case, solver in fastest.items():
        run = _run(options, case, STEPS * (ROUNDS + 1))
        jobs = {"ours": _our_steps(run), "OpenSees": _opensees_steps(run, solver, Formulation.CONSISTENT, STEPS)}
        times = {name: np.array(t) / STEPS for name, t in rounds_of(jobs, ROUNDS).items()}
        ratio = times["OpenSees"] / times["ours"]
        typical = (f"{1e3 * np.median(times[name]):.3f}" for name in jobs)
        rows.append((CASES[case].title, *typical, *(f"{r:.1f}" for r in (np.median(ratio), ratio.min(), ratio.max()))))
    columns = ("median over rounds", "ours ms", "OpenSees ms", "OpenSees / ours", "least", "most")
    table("A step of the line", columns, rows)


def _our_steps(run: Run) -> Callable[[], None]:
    state = run.model.initial_state()
    places = iter(run.path.tolist())

    def steps() -> None:
        for _ in range(STEPS):
            run.model.push(state, STEP, [(0, next(places), run.force)])

    return steps


def _opensees_steps(run: Run, solver: Solver, formulation: Formulation, count: int) -> Callable[[], None]:
    line = OpenSeesLine(run.model, formulation)
    line.move(run.path, run.force, STEP)
    line.prepare(solver)
    return lambda: line.steps(count, STEP)


# Whether the results are the same


def agreement(options: argparse.Namespace, fastest: dict[str, Solver]) -> None:
    """Print how far apart the results are, with our geometric stiffness and with that of the chord alone, in both."""
    runs = {case: _run(options, case, round(options.seconds / STEP)) for case in CASES}
    with chord_stiffness():
        chords = {case: _run(options, case, round(options.seconds / STEP)) for case in CASES}
    _show_elasticity(runs["slack"], chords["slack"])
    for case, solver in fastest.items():
        _show_histories(CASES[case], runs[case], chords[case], solver)


def _show_elasticity(run: Run, chord: Run) -> None:
    spans = run.model.definition.sections[0].spans
    x = positions_in_span(spans[len(spans) // 2], 3)
    rows = []
    for force in STATIC_FORCES:
        values = {"ours": elasticity(run.model, x, force).value, "ours, chord": elasticity(chord.model, x, force).value}
        for formulation in Formulation:
            line = OpenSeesLine(run.model, formulation)
            values[f"OpenSees, {formulation.value}"] = line.elasticity(x, force)
        for name, value in values.items():
            difference = np.abs(value / values["ours"] - 1.0).max()
            row = f"{force:g} N: {name}", _mm(1e3 * value.min()), _mm(1e3 * value.max()), _percent(difference)
            rows.append(row)
    columns = (f"static, {len(x)} places of the middle span", "min mm/kN", "max mm/kN", "largest difference")
    table("Elasticity", columns, rows)


def _show_histories(case: Case, run: Run, chord: Run, solver: Solver) -> None:
    ours = our_history(run)
    histories = {"ours": ours, "ours, chord": our_history(chord)}
    for formulation in Formulation:
        histories[f"OpenSees, {formulation.value}"] = opensees_history(run, solver, formulation)
    uplift, force = np.abs(ours.uplift).max(), np.abs(ours.dropper_force).max()
    rows = [
        (
            name,
            _mm(h.uplift.max()),
            _percent(np.abs(h.uplift - ours.uplift).max() / uplift),
            str(int((h.dropper_force <= _LIMP).sum(axis=1).max())),
            _percent(np.abs(h.dropper_force - ours.dropper_force).max() / force),
        )
        for name, h in histories.items()
    ]
    columns = ("", "highest uplift mm", "difference", "droppers slack at once", "difference in dropper forces")
    table(f"{run.force:g} N along the wire, {case.title}, uplift at the supports", columns, rows)


#: A dropper that carries no more than this is slack [N]; OpenSees ends its iteration near zero.
_LIMP = 1e-3


def our_history(run: Run) -> History:
    """Run our line."""
    state = run.model.initial_state()
    uplift, dropper_force = [], []
    for x in run.path.tolist():
        run.model.push(state, STEP, [(0, x, run.force)])
        uplift.append(run.model.uplift(state).copy())
        dropper_force.append(np.maximum(run.model.spring_force(state), 0.0))  # OpenSees tells no damper's share
    return History(np.array(uplift), np.array(dropper_force))


def opensees_history(run: Run, solver: Solver, formulation: Formulation) -> History:
    """Run OpenSees, which writes every step itself."""
    line = OpenSeesLine(run.model, formulation)
    with tempfile.TemporaryDirectory() as folder:
        heights, forces = Path(folder) / "heights", Path(folder) / "forces"
        line.record(run.model.mesh.support_nodes, heights, forces)
        line.move(run.path, run.force, STEP)
        line.prepare(solver)
        line.steps(len(run.path), STEP)
        rest = line.rest
        line.close()
        return History(np.loadtxt(heights)[:, 1:] - rest, np.loadtxt(forces)[:, 1:])


@contextmanager
def chord_stiffness() -> Iterator[None]:
    """Give lines of ours that are built herein the geometric stiffness of PDelta: F / l on the ends of the chord."""

    def chord(tension: FloatArray, length: FloatArray) -> FloatArray:
        K = np.zeros((len(length), 12, 12))
        for i, j in ((1, 7), (2, 8)):
            K[:, i, i] = K[:, j, j] = tension / length
            K[:, i, j] = K[:, j, i] = -tension / length
        return K

    with mock.patch.object(line_matrices, "beam_geometric_stiffness", chord):
        yield


def _ms(seconds: float) -> str:
    return f"{1e3 * seconds:.1f}" if np.isfinite(seconds) else "failed"


def _ratio(value: float) -> str:
    return f"{value:.2f}" if np.isfinite(value) else ""


def _mm(metres: float) -> str:
    return f"{1e3 * metres:.3f}"


def _percent(share: float) -> str:
    return f"{100.0 * share:.3f} %"


if __name__ == "__main__":
    main()

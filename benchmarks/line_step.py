"""What a step of the line costs, and on what: ``python benchmarks/line_step.py [LINE]``.

The bare model without a load and under a CX pantograph, both at 1 ms, and the same line as FMU called by fmpy; then
what the steps under the pantograph are spent on, measured by clocks around the parts of a step. Without kernels
(``OPENPANTO_KERNEL=numpy``) also the line with its mass coupling stored by rows, not by dense blocks.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from unittest.mock import patch

from clocks import Clocks, Parts
from fmu_calls import stepped
from timing import by_turns, on_one_thread, table

from models.catenary.contact_and_slack import local_problem
from models.catenary.line_model import CatenaryModel
from models.catenary.step import linear_step
from models.catenary.step.compiled_line_step import CompiledLineStep
from models.catenary.step.plain_step import PlainStep
from models.coupled.monolithic import CoupledModel
from models.library.catalogue import load_line, load_lumped
from models.pantograph.lumped.lumped_model import LumpedModel

STEP = 1e-3
STEPS = 200


def main(name: str) -> None:
    on_one_thread()
    begin = time.process_time()
    model = CatenaryModel(load_line(name))
    built = time.process_time() - begin
    under = under_pantograph(model)
    fmu = stepped(f"Catenary_{name}")
    jobs = {
        "line": without_load(model),
        "line under a pantograph, monolithic": under,
        "line as FMU, without contact": lambda: fmu(STEPS),
    }
    if isinstance(model._engine(STEP), PlainStep):
        jobs["line, coupling by rows"] = without_load(by_rows(name))
    best = by_turns(jobs)
    each = {}
    for job, t in best.items():
        each[job] = t / STEPS
        if job.startswith("line under"):
            each["  of that the line: droppers, contact"] = of_the_line(under) / STEPS
    rows = [(job, f"{1e3 * t:.3f}", f"{STEP / t:.2f}", f"{t / each['line']:.2f}") for job, t in each.items()]
    unknowns = int((~model.mesh.fixed).sum())
    title = f"{name}: {unknowns} unknowns, built in {built:.2f} s, steps of {1e3 * STEP:g} ms"
    table(title, ("", "ms a step", "times real time", "ratio"), rows)
    shares(under, parts(model))


def parts(model: CatenaryModel) -> Parts:
    """Return part of a step -> class and methods that it is done in; what they call in another part counts there."""
    pantograph = {"pantograph": (LumpedModel, ("load", "free_response", "compliance", "advance", "velocity_of"))}
    engine = model._engine(STEP)
    if isinstance(engine, CompiledLineStep):
        compiled = {"line, compiled (CompiledLineStep)": (CompiledLineStep, ("_run",))}
        return {**compiled, **pantograph, "rest of the line": (CatenaryModel, ("step",))}
    return {
        "products": (linear_step.LinearStep, ("begin", "finish")),
        "band solution": (type(engine.linear.matrices.factor), ("solve",)),
        "finding the contact": (PlainStep, ("_candidates",)),
        "contact force and slack droppers": (local_problem.LocalProblem, ("solve",)),
        **pantograph,
        "rest of the line": (CatenaryModel, ("step",)),
    }


def by_rows(name: str) -> CatenaryModel:
    """Return a line whose mass coupling is stored by rows, as that of a line with intervals of several sizes is."""
    model = CatenaryModel(load_line(name))
    with patch.object(linear_step, "_by_blocks", return_value=None):
        model._engine(STEP)
    return model


def without_load(model: CatenaryModel) -> Callable[[], None]:
    """Return a function that steps a line at rest; the work does not depend on its motion."""
    state = model.initial_state()

    def steps() -> None:
        for _ in range(STEPS):
            model.push(state, STEP, ())

    return steps


def under_pantograph(model: CatenaryModel, name: str = "CX") -> Callable[[], None]:
    """Return a function that steps a line under a pantograph, which has left its first swing behind."""
    first, last = model.wires[0].ends
    pantograph = load_lumped(name).with_values({"start_position": first + 0.3 * (last - first)})
    coupled = CoupledModel(model, [pantograph])
    coupled.run(1.0, STEP)
    clock = {"n": round(1.0 / STEP)}

    def steps() -> None:
        for _ in range(STEPS):
            clock["n"] += 1
            coupled.step(STEP, clock["n"] * STEP)

    return steps


def of_the_line(steps: Callable[[], None], rounds: int = 7) -> float:
    """Return the least time over some rounds that the line takes of steps under a pantograph [s]."""
    spent = []
    for _ in range(rounds):
        clocks = Clocks()
        with clocks.running({"line": (CatenaryModel, ("step",))}):
            steps()
        spent.append(clocks.spent["line"])
    return min(spent)


def shares(steps: Callable[[], None], parts: Parts) -> None:
    """Print what steps are spent on; the clocks themselves take a few per cent."""
    clocks = Clocks()
    begin = time.process_time()
    with clocks.running(parts):
        steps()
    whole = time.process_time() - begin
    spent = {part: clocks.spent[part] for part in parts}
    spent["coupling"] = whole - sum(spent.values())
    rows = [(part, f"{1e3 * t / STEPS:.3f}", f"{100.0 * t / whole:.0f} %") for part, t in spent.items()]
    table("What a step under the pantograph is spent on", ("", "ms a step", "share"), rows)


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "LN2")

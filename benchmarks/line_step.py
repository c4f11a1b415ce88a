"""What a step of the line costs, and on what: ``python benchmarks/line_step.py [LINE]``.

The bare model under a lumped pantograph at 1 ms, its shares, and the same line as FMU called by fmpy.
"""

from __future__ import annotations

import sys
import time

import numpy as np
from fmu_calls import stepped
from timing import by_turns, table

from models.catenary.model import CatenaryModel
from models.coupled import CoupledModel
from models.library import load_line, load_lumped

STEP = 1e-3
STEPS = 400


def main(name: str) -> None:
    begin = time.perf_counter()
    model = CatenaryModel(load_line(name))
    built = time.perf_counter() - begin
    first, last = model.wires[0].ends
    pantograph = load_lumped("CX").with_values({"start_position": first + 0.3 * (last - first)})
    coupled = CoupledModel(model, [pantograph])
    coupled.run(1.0, STEP)
    clock = {"time": 1.0}

    def steps() -> None:
        for _ in range(STEPS):
            clock["time"] += STEP
            coupled.step(STEP, clock["time"])

    state, stepper = coupled.line_state, model._stepper(STEP)
    load = np.random.default_rng(1).standard_normal(len(model.free))
    fmu = stepped(f"Catenary_{name}")
    jobs = {
        "whole step, monolithic": steps,
        "  solve": lambda: _repeat(lambda: stepper.stiffness.solve(load)),
        "  products": lambda: _repeat(lambda: stepper.product @ state.motion.ravel()),
        "  dropper elongations": lambda: _repeat(lambda: model.B @ state.displacement),
        "line as FMU, without contact": lambda: fmu(STEPS),
    }
    best = by_turns(jobs)
    whole = best["whole step, monolithic"]
    rows = [
        (job, f"{1e3 * t / STEPS:.3f}", f"{100.0 * t / whole:.0f} %", f"{STEP * STEPS / t:.2f}")
        for job, t in best.items()
    ]
    table(
        f"{name}: {len(model.free)} degrees of freedom, built in {built:.2f} s, step {STEP} s",
        ("", "ms per step", "share", "times real time"),
        rows,
    )


def _repeat(job: object) -> None:
    for _ in range(STEPS):
        job()  # type: ignore[operator]


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "LN2")

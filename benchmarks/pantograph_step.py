"""What a step of each pantograph costs: ``python benchmarks/pantograph_step.py``.

Lumped and multibody parts at 1 ms under a contact force that changes, times real time and against the lumped CX;
multibody ones with and without kernels and in the general form of their equations, and as FMUs, called by fmpy.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from fmu_calls import stepped
from timing import by_turns, on_one_thread, table

from models.library.catalogue import load_pantograph, pantograph_names
from models.pantograph.lumped.lumped_part import LumpedPantographPart
from models.pantograph.multibody.mechanism_definition import MechanismDefinition
from models.pantograph.multibody.multibody_part import MultibodyPantographPart

STEP = 1e-3
STEPS = 500


def steps(name: str, formulation: str = "auto", kernel: str = "auto") -> Callable[[], None]:
    """Return a function that steps a pantograph under a swinging force."""
    os.environ["OPENPANTO_KERNEL"] = kernel
    definition = load_pantograph(name)
    part: LumpedPantographPart | MultibodyPantographPart
    if isinstance(definition, MechanismDefinition):
        part = MultibodyPantographPart(replace(definition, formulation=formulation))
    else:
        part = LumpedPantographPart(definition)
    base = np.zeros(2)
    part.initialise(0.0, 0.0, np.zeros(3), base)
    os.environ["OPENPANTO_KERNEL"] = "auto"
    clock = {"n": 0}

    def run() -> None:
        for _ in range(STEPS):
            t = clock["n"] * STEP
            point = np.array([part.strip[0, 0, 0], 0.2 * np.sin(5.0 * t), 5.0])
            part.step(150.0 + 40.0 * np.sin(20.0 * t), point, base, STEP)
            clock["n"] += 1

    return run


def fmu_steps(name: str) -> Callable[[], None]:
    """Return a function that steps a pantograph's FMU under a swinging force."""

    def inputs(time: float) -> dict[str, float]:
        x, y = 300.0 / 3.6 * time, 0.2 * np.sin(5.0 * time)
        return {"contact.force": 150.0 + 40.0 * np.sin(20.0 * time), "contact.x": x, "contact.y": y}

    run = stepped(f"Pantograph_{name}", inputs)
    return lambda: run(STEPS)


def main() -> None:
    on_one_thread()
    jobs = {name: steps(name) for name in pantograph_names()}
    for name in (n for n in pantograph_names() if "multibody" in n):
        jobs[f"{name}, plain"] = steps(name, kernel="numpy")
        jobs[f"{name}, general form"] = steps(name, "general")
        jobs[f"{name}, general form, plain"] = steps(name, "general", "numpy")
    jobs |= {f"{name} as FMU": fmu_steps(name) for name in pantograph_names() if name.endswith("multibody")}
    best = by_turns(jobs, rounds=5)
    rows = [
        (name, f"{1e6 * t / STEPS:.0f}", f"{STEP * STEPS / t:.1f}", f"{t / best['CX']:.1f}") for name, t in best.items()
    ]
    table("Pantographs at 1 ms", ("", "us per step", "times real time", "ratio to CX"), rows)


if __name__ == "__main__":
    main()

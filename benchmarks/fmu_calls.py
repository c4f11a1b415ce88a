"""FMUs stepped by fmpy, for benchmarks."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

from fmus.builder.fmu_build import build
from fmus.builder.recipe import recipe

STEP = 1e-3


def stepped(name: str, inputs: Callable[[float], dict[str, float]] | None = None) -> Callable[[int], None]:
    """Return a function that steps a fresh FMU of the library a number of times.

    Parameters
    ----------
    inputs : callable, optional
        time -> values of input variables, set before every step.
    """
    path = build(recipe(name), Path(tempfile.mkdtemp()))
    description = read_model_description(str(path))
    references = {v.name: v.valueReference for v in description.modelVariables}
    slave = FMU2Slave(
        guid=description.guid,
        unzipDirectory=extract(str(path)),
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName=name,
    )
    slave.instantiate()
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    clock = {"n": 0}

    def steps(count: int) -> None:
        for _ in range(count):
            time = clock["n"] * STEP
            if inputs is not None:
                values = inputs(time)
                slave.setReal([references[k] for k in values], list(values.values()))
            slave.doStep(currentCommunicationPoint=time, communicationStepSize=STEP)
            clock["n"] += 1

    return steps

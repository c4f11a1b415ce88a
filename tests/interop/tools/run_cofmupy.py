"""Run the FMUs of a packed scenario in CoFmuPy, which reads its own configuration instead of SSP."""

import contextlib
import io
import tempfile
from pathlib import Path

import common
from cofmupy import Coordinator, wrappers

from master.coupling.coupling_schemes import initialise
from master.run_session import connected_fmus
from master.scenario.open_scenario import open_scenario
from master.ssp.archive import extract

archive, step, count, out = common.arguments()
read_model_description = wrappers.read_model_description


def read_with_number(path):
    """CoFmuPy is made for FMPy 0.3.20, which reads the step size as a number; later versions leave it text."""
    description = read_model_description(path)
    description.defaultExperiment.stepSize = float(description.defaultExperiment.stepSize)
    return description


wrappers.read_model_description = read_with_number


def start_inputs(system):
    """Consistent inputs at the start: CoFmuPy exchanges nothing before the first step."""
    with connected_fmus(system) as network:
        initialise(network, system.start, system.stop)
        network.gather()
        return dict(zip(network.input_names, network.inputs.tolist(), strict=True))


def configuration(system):
    inputs = start_inputs(system)
    fmus = [
        {
            "id": c.name,
            "path": str(c.fmu.path),
            "initialization": {**c.parameters, **{name: inputs[f"{c.name}.{name}"] for name in c.inputs}},
        }
        for c in system.components
    ]
    connections = [
        {"source": {"id": c.source, "variable": c.output}, "target": {"id": c.target, "variable": c.input}}
        for c in system.connections
    ]
    return {"fmus": fmus, "connections": connections, "cosim_method": "jacobi", "iterative": False}


with tempfile.TemporaryDirectory() as folder:
    extract(Path(archive), Path(folder))
    with open_scenario(Path(folder), build=False) as scenario:
        settings = configuration(scenario.system)
    watch = common.Watch()
    coordinator = Coordinator()
    with contextlib.redirect_stdout(io.StringIO()):
        coordinator.start(settings)
    watch.mark()
    for _ in range(count):
        coordinator.do_step(step)
    watch.mark()
    results = coordinator.get_results()[(common.COMPONENT, common.VARIABLE)]
    common.write(out, step, [float(f) for f in results])
    watch.report()

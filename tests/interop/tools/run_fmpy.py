"""Run a packed scenario with FMPy's ``simulate_ssp``, which takes the parameters as an argument."""

import types
from pathlib import Path

import common
from fmpy.ssp.simulation import simulate_ssp

from master.scenario.open_scenario import open_scenario

archive, step, count, out = common.arguments()


def parameter_set():
    """The scenario's parameters under the names that FMPy wants."""
    with open_scenario(Path(archive), build=False) as scenario:
        values = {f"{c.name}.{name}": value for c in scenario.system.components for name, value in c.parameters.items()}
    named = [types.SimpleNamespace(name=name, value=value) for name, value in values.items()]
    return types.SimpleNamespace(parameters=named)


parameters = parameter_set()
watch = common.Watch()
watch.mark()
# FMPy sums up the time: half a step less makes sure that it stops after the wanted number of steps.
rows = simulate_ssp(archive, stop_time=(count - 0.5) * step, step_size=step, parameter_set=parameters)
watch.mark()
# Its rows hold the values at the end of a step beside the time of its beginning.
common.write(out, step, [float(f) for f in rows[f"{common.COMPONENT}.{common.VARIABLE}"]])
watch.report()

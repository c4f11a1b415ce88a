"""Run a packed scenario in Ecos."""

import common
from ecospy import EcosLib, EcosSimulation

archive, step, count, out = common.arguments()
EcosLib.set_log_level("warn")
watch = common.Watch()
name = f"{common.COMPONENT}::{common.VARIABLE}"
forces = []
with EcosSimulation(ssp_path=archive, step_size=step) as simulation:
    simulation.init(parameter_set="parameters")
    watch.mark()
    for _ in range(count):
        simulation.step()
        forces.append(float(simulation.get_real(name)))
    watch.mark()
    common.write(out, step, forces)
    watch.report()

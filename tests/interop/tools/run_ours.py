"""Run a packed scenario in our own master with the scheme jacobi, recording no more than the other runners do."""

from pathlib import Path

import common

from master.coupling.coupling_schemes import Jacobi
from master.coupling.macro_steps import TimeGrid, simulate
from master.run_session import connected_fmus
from master.scenario.open_scenario import open_scenario
from master.scenario.overrides import Overrides

archive, step, count, out = common.arguments()


class Collector:
    """Observer that keeps the contact force of every step."""

    def begin(self, time, network):
        self._place = network.output_names.index(f"{common.COMPONENT}.{common.VARIABLE}")
        self.forces = []
        watch.mark()

    def observe(self, index, time, network):
        self.forces.append(float(network.outputs[self._place]))

    def finish(self):
        watch.mark()


collector = Collector()
overrides = Overrides(count * step, step, "jacobi", may_stop_early=True)
with open_scenario(Path(archive), overrides, build=False) as scenario:
    watch = common.Watch()
    with connected_fmus(scenario.system) as network:
        outcome = simulate(network, Jacobi(), TimeGrid(0.0, step, count), [collector])
if outcome.error:
    raise SystemExit(str(outcome.error))
common.write(out, step, collector.forces)
watch.report()

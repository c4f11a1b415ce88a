"""A scenario without a contact whose optimum is known, and optimisations of it."""

import shutil
from contextlib import contextmanager

import pytest
from pythonfmu.builder import FmuBuilder

from master.batch.optimisation.optimisation_goal import OptimisationRequest
from master.batch.optimisation.optimisation_page import page
from master.batch.optimisation.optimisation_session import PreparedOptimisation, optimise
from master.batch.sweep.sweep_run import OUTPUT_KINDS, SweepResult
from master.scenario.open_scenario import open_scenario
from master.scenario.overrides import Overrides
from master.system.pantograph_motion import parameter_value
from tests.foreign_fmus import component, connector, ssd, system

BOWL = '''
from pythonfmu import Fmi2Causality as C, Fmi2Slave, Fmi2Variability as V, Real


class Bowl(Fmi2Slave):
    """depth = 10 + 4 (a - 0.3)^2 + (b - 0.62)^2; it fails where a is less than fail_below."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.a, self.b, self.fail_below = 0.9, 0.62, -1.0
        for name in ("a", "b", "fail_below"):
            self.register_variable(Real(name, causality=C.parameter, variability=V.tunable))
        self.register_variable(Real("depth", causality=C.output, getter=self.depth))
        self.register_variable(Real("sum", causality=C.output, getter=lambda: self.a + self.b))

    def depth(self):
        return 10.0 + 4.0 * (self.a - 0.3) ** 2 + (self.b - 0.62) ** 2

    def do_step(self, time, step):
        if self.a < self.fail_below:
            raise RuntimeError("a is too small")
        return True
'''


@pytest.fixture(scope="session")
def bowl_fmu(tmp_path_factory):
    """The bowl as an FMU."""
    folder = tmp_path_factory.mktemp("bowl")
    (folder / "bowl.py").write_text(BOWL)
    FmuBuilder.build_FMU(folder / "bowl.py", dest=folder)
    return folder / "Bowl.fmu"


@pytest.fixture
def bowl(bowl_fmu, tmp_path):
    """A scenario of one step of the bowl."""
    folder = tmp_path / "bowl.ssp"
    (folder / "resources").mkdir(parents=True)
    shutil.copy(bowl_fmu, folder / "resources")
    part = component("f", connector("depth", "output"), connector("sum", "output"), source="resources/Bowl.fmu")
    (folder / "SystemStructure.ssd").write_text(ssd(system(part, name="bowl"), stop=' stopTime="0.1"'))
    return folder


@pytest.fixture
def bowl_system(bowl):
    """The system of the bowl."""
    with open_scenario(bowl, Overrides(), build=False) as found:
        yield found.system


@pytest.fixture
def optimised(bowl, tmp_path):
    """Function that optimises the bowl in a folder; returns the outcome."""

    def made(folder="out", engine=None, show=lambda _: None, parameters=None, **request):
        asked = {"minimise": "f.depth end", "vary": {"f.a": "0:1"}, **request}
        with open_scenario(bowl, Overrides(parameters=parameters or {}), build=False) as found:
            prepared = PreparedOptimisation.of(found.system, OptimisationRequest.read(asked))
            return optimise(prepared, tmp_path / folder, page, engine or Computed(), show=show)

    return made


class Computed:
    """Makes no runs but works out what the bowl's would give, counts them, and is interrupted before a certain one."""

    width = 1

    def __init__(self, interrupt_at=None):
        self.made, self._interrupt_at = 0, interrupt_at

    @contextmanager
    def opened(self, base, place):
        yield lambda runs: (self._result(wanted, wanted.system(base)) for wanted in runs)

    def _result(self, wanted, changed):
        if self.made == self._interrupt_at:
            raise KeyboardInterrupt
        self.made += 1
        a, b, least = (parameter_value(changed.component("f"), name) for name in ("a", "b", "fail_below"))
        if a < least:
            return SweepResult(wanted.key, reason="a is too small")
        figures = {"f.depth": 10.0 + 4.0 * (a - 0.3) ** 2 + (b - 0.62) ** 2, "f.sum": a + b}
        row = {f"{name} {kind} [1]": value for name, value in figures.items() for kind in OUTPUT_KINDS}
        return SweepResult(wanted.key, (row,))

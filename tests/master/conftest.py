"""Fake slaves from plain functions, and toy FMUs with scenarios around them."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pythonfmu.builder import FmuBuilder

CATENARY = '''
from pythonfmu import Fmi2Causality as C, Fmi2Slave, Fmi2Variability as V, Real
from pythonfmu.enums import Fmi2Status

AXES = ("x", "y", "z")

class ToyCatenary(Fmi2Slave):
    """A row of springs at 5 m: F = stiffness * penetration."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.stiffness = 5000.0
        self.height = 5.0
        self.fail_at = 1e9
        self.nan_at = 1e9
        self.warn = 0.0
        self.warn_at = 1e9
        self.values = {}
        self.time = 0.0
        for name in ("stiffness", "height", "fail_at", "nan_at", "warn", "warn_at"):
            self.register_variable(Real(name, causality=C.parameter, variability=V.tunable))
        for end in "AB":
            for kind in ("", "v"):
                for axis in AXES:
                    self._add(f"pantograph[1].{end}.{kind}{axis}", C.input, 0.0)
        for name in ("force", "x", "y", "z"):
            self._add(f"pantograph[1].contact.{name}", C.output, 0.0)
        for i in (1, 2, 3):
            self._add(f"support[{i}].uplift", C.output, 0.0)
            self._add(f"dropper[{i}].force", C.local, 100.0 + i)
            stagger = 0.2 * (-1) ** i
            for name, value in (("x", 50.0 * (i - 1)), ("y", stagger), ("z", 5.0), ("messenger_wire.z", 6.4)):
                self._add(f"support[{i}].{name}", C.calculatedParameter, value)
            x = 50.0 * i - 25.0
            low, high = ("lower.z", 4.95), ("upper.z", 6.0)
            for name, value in (("x", x), ("lower.y", 0.0), low, high, ("length", 1.05)):
                self._add(f"dropper[{i}].{name}", C.calculatedParameter, value)

    def _add(self, name, causality, value):
        self.values[name] = value
        options = {"variability": V.fixed} if causality == C.calculatedParameter else {}
        self.register_variable(Real(
            name, causality=causality, start=value if causality == C.input else None,
            getter=lambda: self.values[name], setter=lambda v: self.values.__setitem__(name, v), **options))

    def _contact(self):
        v = self.values
        mid = {a: 0.5 * (v[f"pantograph[1].A.{a}"] + v[f"pantograph[1].B.{a}"]) for a in AXES}
        depth = mid["z"] - self.height
        v["pantograph[1].contact.force"] = self.stiffness * depth if depth > 0 else 0.0
        for axis in AXES:
            v[f"pantograph[1].contact.{axis}"] = mid[axis]
        for i in (1, 2, 3):
            v[f"support[{i}].uplift"] = max(depth, 0.0) * 0.5 * i

    def exit_initialization_mode(self):
        self._contact()
        if self.warn:
            self.log("the wire [sags] :100:", Fmi2Status.warning)

    def do_step(self, time, step):
        if time >= self.fail_at:
            raise RuntimeError("the wire broke at 100 percent load")
        self._contact()
        if time >= self.warn_at:
            self.log(f"the wire is hot after {self.warn_at:g} s", Fmi2Status.warning)
        if time >= self.nan_at:
            self.values["pantograph[1].contact.force"] = float("nan")
        return True
'''

PANTOGRAPH = '''
from pythonfmu import Fmi2Causality as C, Fmi2Slave, Fmi2Variability as V, Real

class ToyPantograph(Fmi2Slave):
    """One mass of 20 kg pressed up by static_force."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.static_force = 150.0
        self.speed = 50.0
        self.damping = 200.0
        self.ripple = 0.0
        self.position = 0.0
        self.z = 5.0
        self.vz = 0.0
        self.inputs = {"force": 0.0, "x": 0.0, "y": 0.0, "z": 0.0}
        for name in ("static_force", "speed", "damping", "ripple"):
            self.register_variable(Real(name, causality=C.parameter, variability=V.tunable))
        for name in self.inputs:
            self._input(name)
        for name in ("position", "z", "vz"):
            self.register_variable(Real(name, causality=C.local))
        for end, y in (("A", 0.5), ("B", -0.5)):
            for name, value in (
                ("x", lambda: self.position), ("y", lambda y=y: y), ("z", lambda: self.z),
                ("vx", lambda: self.speed), ("vy", lambda: 0.0), ("vz", lambda: self.vz),
            ):
                self.register_variable(Real(f"{end}.{name}", causality=C.output, getter=value))
        self.register_variable(Real("mass[1].z", causality=C.output, getter=lambda: self.z))

    def _input(self, name):
        self.register_variable(Real(
            f"contact.{name}", causality=C.input, start=0.0,
            getter=lambda: self.inputs[name], setter=lambda v: self.inputs.__setitem__(name, v)))

    def do_step(self, time, step):
        import math
        for _ in range(4):
            push = self.static_force + self.ripple * math.sin(0.3 * self.position)
            self.vz += (push - self.inputs["force"] - self.damping * self.vz) / 20.0 * step / 4
            self.z += self.vz * step / 4
        self.position += self.speed * step
        return True
'''

ENDS = [f"{end}.{kind}{axis}" for end in "AB" for kind in ("", "v") for axis in "xyz"]
POINT = ["force", "x", "y", "z"]


def _connectors(names: list[str], kind: str) -> str:
    return "".join(f'<ssd:Connector name="{n}" kind="{kind}"><ssc:Real/></ssd:Connector>\n' for n in names)


def _connection(a: str, x: str, b: str, y: str) -> str:
    return f'<ssd:Connection startElement="{a}" startConnector="{x}" endElement="{b}" endConnector="{y}"/>\n'


def ssd_text(run: str = '<panto:Interval start="20" end="45"/>', stop: str = "1.0", step: str = "0.001") -> str:
    """The toy scenario's SystemStructure.ssd."""
    wires = "".join(_connection("pantograph", n, "catenary", f"pantograph[1].{n}") for n in ENDS)
    wires += "".join(_connection("catenary", f"pantograph[1].contact.{n}", "pantograph", f"contact.{n}") for n in POINT)
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon"
    xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription" version="1.0" name="toy">
<ssd:System name="toy">
<ssd:Elements>
<ssd:Component name="catenary" source="resources/ToyCatenary.fmu">
<ssd:Connectors>
{_connectors([f"pantograph[1].{n}" for n in ENDS], "input")}
{_connectors([f"pantograph[1].contact.{n}" for n in POINT], "output")}
</ssd:Connectors>
</ssd:Component>
<ssd:Component name="pantograph" source="resources/ToyPantograph.fmu">
<ssd:Connectors>
{_connectors(ENDS, "output")}
{_connectors([f"contact.{n}" for n in POINT], "input")}
</ssd:Connectors>
<ssd:ParameterBindings><ssd:ParameterBinding source="parameters.ssv"/></ssd:ParameterBindings>
</ssd:Component>
</ssd:Elements>
<ssd:Connections>
{wires}</ssd:Connections>
</ssd:System>
<ssd:DefaultExperiment startTime="0" stopTime="{stop}">
<ssd:Annotations>
<ssc:Annotation type="com.opensimulationplatform">
<osp:Algorithm xmlns:osp="http://opensimulationplatform.com/SSP/OSPAnnotations">
<osp:FixedStepAlgorithm baseStepSize="{step}"/></osp:Algorithm>
</ssc:Annotation>
</ssd:Annotations>
</ssd:DefaultExperiment>
<ssd:Annotations>
<ssc:Annotation type="urn:openpanto:ssp">
<panto:Run xmlns:panto="urn:openpanto:ssp">{run}</panto:Run></ssc:Annotation>
</ssd:Annotations>
</ssd:SystemStructureDescription>
"""


SSV = """<?xml version="1.0" encoding="UTF-8"?>
<ssv:ParameterSet xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues"
    version="1.0" name="parameters">
  <ssv:Parameters>
    <!-- kept as it is -->
    <ssv:Parameter name="static_force"><ssv:Real value="140"/></ssv:Parameter>
    <ssv:Parameter name="ripple"><ssv:Real value="20"/></ssv:Parameter>
  </ssv:Parameters>
</ssv:ParameterSet>
"""


@pytest.fixture(scope="session")
def toy_fmus(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with ToyCatenary.fmu and ToyPantograph.fmu."""
    folder = tmp_path_factory.mktemp("toys")
    for name, source in (("ToyCatenary", CATENARY), ("ToyPantograph", PANTOGRAPH)):
        script = folder / f"toy_{name.lower()}_script.py"
        script.write_text(source)
        FmuBuilder.build_FMU(script, dest=folder, canGetAndSetFMUstate=True, canSerializeFMUstate=True)
    return folder


@pytest.fixture
def toy(toy_fmus: Path, tmp_path: Path) -> Path:
    """A scenario folder of its own for the test."""
    folder = tmp_path / "toy.ssp"
    (folder / "resources").mkdir(parents=True)
    for path in toy_fmus.glob("*.fmu"):
        shutil.copy(path, folder / "resources")
    (folder / "SystemStructure.ssd").write_text(ssd_text())
    (folder / "parameters.ssv").write_text(SSV)
    return folder


@pytest.fixture
def toy_text() -> Callable[..., str]:
    """Function that gives the toy scenario's SSD with changes."""
    return ssd_text


@dataclass
class FakeSlave:
    """A slave made from plain functions.

    ``flow(state, inputs, time, step)`` returns the new state, ``output(state, inputs)`` the outputs.
    """

    name: str
    input_names: tuple[str, ...]
    output_names: tuple[str, ...]
    state: np.ndarray
    flow: Callable[[np.ndarray, np.ndarray, float, float], np.ndarray]
    output: Callable[[np.ndarray, np.ndarray], Any] = lambda state, inputs: state
    said: str = ""
    calls: list[str] = field(default_factory=list)
    steps: list[tuple[float, float]] = field(default_factory=list)

    def bind(self, inputs: np.ndarray, outputs: np.ndarray) -> None:
        self._in, self._out = inputs, outputs
        self._told = np.zeros_like(inputs)

    def start(self, start: float, stop: float) -> None:
        self.calls.append("start")

    def finish_initialisation(self) -> None:
        self.calls.append("finish")

    def write(self) -> None:
        self._told = self._in.copy()

    def read(self) -> None:
        self._out[:] = self.output(self.state, self._told)

    def step(self, time: float, step: float) -> None:
        self.steps.append((time, step))
        self.state = np.asarray(self.flow(self.state, self._told, time, step))

    def save(self) -> np.ndarray:
        self.calls.append("save")
        return self.state.copy()

    def restore(self, state: np.ndarray) -> None:
        self.state = state.copy()

    def release(self, state: np.ndarray) -> None:
        self.calls.append("release")

    def remark(self) -> str:
        return self.said


@pytest.fixture
def fake_slave() -> type[FakeSlave]:
    """The class of fake slaves."""
    return FakeSlave


@pytest.fixture
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Work in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path

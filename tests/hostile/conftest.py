"""Hostile FMUs, compiled from a C file of our own, and a scenario around one."""

from __future__ import annotations

import shutil
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

HERE = Path(__file__).parent
DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Hostile" guid="{hostile}" generationTool="tests">
<CoSimulation modelIdentifier="Hostile" canGetAndSetFMUstate="true" canSerializeFMUstate="true"
  canHandleVariableCommunicationStepSize="true"/>
<ModelVariables>
<ScalarVariable name="u" valueReference="0" causality="input" variability="continuous"><Real start="1"/>
</ScalarVariable>
<ScalarVariable name="y" valueReference="1" causality="output" variability="continuous"><Real/></ScalarVariable>
</ModelVariables>
<ModelStructure><Outputs><Unknown index="2"/></Outputs></ModelStructure>
</fmiModelDescription>
"""
COMPONENT = """<ssd:Component name="{name}" source="resources/{file}.fmu"><ssd:Connectors>
<ssd:Connector name="u" kind="input"><ssc:Real/></ssd:Connector>
<ssd:Connector name="y" kind="output"><ssc:Real/></ssd:Connector></ssd:Connectors></ssd:Component>"""
SSD = f"""<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon"
    xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription" version="1.0" name="pair">
<ssd:System name="pair"><ssd:Elements>
{COMPONENT.format(name="good", file="Good")}
{COMPONENT.format(name="bad", file="Hostile")}
</ssd:Elements><ssd:Connections>
<ssd:Connection startElement="good" startConnector="y" endElement="bad" endConnector="u"/>
<ssd:Connection startElement="bad" startConnector="y" endElement="good" endConnector="u"/>
</ssd:Connections></ssd:System>
<ssd:DefaultExperiment startTime="0" stopTime="0.1"><ssd:Annotations>
<ssc:Annotation type="com.opensimulationplatform">
<osp:Algorithm xmlns:osp="http://opensimulationplatform.com/SSP/OSPAnnotations">
<osp:FixedStepAlgorithm baseStepSize="0.01"/></osp:Algorithm></ssc:Annotation>
</ssd:Annotations></ssd:DefaultExperiment>
</ssd:SystemStructureDescription>
"""


@pytest.fixture(scope="session")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The compiled library."""
    if sys.platform != "linux" or shutil.which("gcc") is None:
        pytest.skip("needs gcc on Linux")
    path = tmp_path_factory.mktemp("hostile") / "Hostile.so"
    subprocess.run(["gcc", "-shared", "-fPIC", "-O1", "-w", "-o", path, HERE / "hostile.c"], check=True)
    return path


@pytest.fixture
def pair(library: Path, tmp_path: Path) -> Callable[..., Path]:
    """Function that gives a scenario of a good FMU and one that does a deed in a function from a time on."""

    def make(function: str, kind: str, time: float = -1.0) -> Path:
        folder = tmp_path / "pair.ssp"
        (folder / "resources").mkdir(parents=True)
        (folder / "SystemStructure.ssd").write_text(SSD)
        for name, deed in (("Good", ""), ("Hostile", f"{function} {kind} {time}")):
            with zipfile.ZipFile(folder / "resources" / f"{name}.fmu", "w") as fmu:
                fmu.writestr("modelDescription.xml", DESCRIPTION)
                fmu.write(library, "binaries/linux64/Hostile.so")
                fmu.writestr("resources/deed", deed)
        return folder

    return make

"""A pantograph that cannot be put together: an error of initialisation in FMPy, Ecos and a host in C, and no crash."""

from __future__ import annotations

import re
import subprocess
import sys
import zipfile

import pytest

from fmus.builder.fmu_build import build
from fmus.builder.recipe import recipe
from models.library.catalogue import pantograph_path
from tests.fmus.support import Instance, refused
from tests.interop.support import require
from tests.interop.test_conduct import _ask, _load, linux, obedient  # noqa: F401 - a fixture
from tests.interop.test_host import unpack

SSD = """<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription"
    xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" version="1.0" name="broken">
  <ssd:System name="broken">
    <ssd:Elements>
      <ssd:Component name="pantograph" source="resources/{fmu}" type="application/x-fmu-sharedlibrary">
        <ssd:Connectors><ssd:Connector name="A.z" kind="output"><ssc:Real/></ssd:Connector></ssd:Connectors>
      </ssd:Component>
    </ssd:Elements>
  </ssd:System>
</ssd:SystemStructureDescription>
"""
ECOS = """
import sys
from ecospy import EcosSimulation
with EcosSimulation(ssp_path=sys.argv[1], step_size=1e-3) as simulation:
    try:
        simulation.init()
        simulation.step()
        print("value", simulation.get_real("pantograph::A.z"))
    except Exception as error:
        print("refused", type(error).__name__)
print("freed")
"""


@pytest.fixture(scope="module")
def broken(tmp_path_factory):
    """The FMU of the generic mechanism with a joint's point half a metre away."""
    folder = tmp_path_factory.mktemp("broken")
    text = pantograph_path("generic_multibody").read_text().replace('name = "generic_multibody"', 'name = "broken"')
    head, joint, rest = text.partition("[joint.joint_4]")
    moved = re.sub(r"point_i = \[\[(-?[0-9.]+)", lambda m: f"point_i = [[{float(m[1]) + 0.5}", rest, count=1)
    (folder / "broken.toml").write_text(head + joint + moved)
    return build(recipe(str(folder / "broken.toml")), folder)


def test_in_fmpy(broken):
    made = Instance(broken)
    with refused():
        made.initialise()
    assert any(status == 3 for status, _ in made.messages)
    made.free()


@linux
def test_in_a_host_in_c(obedient, broken, tmp_path):  # noqa: F811
    part = unpack(broken, tmp_path)
    lines, said = _ask(obedient, _load(part), "start", "step 0", "free")
    assert "start 3" in lines
    assert any(line in ("step 2", "step 3") for line in lines)
    assert lines[-1] == "free 0"
    assert "joint_4" in said


def test_in_ecos(broken, tmp_path):
    require("ecospy")
    archive = tmp_path / "broken.ssp"
    with zipfile.ZipFile(archive, "w") as file:
        file.writestr("SystemStructure.ssd", SSD.format(fmu=broken.name))
        file.write(broken, f"resources/{broken.name}")
    done = subprocess.run([sys.executable, "-c", ECOS, str(archive)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    assert done.stdout.split("\n")[-2:] == ["freed", ""]
    # Ecos says nothing of the status that initialisation returns; then nothing computed may be taken for a result.
    assert "refused" in done.stdout or "value nan" in done.stdout
    assert "joint 'joint_4' gapes by" in done.stderr + done.stdout

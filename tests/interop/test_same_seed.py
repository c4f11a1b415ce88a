"""One seed has the same errors of assembly in every tool; tests/fmus/slave has a sample in a host without a tool."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest

from master.ssp.archive import extract
from master.ssp.pack import pack
from models.catenary.line_part import CatenaryPart
from models.library.catalogue import load_line
from tests.interop.support import ROOT, TOOLS, require

ERRORS = {
    "irregularity.dropper_length_sigma": 0.01,
    "irregularity.dropper_position_sigma": 0.05,
    "irregularity.support_height_sigma": 0.005,
    "irregularity.stagger_sigma": 0.01,
    "irregularity.seed": 7,
}
GIVEN = '<ssv:Parameter name="contact.stiffness">'


@pytest.mark.long
@pytest.mark.parametrize("tool", ["ecos", "libcosim"])
def test_a_seed_has_the_same_errors_in_another_tool(tool, packed, tmp_path):
    require({"ecos": "ecospy", "libcosim": "libcosimpy"}[tool])
    folder = tmp_path / "seeded.ssp"
    folder.mkdir()
    extract(packed, folder)
    ssd = folder / "SystemStructure.ssd"
    kinds = {name: "Integer" if name.endswith("seed") else "Real" for name in ERRORS}
    values = "".join(
        f'<ssv:Parameter name="{n}"><ssv:{kinds[n]} value="{v}"/></ssv:Parameter>' for n, v in ERRORS.items()
    )
    text = ssd.read_text()
    assert text.count(GIVEN) == 1
    ssd.write_text(text.replace(GIVEN, values + GIVEN))
    archive, out = pack(folder, tmp_path / "packed" / "seeded.ssp"), tmp_path / "values.csv"
    ours = CatenaryPart(load_line("LN2").with_values(ERRORS)).geometry
    wanted = {f"dropper[{j}].{name}": values[j - 1] for j in (3, 90) for name, values in (
        ("x", ours.dropper_x), ("length", ours.dropper_length), ("lower.z", ours.dropper_lower_z),
    )} | {f"support[{k}].{axis}": values[k - 1] for k in (4, 20) for axis, values in (
        ("y", ours.support_y), ("messenger_wire.z", ours.support_messenger_z),
    )}  # fmt: skip
    names = [f"catenary::{name}::Real" for name in wanted]
    command = [sys.executable, TOOLS / "run_values.py", tool, archive, "0.001", "1", out, *names]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    options = {"env": environment, "cwd": tmp_path, "capture_output": True, "text": True, "check": False}
    done = subprocess.run([*map(str, command)], **options)
    assert done.returncode == 0, done.stdout[-500:] + done.stderr[-2000:]
    assert np.loadtxt(out, delimiter=",") == pytest.approx(np.array(list(wanted.values())), rel=1e-13)

"""The verbs ``validate`` and ``pack``."""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Final

from master.commands.command_options import _overrides, _tell, _tell_warnings
from master.errors import MasterError, RequestError
from master.fmu.fmu_provision import write_runtime
from master.report.terminal_summary import _told_tolerance
from master.scenario import scenario_advice as limits
from master.scenario.open_scenario import open_scenario
from master.ssp.archive import SSD_NAME
from master.ssp.pack import left_out, pack
from master.system.step_rounding import adjustments

#: Where an archive holds one Python for all its FMUs.
RUNTIME: Final = "resources/runtime"


def _validate(options: argparse.Namespace) -> int:
    with open_scenario(
        options.scenario, _overrides(options), _tell, build=not options.no_build, is_check=True
    ) as scenario:
        system = scenario.system
        _tell_warnings(system, _tell)
        counts = f"{len(system.components)} components, {len(system.connections)} connections"
        times = f"{system.start:g} s to {system.stop:g} s in steps of {system.step:g} s"
        for text in (*limits.warnings(system), *adjustments(system)):
            _tell(f"warning: {text}")
        tolerance = _told_tolerance({c.name: c.tolerance for c in system.components})
        print(f"{system.name}: valid; {counts}, {times}, {system.settings.coupling.scheme}{tolerance}")
    return 0


def _pack(options: argparse.Namespace) -> int:
    with open_scenario(options.scenario, tell=_tell, build=not options.no_build) as scenario:
        _tell_warnings(scenario.system, _tell)
        archive = options.out or Path("dist") / f"{scenario.system.name}.ssp"
        if archive.is_dir():
            raise RequestError(f"{archive} is a folder; choose another name with --out")
        root = scenario.package.root
        with tempfile.TemporaryDirectory(prefix="openpanto_") as folder:
            added = {RUNTIME: _runtime(Path(folder))} if options.standalone else {}
            print(pack(root, archive, added))
        if names := left_out(root):
            _tell(f"left out, for {SSD_NAME} does not name it: {', '.join(names)}")
    return 0


def _runtime(folder: Path) -> Path:
    """Write the Python that FMUs run in on a machine that has none; return its folder."""
    try:
        write_runtime(folder)
    except ValueError as error:
        raise MasterError(f"the archive cannot be standalone: {error}") from error
    return folder

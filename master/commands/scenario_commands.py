"""The verbs ``validate`` and ``pack``."""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Final

from master.commands.command_options import overrides_of, say, say_warnings
from master.errors import MasterError, RequestError
from master.fmu.fmu_provision import write_runtime
from master.report.terminal_summary import tolerance_words
from master.scenario import scenario_advice
from master.scenario.open_scenario import open_scenario
from master.scenario.scenario_place import fmu_cache
from master.ssp.archive import SSD_NAME
from master.ssp.pack import left_out, pack
from master.system.step_rounding import adjustments

#: Where an archive holds its FMUs, and one Python for them all.
_RESOURCES: Final = "resources"
_RUNTIME: Final = f"{_RESOURCES}/runtime"


def validate_verb(options: argparse.Namespace) -> int:
    """Check a scenario and say what a run would be."""
    with open_scenario(
        options.scenario, overrides_of(options), say, build=not options.no_build, is_check=True
    ) as scenario:
        system = scenario.system
        say_warnings(system)
        counts = f"{len(system.components)} components, {len(system.connections)} connections"
        times = f"{system.start:g} s to {system.stop:g} s in steps of {system.step:g} s"
        for text in (*scenario_advice.warnings(system), *adjustments(system)):
            say(f"warning: {text}")
        tolerance = tolerance_words({c.name: c.tolerance for c in system.components})
        print(f"{system.name}: valid; {counts}, {times}, {system.settings.coupling.scheme}{tolerance}")
    return 0


def pack_verb(options: argparse.Namespace) -> int:
    """Write a scenario as an archive."""
    with open_scenario(options.scenario, tell=say, build=not options.no_build) as scenario:
        say_warnings(scenario.system)
        archive = options.out or Path("dist") / f"{scenario.system.name}.ssp"
        if archive.is_dir():
            raise RequestError(f"{archive} is a folder; choose another name with --out")
        root = scenario.package.root
        with tempfile.TemporaryDirectory(prefix="openpanto_") as folder:
            added = {_RUNTIME: _runtime(Path(folder))} if options.standalone else {}
            if (built := fmu_cache(root)) is not None:
                added[_RESOURCES] = built
            print(pack(root, archive, added))
        if names := left_out(root):
            say(f"left out, because {SSD_NAME} does not name it: {', '.join(names)}")
    return 0


def _runtime(folder: Path) -> Path:
    """Write the Python that FMUs run in on a machine without one; return its folder."""
    try:
        write_runtime(folder)
    except ValueError as error:
        raise MasterError(f"the archive cannot be standalone: {error}") from error
    return folder

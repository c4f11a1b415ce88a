"""The command line: ``python -m master [VERB] ...``.

Exit codes: 0 done; 1 failed, invalid or incomplete (scenario, definition, FMU, results, limits that must hold in
``verify``); 2 only for a command line that was not understood. See docs/reliability.md.
"""

from __future__ import annotations

import argparse
import importlib
import sys
from collections.abc import Collection, Mapping, Sequence
from typing import Final

from master.commands.verb_execution import carry_out

#: Module and function that declare each verb and its options, in the order of the help. A module is imported when its
#: verb is asked for: sweeps need ten times as many modules as a run.
VERBS: Final[Mapping[str, tuple[str, str]]] = {
    "run": ("run_command", "add_run"),
    "validate": ("scenario_commands", "add_validate"),
    "pack": ("scenario_commands", "add_pack"),
    "compare": ("report_commands", "add_compare"),
    "report": ("report_commands", "add_report"),
    "calibrate": ("calibrate_command", "add_calibrate"),
    "verify": ("verify_command", "add_verify"),
    "study": ("study_command", "add_study"),
    "sweep": ("sweep_command", "add_sweep"),
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return the exit code."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    if given and given[0] not in VERBS and given[0] not in ("-h", "--help"):
        given.insert(0, "run")
    return carry_out(_parser(given[:1] if given and given[0] in VERBS else VERBS).parse_args(given))


def _parser(wanted: Collection[str]) -> argparse.ArgumentParser:
    """Return the parser of the command line, with the wanted verbs."""
    parser = argparse.ArgumentParser(
        prog="python -m master",
        description="Run pantograph-catenary scenarios (SSP) and judge the contact quality.",
        epilog="'run' may be omitted: python -m master SCENARIO ...",
    )
    verbs = parser.add_subparsers(required=True, metavar="VERB")
    for name in wanted:
        module, declare = VERBS[name]
        getattr(importlib.import_module(f"master.commands.{module}"), declare)(verbs)
    return parser

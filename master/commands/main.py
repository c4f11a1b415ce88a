"""The command line: ``python -m master [VERB] ...``.

Exit codes: 0 done; 1 failed, invalid or incomplete (scenario, definition, FMU, results, limits that must hold in
``verify``); 2 only a command line that was not understood; docs/reliability.md says more.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from rich.console import Console

from master.commands import report_commands, study_command, verify_command
from master.commands.calibrate_command import _add_calibrate
from master.commands.command_options import _add, _add_overrides, _add_tolerance
from master.commands.run_command import _add_run
from master.commands.scenario_commands import RUNTIME, _pack, _validate
from master.errors import MasterError, UsageError
from master.report.terminal_summary import Terminal

VERBS: Final = ("run", "pack", "validate", "compare", "report", "calibrate", "verify", "study")
_WIDTH: Final = 80


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    if given and given[0] not in VERBS and given[0] not in ("-h", "--help"):
        given.insert(0, "run")
    options = _parser().parse_args(given)
    error = Terminal(stderr=True, width=_WIDTH if not sys.stderr.isatty() else None, soft_wrap=True)
    try:
        code: int = options.verb(options)
        sys.stdout.flush()  # here, where an error can still be told
    except UsageError as failure:
        return _fail(error, failure, 2)
    except MasterError as failure:
        return _fail(error, failure, 1)
    except BrokenPipeError:
        return 1
    except KeyboardInterrupt:
        return _fail(error, "interrupted", 1)
    except OSError as failure:
        return _fail(error, f"{failure.filename or 'standard output'}: {failure.strerror or failure}", 1)
    return code


def _fail(console: Console, failure: object, code: int) -> int:
    console.print(f"error: {failure}", style="red", markup=False, highlight=False, emoji=False)
    return code


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m master",
        description="Run pantograph-catenary scenarios (SSP) and judge the contact quality.",
        epilog="'run' may be left out: python -m master SCENARIO ...",
    )
    verbs = parser.add_subparsers(required=True, metavar="VERB")
    _add_run(verbs)
    checking = _add(verbs, "validate", "check a scenario without running it", _validate, scenario=True)
    _add_overrides(checking)
    _add_tolerance(checking)
    packing = _add(verbs, "pack", "write a scenario as a .ssp archive, FMUs included", _pack, scenario=True)
    packing.add_argument("--out", type=Path, metavar="FILE", help="default: dist/NAME.ssp")
    packing.add_argument(
        "--standalone",
        action="store_true",
        help=f"with the Python that the FMUs run in, as {RUNTIME}, for tools where OPENPANTO_RUNTIME names it",
    )
    report_commands.add_compare_arguments(
        _add(verbs, "compare", report_commands.COMPARE_HELP, report_commands.run_compare)
    )
    report_commands.add_report_arguments(_add(verbs, "report", report_commands.REPORT_HELP, report_commands.run_report))
    _add_calibrate(verbs)
    verify_command.add_arguments(_add(verbs, "verify", verify_command.HELP, verify_command.run))
    study_command.add_arguments(_add(verbs, "study", study_command.HELP, study_command.run))
    return parser

"""The command line: ``python -m master [VERB] ...``.

Exit codes: 0 done; 1 failed, invalid or incomplete (scenario, definition, FMU, results, limits that must hold in
``verify``); 2 only for a command line that was not understood. See docs/reliability.md.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

from rich.console import Console

from master.commands.calibrate_command import add_calibrate
from master.commands.report_commands import add_compare, add_report
from master.commands.run_command import add_run
from master.commands.scenario_commands import add_pack, add_validate
from master.commands.study_command import add_study
from master.commands.sweep_command import add_sweep
from master.commands.verify_command import add_verify
from master.errors import MasterError, UsageError, said
from master.report.terminal_summary import WIDTH, Terminal

#: What declares each verb and its options, in the order of the help.
VERBS: Final[Mapping[str, Callable[[Any], None]]] = {
    "run": add_run,
    "validate": add_validate,
    "pack": add_pack,
    "compare": add_compare,
    "report": add_report,
    "calibrate": add_calibrate,
    "verify": add_verify,
    "study": add_study,
    "sweep": add_sweep,
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return the exit code."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    if given and given[0] not in VERBS and given[0] not in ("-h", "--help"):
        given.insert(0, "run")
    return carry_out(_parser().parse_args(given))


def carry_out(options: argparse.Namespace) -> int:
    """Carry out a verb that was understood and return the exit code; what a user can cause is one message."""
    error = Terminal(stderr=True, width=WIDTH if not sys.stderr.isatty() else None, soft_wrap=True)
    try:
        code: int = options.verb(options)
        sys.stdout.flush()  # here, where an error can still be reported
    except UsageError as failure:
        return _fail(error, failure, 2)
    except MasterError as failure:
        return _fail(error, failure, 1)
    except BrokenPipeError:
        return 1
    except KeyboardInterrupt:
        return _fail(error, "interrupted", 1)
    except OSError as failure:
        return _fail(error, f"{failure.filename or 'standard output'}: {said(failure)}", 1)
    return code


def _fail(console: Console, failure: object, code: int) -> int:
    console.print(f"error: {failure}", style="red", markup=False, highlight=False, emoji=False)
    return code


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m master",
        description="Run pantograph-catenary scenarios (SSP) and judge the contact quality.",
        epilog="'run' may be omitted: python -m master SCENARIO ...",
    )
    verbs = parser.add_subparsers(required=True, metavar="VERB")
    for add in VERBS.values():
        add(verbs)
    return parser

"""The command line: ``python -m master [VERB] ...``.

Exit codes: 0 done; 1 failed, invalid or incomplete (scenario, definition, FMU, results, limits that must hold in
``verify``); 2 only for a command line that was not understood. See docs/reliability.md.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, Final

from master.commands import verb_options
from master.commands.verb_execution import carry_out
from master.errors import empty_argument

#: What declares each verb and its options, in the order of the help.
VERBS: Final[Mapping[str, Callable[[Any], None]]] = {
    "run": verb_options.add_run,
    "validate": verb_options.add_validate,
    "pack": verb_options.add_pack,
    "compare": verb_options.add_compare,
    "report": verb_options.add_report,
    "calibrate": verb_options.add_calibrate,
    "verify": verb_options.add_verify,
    "study": verb_options.add_study,
    "sweep": verb_options.add_sweep,
    "optimise": verb_options.add_optimise,
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return the exit code."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    if empty := empty_argument(given):
        _parser(()).error(empty)
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
        VERBS[name](verbs)
    return parser

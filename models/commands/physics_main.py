"""``python -m models``: the verbs, and how their errors reach the user."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

import models.scipy_start  # noqa: F401  before all that imports SciPy
from models.catenary.contact_and_slack.local_problem import LocalSolutionError
from models.catenary.shape.form_finding import EquilibriumError
from models.commands.physics_options import show_log
from models.commands.physics_verbs import (
    add_asbuilt,
    add_couple,
    add_export,
    add_identify,
    add_import,
    add_lanes,
    add_pantograph,
    add_spans,
    add_statics,
)
from models.definition_files.message_text import empty_argument, printable, said
from models.definition_files.parameter import ParameterError
from models.definition_files.toml_reader import DefinitionError
from models.library.catalogue import UnknownNameError
from models.numerics.kernel_cache import KernelError
from models.pantograph.multibody.mechanism import MechanismError

_VERBS = (
    add_couple,
    add_statics,
    add_spans,
    add_import,
    add_export,
    add_asbuilt,
    add_pantograph,
    add_identify,
    add_lanes,
)
#: What a user can cause; everything else is a defect and keeps its traceback.
_USER_ERRORS = (
    DefinitionError,
    EquilibriumError,
    KernelError,
    LocalSolutionError,
    MechanismError,
    ParameterError,
    UnknownNameError,
)


def main(argv: Sequence[str]) -> int:
    """Run ``python -m models``; return 0, 1 (failed or invalid) or 2 (a command line that was not understood)."""
    parser = argparse.ArgumentParser(prog="python -m models", description="Physics of lines and pantographs.")
    subparsers = parser.add_subparsers(dest="verb", required=True)
    for add in _VERBS:
        add(subparsers)
    if empty := empty_argument(argv):
        parser.error(empty)
    return carry_out(parser.parse_args(argv))


def carry_out(options: argparse.Namespace) -> int:
    """Carry out a verb that was understood and return the exit code; what a user can cause is one message."""
    show_log(lambda text: print(printable(text), file=sys.stderr, flush=True))
    try:
        code = int(options.run(options))
        if sys.stdout is not None:  # closed by the caller
            sys.stdout.flush()  # here, where an error can still be reported
    except OSError as error:
        text = f"{error.filename or 'standard output'}: {said(error)}"
        print(f"error: {printable(text)}", file=sys.stderr)
        return 1
    except _USER_ERRORS as error:
        print(f"error: {printable(str(error))}", file=sys.stderr)
        return 1
    except MemoryError:
        print("error: there is not enough memory; end other programs, or raise the limit (ulimit -v)", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("error: interrupted", file=sys.stderr)
        return 1
    return code

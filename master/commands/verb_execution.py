"""What every verb ends in: an exit code, and for what a user can cause one message."""

from __future__ import annotations

import argparse
import sys

from rich.console import Console

from master.errors import MasterError, UsageError, said
from master.report.terminal_summary import WIDTH, Terminal


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

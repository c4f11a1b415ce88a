"""SciPy without what it would load of NumPy that nobody here needs: a quarter of what starting a process takes.

SciPy copies whatever NumPy names into a module of its own, and that loads parts which NumPy itself leaves alone until
somebody asks for them: a compiler's front end for Fortran, tools for tests, polynomials. Whoever imports this module
first gets a SciPy that has copied the rest; in NumPy all is found as ever.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from typing import Final

import numpy as np

#: Parts of NumPy that SciPy's copy need not have.
_LEFT_OUT: Final = frozenset({"ctypeslib", "f2py", "ma", "polynomial", "testing"})


@contextlib.contextmanager
def _hidden() -> Iterator[None]:
    """Let NumPy not name those parts for a while."""
    names, listed = np.__all__, np.__dir__
    try:
        vars(np)["__all__"] = [name for name in names if name not in _LEFT_OUT]
        vars(np)["__dir__"] = lambda: [name for name in listed() if name not in _LEFT_OUT]
        yield
    finally:
        vars(np).update(__all__=names, __dir__=listed)


if "scipy" not in sys.modules:
    with _hidden(), contextlib.suppress(ImportError, AttributeError):  # another SciPy has it elsewhere, or not at all
        import scipy._lib.array_api_compat.numpy  # noqa: F401

"""The reduced form compiled: `reduced_equations`, and in place of some of its functions what arrays need.

Both are one source for `kernel_cache`, that of `reduced_equations` first; this file alone is of no use.
"""

import types

import numpy as np
from numba import njit


def look_up(table, theta):
    """Return the functions of a table at ``theta``, shape (functions,)."""
    start, scale, count, cells = table
    place = (theta - start) * scale
    k = min(max(int(place), 0), count - 1)
    x = place - k
    values = np.empty(cells.shape[1])
    for i in range(len(values)):
        row = cells[k, i]
        values[i] = row[0] + x * (row[1] + x * (row[2] + x * (row[3] + x * (row[4] + x * row[5]))))
    return values


def put(target, values):
    """Write values into a memory."""
    for i in range(len(target)):
        target[i] = values[i]


#: What is called from Python, and what by other kernels alone: nothing is made for Python then, which takes long.
_FOR_PYTHON = ("look_up", "lift_value", "begin", "step", "is_free", "place_strip", "place_bodies")
_compiled = njit(cache=True, error_model="numpy")
_part = njit(  # type: ignore[call-overload]
    error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True
)

for _name, _function in list(globals().items()):
    if isinstance(_function, types.FunctionType) and _function.__module__ == __name__:
        globals()[_name] = (_compiled if _name in _FOR_PYTHON else _part)(_function)

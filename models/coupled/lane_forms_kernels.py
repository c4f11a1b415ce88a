"""How kernels of lanes are compiled, for numba: they make no arrays, so that references to arrays need not be counted.

Such counts are a sixth of what the compiler has to do with functions of many arrays.
"""

from typing import Any

from numba import njit

_FORM: Any = {
    "fastmath": {"reassoc", "contract", "nsz"},
    "error_model": "numpy",
    "_nrt": False,
    "no_cfunc_wrapper": True,
}
#: What is called from Python; its machine code is kept.
outer = njit(**(_FORM | {"cache": True}))
#: What is called by other kernels alone: what leads into it from Python is not compiled.
inner = njit(**(_FORM | {"no_cpython_wrapper": True}))
#: What is written into its callers: so that numbers stay in registers, or because it returns a part of an array.
merged = njit(**(_FORM | {"inline": "always"}))

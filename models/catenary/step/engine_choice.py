"""The choice of a step engine.

``OPENPANTO_KERNEL=numpy`` keeps to NumPy and SciPy; ``numba`` insists on the kernels; by default they are used if
numba is installed.
"""

from __future__ import annotations

import os
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from models.catenary.linear_motion.step_matrices import StepMatrices
from models.catenary.step.numba_engine import NumbaEngine, UnsuitedError
from models.catenary.step.numpy_engine import NumpyEngine
from models.catenary.step.step_engine import StepEngine
from models.numerics.kernel_cache import SWITCH, KernelError, load_kernels

if TYPE_CHECKING:  # an FMU carries what is imported, and this is never imported by its name
    from models.catenary.step import step_kernels as _  # noqa: F401

#: Read now: an FMU's folder may be gone when a second instance asks for the kernels.
_SOURCE = Path(__file__).with_name("step_kernels.py").read_bytes()


def make_engine(matrices: StepMatrices) -> StepEngine:
    """Return the fastest step engine that this machine has for a line.

    Raises
    ------
    KernelError
        If the environment asks for kernels that cannot be had, or for ones that do not exist.
    """
    wanted = os.environ.get(SWITCH, "auto")
    if wanted not in ("auto", "numpy", "numba"):
        raise KernelError(f"{SWITCH} is '{wanted}'; use auto, numpy or numba")
    if wanted == "numpy":
        return NumpyEngine(matrices)
    try:
        return NumbaEngine(matrices, kernels())
    except (ImportError, UnsuitedError) as error:
        if wanted == "numba":
            raise KernelError(f"{SWITCH} is 'numba', but {error}") from error
        return NumpyEngine(matrices)


def kernels() -> ModuleType:
    """Return the compiled kernels.

    Raises
    ------
    ImportError
        If numba is not installed, or no folder can hold their source.
    """
    return load_kernels("kernels", _SOURCE)

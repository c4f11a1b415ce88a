"""The choice of a step engine.

``OPENPANTO_KERNEL=numpy`` keeps to NumPy and SciPy; ``numba`` insists on the kernels; by default they are used if
numba is installed.
"""

from __future__ import annotations

from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from models.catenary.linear_motion.step_matrices import StepMatrices
from models.catenary.step.compiled_line_step import CompiledLineStep, UnsuitedError
from models.catenary.step.plain_step import PlainStep
from models.catenary.step.step_engine import StepEngine, SteppedLine
from models.numerics.kernel_cache import SWITCH, KernelError, joined, load_kernels, wanted_kernels
from models.numerics.newmark import Newmark

if TYPE_CHECKING:  # an FMU carries what is imported, and this and what it imports are never imported by their names
    from models.catenary.step import step_kernels as _  # noqa: F401

#: The kernels, each after those that it calls.
KERNEL_FILES = tuple(
    Path(__file__).with_name(f"{part}_kernels.py")
    for part in ("vector", "attachment", "mode", "contact", "law", "local", "step")
)
#: Read now: an FMU's folder may be gone when a second instance asks for the kernels.
_SOURCE = joined(KERNEL_FILES)


def make_engine(line: SteppedLine, newmark: Newmark) -> StepEngine:
    """Return the fastest step engine that this machine has for a line.

    Raises
    ------
    KernelError
        If the environment asks for kernels that cannot be had, or for ones that do not exist.
    numpy.linalg.LinAlgError
        If the line cannot make steps of this length.
    """
    wanted = wanted_kernels()
    matrices = StepMatrices(line.modes, newmark)
    if wanted == "numpy":
        return PlainStep(line, matrices)
    try:
        return CompiledLineStep(line, matrices, kernels())
    except (ImportError, UnsuitedError) as error:
        if wanted == "numba":
            raise KernelError(f"{SWITCH} is 'numba', but {error}") from error
        return PlainStep(line, matrices)


def kernels() -> ModuleType:
    """Return the compiled kernels.

    Raises
    ------
    ImportError
        If numba is not installed, or no folder can hold their source.
    """
    return load_kernels("kernels", _SOURCE)

"""Types of arrays, and of a model's whole state as arrays."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
ComplexArray = npt.NDArray[np.complex128]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

#: A model's whole state, bit for bit: name -> array.
Snapshot = dict[str, npt.NDArray[np.generic]]

"""The step of a line in compiled kernels, where numba is there: the same figures, two to three times as fast.

``OPENPANTO_KERNEL=numpy`` keeps to NumPy and SciPy; ``numba`` insists on the kernels; by default they are used if
numba is installed.
"""

from __future__ import annotations

import atexit
import hashlib
import importlib.util
import os
import shutil
import sys
import tempfile
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.sparse as sp

from models.catenary.band import Banded
from models.catenary.contact_wire import ContactWire, Crossing, Touch
from models.catenary.interval_modes import IntervalModes
from models.catenary.stepping import LineMotion, Stepper
from models.part import FloatArray
from models.time_integration import Newmark

if TYPE_CHECKING:  # an FMU carries what is imported, and this is never imported by its name
    from models.catenary import kernels as _  # noqa: F401

_SWITCH = "OPENPANTO_KERNEL"
#: Chunks of a group, 15 modes each as a rule.
_GROUP = 24
#: Read now: an FMU's folder may be gone when a second instance asks for the kernels.
_SOURCE = Path(__file__).with_name("kernels.py").read_bytes()


class KernelError(RuntimeError):
    """The compiled kernels were asked for and are not to be had."""


def make_stepper(modes: IntervalModes, newmark: Newmark) -> Stepper:
    """Return the fastest stepper that this machine has for a line.

    Raises
    ------
    KernelError
        If the environment asks for kernels that cannot be had, or for ones that do not exist.
    """
    wanted = os.environ.get(_SWITCH, "auto")
    if wanted not in ("auto", "numpy", "numba"):
        raise KernelError(f"{_SWITCH} is '{wanted}'; use auto, numpy or numba")
    if wanted == "numpy":
        return Stepper(modes, newmark)
    try:
        return CompiledStepper(modes, newmark, kernels())
    except (ImportError, _UnsuitedError) as error:
        if wanted == "numba":
            raise KernelError(f"{_SWITCH} is 'numba', but {error}") from error
        return Stepper(modes, newmark)


def kernels() -> ModuleType:
    """Return the compiled kernels.

    What numba compiles it keeps beside the source, and knows it again by its path. FMUs are unpacked somewhere new
    every time, so the source is taken from a copy in the user's cache, named by its content.

    Raises
    ------
    ImportError
        If numba is not installed.
    """
    if importlib.util.find_spec("numba") is None:
        raise ImportError("numba is not installed; pip install numba")
    key = hashlib.sha256(_SOURCE + sys.version.encode()).hexdigest()[:16]
    name = f"openpanto_kernels_{key}"
    found = sys.modules.get(name)
    return _load(name, _cached(_SOURCE, key)) if found is None else found


def _load(name: str, path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    sys.modules[name] = module
    return module


def _cached(source: bytes, key: str) -> Path:
    """Return a copy of the kernels' source in the user's cache, or in a folder of this process alone."""
    copy = _cache_folder() / "openpanto" / f"kernels-{key}" / "kernels.py"
    try:
        if not copy.is_file() or copy.read_bytes() != source:
            copy.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
            part = copy.with_name(f"kernels.{os.getpid()}.part")
            part.write_bytes(source)
            part.replace(copy)
    except OSError:
        folder = tempfile.mkdtemp(prefix="openpanto-")
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        copy = Path(folder) / "kernels.py"
        copy.write_bytes(source)
    return copy


def _cache_folder() -> Path:
    """Return where this user's programs keep what they can make again."""
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", "~")).expanduser()
    return Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache").expanduser()


class _UnsuitedError(Exception):
    """A line that the kernels are not made for: too short, or too wide a band."""


class CompiledStepper(Stepper):
    """A stepper whose two halves are compiled.

    Parameters
    ----------
    modes : IntervalModes
    newmark : Newmark
    module : module
        The kernels.
    """

    def __init__(self, modes: IntervalModes, newmark: Newmark, module: ModuleType) -> None:
        self.kernels: ModuleType = module
        super().__init__(modes, newmark)

    def _set_up(self, coupling: sp.csr_matrix) -> None:
        if not isinstance(self.factor, Banded) or coupling.shape[1] < self.kernels.WIDTH:
            raise _UnsuitedError("the line's attachments are not a band, or too few")
        modes, newmark = self.modes, self.newmark
        chunks, values = _chunks(modes, coupling, self.kernels.WIDTH)
        band = _Twisted(self.factor)
        mu = self._mu[chunks[:, 0].astype(np.int64)]
        rates = np.stack([newmark.a1 / mu, np.full(len(mu), newmark.a2), newmark.a2 / mu], axis=1)
        self._modes = (
            _groups(chunks, rates), chunks, rates, values, self._from_modal, self.inverse, np.zeros(len(self.modal)),
        )  # fmt: skip
        own = sp.triu(-2.0 * modes.K + 1j * newmark.a2 * modes.M)  # both on one pattern
        rows, columns, entries = _pattern(own)
        self._first = (
            *_pattern(modes.turn.T), rows, columns, np.stack([entries.real, entries.imag], axis=1),
            band.top, band.bottom, band.middle, band.size,
        )  # fmt: skip
        self._last = *_pattern(modes.turn), *self._modes, newmark.a1
        self._band_work = np.zeros((2, int(band.size[0] + band.size[2])))

    def begin(self, motion: LineMotion, pressed: FloatArray) -> None:
        """Find the changes of this step without forces on intervals; see `Stepper.begin`."""
        if not motion.prepared.size or motion.prepared[0] != self.newmark.step:
            motion.prepared = np.empty(1 + len(self.inverse) + len(self._ends))
            motion.prepared[0] = self.newmark.step
            self.kernels.prepare(*self._modes, motion.modal, motion.momentum, *self._parts(motion))
        self.modal, pull = self._parts(motion)
        self.kernels.attachments(
            *self._first, motion.attached, pressed, pull, self._right, self._band_work, self.attached
        )

    def finish(self, motion: LineMotion) -> None:
        """Let the intervals follow their attachments, and replace the motion by that at the end of the step."""
        self.kernels.finish(
            *self._last, self.attached, self._ends,
            motion.modal, motion.momentum, motion.attached, *self._parts(motion),
        )  # fmt: skip

    def place(
        self, wire: ContactWire, crossing: Crossing, touch: Touch, motion: LineMotion, point: FloatArray
    ) -> None:
        """Put a point of a wire into ``point``, shape (3,) [m]."""
        interval = touch.interval
        self.kernels.place(
            interval.plan, interval.plan_static, touch.row, touch.height, interval.modes.start, interval.count,
            interval.ends, motion.modal, motion.attached, crossing.element - interval.first, crossing.xi, point,
        )  # fmt: skip

    def _parts(self, motion: LineMotion) -> tuple[FloatArray, FloatArray]:
        """Return the prepared changes of the modal amplitudes and pulls on the ends, views."""
        return motion.prepared[1 : 1 + len(self.inverse)], motion.prepared[1 + len(self.inverse) :]



_Pattern = tuple[Any, Any, FloatArray]


def _pattern(matrix: sp.spmatrix) -> _Pattern:
    """Return a matrix compressed by rows, with unsigned indices; short ones, as what is read sets the pace."""
    rows = sp.csr_matrix(matrix)
    rows.sort_indices()
    return rows.indptr.astype(np.uint32), rows.indices.astype(np.uint32), rows.data


def _chunks(modes: IntervalModes, coupling: sp.csr_matrix, width: int) -> tuple[Any, FloatArray]:
    """Return the coupling in chunks of modes by ``width`` ends, and where each belongs."""
    rows, values, entry = [], [np.zeros(0)], 0
    for first, count in sorted((int(a), b.modes.shape[1]) for b in modes.blocks for a in b.modes[:, 0]):
        part = coupling[first : first + count]
        low, high = (int(part.indices.min()), int(part.indices.max()) + 1) if part.nnz else (0, 1)
        for start in range(low, high, width):
            at = min(start, coupling.shape[1] - width)
            dense = part[:, at : at + width].toarray()
            dense[:, : start - at] = 0.0  # columns of the chunk before
            values.append(dense.ravel())
            rows.append((first, count, at, entry))
            entry += dense.size
    return np.array(rows, dtype=np.uint64).reshape(-1, 4), np.concatenate(values)


def _groups(chunks: Any, rates: FloatArray) -> Any:
    """Return where groups of chunks begin and end: not between chunks of the same modes, and of equal rates."""
    result, begin = [], 0
    for k in range(1, len(chunks) + 1):
        full = k - begin >= _GROUP
        if k == len(chunks) or ((full or (rates[k] != rates[k - 1]).any()) and chunks[k, 0] != chunks[k - 1, 0]):
            result.append((begin, k))
            begin = k
    return np.array(result, dtype=np.uint64).reshape(-1, 2)


class _Twisted:
    """A band factorised from both ends towards the middle.

    Attributes
    ----------
    top, bottom, middle, size
        See `models.catenary.kernels.solve`.
    """

    def __init__(self, factor: Banded) -> None:
        matrix, width = factor.matrix, factor.factor.shape[0] - 1
        n = matrix.shape[0]
        if n < 2 * width + 2:
            raise _UnsuitedError("the line is too short for them")
        p = (n - width + 1) // 2
        q = n - width - p
        between = slice(p, p + width)
        upper, lower = matrix[: p + width, : p + width], matrix[p:, p:][::-1, ::-1]
        first, last = self._half(upper, width), self._half(lower, width)
        left = _lower(first[p:])
        right = _lower(last[q:])[::-1, ::-1]
        rest = left @ left.T + right @ right.T - matrix[between, between].toarray()
        inverse = np.linalg.inv(rest)
        self.middle = np.ascontiguousarray(0.5 * (inverse + inverse.T))
        self.top, self.bottom = (_inverted(half[:count]) for half, count in ((first, p), (last, q)))
        self.size = np.array([p, q, width, width + 1], dtype=np.uint64)

    @staticmethod
    def _half(part: sp.spmatrix, width: int) -> FloatArray:
        """Return the Cholesky factor of a part, row j its column from the diagonal down, shape (n, width + 1)."""
        return np.ascontiguousarray(Banded(part.tocoo(), width).factor.T)


def _lower(rows: FloatArray) -> FloatArray:
    """Return the last rows of a band factor as a dense lower triangle."""
    n = len(rows)
    result = np.zeros((n, n))
    for j, column in enumerate(rows):
        result[j:, j] = column[: n - j]
    return result


def _inverted(rows: FloatArray) -> FloatArray:
    """Return the rows with the inverse of the diagonal in its place."""
    result = rows.copy()
    result[:, 0] = 1.0 / result[:, 0]
    return result.ravel()

"""Files that the verbs write: each replaces the old one as a whole or leaves it, and every error names its file.

`master.safety.safe_files` writes a run's files by the same rules; the packages do not import each other's tools, so
the few lines stand in both.
"""

from __future__ import annotations

import errno
import io
import os
import textwrap
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from models.arrays import BoolArray, FloatArray
from models.definition_files.message_text import said
from models.definition_files.parameter import ParameterError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: What a file that is being written is called.
_PART: Final = ".part"
#: Letters of a heading that an inch of a figure's width holds.
_LETTERS_PER_INCH: Final = 9.5
#: An axis spans at least this share of the largest value.
_LEAST_SHARE: Final = 0.02


def write_atomically(path: Path, data: bytes) -> None:
    """Write a file in one go: readers see the old one or the new one, never half of it.

    Raises
    ------
    OSError
        That names the file, if it cannot be written; the old one is still there then.
    """
    # A device, such as /dev/null, would be replaced by a file for all users of the computer.
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise OSError(errno.EEXIST, "this is not a file and is left alone; choose another", str(path))
    temporary = path.with_name(f".{path.name}.{os.getpid()}{_PART}")  # two commands do not mix
    try:
        with temporary.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
    except OSError as error:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
        raise OSError(error.errno, error.strerror or str(error), str(path)) from error


def write_text(path: Path, text: str) -> None:
    """Write a text file in one go."""
    write_atomically(path, text.encode())


def write_csv(path: Path, names: Sequence[str], columns: Sequence[FloatArray | BoolArray], digits: int = 9) -> None:
    """Write columns of numbers under their names, with so many significant digits."""
    text = io.StringIO()
    np.savetxt(text, np.column_stack(columns), delimiter=",", header=",".join(names), comments="", fmt=f"%.{digits}g")
    write_text(path, text.getvalue())


def write_figure(path: Path, figure: Figure, dpi: int) -> None:
    """Write a figure in the format that the ending of its name says.

    Raises
    ------
    ParameterError
        If there is no such format.
    """
    buffer = io.BytesIO()
    figure.savefig(buffer, format=check_figure(path), dpi=dpi)
    write_atomically(path, buffer.getvalue())


def set_heading(figure: Figure, text: str) -> None:
    """Put a heading over a figure, broken into lines that fit its width."""
    figure.suptitle(textwrap.fill(text, int(_LETTERS_PER_INCH * figure.get_figwidth()), break_long_words=False))


def show_no_noise(axes: Axes, values: FloatArray, unit: str) -> None:
    """Widen an axis over which a value hardly changes, so that rounding errors do not fill it.

    What is drawn spans at least 2 % of the largest value and, of forces and moments, 1 N or 1 N.m.
    """
    least = max(_LEAST_SHARE * float(np.max(np.abs(values), initial=0.0)), 1.0 if unit in ("N", "N.m") else 0.0)
    low, high = axes.get_ylim()
    if high - low < least:
        middle = 0.5 * (low + high)
        axes.set_ylim(middle - 0.5 * least, middle + 0.5 * least)
    axes.ticklabel_format(axis="y", useOffset=False)


def check_figure(path: Path) -> str:
    """Return the format of a figure that the ending of its name says.

    Raises
    ------
    ParameterError
        If there is no such format, or no folder to write the figure into, or one that permissions close.
    """
    from matplotlib.backend_bases import FigureCanvasBase

    known = FigureCanvasBase.get_supported_filetypes()
    kind = path.suffix.lower().removeprefix(".")
    if kind not in known:
        raise ParameterError(f"{path}: a figure must be named .png or .svg, or another of {', '.join(sorted(known))}")
    if not path.parent.is_dir():
        raise ParameterError(f"{path}: there is no folder {path.parent}; make it, or name another place")
    if not os.access(path.parent, os.W_OK):
        raise ParameterError(f"{path}: {said(PermissionError(errno.EACCES, ''))}")
    return kind

"""Columns of the physics as pandas data frames, each with its unit in its title."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from models.arrays import BoolArray, FloatArray

if TYPE_CHECKING:
    import pandas


def column_frame(
    titles: Sequence[str], columns: Sequence[FloatArray | BoolArray], is_indexed: bool = False
) -> pandas.DataFrame:
    """Return columns under their titles; the first one may be the index.

    Raises
    ------
    ImportError
        If pandas is not installed.
    """
    try:
        import pandas
    except ImportError as error:
        raise ImportError("data frames need pandas: pip install 'openpanto[pandas]'") from error
    frame = pandas.DataFrame(dict(zip(titles, columns, strict=True)))
    return frame.set_index(titles[0]) if is_indexed else frame

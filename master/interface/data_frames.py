"""Tables and time series as pandas data frames, each column with its unit in its title."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from master.arrays import BoolArray, FloatArray
from master.errors import MasterError

if TYPE_CHECKING:
    import pandas

MISSING = "data frames need pandas: pip install 'openpanto[pandas]'"


def load_pandas() -> Any:
    """Return the module pandas.

    Raises
    ------
    MasterError
        If it is not installed.
    """
    try:
        import pandas
    except ImportError as error:
        raise MasterError(MISSING) from error
    return pandas


def time_frame(titles: Sequence[str], columns: Sequence[FloatArray | BoolArray]) -> pandas.DataFrame:
    """Return columns over time, the first of which is the index."""
    pandas = load_pandas()
    index = pandas.Index(columns[0], name=titles[0])
    return pandas.DataFrame(dict(zip(titles[1:], columns[1:], strict=True)), index=index)


def table_frame(heads: Sequence[str], rows: Sequence[Sequence[object]], index: str = "") -> pandas.DataFrame:
    """Return rows under their heads; the column ``index``, if there is one, becomes the index."""
    frame = load_pandas().DataFrame.from_records(list(rows), columns=list(heads))
    return frame.set_index(index) if index else frame


def columns_frame(columns: Mapping[str, Sequence[object]]) -> pandas.DataFrame:
    """Return columns under their titles."""
    return load_pandas().DataFrame(dict(columns))


def side_by_side(columns: Mapping[str, Mapping[str, float]], index: str) -> pandas.DataFrame:
    """Return figures by name, a column for each of several things."""
    frame = load_pandas().DataFrame(dict(columns))
    frame.index.name = index
    return frame

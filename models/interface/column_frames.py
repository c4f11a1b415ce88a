"""Columns of the physics as pandas data frames, each with its unit in its title."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from models.arrays import BoolArray, FloatArray
from models.definition_files.parameter import ParameterError

if TYPE_CHECKING:
    import pandas


#: A table: titles with units, and columns.
Table = tuple[tuple[str, ...], tuple[FloatArray | BoolArray, ...]]


def table_frame(tables: Mapping[str, Table], name: str, is_indexed: bool = False) -> pandas.DataFrame:
    """Return one of some tables; its first column may be the index.

    Raises
    ------
    ParameterError
        If there is no such table.
    ImportError
        If pandas is not installed.
    """
    if name not in tables:
        raise ParameterError(f"there is no table '{name}'; there are {', '.join(tables)}")
    return column_frame(*tables[name], is_indexed)


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

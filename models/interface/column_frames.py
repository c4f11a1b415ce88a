"""Columns of the physics as pandas data frames, each with its unit in its title."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, ClassVar

from models.arrays import BoolArray, FloatArray
from models.definition_files.parameter import ParameterError

if TYPE_CHECKING:
    import pandas


#: A table: titles with units, and columns.
Table = tuple[tuple[str, ...], tuple[FloatArray | BoolArray, ...]]


class Tabled(ABC):
    """What can be had as tables, and each of them as a data frame."""

    #: Whether the first column is the index of its data frame.
    is_indexed: ClassVar[bool] = False

    @property
    @abstractmethod
    def tables(self) -> Mapping[str, Table]:
        """Columns by name."""

    def frame(self, name: str | None = None) -> pandas.DataFrame:
        """Return one of the `tables`, by default the first, as a data frame (needs pandas).

        Raises
        ------
        ParameterError
            If there is no such table.
        ImportError
            If pandas is not installed.
        """
        tables = self.tables
        chosen = next(iter(tables)) if name is None else name
        if chosen not in tables:
            raise ParameterError(f"there is no table '{chosen}'; there are {', '.join(tables)}")
        return column_frame(*tables[chosen], self.is_indexed)


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

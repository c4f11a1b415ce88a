"""Time series as Parquet: the columns of the CSV files, one row per time."""

from __future__ import annotations

from pathlib import Path

from master.errors import MasterError
from master.recording.recording import TIMESERIES, Recording, header, load
from master.results.results_folder import FORCES
from master.safety.safe_files import atomic_file


def write_parquet(folder: Path) -> tuple[Path, ...]:
    """Write a ``.parquet`` file beside every time series of a run and its ``contact_force.csv``; return their paths.

    The titles are those of the CSV files, with units in brackets; there is no index column.

    Raises
    ------
    MasterError
        If pyarrow is not installed.
    """
    sources = [folder / TIMESERIES, *sorted(p for p in folder.glob("timeseries*.csv") if p.name != TIMESERIES)]
    sources += [folder / FORCES] if (folder / FORCES).is_file() else []
    return tuple(_write(load(source), source.with_suffix(".parquet")) for source in sources)


def _write(recording: Recording, path: Path) -> Path:
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError as error:
        raise MasterError("Parquet needs pyarrow: pip install 'openpanto[parquet]'") from error
    titles = header(recording.names, recording.units)
    columns = [recording.time, *recording.values.T]
    with atomic_file(path) as temporary:
        parquet.write_table(pyarrow.table(dict(zip(titles, columns, strict=True))), temporary)
    return path

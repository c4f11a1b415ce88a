"""Bands of the contact force over the track: quantiles, position by position, of the runs whose series were kept."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from master.arrays import FloatArray
from master.batch.sweep.pages.sample_statistics import QUANTILES
from master.results.results_folder import FORCES

#: Distance of the positions at which forces are compared [m], and how many there are at most.
_DISTANCE: Final = 0.25
_MOST_POSITIONS: Final = 2000
#: Most runs that a band is made of.
MOST_RUNS: Final = 1000


@dataclass(frozen=True)
class ForceBand:
    """Quantiles of the low-passed contact force over the track.

    Attributes
    ----------
    position : ndarray, shape (n,)
        Along the track [m].
    quantiles : ndarray, shape (3, n)
        Of 5, 50 and 95 % [N].
    runs : int
        How many runs it is made of.
    """

    position: FloatArray
    quantiles: FloatArray
    runs: int


def force_band(folders: Sequence[Path], contact: str, interval: tuple[float | None, float | None]) -> ForceBand | None:
    """Return the band of the runs in some folders, None if fewer than two of them left their force.

    The force is the one that the verdict comes from, at the positions where it counts.

    Parameters
    ----------
    folders : sequence of Path
        Results folders; those that are missing are passed over.
    contact : str
        Beginning of its variables' names.
    interval : (float, float)
        Part of the track [m]; None where it is open.
    """
    found = [s for folder in folders[:MOST_RUNS] if (s := _series(folder / FORCES, contact)) is not None]
    if len(found) < 2:
        return None
    low = min(float(x[0]) for x, _ in found) if interval[0] is None else interval[0]
    high = max(float(x[-1]) for x, _ in found) if interval[1] is None else interval[1]
    if not high > low:
        return None
    count = min(_MOST_POSITIONS, int((high - low) / _DISTANCE) + 1)
    position = np.linspace(low, high, max(count, 2))
    forces = np.array([np.interp(position, x, f, left=np.nan, right=np.nan) for x, f in found])
    there = np.isfinite(forces).sum(axis=0) >= 2
    quantiles = np.full((len(QUANTILES), len(position)), np.nan)
    quantiles[:, there] = np.nanquantile(forces[:, there], QUANTILES, axis=0)
    return ForceBand(position, quantiles, len(found))


def _series(path: Path, contact: str) -> tuple[FloatArray, FloatArray] | None:
    """Return rising positions and forces of a contact where they count, None if the file does not have them."""
    try:
        with path.open(encoding="utf-8", newline="") as file:
            heads = next(csv.reader(file), [])
            columns = _columns(heads, contact)
            if columns is None:
                return None
            table = np.loadtxt(file, delimiter=",", usecols=columns, ndmin=2)
    except (OSError, ValueError):
        return None
    position, force = table[table[:, 2] > 0.5, :2].T
    order = np.argsort(position, kind="stable")
    return (position[order], force[order]) if len(position) > 1 else None


def _columns(heads: Sequence[str], contact: str) -> tuple[int, int, int] | None:
    """Return the columns of position, force and what counts of a contact."""
    names = (f"{contact}.track_position [m]", f"{contact}.filtered_force [N]", f"{contact}.in_interval")
    if not all(name in heads for name in names):
        return None
    return (heads.index(names[0]), heads.index(names[1]), heads.index(names[2]))

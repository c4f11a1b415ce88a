"""A measured contact force beside the simulated one."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from master.arrays import BoolArray, FloatArray
from master.errors import MasterError
from master.quality import low_pass
from master.report.charts import Axes, Chart, Curve, curve_trace
from master.report.signals import Signals

_TITLE: Final = re.compile(r"(?P<name>.*?)\s*(?:[\[(](?P<unit>[^\])]*)[\])])?\s*")
_POSITIONS: Final = ("x", "position", "track position", "distance", "chainage", "km")
_TIMES: Final = ("t", "time")
_FORCES: Final = ("f", "fc", "force", "contact force")
_FACTORS: Final = {"m": 1.0, "km": 1e3, "s": 1.0, "ms": 1e-3, "n": 1.0, "kn": 1e3, "": 1.0}


@dataclass(frozen=True)
class Measurement:
    """A measured contact force.

    Attributes
    ----------
    source : str
        File name.
    over_time : bool
        Whether the abscissa is time [s]; otherwise track position [m].
    abscissa, force : ndarray, shape (n,)
        Increasing abscissa and force [N].
    """

    source: str
    over_time: bool
    abscissa: FloatArray
    force: FloatArray


@dataclass(frozen=True)
class Comparison:
    """Measured and simulated 0-20 Hz force at the same instants.

    Attributes
    ----------
    source : str
        File name of the measurement.
    pantograph : str
        The simulated one.
    position, simulated, measured : ndarray, shape (n,)
        Track position [m] and forces [N] where both are known within the interval of interest.
    """

    source: str
    pantograph: str
    position: FloatArray
    simulated: FloatArray
    measured: FloatArray

    @property
    def start(self) -> float:
        """First track position compared [m]."""
        return float(self.position[0])

    @property
    def end(self) -> float:
        """Last track position compared [m]."""
        return float(self.position[-1])

    @property
    def correlation(self) -> float | None:
        """Pearson's coefficient, None where a force is constant."""
        if min(self.simulated.std(), self.measured.std()) <= 1e-9:
            return None
        return float(np.corrcoef(self.simulated, self.measured)[0, 1])

    @property
    def rms(self) -> float:
        """Root mean square difference [N]."""
        return float(np.sqrt(np.mean((self.simulated - self.measured) ** 2)))


def read_measured(path: Path) -> Measurement:
    """Read a CSV file with a header: one column of position or time, one of force; units in brackets.

    Positions may be in m or km, times in s or ms, forces in N or kN. Columns are separated by commas or
    semicolons; further columns are left out.

    Raises
    ------
    MasterError
        If it cannot be read, a column is missing, or the abscissa does not increase.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise MasterError(f"{path} cannot be read ({error})") from error
    separator = ";" if lines and ";" in lines[0] else ","
    rows = [row for row in csv.reader(lines, delimiter=separator) if any(cell.strip() for cell in row)]
    titles = [_title(t) for t in rows[0]] if rows else []
    place, over_time = _abscissa(path, titles)
    force = _find(titles, _FORCES)
    if force is None:
        raise MasterError(f"{path} has no column named force (e.g. 'force [N]')")
    values = [_column(path, rows[1:], i, _factor(path, titles[i])) for i in (place, force)]
    return _checked(path, over_time, *values)


def _title(title: str) -> tuple[str, str]:
    match = _TITLE.fullmatch(title.strip())
    return (match["name"].lower(), (match["unit"] or "").lower()) if match else (title.lower(), "")


def _abscissa(path: Path, titles: Sequence[tuple[str, str]]) -> tuple[int, bool]:
    for names, over_time in ((_POSITIONS, False), (_TIMES, True)):
        found = _find(titles, names)
        if found is not None:
            return found, over_time
    raise MasterError(f"{path} has no column named position or time (e.g. 'position [m]', 'time [s]')")


def _find(titles: Sequence[tuple[str, str]], names: Sequence[str]) -> int | None:
    return next((i for i, (name, _) in enumerate(titles) if name in names), None)


def _factor(path: Path, title: tuple[str, str]) -> float:
    name, unit = title
    if name == "km":
        return 1e3
    if unit not in _FACTORS:
        raise MasterError(f"{path}: column '{name}' has the unit '{unit}'; m, km, s, ms, N or kN are known")
    return _FACTORS[unit]


def _column(path: Path, rows: Sequence[Sequence[str]], index: int, factor: float) -> FloatArray:
    try:
        return factor * np.array([float(row[index]) for row in rows])
    except (ValueError, IndexError) as error:
        raise MasterError(f"{path}: column {index + 1} is not a column of numbers ({error})") from error


def _checked(path: Path, over_time: bool, abscissa: FloatArray, force: FloatArray) -> Measurement:
    if len(abscissa) < 3 or not (np.isfinite(abscissa).all() and np.isfinite(force).all()):
        raise MasterError(f"{path} must hold at least three rows of finite numbers")
    if np.any(np.diff(abscissa) <= 0.0):
        raise MasterError(f"{path}: the {'times' if over_time else 'positions'} do not increase from row to row")
    return Measurement(path.name, over_time, abscissa, force)


def compare_measured(s: Signals, measurement: Measurement) -> Comparison:
    """Put a measurement beside a simulated contact; both are low-passed to 0-20 Hz.

    The measured force is brought to the simulation's instants, then filtered as the simulated one is.

    Raises
    ------
    MasterError
        If it does not overlap the interval of interest.
    """
    there = s.time if measurement.over_time else s.position
    known = (there >= measurement.abscissa[0]) & (there <= measurement.abscissa[-1])
    both = known & s.inside & np.isfinite(s.shown)
    if np.count_nonzero(both) < 3:
        first, last = measurement.abscissa[0], measurement.abscissa[-1]
        unit = "s" if measurement.over_time else "m"
        raise MasterError(
            f"{measurement.source} ({first:g} {unit} to {last:g} {unit}) lies outside the interval of interest"
        )
    filtered = _filtered(s, measurement, there, known)
    return Comparison(measurement.source, s.contact.pantograph, s.position[both], s.filtered[both], filtered[both])


def _filtered(s: Signals, measurement: Measurement, there: FloatArray, known: BoolArray) -> FloatArray:
    filtered = np.full(len(there), np.nan)
    filtered[known] = low_pass(np.interp(there[known], measurement.abscissa, measurement.force), s.step)
    return filtered


def comparison_rows(c: Comparison) -> list[tuple[str, ...]]:
    """Return mean, sigma, extremes of both and their difference, and the correlation."""
    figures = (
        ("mean force [N]", np.mean),
        ("standard deviation [N]", np.std),
        ("maximum [N]", np.max),
        ("minimum [N]", np.min),
    )
    rows: list[tuple[str, ...]] = []
    for name, figure in figures:
        one, two = float(figure(c.simulated)), float(figure(c.measured))
        rows.append((name, f"{one:.1f}", f"{two:.1f}", f"{one - two:+.1f}"))
    rows.append(("rms difference [N]", "", "", f"{c.rms:.1f}"))
    rows.append(("correlation", "", "", "-" if c.correlation is None else f"{c.correlation:.3f}"))
    return rows


def comparison_chart(c: Comparison) -> Chart:
    """Return both forces over track position."""
    traces = [
        curve_trace(c.position, c.simulated, Curve(0, f"simulated, {c.pantograph}", 2.2)),
        curve_trace(c.position, c.measured, Curve(1, "measured", 1.6)),
    ]
    layout = Axes("track position of the contact [m]", "contact force, 0-20 Hz [N]").layout()
    return Chart("measured_force", "Contact force, measured and simulated", {"data": traces, "layout": layout})

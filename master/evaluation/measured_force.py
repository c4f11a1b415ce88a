"""A measured contact force beside the simulated one: read, filtered alike, compared."""

from __future__ import annotations

import csv
import itertools
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from master.arrays import BoolArray, FloatArray
from master.errors import MasterError, not_utf8, one_line, said
from master.evaluation.contact_signals import Signals
from master.evaluation.filters import low_pass

_TITLE: Final = re.compile(r"(?P<name>.*?)\s*(?:[\[(](?P<unit>[^\])]*)[\])])?\s*")
_POSITIONS: Final = ("x", "position", "track position", "distance", "chainage", "km")
_TIMES: Final = ("t", "time")
_FORCES: Final = ("f", "fc", "force", "contact force")
#: Units of each kind of column and their factors.
_LENGTHS: Final = {"m": 1.0, "km": 1e3, "": 1.0}
_DURATIONS: Final = {"s": 1.0, "ms": 1e-3, "": 1.0}
_NEWTONS: Final = {"n": 1.0, "dan": 10.0, "kn": 1e3, "": 1.0}
#: What begins a line that is a comment.
_COMMENTS: Final = ("#", "%", "//")
#: Magnitude beyond which no time, position or force lies; sums and squares stay finite.
_LARGEST: Final = 1e12
#: Share of the interval of interest that counts as all of it: rows of a measurement seldom lie on its ends.
_WHOLE: Final = 0.99
#: How many times the simulated force a measured one may be before its unit is doubted.
_MANY: Final = 5.0
_SPELLED: Final = {"m": "m", "km": "km", "s": "s", "ms": "ms", "n": "N", "dan": "daN", "kn": "kN"}


@dataclass(frozen=True)
class Measurement:
    """A measured contact force.

    Attributes
    ----------
    source : str
        File name.
    over_time : bool
        Whether the abscissa is time [s] rather than track position [m].
    abscissa, force : ndarray, shape (n,)
        Increasing abscissa, or falling position, and force [N].
    """

    source: str
    over_time: bool
    abscissa: FloatArray
    force: FloatArray

    @property
    def falls(self) -> bool:
        """Whether positions fall from row to row, as where a train runs against the kilometrage."""
        return bool(self.abscissa[-1] < self.abscissa[0])


@dataclass(frozen=True)
class MeasuredComparison:
    """Measured and simulated low-passed force at the same instants.

    Attributes
    ----------
    source : str
        File name of the measurement, and how its abscissa was moved.
    pantograph : str
        The simulated one.
    position, simulated, measured : ndarray, shape (n,)
        Track position [m] and forces [N] where both are known within the interval of interest.
    part : str
        Which part of the interval of interest that is; empty if it is all of it.
    coarse : str
        A warning if the rows of the measurement are too far apart for the band of the filter; else empty.
    """

    source: str
    pantograph: str
    position: FloatArray
    simulated: FloatArray
    measured: FloatArray
    part: str = ""
    coarse: str = ""

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a reader has to know beyond the figures."""
        return tuple(filter(None, (self.part, self.coarse, self.size)))

    @property
    def size(self) -> str:
        """A warning if one force is many times the other, as in another unit than its column says; else empty."""
        measured, simulated = (float(np.abs(force).mean()) for force in (self.measured, self.simulated))
        if min(measured, simulated) <= 0.0 or 1.0 / _MANY < measured / simulated < _MANY:
            return ""
        return f"the measured force is {measured / simulated:.3g} times the simulated one: check the unit of its column"

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

    Positions may be in m or km, times in s or ms, forces in N, daN or kN. Columns are separated by commas, semicolons
    or tabs; further columns, and lines that begin with ``#``, ``%`` or ``//``, are ignored. Numbers may have a decimal
    comma. Positions may fall.

    Raises
    ------
    MasterError
        If it cannot be read, a column is missing, present twice or in another unit, a cell is not a finite number,
        or the abscissa does not increase (positions: neither increase nor fall).
    """
    rows = _rows(path)
    titles = [_title(t) for t in rows[0].cells] if rows else []
    place, over_time = _abscissa(path, titles)
    force = _find(path, titles, _FORCES)
    if force is None:
        raise MasterError(f"{path} has no column named force (e.g. 'force [N]'){_instead(titles)}")
    for row in rows[1:]:
        if len(row.cells) < len(titles) or any(map(str.strip, row.cells[len(titles) :])):
            text = f"{path}:{row.line}: has {len(row.cells)} cells, the head has {len(titles)}"
            comma = "; numbers with a decimal comma need columns separated by semicolons or tabs"
            raise MasterError(text + (comma if len(row.cells) == 2 * len(titles) else ""))
    known = _DURATIONS if over_time else _LENGTHS
    factors = (_factor(path, titles[place], known), _factor(path, titles[force], _NEWTONS))
    _check_marks(path, rows[1:], (place, force))
    values = [_column(path, rows[1:], i, f) for i, f in zip((place, force), factors, strict=True)]
    return _checked(path, over_time, rows[1:], *values)


@dataclass(frozen=True)
class _Row:
    """A row that is not empty, with the line of the file that it ends on; its numbers may have a decimal comma."""

    line: int
    cells: list[str]
    may_have_comma: bool


def _rows(path: Path) -> list[_Row]:
    try:
        lines = [_without_comment(line) for line in path.read_text(encoding="utf-8-sig").splitlines()]
        head = next(filter(None, lines), "")
        mark = next((mark for mark in ";\t" if mark in head), ",")
        reader = csv.reader(lines, delimiter=mark)
        return [_Row(reader.line_num, cells, mark != ",") for cells in reader if any(cell.strip() for cell in cells)]
    except OSError as error:
        raise MasterError(f"{path} cannot be read ({said(error)})") from error
    except UnicodeDecodeError as error:
        raise MasterError(f"{path} {not_utf8(error)}") from error
    except csv.Error as error:
        raise MasterError(f"{path} is not a table of separated values ({error})") from error


def _without_comment(line: str) -> str:
    """Return a line, empty if it is a comment or blank: so that the next ones keep their numbers."""
    return "" if not line.strip() or line.lstrip().startswith(_COMMENTS) else line


def _check_marks(path: Path, rows: Sequence[_Row], columns: Sequence[int]) -> None:
    """Refuse a table with decimal commas in some numbers and points in others: one of them groups thousands."""
    marks: dict[str, int] = {}
    for row, i, mark in itertools.product((row for row in rows if row.may_have_comma), columns, ",."):
        if mark in row.cells[i]:
            marks.setdefault(mark, row.line)
    if len(marks) > 1:
        where = f"a comma in line {marks[',']} and a point in line {marks['.']}"
        raise MasterError(
            f"{path}: numbers have {where}; write all with one decimal mark and nothing between thousands"
        )


def _title(title: str) -> tuple[str, str]:
    match = _TITLE.fullmatch(title.strip())
    return (match["name"].lower(), (match["unit"] or "").lower()) if match else (title.lower(), "")


def _abscissa(path: Path, titles: Sequence[tuple[str, str]]) -> tuple[int, bool]:
    for names, over_time in ((_POSITIONS, False), (_TIMES, True)):
        found = _find(path, titles, names)
        if found is not None:
            return found, over_time
    example = "e.g. 'position [m]', 'time [s]'"
    raise MasterError(f"{path} has no column named position or time ({example}){_instead(titles)}")


def _instead(titles: Sequence[tuple[str, str]]) -> str:
    """Return what a table has instead of a column that is looked for."""
    if not titles:
        return "; it is empty"
    shown = ", ".join(f"'{name}'" for name, _ in titles)
    if all(_is_number(name) for name, _ in titles if name):
        return f"; it begins with {one_line(shown)}: write a line of titles above, as 'position [m],force [N]'"
    return f"; it has {one_line(shown)}: rename the columns"


def _is_number(text: str) -> bool:
    try:
        float(text.replace(",", "."))
    except ValueError:
        return False
    return True


def _find(path: Path, titles: Sequence[tuple[str, str]], names: Sequence[str]) -> int | None:
    found = [i for i, (name, _) in enumerate(titles) if name in names]
    if len(found) > 1:
        columns = " and ".join(f"'{titles[i][0]}' (column {i + 1})" for i in found)
        raise MasterError(f"{path} has several columns of the same meaning: {one_line(columns)}; remove all but one")
    return found[0] if found else None


def _factor(path: Path, title: tuple[str, str], known: Mapping[str, float]) -> float:
    name, unit = title
    if name == "km" and unit == "":
        return 1e3
    if unit not in known:
        units = " or ".join(_SPELLED[u] for u in known if u)
        raise MasterError(f"{path}: column '{name}' has the unit '{one_line(unit)}'; {units} is needed")
    return known[unit]


def _column(path: Path, rows: Sequence[_Row], index: int, factor: float) -> FloatArray:
    return factor * np.array([_number(path, row, index) for row in rows])


def _number(path: Path, row: _Row, index: int) -> float:
    text = row.cells[index].strip()
    try:
        value = float(text.replace(",", ".") if row.may_have_comma else text)
    except ValueError:
        value = math.nan
    # Python accepts 1_000, and the digits of every script; in a table they are typing errors.
    if not abs(value) <= _LARGEST or "_" in text or not text.isascii():
        # In quotation marks between commas it may be a decimal one, or stand between thousands.
        comma = ": write a decimal point, and nothing between thousands" if re.search(r"\d,\d", text) else ""
        raise MasterError(f"{path}:{row.line}: '{one_line(text)}' in column {index + 1} is not a finite number{comma}")
    return value


def _checked(path: Path, over_time: bool, rows: Sequence[_Row], abscissa: FloatArray, force: FloatArray) -> Measurement:
    if len(abscissa) < 3:
        raise MasterError(f"{path} must hold at least three rows of numbers; it holds {len(abscissa)}")
    falls = not over_time and abscissa[-1] < abscissa[0]
    back = np.flatnonzero(np.diff(-abscissa if falls else abscissa) <= 0.0)
    if back.size:
        line, what = rows[int(back[0]) + 1].line, "time" if over_time else "position"
        value = rows[int(back[0]) + 1].cells
        text = (
            f"the {what} does not {'fall' if falls else 'increase'} from the row before ({one_line(', '.join(value))})"
        )
        raise MasterError(f"{path}:{line}: {text}")
    return Measurement(path.name, over_time, abscissa, force)


def placed(s: Signals, measurement: Measurement, offset: float | None) -> Measurement:
    """Return a measurement over the simulation's time or track position, increasing.

    Where one of the two runs to rising positions and the other to falling ones, a position of the simulation is
    ``offset`` less the measured one; otherwise the two are added.

    Raises
    ------
    MasterError
        If they run in opposite directions and no offset is given.
    """
    unit, what = ("s", "times") if measurement.over_time else ("m", "positions")
    is_opposite = not measurement.over_time and measurement.falls != bool(s.position[-1] < s.position[0])
    if is_opposite and offset is None:
        ends = sorted(float(measurement.abscissa[i] + s.position[s.inside][j]) for i in (0, -1) for j in (0, -1))
        raise MasterError(
            f"{measurement.source}: the position {'falls' if measurement.falls else 'rises'}, that of the simulated "
            "pantograph does not; give --measured-offset D, and the track position is D less the measured one "
            f"(D between {ends[0]:g} m and {ends[-1]:g} m)"
        )
    if offset is None:
        moved, source = measurement.abscissa, measurement.source
    elif is_opposite:
        moved, source = offset - measurement.abscissa, f"{measurement.source}, at {offset:g} m less its positions"
    else:
        moved, source = measurement.abscissa + offset, f"{measurement.source}, its {what} {offset:+g} {unit}"
    order = slice(None, None, -1 if moved[-1] < moved[0] else 1)
    return Measurement(source, measurement.over_time, moved[order], measurement.force[order])


def compare_measured(s: Signals, measurement: Measurement, offset: float | None = None) -> MeasuredComparison:
    """Compare a measurement with a simulated contact; both are low-passed with the filter of the run.

    The measured force is interpolated to the instants of the simulation, then filtered as the simulated one is.

    Parameters
    ----------
    s : Signals
    measurement : Measurement
    offset : float, optional
        What is added to the measured times [s] or positions [m]; see `placed`.

    Raises
    ------
    MasterError
        If it does not overlap the interval of interest, or the directions differ without an offset.
    """
    measurement = placed(s, measurement, offset)
    there = s.time if measurement.over_time else s.position
    known = (there >= measurement.abscissa[0]) & (there <= measurement.abscissa[-1])
    both = known & s.inside & np.isfinite(s.shown)
    if np.count_nonzero(both) < 3:
        first, last = measurement.abscissa[0], measurement.abscissa[-1]
        unit = "s" if measurement.over_time else "m"
        raise MasterError(
            f"{measurement.source} ({first:g} {unit} to {last:g} {unit}) lies outside the interval of interest "
            f"({_span(there[s.inside], unit)}); --measured-offset D moves it"
        )
    filtered = _filtered(s, measurement, there, known)
    texts = _part(s, both), _coarse(s, measurement, there, both)
    return MeasuredComparison(
        measurement.source, s.contact.pantograph, s.position[both], s.filtered[both], filtered[both], *texts
    )


def _span(places: FloatArray, unit: str) -> str:
    return f"{places.min():g} {unit} to {places.max():g} {unit}" if places.size else "which the run does not reach"


def _part(s: Signals, both: BoolArray) -> str:
    shared, whole = np.count_nonzero(both), np.count_nonzero(s.inside)
    if shared >= _WHOLE * whole:
        return ""
    return f"only {100.0 * shared / whole:.3g} % of the interval of interest is measured: both columns are of that part"


def _coarse(s: Signals, measurement: Measurement, there: FloatArray, both: BoolArray) -> str:
    """Return a warning if neighbouring rows are too far apart to resolve the force up to the cut-off."""
    rows = np.interp(measurement.abscissa, *_increasing(there[both], s.time[both]), left=np.nan, right=np.nan)
    times = np.concatenate(([s.time[both][0]], np.sort(rows[np.isfinite(rows)]), [s.time[both][-1]]))
    longest, needed = float(np.diff(times).max()), 0.5 / s.filter.cutoff
    if longest <= needed * (1.0 + 1e-6):
        return ""
    return (
        f"rows of the measurement lie up to {1e3 * longest:.3g} ms apart; {s.filter.cutoff:g} Hz needs at most "
        f"{1e3 * needed:g} ms: what lies between them is a straight line, and its sigma and extremes are too small"
    )


def _increasing(places: FloatArray, times: FloatArray) -> tuple[FloatArray, FloatArray]:
    order = np.argsort(places, kind="stable")
    return places[order], times[order]


def _filtered(s: Signals, measurement: Measurement, there: FloatArray, known: BoolArray) -> FloatArray:
    filtered = np.full(len(there), np.nan)
    filtered[known] = low_pass(np.interp(there[known], measurement.abscissa, measurement.force), s.step, s.filter)
    return filtered

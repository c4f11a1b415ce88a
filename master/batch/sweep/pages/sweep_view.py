"""A sweep as its page sees it: the table, the parameters, and the limits by which its runs are judged."""

from __future__ import annotations

import csv
import io
import json
import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np

from master.arrays import FloatArray
from master.batch.assessment_figures import FIGURES
from master.batch.sweep.sweep_run import TEXTS, Cell, Row
from master.errors import MasterError
from master.evaluation.en50367_limits import LimitChoice, OwnLimits, limits_at
from master.safety.safe_files import plain_cell
from master.ssp.ssp_units import COMMON, conversion

#: Columns of the table that are read as text, and those that hold no figures.
_TEXTS: Final = (*TEXTS, "passed")
_HEAD: Final = (*_TEXTS, "run", "stop time [s]", "static force [N]")
#: Criterion that judges a figure, by the figure's name.
_JUDGED_BY: Final = {
    "mean": "mean force",
    "sigma": "sigma / mean",
    "sigma / mean": "sigma / mean",
    "maximum": "maximum force",
    "statistical minimum": "statistical minimum",
    "share of loss": "NQ (estimate)",
    "uplift": "uplift at supports",
}
_SEEDS: Final = "seed of random numbers"
_DECIMALS: Final = {name: decimals for name, _, _, decimals in FIGURES}
_TITLE: Final = re.compile(r"(.*?)(?: \[([^\]]*)\])?", re.DOTALL)

#: A table has few speeds and many rows.
_limits_at: Final = lru_cache(maxsize=1024)(limits_at)

Kind = Literal["grid", "sampled", "listed"]


@dataclass(frozen=True)
class SweptColumn:
    """A varied parameter.

    Attributes
    ----------
    title : str
        Head of its column: name and unit.
    kind : str
        Whether its values come from a grid, a distribution or a table.
    targets : tuple of str
        The parameters, ``component.parameter``, that take its values.
    distribution : str
        As a user would write it, if it is sampled; a seed is a sample however its values are listed.
    """

    title: str
    kind: Kind
    targets: tuple[str, ...] = ()
    distribution: str = ""

    @property
    def name(self) -> str:
        """Its name without the unit."""
        return split_title(self.title)[0]

    @property
    def is_seed(self) -> bool:
        """Whether it is the seed of random numbers."""
        return self.distribution == _SEEDS


@dataclass(frozen=True)
class Figure:
    """A column of figures.

    Attributes
    ----------
    title : str
        Head of the column.
    name, unit : str
        The unit is empty for shares.
    decimals : int
    """

    title: str
    name: str
    unit: str
    decimals: int

    @property
    def heading(self) -> str:
        """Its name as a title."""
        return self.name[:1].upper() + self.name[1:]

    @property
    def criterion(self) -> str:
        """The criterion that judges it, empty if there is none."""
        return _JUDGED_BY.get(self.name, "")

    def shown(self, value: float) -> str:
        """Return a value as text."""
        return f"{value:.{self.decimals}f}" if math.isfinite(value) else "-"


@dataclass(frozen=True)
class SweepView:
    """A sweep as its page sees it.

    Attributes
    ----------
    scenario, status, date : str
    parameters : tuple of SweptColumn
    rows : tuple of dict
        The table: a row for each finished run and pantograph.
    runs, finished : int
        Numbers of runs.
    failures : dict
        Reasons why runs failed, by their numbers.
    request : dict
        What was asked for.
    limits : LimitChoice, optional
        By which the runs are judged, if that is known.
    interval : (float, float)
        Of the track, from which figures come [m]; None where it is open.
    speeds : dict
        Speed of each pantograph in the scenario as it is [km/h].
    contacts : dict
        How the names of a pantograph's contact variables begin.
    places : dict
        Description of each parameter that makes a fault act, by its name.
    changes : dict
        Values that all runs have in place of the scenario's (``--set``), as given, by ``component.parameter``.
    folder : Path, optional
        Holds the runs that were kept.
    indices : tuple of dict
        Indices of sensitivity, as in ``sensitivity.json``.
    """

    scenario: str
    status: str
    date: str
    parameters: tuple[SweptColumn, ...]
    rows: tuple[Row, ...]
    runs: int
    finished: int
    failures: Mapping[str, str] = field(default_factory=dict)
    request: Mapping[str, Any] = field(default_factory=dict)
    limits: LimitChoice | None = None
    interval: tuple[float | None, float | None] = (None, None)
    speeds: Mapping[str, float] = field(default_factory=dict)
    contacts: Mapping[str, str] = field(default_factory=dict)
    places: Mapping[str, str] = field(default_factory=dict)
    changes: Mapping[str, str] = field(default_factory=dict)
    folder: Path | None = None
    indices: tuple[Mapping[str, Any], ...] = ()

    @cached_property
    def short_names(self) -> dict[str, str]:
        """The parameters' names, by title, without the first words that nobody needs to tell them apart."""
        words = {p.title: p.name.split(".") for p in self.parameters}
        ends = {t: [".".join(w[k:]) for k in range(len(w))] for t, w in words.items()}
        known = Counter(end for each in ends.values() for end in each)
        return {
            t: next((e for e in reversed(each) if known[e] == 1 and not e.isdigit()), t) for t, each in ends.items()
        }

    def short_title(self, title: str) -> str:
        """Return the short name of a parameter with its unit; other titles as they are."""
        unit = split_title(title)[1]
        name = self.short_names.get(title)
        return title if name is None else f"{name} [{unit}]" if unit else name

    def told(self, title: str, value: Cell) -> str:
        """Return a parameter's value with its name and unit, in few words."""
        unit = split_title(title)[1] if title in self.short_names else ""
        return f"{self.short_names.get(title, title)} {level_text(value)} {unit}".rstrip()

    @cached_property
    def complete(self) -> tuple[Row, ...]:
        """The rows of runs that did not fail."""
        return tuple(row for row in self.rows if row.get("status") == "complete")

    @cached_property
    def pantographs(self) -> tuple[str, ...]:
        """The pantographs, the leading one first; a single empty name if the runs have none."""
        return tuple(dict.fromkeys(str(row.get("pantograph") or "") for row in self.complete))

    def rows_of(self, pantograph: str) -> list[Row]:
        """Return the rows of a pantograph whose runs did not fail."""
        return [row for row in self.complete if str(row.get("pantograph") or "") == pantograph]

    @cached_property
    def figures(self) -> tuple[Figure, ...]:
        """The columns of figures that have a value somewhere."""
        known = {*_HEAD, *(p.title for p in self.parameters)}
        titles = dict.fromkeys(title for row in self.complete for title in row if title not in known)
        return tuple(_figure(t) for t in titles if any(isinstance(row.get(t), float) for row in self.complete))

    def of_kind(self, *kinds: Kind) -> list[SweptColumn]:
        """Return the parameters of some kinds that have more than one value."""
        return [p for p in self.parameters if p.kind in kinds and len({row.get(p.title) for row in self.rows}) > 1]

    def bounds(self, figure: Figure, row: Row) -> tuple[float, float]:
        """Return between which limits a figure of a row has to lie; infinite or NaN where there is none."""
        speed = self._speed(row)
        if self.limits is None or speed is None:
            return -math.inf, math.inf
        at = _limits_at(speed / 3.6, self.limits)
        mean = row.get("mean [N]")
        sigma = at.sigma_share.value * mean if isinstance(mean, float) else math.nan
        return {
            "mean [N]": (at.mean_lower.value, at.mean_upper.value),
            "sigma [N]": (-math.inf, sigma),
            "sigma / mean [1]": (-math.inf, at.sigma_share.value),
            "maximum [N]": (-math.inf, at.maximum.value),
            "statistical minimum [N]": (at.statistical_minimum.value, math.inf),
            "uplift [mm]": (-math.inf, 1e3 * at.uplift.value),
        }.get(figure.title, (-math.inf, math.inf))

    def _speed(self, row: Row) -> float | None:
        """Return the speed of the pantograph of a row [km/h]."""
        pantograph = str(row.get("pantograph") or "")
        for p in self.parameters:
            value = row.get(p.title)
            if f"{pantograph}.speed" in p.targets and isinstance(value, float):
                unit = split_title(p.title)[1] or "m/s"
                found = conversion(COMMON[unit], COMMON["km/h"]) if unit in COMMON else None
                return None if found is None else found(value)
        return self.speeds.get(pantograph)


def failed_limits(row: Row) -> list[str]:
    """Return the names of the limits that a row does not meet."""
    return [name for name in str(row.get("failed limits") or "").split("; ") if name]


def is_judged(row: Row) -> bool:
    """Whether a row has a verdict."""
    return row.get("passed") in ("true", "false")


def values_of(rows: Sequence[Row], title: str) -> FloatArray:
    """Return a column as numbers, NaN where there is none."""
    found = (row.get(title) for row in rows)
    return np.array([v if isinstance(v, float) else math.nan for v in found], dtype=np.float64)


def levels(rows: Iterable[Row], title: str) -> list[float | str]:
    """Return the different values of a column: numbers in their order, texts in that of the table."""
    found = list(dict.fromkeys(v for row in rows if (v := row.get(title)) is not None))
    numbers = [v for v in found if isinstance(v, float)]
    return sorted(numbers) if len(numbers) == len(found) else list(map(str, found))


def level_text(value: Cell) -> str:
    """Return a value of a parameter as text."""
    return f"{value:.6g}" if isinstance(value, float) else "none" if value is None else value


def split_title(title: str) -> tuple[str, str]:
    """Return the name and the unit in the head of a column.

    Examples
    --------
    >>> split_title("sigma / mean [1]"), split_title("fault[1].active")
    (('sigma / mean', '1'), ('fault[1].active', ''))
    """
    match = _TITLE.fullmatch(title)
    assert match is not None
    return match[1], match[2] or ""


def _figure(title: str) -> Figure:
    name, unit = split_title(title)
    return Figure(title, name, "" if unit == "1" else unit, _DECIMALS.get(name, 4))


def view_of(
    data: Mapping[str, Any],
    rows: Sequence[Row],
    folder: Path | None = None,
    indices: Sequence[Mapping[str, Any]] = (),
) -> SweepView:
    """Return the view of a sweep from the contents of ``sweep.json``, its table, and its indices of sensitivity."""
    request, setting = data.get("request", {}), data.get("setting", {})
    limits = setting.get("limits")
    interval = setting.get("interval") or (None, None)
    return SweepView(
        scenario=str(data["scenario"]),
        status=str(data["status"]),
        date=str(data["date"]),
        parameters=tuple(_column(p, request) for p in data["parameters"]),
        rows=tuple(_with_numbers(rows, [str(p["column"]) for p in data["parameters"]])),
        runs=int(data["runs"]),
        finished=int(data["finished"]),
        failures=dict(data.get("failures", {})),
        request=request,
        limits=None if limits is None else LimitChoice(limits["supply"], OwnLimits(**limits["own"])),
        interval=(interval[0], interval[1]),
        speeds=setting.get("speeds", {}),
        contacts=setting.get("contacts", {}),
        places=setting.get("places", {}),
        changes=dict(setting.get("changes", {})),
        folder=folder,
        indices=tuple(indices),
    )


def _column(data: Mapping[str, Any], request: Mapping[str, Any]) -> SweptColumn:
    sampled = data.get("sampled") or ""
    if not sampled and str(data["name"]).rpartition(".")[2] == "seed":
        sampled = _SEEDS  # what follows from a seed is random, whoever counts the seeds
    kind: Kind = "sampled" if sampled else "grid" if data["name"] in request.get("over", {}) else "listed"
    return SweptColumn(str(data["column"]), kind, tuple(data.get("targets", ())), sampled)


def read_view(json_file: Path, csv_file: Path, indices_file: Path) -> SweepView:
    """Return the view of a sweep from its files.

    Raises
    ------
    MasterError
        If they cannot be read.
    """
    try:
        data = json.loads(json_file.read_text(encoding="utf-8"))
        titles = [str(p["column"]) for p in data["parameters"]]
        rows = _read_rows(csv_file, titles) if csv_file.is_file() else []
        is_whole = data["status"] == "complete" and data.get("request", {}).get("sensitivity")
        has_indices = is_whole and indices_file.is_file()
        indices = json.loads(indices_file.read_text(encoding="utf-8"))["indices"] if has_indices else []
        return view_of(data, rows, json_file.parent, indices)
    except OSError as error:
        raise MasterError(f"{error.filename} cannot be read: {error.strerror}") from error
    except (ValueError, LookupError, TypeError, AttributeError, csv.Error, RecursionError) as error:
        text = f"{json_file.parent} holds no sweep that can be read; start the sweep again to write its files anew"
        raise MasterError(f"{text} ({type(error).__name__}: {error})") from error


def _with_numbers(rows: Sequence[Row], parameters: Sequence[str]) -> list[Row]:
    """Return rows in which parameters are numbers if all their values can be read as such: whole numbers are texts."""
    texts = [
        name
        for name in parameters
        if all(_is_number(v) for row in rows if isinstance(v := row.get(name), str))
        and any(isinstance(row.get(name), str) for row in rows)
    ]
    return [{**row, **{t: float(v) for t in texts if (v := row.get(t)) is not None}} for row in rows]


def _read_rows(path: Path, parameters: Sequence[str]) -> list[Row]:
    """Return the rows of a table; parameters are texts as yet."""
    heads, *cells = list(csv.reader(io.StringIO(path.read_text(encoding="utf-8-sig")))) or [[]]
    names = [plain_cell(head) for head in heads]
    return [
        {name: _cell(cell, name in _TEXTS or name in parameters) for name, cell in zip(names, row, strict=True)}
        for row in cells
    ]


def _cell(text: str, is_text: bool) -> Cell:
    if not text:
        return None
    return plain_cell(text) if is_text else float(text)


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False

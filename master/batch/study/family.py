"""A family of variants as files in its scenario's folder: ``study.toml`` (what is reported) and ``variants.csv``.

The table has a row for each variant. Its columns are ``component.parameter``, in the FMU's units, and the columns of
the run itself (``stop``, ``step``). A value may have a unit (``12 kN``). A component that has columns, but no value in
a row, takes no part in that variant; the cells of the line must all have a value.
"""

from __future__ import annotations

import csv
import io
import math
import re
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from master.errors import MasterError, Problem, RequestError, ScenarioError, hint
from master.results.results_folder import write_text
from master.scenario.scenario_place import LIBRARY

STUDY: Final = "study.toml"
VARIANTS: Final = "variants.csv"
_NAME: Final = "variant"
_RUN: Final = ("stop", "step")


class _Model(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Interval(_Model):
    """An interval of interest along the track [m]."""

    name: str
    start: float
    end: float

    @model_validator(mode="after")
    def _ordered(self) -> Interval:
        if self.start >= self.end:
            raise ValueError(f"start {self.start:g} m must lie before end {self.end:g} m")
        return self


class Calibration(_Model):
    """The parameter of every pantograph that is calibrated, its target mean contact force [N] and the interval."""

    parameter: str = "static_force"
    mean_force: float = Field(gt=0)
    tolerance: float = Field(0.2, gt=0)
    interval: str


class Histories(_Model):
    """The variants, and the track position [m], whose uplift and dropper force are drawn over time."""

    variants: tuple[str, ...] = ()
    position: float


class Sharing(_Model):
    """The variants whose contact force is drawn wire by wire."""

    variants: tuple[str, ...] = ()


class Settings(_Model):
    """Contents of ``study.toml``."""

    title: str
    source: str = ""
    interval: tuple[Interval, ...] = Field(min_length=1)
    calibration: Calibration | None = None
    histories: Histories | None = None
    sharing: Sharing | None = None
    sweep: dict[str, Any] | None = None  # read by the verb of that name


class Variant(_Model):
    """One row of the table.

    Attributes
    ----------
    name : str
    values : dict
        Text by ``component.parameter``.
    absent : tuple of str
        Components that take no part.
    empty : tuple of str
        Columns without a value.
    stop, step : float, optional
        Of the run [s].
    """

    name: str = Field(min_length=1)
    values: dict[str, str]
    absent: tuple[str, ...] = ()
    empty: tuple[str, ...] = ()
    stop: float | None = Field(None, gt=0)
    step: float | None = Field(None, gt=0)


class Family(_Model):
    """A scenario with its variants."""

    name: str
    folder: Path
    settings: Settings
    variants: tuple[Variant, ...]

    def chosen(self, names: Sequence[str]) -> tuple[Variant, ...]:
        """Return the variants of these names in the order of the table, all if there are none.

        Raises
        ------
        RequestError
            If a name is unknown.
        """
        known = [v.name for v in self.variants]
        for name in names:
            if name not in known:
                raise RequestError(
                    f"study '{self.name}' has no variant '{name}'; known: {'; '.join(known)}{hint(name, known)}"
                )
        return tuple(v for v in self.variants if v.name in names or not names)


def family_names(root: Path = LIBRARY) -> tuple[str, ...]:
    """Return the names of all scenarios that have a study."""
    return tuple(sorted(p.parent.name.removesuffix(".ssp") for p in root.glob(f"*.ssp/{STUDY}")))


def load_family(name: str, root: Path = LIBRARY) -> Family:
    """Read a family by its name, or by the path of its scenario's folder.

    Raises
    ------
    RequestError
        If there is no such family.
    ScenarioError
        With all mistakes in its files.
    """
    own = sorted(folder for folder in (Path(name), *Path(name).glob("*.ssp")) if (folder / STUDY).is_file())
    folder = own[0] if len(own) == 1 else root / f"{name}.ssp"
    if not (folder / STUDY).is_file():
        known = family_names(root)
        text = f"known: {', '.join(known) or 'none'} (or give a scenario's folder with a {STUDY})"
        raise RequestError(f"there is no study '{name}'; {text}{hint(name, known)}")
    settings = _read_settings(folder / STUDY)
    variants = _read_variants(folder / VARIANTS)
    _check_names(folder / STUDY, settings, variants)
    return Family(name=folder.resolve().name.removesuffix(".ssp"), folder=folder, settings=settings, variants=variants)


def store_values(family: Family, variant: str, values: dict[str, float]) -> None:
    """Write values into the row of a variant and leave all others unchanged.

    Raises
    ------
    MasterError
        If the table has no such row or columns.
    """
    path = family.folder / VARIANTS
    rows = _table(path)
    wanted = [row for row in rows[1:] if row and row[0] == variant]
    if len(wanted) != 1 or not set(values) <= set(rows[0]):
        raise MasterError(f"{path} must have one row '{variant}', with columns {', '.join(values)}")
    for name, value in values.items():
        wanted[0][rows[0].index(name)] = f"{value:.6g}"
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    write_text(path, text.getvalue())


def _read_settings(path: Path) -> Settings:
    try:
        return Settings.model_validate(tomllib.loads(path.read_text(encoding="utf-8-sig")))
    except ValidationError as error:
        raise ScenarioError(_problems(path, 0, error)) from error
    except RecursionError as error:
        raise ScenarioError([Problem(str(path), 0, "study", "cannot be read: it is nested too deeply")]) from error
    except (OSError, ValueError) as error:  # not UTF-8, not TOML, integers of thousands of digits
        raise ScenarioError([Problem(str(path), 0, "study", f"cannot be read: {error}")]) from error


def _table(path: Path) -> list[list[str]]:
    try:
        return list(csv.reader(io.StringIO(path.read_text(encoding="utf-8-sig"))))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ScenarioError([Problem(str(path), 0, "variants", f"cannot be read: {error}")]) from error


def _read_variants(path: Path) -> tuple[Variant, ...]:
    rows = _table(path)
    heads = rows[0] if rows else []
    problems = _head_problems(path, heads)
    found = []
    for line, row in enumerate(rows[1:], 2):
        if not problems and any(row):
            found += _read_row(path, line, heads, row, problems)
    names = [v.name for v in found]
    problems += [Problem(str(path), 0, "variants", text) for text in _name_texts(names)]
    if not problems and not found:
        problems.append(Problem(str(path), 0, "variants", "has no variant"))
    if problems:
        raise ScenarioError(problems)
    return tuple(found)


def _name_texts(names: Sequence[str]) -> list[str]:
    """Return what is wrong with the names of the variants: each must name a different folder."""
    folders = [folder_name(n).casefold() for n in names]
    texts = [f"'{n}' appears more than once" for n in dict.fromkeys(names) if names.count(n) > 1]
    taken = dict(zip(reversed(folders), reversed(names), strict=True))
    texts += [
        f"'{name}' and '{taken[folder]}' would have the same folder of results, '{folder}'; rename one"
        for name, folder in zip(names, folders, strict=True)
        if taken[folder] != name
    ]
    return texts


def folder_name(variant: str) -> str:
    """Return the name of a variant's folder.

    Examples
    --------
    >>> folder_name("31 m, low damping")
    '31_m_low_damping'
    """
    return re.sub(r"[^A-Za-z0-9.+-]+", "_", variant).strip("_.") or "variant"


def _head_problems(path: Path, heads: Sequence[str]) -> list[Problem]:
    if not heads or heads[0] != _NAME:
        return [Problem(str(path), 1, "variants", f"the first column must be '{_NAME}'")]
    text = f"is neither 'component.parameter' nor one of {', '.join(_RUN)}"
    wrong = [f"column '{h}' {text}" for h in heads[1:] if h not in _RUN and not all(h.partition("."))]
    wrong += [f"column '{h}' appears {heads.count(h)} times" for h in dict.fromkeys(heads) if heads.count(h) > 1]
    return [Problem(str(path), 1, "variants", text) for text in wrong]


def _read_row(
    path: Path, line: int, heads: Sequence[str], row: Sequence[str], problems: list[Problem]
) -> list[Variant]:
    if len(row) != len(heads):
        problems.append(Problem(str(path), line, "variants", f"has {len(row)} cells, the head has {len(heads)}"))
        return []
    cells = {h: c.strip() for h, c in zip(heads, row, strict=True)}
    values = {h: c for h, c in cells.items() if "." in h and c}
    data: dict[str, Any] = {h: cells[h] for h in _RUN if cells.get(h)}
    try:
        empty = tuple(h for h, c in cells.items() if "." in h and not c)
        return [Variant(name=cells[_NAME], values=values, absent=_absent(heads, values), empty=empty, **data)]
    except ValidationError as error:
        problems += _problems(path, line, error)
        return []


def _absent(heads: Sequence[str], values: dict[str, str]) -> tuple[str, ...]:
    components = dict.fromkeys(h.partition(".")[0] for h in heads if "." in h)
    present = {name.partition(".")[0] for name in values}
    return tuple(c for c in components if c not in present)


def _problems(path: Path, line: int, error: ValidationError) -> list[Problem]:
    return [Problem(str(path), line, "study", f"{'.'.join(map(str, e['loc']))}: {e['msg']}") for e in error.errors()]


def _check_names(path: Path, settings: Settings, variants: Sequence[Variant]) -> None:
    """Check that the variants and intervals named in the settings exist."""
    named = [*(settings.histories.variants if settings.histories else ())]
    named += settings.sharing.variants if settings.sharing else ()
    texts = [f"there is no variant '{n}'" for n in named if n not in {v.name for v in variants}]
    wanted = settings.calibration
    if wanted is not None and wanted.interval not in {i.name for i in settings.interval}:
        texts.append(f"calibration.interval: there is no interval '{wanted.interval}'")
    if settings.histories is not None and not math.isfinite(settings.histories.position):
        texts.append("histories.position is not finite")
    if texts:
        raise ScenarioError([Problem(str(path), 0, "study", text) for text in texts])

"""Case files in TOML: which scenarios are run, and the rows that are judged."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator, model_validator

from master.batch.verification.quantities import QUANTITIES, Choice
from master.errors import Problem, RequestError, ScenarioError, hint
from master.scenario.scenario_place import LIBRARY

#: The cases that come with the package.
CASES: Final = Path(__file__).parent / "cases"
_ONLY_RUN: Final = "run"

#: must hold: a row that fails fails the verification. indicative: likewise, though its source calls its data
#: indicative. report: printed and judged, but fails only outside its band.
Kind = Literal["must hold", "indicative", "report"]


class _Data(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Run(_Data):
    """A scenario that a case needs.

    Attributes
    ----------
    scenario : str
        Name of one in the library, or a path ending in ``.ssp``, relative to the case file.
    start_only : bool
        Whether the first instant suffices (static figures).
    set : dict of str to float
        Values of parameters to change, as with ``--set``: "catenary.contact.stiffness".
    """

    scenario: str = Field(min_length=1)
    start_only: bool = False
    set: dict[str, float] = Field(default_factory=dict)

    @model_validator(mode="before")
    @classmethod
    def _short(cls, data: Any) -> Any:
        return {"scenario": data} if isinstance(data, str) else data


class Row(_Data):
    """A quantity of a run and its reference: a value, a range, a verdict or other runs.

    Attributes
    ----------
    quantity : str
        Key of `QUANTITIES`.
    title : str
        Printed instead of the title of the quantity.
    run : str
        Which run; may be omitted if there is only one.
    contact, at, within
        See `Choice`.
    value : tuple of float
        Reference, in the quantity's unit (in the file a plain number if it is one); one for all, or one for each of
        the supports in ``at``.
    range : (float, float)
        Lower and upper limit.
    minimum, maximum : float
        A single limit.
    truth : bool
        Expected verdict (in the file: ``is``).
    below, above : tuple of str
        Runs below (above) whose values this one must lie.
    tolerance, tolerance_percent : float
        How far off a value may be, or beyond the nearer limit, in the quantity's unit or in percent of it.
    source : str
        Where the reference comes from.
    band : (float, float)
        Range of the figure over untuned readings of the source's data: a wide one shows how little agreement alone
        proves. A figure outside fails, whatever the kind of the row.
    recalled : bool
        Whether the reference is known from secondary texts, not read where it was published.
    kind : Kind
    """

    quantity: str
    title: str = ""
    run: str = ""
    contact: int = Field(1, ge=1)
    at: tuple[float, ...] = ()
    within: float | None = Field(None, gt=0)
    value: tuple[float, ...] | None = None
    range: tuple[float, float] | None = None
    minimum: float | None = None
    maximum: float | None = None
    truth: bool | None = Field(None, alias="is")
    below: tuple[str, ...] = ()
    above: tuple[str, ...] = ()
    tolerance: float | None = Field(None, ge=0)
    tolerance_percent: float | None = Field(None, ge=0)
    source: str = Field(min_length=1)
    band: tuple[float, float] | None = None
    recalled: bool = False
    kind: Kind = "must hold"

    @property
    def choice(self) -> Choice:
        """How the quantity is to be measured."""
        return Choice(self.contact, self.at, math.inf if self.within is None else self.within)

    @property
    def others(self) -> tuple[str, ...]:
        """The runs with which the row compares its own."""
        return self.below + self.above

    @property
    def references(self) -> tuple[str, ...]:
        """Names of the references that are given, as written in a file."""
        given: dict[str, Any] = {
            "value": self.value,
            "range": self.range,
            "minimum": self.minimum,
            "maximum": self.maximum,
            "is": self.truth,
            "below": self.below or None,
            "above": self.above or None,
        }
        return tuple(name for name, content in given.items() if content is not None)

    @field_validator("value", mode="before")
    @classmethod
    def _several(cls, value: Any) -> Any:
        return value if isinstance(value, list | tuple) or value is None else (value,)

    @model_validator(mode="after")
    def _makes_sense(self) -> Row:
        problem = next(self._problems(), None)
        if problem is not None:
            raise ValueError(problem)
        return self

    def _problems(self) -> Iterator[str]:
        quantity = QUANTITIES.get(self.quantity)
        if quantity is None:
            yield f"there is no quantity '{self.quantity}'{hint(self.quantity, QUANTITIES)}"
            return
        if len(self.references) != 1:
            known = "value, range, minimum, maximum, is, below, above"
            yield f"exactly one of {known} is needed, given: {', '.join(self.references) or 'none'}"
        yield from self._quantity_problems(quantity.needs, quantity.is_verdict)
        yield from self._value_problems()
        yield from self._tolerance_problems()

    def _quantity_problems(self, needs: tuple[str, ...], is_verdict: bool) -> Iterator[str]:
        given = {"at": bool(self.at), "within": self.within is not None}
        for name, has in given.items():
            if has != (name in needs):
                yield f"quantity '{self.quantity}' {'needs' if not has else 'does not take'} '{name}'"
        if is_verdict != (self.truth is not None):
            what = "a verdict: it takes only" if is_verdict else "not a verdict: it does not take"
            yield f"quantity '{self.quantity}' is {what} 'is'"
        if self.quantity == "uplift_at" and self.others:
            yield "'uplift_at' has a value per support and cannot be compared with other runs; use 'uplift'"

    def _value_problems(self) -> Iterator[str]:
        if self.value is not None and len(self.value) not in (1, len(self.at)):
            yield f"{len(self.value)} values for {len(self.at)} places 'at'"
        for what, limits in (("range", self.range), ("band", self.band)):
            if limits is not None and limits[0] > limits[1]:
                yield f"the {what} begins at {limits[0]:g}, above its end {limits[1]:g}"
        if self.band is not None and (self.truth is not None or self.others):
            yield "a band goes with value, range, minimum or maximum only"

    def _tolerance_problems(self) -> Iterator[str]:
        given = [t for t in (self.tolerance, self.tolerance_percent) if t is not None]
        if len(given) > 1:
            yield "only one of tolerance and tolerance_percent may be given"
        if self.value is not None and not given:
            yield "a value needs a tolerance or a tolerance_percent"
        if given and (self.others or self.truth is not None):
            yield "a tolerance goes with value, range, minimum or maximum only"


class _CaseData(_Data):
    title: str = Field(min_length=1)
    description: str = ""
    citation: str = ""
    scenario: str = ""
    runs: dict[str, Run] = {}
    rows: tuple[Row, ...] = ()


@dataclass(frozen=True)
class Case:
    """A case, as read from its file.

    Attributes
    ----------
    name : str
        The file's name without ending.
    path : Path
        The file.
    title, description, citation : str
        For the reader.
    runs : dict
        Scenarios by the names that the rows use.
    rows : tuple of Row
        Every row names its run.
    """

    name: str
    path: Path
    title: str
    description: str
    citation: str
    runs: dict[str, Run]
    rows: tuple[Row, ...]

    def scenario_path(self, run: str) -> Path:
        """Return the path of the scenario of a run."""
        scenario = self.runs[run].scenario
        return self.path.parent / scenario if scenario.endswith(".ssp") else LIBRARY / f"{scenario}.ssp"


def find_cases(names: Iterable[str]) -> tuple[Path, ...]:
    """Return the files of the named cases, or of all cases in the library if none is named.

    Parameters
    ----------
    names : iterable of str
        Names of cases in the library, or paths of case files.

    Raises
    ------
    RequestError
        If a name is unknown, with the nearest one that is known.
    """
    known = {path.stem: path for path in sorted(CASES.glob("*.toml"))}
    return tuple(dict.fromkeys(_find(name, known) for name in names)) or tuple(known.values())


def _find(name: str, known: dict[str, Path]) -> Path:
    if name in known:
        return known[name]
    path = Path(name)
    if path.suffix == ".toml" and path.is_file():
        return path
    raise RequestError(f"there is no case '{name}'{hint(name, known)} (--list names them all)")


def load_cases(paths: Iterable[Path]) -> tuple[Case, ...]:
    """Read case files.

    Raises
    ------
    ScenarioError
        With every mistake in all of them.
    """
    cases: list[Case] = []
    problems: list[Problem] = []
    for path in paths:
        try:
            cases.append(load_case(path))
        except ScenarioError as error:
            problems += error.problems
    if problems:
        raise ScenarioError(problems)
    return tuple(cases)


def load_case(path: Path) -> Case:
    """Read a case file.

    Raises
    ------
    ScenarioError
        With every mistake in it, by file and key.
    """
    try:
        data = _CaseData.model_validate(tomllib.loads(path.read_text(encoding="utf-8-sig")))
    except ValidationError as error:
        raise ScenarioError([Problem(path.name, 0, "case", _sentence(item)) for item in error.errors()]) from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ScenarioError([Problem(path.name, 0, "toml", str(error))]) from error
    problems = [Problem(path.name, 0, "case", text) for text in _run_problems(data)]
    if problems:
        raise ScenarioError(problems)
    runs = data.runs or {_ONLY_RUN: Run(scenario=data.scenario)}
    rows = tuple(row if row.run else row.model_copy(update={"run": next(iter(runs))}) for row in data.rows)
    return Case(path.stem, path, data.title, data.description, data.citation, runs, rows)


def _run_problems(data: _CaseData) -> Iterator[str]:
    if bool(data.scenario) == bool(data.runs):
        yield "either 'scenario' or 'runs' is needed, not both"
        return
    if not data.rows:
        yield "rows: there are none; each begins with [[rows]]"
    for number, row in enumerate(data.rows, 1):
        if not row.run and len(data.runs) > 1:
            yield f"rows[{number}].run: is missing; the runs are {', '.join(data.runs)}"
        for key, names in (("run", (row.run,) if row.run else ()), ("below", row.below), ("above", row.above)):
            for name in names:
                if name not in data.runs:
                    yield f"rows[{number}].{key}: there is no run '{name}'{hint(name, data.runs)}"


def _sentence(item: Any) -> str:
    """Return ``rows[2].tolerance: what is wrong`` from an error of pydantic; rows count from 1."""
    key = ""
    for part in item["loc"]:
        key += f"[{part + 1}]" if isinstance(part, int) else f".{part}" if key else str(part)
    text = item["msg"].removeprefix("Value error, ")
    given = item.get("input")
    shown = f" (given: {given!r})" if isinstance(given, str | int | float) else ""
    return f"{key or 'file'}: {text}{shown}"

"""The plan of a sweep: what the user asks for, and the values of every run that follow from it.

A grid (every value with every other), a sample and a table may be combined: every row of the table with every point of
the grid with every sample.
"""

from __future__ import annotations

import csv
import io
import itertools
import math
import re
import tomllib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal, Self, get_args

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from master.batch.sweep.distributions import Distribution, Method, draw, read_distribution
from master.batch.sweep.seed_samples import seed_samples
from master.batch.sweep.sensitivity import LEAST_BLOCKS, SensitivityMethod, block_size, designed
from master.batch.sweep.swept_parameter import OF_THE_RUN, ParameterReader, SweptParameter, SweptValue
from master.errors import MasterError, RequestError, hint, not_utf8, said
from master.scenario.overrides import FaultsOf
from master.system.components import System
from master.system.pantograph_motion import STATIC_FORCE

Keep = Literal["all", "thinned", "figures", "failed"]
Engine = Literal["fmu", "lanes"]
#: Most runs of a sweep.
MOST_RUNS: Final = 100_000
#: Column of a table that names its rows.
VARIANT: Final = "variant"
STUDY: Final = "study.toml"
_FAULT: Final = re.compile(r"fault\[\d+\]\.active", re.ASCII)
_HEAD: Final = re.compile(r"\s*(.+?)\s*(?:\[([^\]]*)\])?\s*")


class PlainRequest(BaseModel):
    """What a batch is asked for, read from plain data; unknown names and impossible values are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @classmethod
    def read(cls, data: Mapping[str, Any], origin: str = "") -> Self:
        """Return the request in plain data.

        Raises
        ------
        RequestError
            Naming the first thing that is wrong, and ``origin``.
        """
        try:
            return cls.model_validate(dict(data))
        except ValidationError as error:
            first = error.errors()[0]
            where = ".".join(map(str, first["loc"]))
            raise RequestError(": ".join(filter(None, (origin, where, first["msg"])))) from error


class SweepRequest(PlainRequest):
    """What a sweep is asked for: the options of the command, the table ``[sweep]`` of ``study.toml``.

    Attributes
    ----------
    over : dict
        Values of a grid by parameter: ``18kN,20kN``, ``200:320:10``.
    vary : dict
        Distributions by parameter: ``normal(20kN, 0.2kN)``.
    samples : int
        How many samples of the distributions.
    seed : int
    method : str
        How they are drawn: ``lhs`` or ``sobol``.
    sensitivity : str, optional
        ``sobol`` or ``morris``: ``samples`` is the number of blocks of runs (`sensitivity`) from which it is found how
        every figure depends on every parameter.
    table : Path, optional
        CSV file with a row for each run and a column for each parameter.
    faults : tuple of int
        Spans whose droppers break one after the other; the first run has none broken. The scenario must have been
        opened with them.
    faults_of : str
        ``each-dropper``, or ``each-arm``: the steady arms at the ends of these spans come off instead.
    stop : float, optional
        Stop time of all runs [s]; it follows the speed if not given.
    static_force, mean_force : str, optional
        ``70 N + 0.00097 v^2``, v in km/h, or without v: the static force of every pantograph, or the mean contact force
        that it is found for.
    tolerance : float
        How near to the mean force is enough [N].
    keep : str
        What stays of the runs beside the table: ``all``; ``thinned``, the contact force and the summary;
        ``figures``, nothing; ``failed``, what those left that failed.
    engine : str
        What makes the runs: ``fmu``, or ``lanes``, which steps them side by side without FMUs.
    check : int
        How many runs ``lanes`` makes as FMUs as well, to compare.
    """

    over: dict[str, str] = Field(default_factory=dict)
    vary: dict[str, str] = Field(default_factory=dict)
    samples: int | None = Field(None, gt=0, le=MOST_RUNS)
    seed: int = Field(1, ge=0)
    method: Method = "lhs"
    sensitivity: SensitivityMethod | None = None
    table: Path | None = None
    faults: tuple[int, ...] = ()
    faults_of: FaultsOf = "each-dropper"
    stop: float | None = None
    static_force: str | None = None
    mean_force: str | None = None
    tolerance: float = Field(0.2, gt=0)
    keep: Keep = "figures"
    engine: Engine = "fmu"
    check: int = Field(1, ge=0)


def listed_faults(faults: str | int | Sequence[int], span: int | Sequence[int]) -> dict[str, Any]:
    """Return what a request says of faults: ``each-dropper`` or ``each-arm`` with spans, or spans alone.

    Raises
    ------
    RequestError
        If spans are missing, or given twice.
    """
    spans = (span,) if isinstance(span, int) else tuple(span)
    if not isinstance(faults, str):
        if spans:
            raise RequestError("--span is of --faults each-dropper and --faults each-arm: give one of them too")
        return {"faults": (faults,) if isinstance(faults, int) else tuple(faults)}
    if faults not in get_args(FaultsOf):
        known = get_args(FaultsOf)
        raise RequestError(f"--faults: '{faults}' is none of {', '.join(known)}{hint(faults, known)}")
    if not spans:
        raise RequestError(f"--faults {faults} needs --span K: of which span of the line?")
    return {"faults": spans, "faults_of": faults}


def stored_request(folder: Path) -> dict[str, Any]:
    """Return the table ``[sweep]`` of the ``study.toml`` in a scenario's folder, empty if there is none.

    Raises
    ------
    RequestError
        If the file cannot be read.
    """
    path = folder / STUDY
    if not path.is_file():
        return {}
    try:
        found = tomllib.loads(path.read_text(encoding="utf-8-sig")).get("sweep", {})
    except (OSError, ValueError, RecursionError) as error:
        raise RequestError(f"{path} cannot be read: {error}") from error
    if not isinstance(found, dict):
        raise RequestError(f"{path}: sweep must be a table, [sweep]")
    if "table" in found:
        found["table"] = folder / str(found["table"])
    return found


@dataclass(frozen=True)
class SweepPlan:
    """The values of every run of a sweep.

    Attributes
    ----------
    parameters : tuple of SweptParameter
        What is varied, in the order of the columns.
    points : tuple
        For each run a value for each parameter, None where it takes none.
    distributions : tuple of Distribution
        Those of the parameters that are sampled.
    variants : tuple of str
        Names of the points in the table, empty without a table.
    """

    parameters: tuple[SweptParameter, ...]
    points: tuple[tuple[SweptValue | None, ...], ...]
    distributions: tuple[Distribution, ...] = ()
    variants: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Part:
    """A part of a plan: some parameters and their values, a row for each point."""

    parameters: tuple[SweptParameter, ...]
    rows: Sequence[tuple[SweptValue | None, ...]]


def make_plan(system: System, request: SweepRequest) -> SweepPlan:
    """Return the values of every run.

    Parameters
    ----------
    system : System
        Of the scenario as it is.
    request : SweepRequest

    Raises
    ------
    RequestError
        If something is asked for that there is not, or the parts do not go together.
    """
    if request.vary and request.samples is None:
        raise RequestError("samples need --samples N: how many")
    _check_sensitivity(request)
    table, names = (None, ()) if request.table is None else _read_table(system, request.table)
    if request.faults:
        if table is not None:
            raise RequestError("--faults and --from-csv both list runs: leave one out")
        table, names = broken_in_turn(system)
    grid = [_listed(system, name, text) for name, text in request.over.items()]
    distributions = tuple(read_distribution(ParameterReader(system, n), text) for n, text in request.vary.items())
    if request.samples is not None and not distributions:
        grid.append(_Part(*seed_samples(system, request.samples, request.seed, {*request.over, *_names(table)})))
    sizes = [len(part.rows) for part in (table, *grid) if part is not None]
    each_sample = block_size(request.sensitivity, len(distributions)) if request.sensitivity else 1
    if (count := math.prod(sizes) * (request.samples or 1 if distributions else 1) * each_sample) > MOST_RUNS:
        raise RequestError(f"that makes {count} runs, more than {MOST_RUNS}")
    parts = [part for part in (table, *grid) if part is not None]
    parts += [_sample(distributions, request)] if distributions else []
    if not parts:
        text = "--over, --vary with --samples, or --from-csv; in Python over, vary with samples, or table"
        raise RequestError(f"nothing is varied: give {text}")
    parameters = tuple(p for part in parts for p in part.parameters)
    check_distinct(parameters)
    _check_used(request, parameters)
    points = tuple(tuple(itertools.chain(*rows)) for rows in itertools.product(*(part.rows for part in parts)))
    each = len(points) // len(names) if names else 0
    return SweepPlan(parameters, points, distributions, tuple(name for name in names for _ in range(each)))


def _check_used(request: SweepRequest, parameters: Sequence[SweptParameter]) -> None:
    """Refuse what the runs would not heed, and values that they would not have."""
    given = request.model_fields_set
    is_seeded = request.seed != SweepRequest.model_fields["seed"].default
    if (not request.vary and "method" in given) or (request.samples is None and is_seeded):
        raise RequestError("--seed and --method are of samples: give --vary with --samples, or leave them out")
    if "tolerance" in given and request.mean_force is None:
        raise RequestError("--mean-tolerance is of --mean-force: give that too, or leave it out")
    if request.check != SweepRequest.model_fields["check"].default and request.engine != "lanes":
        raise RequestError("--check is of --engine lanes: give that too, or leave it out")
    varied = {name.rpartition(".")[2] for p in parameters for name in (p.targets or (p.name,))}
    if request.stop is not None and "stop" in varied:
        raise RequestError("the stop time is varied, so it cannot be the same for all runs: leave out --stop")
    for option, force in (("static", request.static_force), ("mean", request.mean_force)):
        if force is not None and STATIC_FORCE in varied:
            does = "follows the speed" if option == "static" else "is found for the mean force"
            raise RequestError(f"the static force is varied, and it {does}: leave out one, or --{option}-force")


def check_overridden(plan: SweepPlan, given: Collection[str]) -> None:
    """Raise a `RequestError` if a parameter is varied whose value in all runs is given too."""
    for p in plan.parameters:
        for name in p.targets or (p.name,):
            if name in given:
                raise RequestError(f"'{name}' is varied, so it cannot be given a value for all runs as well")


def _check_sensitivity(request: SweepRequest) -> None:
    """Refuse what does not go together with a design for sensitivity indices."""
    if request.sensitivity is None:
        return
    if not request.vary:
        raise RequestError("--sensitivity needs --vary NAME=DISTRIBUTION, of what, and --samples N, how many blocks")
    if request.over or request.table is not None or request.faults:
        text = "leave out --over, --from-csv and --faults"
        raise RequestError(f"--sensitivity looks at what --vary samples, alone: {text}")
    if "method" in request.model_fields_set:
        raise RequestError("--sensitivity has samples of its own: leave out --method")
    if request.samples is not None and request.samples < LEAST_BLOCKS:
        raise RequestError(f"--sensitivity needs at least {LEAST_BLOCKS} samples, not {request.samples}")


def check_distinct(parameters: Sequence[SweptParameter]) -> None:
    """Raise a `RequestError` if a parameter is varied twice."""
    names = [name for p in parameters for name in (p.targets or (p.name,))]
    for name in dict.fromkeys(names):
        if names.count(name) > 1:
            raise RequestError(f"'{name}' is varied twice")


def _listed(system: System, name: str, text: str) -> _Part:
    parameter, values = ParameterReader(system, name).listed(text)
    return _Part((parameter,), [(value,) for value in values])


def _sample(distributions: Sequence[Distribution], request: SweepRequest) -> _Part:
    count, seed = request.samples or 0, request.seed
    if request.sensitivity is not None:
        values = designed(distributions, count, seed, request.sensitivity)
    else:
        values = draw(distributions, count, seed, request.method)
    return _Part(tuple(d.parameter for d in distributions), [tuple(map(float, row)) for row in values])


def _read_table(system: System, path: Path) -> tuple[_Part, tuple[str, ...]]:
    """Return the values in a CSV file and the names of its rows."""
    lines = _read_lines(path)
    if len(lines) < 2:
        raise RequestError(f"{path} has no row under its head")
    heads = lines[0][1]
    if len(heads) == 1 and ";" in heads[0]:
        raise RequestError(
            f"{path}: its cells are separated by semicolons; separate them by commas, decimals by points"
        )
    for number, row in lines[1:]:
        if len(row) != len(heads):
            raise RequestError(f"{path}, line {number}: has {len(row)} cells, the head has {len(heads)}")
    rows = [row for _, row in lines]
    columns = {head.strip(): [cell.strip() for cell in cells] for head, *cells in zip(*rows, strict=True)}
    if len(columns) < len(heads):
        raise RequestError(f"{path}: a column appears more than once")
    names = tuple(columns.pop(VARIANT, ()))
    if "" in names:
        raise RequestError(f"{path}: column '{VARIANT}' has an empty cell; name every row")
    if twice := next((n for n in names if names.count(n) > 1), None):
        raise RequestError(f"{path}: two rows are named '{twice}' in column '{VARIANT}'")
    if not columns:
        raise RequestError(f"{path} has no column of values")
    try:
        read = [_column(system, head, cells) for head, cells in columns.items()]
    except RequestError as error:
        raise RequestError(f"{path}: {error}") from error
    values = list(zip(*(cells for _, cells in read), strict=True))
    return _Part(tuple(p for p, _ in read), values), names or tuple(map(str, range(1, len(rows))))


def broken_in_turn(system: System) -> tuple[_Part, tuple[str, ...]]:
    """Return runs in which every fault that is not active becomes so in turn, the first without, and their names."""
    found = [
        (f"{c.name}.{v.name}", v.description)
        for c in system.components
        for v in c.fmu.variables.values()
        if _FAULT.fullmatch(v.name) and float(v.start or 0.0) == 0.0
    ]
    if not found:
        raise RequestError("--faults: no component is a line FMU of ours, Catenary_NAME.fmu, that could list faults")
    count = len(found)
    cells = [["1" if row == k + 1 else "0" for row in range(count + 1)] for k in range(count)]
    read = [_column(system, name, column) for (name, _), column in zip(found, cells, strict=True)]
    values = list(zip(*(column for _, column in read), strict=True))
    return _Part(tuple(p for p, _ in read), values), ("healthy", *(name for name, _ in found))


def _names(part: _Part | None) -> list[str]:
    return [] if part is None else [name for p in part.parameters for name in (p.targets or (p.name,))]


def _read_lines(path: Path) -> list[tuple[int, list[str]]]:
    """Return the rows of a CSV file that are not empty, each with the number of its last line."""
    try:
        reader = csv.reader(io.StringIO(path.read_text(encoding="utf-8-sig")))
        return [(reader.line_num, row) for row in reader if any(row)]
    except UnicodeDecodeError as error:
        raise RequestError(f"{path} {not_utf8(error)}") from error
    except (OSError, csv.Error) as error:
        why = said(error) if isinstance(error, OSError) else error
        raise MasterError(f"{path} cannot be read: {why}") from error


def _column(system: System, head: str, cells: Sequence[str]) -> tuple[SweptParameter, tuple[SweptValue | None, ...]]:
    match = _HEAD.fullmatch(head)
    if match is None:
        raise RequestError("a column has no head")
    reader = ParameterReader(system, match[1], match[2] or "")
    found = reader.cells(cells)
    if match[1] in OF_THE_RUN and None in found[1]:
        raise RequestError(f"column '{head}' has an empty cell")
    return found

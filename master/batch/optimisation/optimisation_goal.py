"""What an optimisation is asked for: the figure that shall be least or greatest, bounds of parameters, constraints."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from pydantic import Field

from master.batch.assessment_figures import FIGURES
from master.batch.sweep.sweep_plan import MOST_RUNS, PlainRequest, SweepRequest, check_distinct
from master.batch.sweep.sweep_run import OUTPUT_KINDS, Row, SweepResult
from master.batch.sweep.swept_parameter import ParameterReader, SweptParameter
from master.batch.sweep.swept_systems import STATIC_FORCE, ForceLaw
from master.errors import RequestError, hint
from master.recording.recording_plan import recording_plans
from master.ssp.ssp_units import COMMON, conversion, split_quantity
from master.system.components import System

#: What can be held at a value: the static force of every run is found for it.
HELD: Final = "mean"
_CONSTRAINT: Final = re.compile(r"\s*(.+?)\s*(<=|>=|=)\s*(.+?)\s*")
#: Merit of a point that breaks a constraint, to which the excess is added: worse than any that breaks none.
_BROKEN: Final = 1e12
#: A value this near to a bound, as a share of the range between them, lies at it.
_NEAR: Final = 0.005


class OptimisationRequest(PlainRequest):
    """What an optimisation is asked for.

    Attributes
    ----------
    minimise, maximise : str, optional
        The figure, one of the two.
    vary : dict
        Bounds by parameter: ``3000:12000 N/m``.
    subject_to : list of str
        ``mean=157.5 N``, ``maximum<=350 N``, ``minimum>=0 N``.
    max_runs : int
        Most points that are tried.
    seed : int
    tolerance : float
        How near to the mean force is enough [N].
    stop : float, optional
        Stop time of all runs [s]; it follows the speed if not given.
    """

    minimise: str | None = None
    maximise: str | None = None
    vary: dict[str, str] = Field(default_factory=dict)
    subject_to: list[str] = Field(default_factory=list)
    max_runs: int = Field(60, gt=0, le=MOST_RUNS)
    seed: int = Field(1, ge=0)
    tolerance: float = Field(0.2, gt=0)
    stop: float | None = None


@dataclass(frozen=True)
class BoundedParameter:
    """A parameter with its bounds.

    Attributes
    ----------
    parameter : SweptParameter
    low, high : float
        In the unit of the parameter.
    start : float
        Where the search begins: the scenario's own value, or the middle if that lies outside.
    """

    parameter: SweptParameter
    low: float
    high: float
    start: float

    @classmethod
    def read(cls, system: System, name: str, text: str) -> BoundedParameter:
        """Return the parameter whose bounds a text states, such as ``3000:12000 N/m``.

        Raises
        ------
        RequestError
        """
        ends = text.split(":")
        if len(ends) != 2:
            raise RequestError(f"{name}: bounds are written LOW:HIGH, not '{text.strip()}'")
        reader = ParameterReader(system, name)
        parameter, (low, high) = reader.arguments(", ".join(ends), (False, False))
        if not low < high:
            raise RequestError(f"{name}: the bounds {text.strip()} must rise")
        present = reader.present(parameter.unit)
        start = 0.5 * (low + high) if present is None or not low <= present <= high else present
        return cls(parameter, low, high, start)

    def value(self, share: float) -> float:
        """Return the value at a share of the way from the lower to the upper bound, in nine digits."""
        return min(max(float(f"{self.low + share * (self.high - self.low):.9g}"), self.low), self.high)

    def share(self, value: float) -> float:
        """Return at which share of the way a value lies."""
        return (value - self.low) / (self.high - self.low)

    def bound_at(self, value: float) -> str:
        """Return which bound a value lies at: ``lower``, ``upper`` or none."""
        share = self.share(value)
        return "lower" if share < _NEAR else "upper" if share > 1.0 - _NEAR else ""


@dataclass(frozen=True)
class Constraint:
    """A bound of a figure, for every pantograph.

    Attributes
    ----------
    figure, unit : str
    is_upper : bool
        Whether the figure must not be greater than the bound, or not less.
    bound : float
    """

    figure: str
    unit: str
    is_upper: bool
    bound: float

    @property
    def text(self) -> str:
        """As a user would write it."""
        return f"{self.figure} {'<=' if self.is_upper else '>='} {shown(self.bound, self.unit)}"

    def excess(self, row: Row) -> float:
        """Return by how much a row breaks it, relative to the bound; 0 if it does not, infinite without the figure."""
        value = row.get(column(self.figure, self.unit))
        if not isinstance(value, float):
            return math.inf
        miss = value - self.bound if self.is_upper else self.bound - value
        return max(0.0, miss / max(abs(self.bound), 1e-9))


@dataclass(frozen=True)
class Goal:
    """What shall be least or greatest, under which constraints.

    Attributes
    ----------
    figure, unit : str
    is_least : bool
        Whether the figure shall be least, or greatest.
    constraints : tuple of Constraint
    mean_force : str
        What the mean force is held at, empty if it is not.
    """

    figure: str
    unit: str
    is_least: bool
    constraints: tuple[Constraint, ...] = ()
    mean_force: str = ""

    @classmethod
    def read(cls, system: System, request: OptimisationRequest) -> Goal:
        """Return the goal of a request.

        Raises
        ------
        RequestError
            If there is no such figure, or a constraint cannot be meant.
        """
        if (request.minimise is None) == (request.maximise is None):
            raise RequestError("one figure is to be least or greatest: give --minimise or --maximise")
        known = known_figures(system)
        name = _known(request.minimise or request.maximise or "", known)
        read = [_constraint(text, known) for text in request.subject_to]
        held = [c for c in read if isinstance(c, str)]
        if len(held) > 1:
            raise RequestError("the mean force is held at two values")
        if held and name == HELD:
            raise RequestError("the mean force is held at a value, so it cannot be optimised as well")
        bounds = tuple(c for c in read if isinstance(c, Constraint))
        _check_room(bounds)
        return cls(name, known[name], request.minimise is not None, bounds, held[0] if held else "")

    @property
    def text(self) -> str:
        """As a sentence without its full stop."""
        mean = [f"mean = {self.mean_force}"] if self.mean_force else []
        held = ", ".join([*mean, *(c.text for c in self.constraints)])
        return f"{'least' if self.is_least else 'greatest'} {self.figure}{f' with {held}' if held else ''}"

    def value(self, result: SweepResult) -> float | None:
        """Return the figure of a run, that of the worst pantograph; None if it failed or one has none."""
        cells = [row.get(column(self.figure, self.unit)) for row in result.rows]
        values = [cell for cell in cells if isinstance(cell, float)]
        if not values or len(values) < len(cells):
            return None
        return max(values) if self.is_least else min(values)

    def excess(self, result: SweepResult) -> float:
        """Return by how much a run breaks its constraints, in all; 0 if it keeps them."""
        return sum((c.excess(row) for c in self.constraints for row in result.rows), 0.0)

    def keeps(self, result: SweepResult) -> bool:
        """Whether a run has the figure and keeps all constraints."""
        return self.value(result) is not None and self.excess(result) == 0.0

    def merit(self, result: SweepResult) -> float:
        """Return a number that is the less the better: of failed runs infinite, of broken constraints very great."""
        value, excess = self.value(result), self.excess(result)
        if value is None or not math.isfinite(excess):
            return math.inf
        if excess > 0.0:
            return _BROKEN * (1.0 + excess)
        return value if self.is_least else -value


def column(figure: str, unit: str) -> str:
    """Return the title of a figure's column in the table."""
    return f"{figure} [{unit}]"


def shown(value: float, unit: str) -> str:
    """Return a value with its unit for people."""
    return f"{value:.6g} {unit}".strip() if unit != "1" else f"{value:.6g}"


def known_figures(system: System) -> Mapping[str, str]:
    """Return the units of the figures that the runs of a scenario have, by their names."""
    if system.contacts:
        return {title: unit for title, unit, *_ in FIGURES} | {"static force": "N"}
    names = [(c.source, c.output) for c in system.connections]
    names += [(part, name) for p in recording_plans(system) for part, found in p.names.items() for name in found]
    units = {f"{part}.{name}": system.component(part).fmu.variables[name].unit or "1" for part, name in names}
    return {f"{name} {kind}": unit for name, unit in units.items() for kind in OUTPUT_KINDS}


def _known(text: str, known: Mapping[str, str]) -> str:
    name = text.strip()
    if name in known:
        return name
    bare = name.rpartition(" [")[0]
    if bare in known:
        return bare
    some = ", ".join(list(known)[:12])
    raise RequestError(f"there is no figure '{name}'{hint(name, known)}; known: {some}{', ...' * (len(known) > 12)}")


def _constraint(text: str, known: Mapping[str, str]) -> Constraint | str:
    """Return a bound of a figure, or what the mean force is held at."""
    match = _CONSTRAINT.fullmatch(text)
    if match is None:
        raise RequestError(f"'{text}' is no constraint, such as 'mean=157.5 N' or 'maximum<=350 N'")
    name, sign = _known(match[1], known), match[2]
    if sign == "=":
        if name != HELD:
            raise RequestError(f"'{text}': only the {HELD} force can be held at a value; bound {name} by <= or >=")
        ForceLaw.read(match[3])
        return match[3]
    return Constraint(name, known[name], sign == "<=", _bound(text, match[3], known[name]))


def _bound(text: str, written: str, wanted: str) -> float:
    number, unit = split_quantity(written)
    if number is None or not math.isfinite(number):
        raise RequestError(f"'{text}': '{written}' is not a number")
    if unit == wanted or (not unit and wanted == "1"):
        return number
    if not unit:
        raise RequestError(f"'{text}' needs a unit, as in '{number:g} {wanted}'")
    found = conversion(COMMON[unit], COMMON[wanted]) if unit in COMMON and wanted in COMMON else None
    if found is None:
        raise RequestError(f"'{text}': '{unit}' does not fit, give it in a unit of {wanted}")
    return found(number)


def _check_room(bounds: Sequence[Constraint]) -> None:
    """Refuse bounds of a figure that no value fits between."""
    for lower in (c for c in bounds if not c.is_upper):
        for upper in (c for c in bounds if c.is_upper and c.figure == lower.figure):
            if lower.bound > upper.bound:
                raise RequestError(f"nothing can keep both {lower.text} and {upper.text}")


def read_bounds(system: System, request: OptimisationRequest) -> tuple[BoundedParameter, ...]:
    """Return the parameters of a request.

    Raises
    ------
    RequestError
        If there are none, or one is not there, not real, or has no room between its bounds.
    """
    if not request.vary:
        raise RequestError("nothing is varied: give --vary NAME=LOW:HIGH")
    found = tuple(BoundedParameter.read(system, name, text) for name, text in request.vary.items())
    check_distinct([b.parameter for b in found])
    return found


def sweep_request(request: OptimisationRequest, goal: Goal, bounds: Sequence[BoundedParameter]) -> SweepRequest:
    """Return what a sweep would be asked for to make the runs.

    Raises
    ------
    RequestError
        If the static force is both found and varied.
    """
    names = [name for b in bounds for name in (b.parameter.name, *b.parameter.targets)]
    if goal.mean_force and any(name.rpartition(".")[2] == STATIC_FORCE for name in names):
        raise RequestError(f"the {STATIC_FORCE} is found for the mean force, so it cannot be varied as well")
    force = {"mean_force": goal.mean_force} if goal.mean_force else {}
    return SweepRequest.read({"stop": request.stop, "tolerance": request.tolerance, **force})

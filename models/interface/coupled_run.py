"""A lumped pantograph on a line as one system, from Python; with the checks that the command makes too."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from models.arrays import FloatArray
from models.catenary import line_advice as limits
from models.catenary.definition.line_definition import SHORTEST_STEP
from models.catenary.line_model import CatenaryModel
from models.catenary.line_part import CatenaryPart, wires_at_rest
from models.catenary.strip_checks import check_strips, start_warning
from models.coupled.monolithic import CoupledModel, CoupledRecord
from models.definition_files.given_value import quantity
from models.definition_files.parameter import ParameterError
from models.interface.column_frames import column_frame
from models.interface.line_and_pantograph import Line, Pantograph, open_line, open_pantograph
from models.interface.line_statics import given
from models.pantograph.lumped.lumped_advice import working_height_warning
from models.pantograph.lumped.lumped_definition import LumpedDefinition

if TYPE_CHECKING:
    import pandas

#: Longest step of the monolithic run [s]: a contact lasts longer than it.
LONGEST_STEP: Final = 0.1
#: Time after the uplift acts fully in which a strip that can reach the wire has reached it [s].
LONGEST_RISE = 1.0
#: Steps of a run: enough for the filter, and not more than fit into memory.
FEWEST_STEPS, MOST_STEPS = 100, 10**7


@dataclass(frozen=True)
class CoupledRun:
    """The record of a pantograph on a line, a row per step, the start included; SI.

    Attributes
    ----------
    record : CoupledRecord
        All that was recorded; no promise is kept for this attribute.
    pantograph : LumpedDefinition
        As it ran; likewise.
    step : float
        Time step [s].
    warnings : tuple of str
        What deserves a second look.
    """

    record: CoupledRecord = field(repr=False)
    pantograph: LumpedDefinition = field(repr=False)
    step: float
    warnings: tuple[str, ...]

    @property
    def time(self) -> FloatArray:
        """Times [s], shape (n,)."""
        return self.record.time

    @property
    def force(self) -> FloatArray:
        """Contact force [N], shape (n,), not filtered."""
        return self.record.contact_force[:, 0]

    @property
    def position(self) -> FloatArray:
        """Position of the contact along the track [m], shape (n,)."""
        return contact_point(self.record, 0.0)[0]

    def frame(self) -> pandas.DataFrame:
        """Return the contact over time: position, force, height and place on the strip (needs pandas)."""
        titles = ("time [s]", "track_position [m]", "force [N]", "contact_height [m]", "lateral_position [m]")
        place = contact_point(self.record, self.pantograph.strip_offset)
        return column_frame(titles, (self.time, place[0], self.force, *place[1:]), True)

    def uplift_frame(self) -> pandas.DataFrame:
        """Return the uplift of every support over time (needs pandas)."""
        uplift = self.record.uplift
        titles = ("time [s]", *(f"support[{i + 1}].uplift [m]" for i in range(uplift.shape[1])))
        return column_frame(titles, (self.time, *uplift.T), True)


def couple(
    line: Line | str | Path,
    pantograph: Pantograph | str | Path,
    *,
    speed: float | str = "300 km/h",
    start: float | str | None = None,
    end: float | str | None = None,
    step: float | str = 1e-3,
    progress: Callable[[float], None] | None = None,
) -> CoupledRun:
    """Run a lumped pantograph on a line as one system, without FMUs and co-simulation.

    Parameters
    ----------
    line : Line, str or Path
        From `open_line`, or what it takes.
    pantograph : Pantograph, str or Path
        From `open_pantograph`, or what it takes. Its own speed and start are not used.
    speed : float or str
        In m/s or with a unit.
    start, end : float or str, optional
        Where the pantograph is raised and where the run ends [m]; by default well inside the line.
    step : float or str
        Time step [s].
    progress : callable, optional
        Called with the time after every step [s].

    Raises
    ------
    ParameterError
        If the run does not lie on the line, the pantograph is not a lumped one or never touches the wire, or another
        value cannot be meant.

    Examples
    --------
    >>> run = couple("LN2", "CX", speed="300 km/h", start=500.0, end=520.0)
    >>> len(run.time), round(float(run.position[-1]))
    (241, 520)
    """
    own = line if isinstance(line, Line) else open_line(line)
    carried = pantograph if isinstance(pantograph, Pantograph) else open_pantograph(pantograph)
    if not isinstance(carried.definition, LumpedDefinition):
        raise ParameterError(f"'{carried.name}' is a multibody model; couple needs a lumped one")
    time_step, fast = given("step", step, "s"), given("speed", speed, "m/s")
    check_step(time_step)
    model = CatenaryModel(own.definition)
    way = travelled(model, _place("start", start), _place("end", end))
    check_length(way, fast, time_step)
    moving = carried.definition.with_values({"speed": fast, "start_position": way[0]})
    coupled = CoupledModel(model, [moving])
    warnings = tuple(filter(None, (*advice(model, moving, time_step), *advice_at_start(coupled))))
    record = coupled.run((way[1] - way[0]) / fast, time_step, progress)
    check_touched(record, moving)
    return CoupledRun(record, moving, time_step, warnings)


def _place(name: str, value: float | str | None) -> float | None:
    try:
        return None if value is None else quantity(name, value, "m")
    except (TypeError, ValueError) as error:
        raise ParameterError(str(error)) from error


def contact_point(record: CoupledRecord, strip_offset: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return where the first pantograph touches: along the track, height, across the strip [m]; NaN without contact.

    Along the track the strip's position stands in where there is no contact.
    """
    point, touches = record.contact_point[:, 0], record.contact_force[:, 0] > 0.0
    position = np.where(touches, point[:, 0], record.position[:, 0])
    height, lateral = (np.where(touches, values, np.nan) for values in (point[:, 2], point[:, 1] - strip_offset))
    return position, height, lateral


def travelled(line: CatenaryModel, start: float | None, end: float | None) -> tuple[float, float]:
    """Return where a run begins and ends [m]: as given, or well inside the line.

    Raises
    ------
    ParameterError
        If that does not lie on the line.
    """
    first, last = line.wires[0].ends
    length = last - first
    start = start if start is not None else first + 0.2 * length
    end = end if end is not None else last - 0.2 * length
    furthest = math.inf if line.wires[0].period else last  # one that closes on itself is travelled on and on
    if first <= end <= start <= furthest:
        raise ParameterError(f"the run from {start:g} m to {end:g} m ends before it begins: give start below end")
    if not first <= start < end <= furthest:
        text = f"the run from {start:g} m to {end:g} m does not lie on the line, {first:g} m to {last:g} m"
        raise ParameterError(text)
    return start, end


def check_length(way: tuple[float, float], speed: float, step: float) -> None:
    """Refuse a run of too few or too many steps between two places [m] at a speed [m/s].

    Raises
    ------
    ParameterError
    """
    steps = (way[1] - way[0]) / (speed * step)
    if not FEWEST_STEPS <= steps <= MOST_STEPS:
        text = f"from {way[0]:g} m to {way[1]:g} m at {3.6 * speed:g} km/h takes {steps:.3g} steps"
        raise ParameterError(f"step {step:g} s: {text}, not {FEWEST_STEPS} to {MOST_STEPS:g}")


def check_step(step: float) -> None:
    """Refuse steps that no run can be made of [s].

    Raises
    ------
    ParameterError
    """
    if step > LONGEST_STEP or step < SHORTEST_STEP:
        raise ParameterError(f"step {step:g}: must lie between {SHORTEST_STEP:g} and {LONGEST_STEP:g} s")


def advice(line: CatenaryModel, pantograph: LumpedDefinition, step: float) -> tuple[str, ...]:
    """Return what deserves a second look, empty texts where nothing does."""
    return (
        limits.speed_warning(line.definition, pantograph.speed),
        limits.step_warning(line.definition, step, pantograph.stage[-1].mass),
        limits.slack_warning(CatenaryPart(line.definition).droppers, line.static.is_slack),
        limits.slack_law_warning(line.definition),
        limits.track_warning(line.definition),
        limits.surface_warning(line.definition, pantograph.speed, step),
    )


def advice_at_start(coupled: CoupledModel) -> tuple[str, ...]:
    """Refuse a strip that the line cannot be meant for; return what deserves a second look in how it starts."""
    wires, strips = wires_at_rest(coupled.line), coupled.strips
    force, point = coupled.contact_at_rest()
    forces = force.sum(axis=1)
    check_strips(wires, strips, forces)
    heights = (
        working_height_warning(p.definition, float(x), float(z))
        for p, (x, _, z) in zip(coupled.pantographs, point, strict=True)
    )
    return (start_warning(wires, strips, forces), *heights)


def check_touched(record: CoupledRecord, pantograph: LumpedDefinition) -> None:
    """Refuse a run in which the strip had time to reach the wire, and never did.

    Raises
    ------
    ParameterError
    """
    latest = pantograph.raise_start + pantograph.raise_duration + LONGEST_RISE
    if record.contact_force.any() or record.time[-1] <= latest:
        return
    raise ParameterError(
        f"'{pantograph.name}' never touches the wire (its strip ends at z = {record.strip_height[-1, 0]:.3f} m): "
        "check static_force, reference_height, strip_length and strip_offset against the wire's height and stagger"
    )

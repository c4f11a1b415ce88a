"""A line over temperature: tensions, movements, sags, waves, the room under bridges, and what norms say of them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from models.catenary.definition.line_definition import CatenaryDefinition
from models.catenary.definition.section_definition import Span
from models.catenary.definition.tensioning_definition import COLDEST, HOTTEST
from models.catenary.statics.temperature_table import LineAtTemperature, ruling, temperature_table
from models.catenary.statics.wire_waves import OPERATION_LIMIT
from models.definition_files.given_value import quantity
from models.definition_files.parameter import ParameterError
from models.definition_files.si_units import OFFSETS
from models.interface.column_frames import Table, Tabled
from models.interface.line_and_pantograph import Line, open_line
from models.interface.line_statics import LineStatics, given, listed, whole
from models.interface.norm_judgement import Judgement, verdict_word
from models.interface.support_verdicts import clearance_at_temperatures
from models.library.norm_tables import norm_sources, support_limits

#: 0 degC [K].
ZERO = OFFSETS["degC"]


@dataclass(frozen=True)
class LineOverTemperature(Tabled):
    """A section of a line at some temperatures; SI.

    Attributes
    ----------
    definition : CatenaryDefinition
        The line; no promise is kept for this attribute.
    section : int
        Index of the section, from 0.
    states : tuple of LineAtTemperature
        In the order in which they were asked for; no promise is kept for what is in them.
    """

    definition: CatenaryDefinition
    section: int
    states: tuple[LineAtTemperature, ...]

    def __repr__(self) -> str:
        return f"<LineOverTemperature of {self.definition.name}, {len(self.states)} temperatures>"

    @property
    def ruling(self) -> tuple[float, Span]:
        """Return the ruling span [m], and the span of nearest length in which sags are taken."""
        return ruling(self.definition.sections[self.section])

    @property
    def judgements(self) -> tuple[Judgement, ...]:
        """Return the verdicts on the largest loss of tension, the slowest waves and the room under bridges."""
        return tuple(self._judged())

    def _judged(self) -> Iterator[Judgement]:
        yield _loss(self.states)
        yield from _waves(self.states)
        highest = np.array([state.highest for state in self.states])
        temperatures = [state.temperature for state in self.states]
        yield from clearance_at_temperatures(self.definition.overbridge, temperatures, highest)

    @property
    def tables(self) -> dict[str, Table]:
        """Columns by name: ``temperature`` (a row for each), and ``tension`` (a row for each, span and wire).

        The wires of ``tension`` are counted from 1: contact wire, messenger wire, auxiliary wire.
        """
        columns = _columns(self.definition, self.states)
        parts = [
            (np.full(len(w.tension), state.temperature - ZERO), np.full(len(w.tension), k + 1.0), w.ends[:-1],
             w.ends[1:], w.tension)
            for state in self.states
            for k, w in enumerate(each.wire for each in state.wires)
        ]  # fmt: skip
        tension = ("temperature [degC]", "wire", "from [m]", "to [m]", "tension [N]")
        joined = tuple(np.concatenate(column) for column in zip(*parts, strict=True))
        return {"temperature": (tuple(columns), tuple(map(np.array, columns.values()))), "tension": (tension, joined)}


def over_temperature(
    line: LineStatics | Line | str | Path,
    temperatures: Iterable[float | str],
    *,
    section: int = 1,
    speed: float | str = "300 km/h",
) -> LineOverTemperature:
    """Find what a line with a table [tensioning] does at some temperatures.

    Parameters
    ----------
    line : LineStatics, Line, str or Path
        The line at rest from `statics`, whose section and speed are taken; or a line, or what `open_line` takes.
    temperatures : iterable of float or str
        In K, or with a unit: ``"-20 degC"``.
    section : int
        Section of a line with overlaps, from 1.
    speed : float or str
        Speed of the train for the wave figures, in m/s or with a unit.

    Raises
    ------
    ParameterError
        If the line says nothing of its tensioning, or section, speed or a temperature cannot be meant.
    EquilibriumError
        If the line has no equilibrium at one of the temperatures.

    Examples
    --------
    >>> over_temperature("LN2", ["15 degC"])  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    models.definition_files.parameter.ParameterError: line 'LN2' has no table [tensioning]: ...
    """
    if isinstance(line, LineStatics):
        definition, index, fast = line.model.definition, line.section, line.waves.train_speed
    else:
        definition = (line if isinstance(line, Line) else open_line(line)).definition
        whole("section", section)
        index, fast = section - 1, given("speed", speed, "m/s")
    if not 0 <= index < len(definition.sections):
        raise ParameterError(f"section {index + 1}: the line has sections 1 to {len(definition.sections)}")
    asked = [_kelvin(value) for value in listed("temperatures", temperatures, "['-20 degC', '15 degC']")]
    if not asked:
        raise ParameterError("temperatures: give at least one, '15 degC' say")
    return at_temperatures(definition, asked, index, fast)


def at_temperatures(
    definition: CatenaryDefinition, temperatures: Iterable[float], section: int, speed: float
) -> LineOverTemperature:
    """Return a section, counted from 0, at some temperatures [K], with waves at a train speed [m/s]."""
    return LineOverTemperature(definition, section, temperature_table(definition, temperatures, section, speed))


def checked_temperature(kelvin: float, given_as: str) -> float:
    """Return a temperature [K], unless no line is as cold or hot.

    Raises
    ------
    ParameterError
        That says how it was given.
    """
    if not COLDEST <= kelvin <= HOTTEST:
        span = f"{COLDEST - ZERO:g} ... {HOTTEST - ZERO:g}"
        raise ParameterError(f"{given_as}: is outside {span} degC, in which wires can be")
    return kelvin


def _kelvin(value: float | str) -> float:
    try:
        kelvin = quantity("temperature", value, "K")
    except (TypeError, ValueError) as error:
        raise ParameterError(str(error)) from error
    advice = "" if isinstance(value, str) else f" (a number is in K; write '{value:g} degC')"
    return checked_temperature(kelvin, f"temperature {value}{advice}")


def _columns(definition: CatenaryDefinition, states: Sequence[LineAtTemperature]) -> dict[str, list[float]]:
    columns = {"temperature [degC]": [s.temperature - ZERO for s in states]}
    for k, each in enumerate(states[0].wires):
        wires, name = [s.wires[k] for s in states], each.wire.component
        columns |= {
            f"{name} at the tensioner [N]": [w.wire.at_tensioner for w in wires],
            f"{name} at the fixed point [N]": [w.wire.at_fixed_point for w in wires],
            f"{name} loss [N]": [w.wire.loss for w in wires],
            f"{name} D [m]": [w.wire.movement for w in wires],
            f"{name} D_v [m]": [w.weight_movement for w in wires],
            f"{name} sag [m]": [w.sag for w in wires],
        }
    columns |= {
        "cantilever angle [deg]": [math.degrees(s.cantilever_angle) for s in states],
        "stagger change [m]": [s.stagger_change for s in states],
        "dropper slant [1]": [s.dropper_slant for s in states],
        "wave speed [km/h]": [3.6 * s.waves.speed for s in states],
        "reflection factor [1]": [s.waves.reflection for s in states],
        "Doppler factor [1]": [s.waves.doppler for s in states],
    }
    for k, over in enumerate(definition.overbridge):
        columns[f"clearance under bridge {k + 1} [m]"] = [over.underside - float(s.highest[k]) for s in states]
    return columns


def _loss(states: Sequence[LineAtTemperature]) -> Judgement:
    losses = [(w.wire.loss / w.wire.nominal, s.temperature - ZERO, w.wire.component) for s in states for w in s.wires]
    share, temperature, component = max(losses)
    largest = support_limits().largest_loss
    return Judgement(
        "largest loss of tension [% of nominal]",
        f"{100.0 * share:.1f}, {component.replace('_', ' ')} at {temperature:g} degC",
        verdict_word(is_kept=share <= largest),
        f"{100.0 * largest:g} (TB 10009-2016)",
        norm_sources("supports")["largest_loss"],
    )


def _waves(states: Sequence[LineAtTemperature]) -> Iterator[Judgement]:
    """Yield the verdict on the speed of the train where waves are slowest."""
    slowest = min(states, key=lambda state: state.waves.speed)
    speed, C = slowest.waves.train_speed, slowest.waves.speed
    if speed > 0.0:
        yield Judgement(
            f"{3.6 * speed:g} km/h over the slowest wave speed [1]",
            f"{speed / C:.3f}, {3.6 * C:.1f} km/h at {slowest.temperature - ZERO:g} degC",
            verdict_word(is_kept=speed <= OPERATION_LIMIT * C),
            f"{OPERATION_LIMIT:g} (EN 50119)",
            "EN 50119, as section 2.1 of the 2012 thesis gives it",
        )

"""A line at rest in a steady wind from either side: how far its contact wire is blown, and whether it may be."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from models.arrays import BoolArray, FloatArray
from models.catenary.definition.line_definition import CatenaryDefinition
from models.catenary.definition.wind_definition import DesignWind, Wind
from models.catenary.line_model import CatenaryModel
from models.catenary.shape.line_mesh import contact_wire_height
from models.catenary.shape.support_places import SupportPlaces
from models.catenary.shape.track import track_at
from models.catenary.statics.blow_off import BlowOff, blow_off
from models.definition_files.parameter import ParameterError
from models.interface.column_frames import Table, Tabled
from models.interface.line_and_pantograph import Line, open_line
from models.interface.line_statics import LineStatics, given, whole
from models.interface.norm_judgement import Judgement, verdict_word
from models.library.norm_tables import lateral_norm

#: Strongest wind that is meant [m/s], [Pa].
_FASTEST: Final = 100.0
_HIGHEST: Final = 50e3
#: Farthest from the middle of the track that a wire can be meant to be [m].
_FARTHEST: Final = 2.0


@dataclass(frozen=True)
class LineInWind(Tabled):
    """A section of a line in the wind, from either side, and what it may be blown by; SI.

    Attributes
    ----------
    pressure : float
        1/2 rho V^2 G_q [Pa].
    found : BlowOff
        Offsets as found; no promise is kept for this attribute.
    start, end : ndarray, shape (n_spans,)
        Of every span [m].
    limit : ndarray, shape (n_spans,)
        Permissible offset [m]; NaN where none is known, or no strip runs.
    works : ndarray of bool, shape (n_spans,)
        Whether the wire is at its working height.
    source : str
        Where the limit is from.
    """

    pressure: float
    found: BlowOff
    start: FloatArray
    end: FloatArray
    limit: FloatArray
    works: BoolArray
    source: str

    def __repr__(self) -> str:
        return f"<LineInWind of {self.pressure:.0f} Pa, {len(self.start)} spans>"

    @property
    def offset(self) -> FloatArray:
        """Return the largest distance of the contact wire from the middle of the track, span by span [m]."""
        return self.found.offset

    @property
    def judgements(self) -> tuple[Judgement, ...]:
        """Return the verdict on the span that is nearest to its limit, or farthest beyond it; none without a limit."""
        return tuple(self._judged())

    def _judged(self) -> Iterator[Judgement]:
        known = np.flatnonzero(np.isfinite(self.limit))
        if known.size:
            worst = int(known[(self.limit - self.offset)[known].argmin()])
            beyond = int((self.offset[known] > self.limit[known]).sum())
            spans = f"; {beyond} of {known.size} spans beyond" if beyond else ""
            yield Judgement(
                "offset in the wind, worst span [mm]",
                f"{1e3 * self.offset[worst]:.0f} in span {worst + 1}{spans}",
                verdict_word(is_kept=not beyond),
                f"{1e3 * self.limit[worst]:.0f} there",
                self.source,
            )

    @property
    def tables(self) -> dict[str, Table]:
        """Columns by name: ``wind`` (span by span), ``plan`` (the wire without wind and with it), ``arms``."""
        f = self.found
        spans = {
            "from [m]": self.start,
            "to [m]": self.end,
            "offset [m]": f.offset,
            "offset of a string [m]": f.string,
            "limit [m]": self.limit,
            "blown from the line between clamps [m]": f.blown,
            "the same of a string [m]": f.string_blown,
        }
        plan = {"x [m]": f.x, "y [m]": f.still, "y, wind to the left [m]": f.to_left,
                "y, wind to the right [m]": f.to_right}  # fmt: skip
        rise = f.lift.reshape(-1, 2)
        arms = {"x [m]": f.arm_x, "rise, wind to the left [m]": rise[:, 0], "rise, wind to the right [m]": rise[:, 1]}
        every = {"wind": spans, "plan": plan, "arms": arms}
        return {name: (tuple(columns), tuple(columns.values())) for name, columns in every.items()}


def in_wind(
    line: LineStatics | Line | str | Path,
    *,
    speed: float | str | None = None,
    pressure: float | str | None = None,
    limit: float | str | None = None,
    head: int | str | None = None,
    section: int = 1,
) -> LineInWind:
    """Find how far a steady wind across a line blows its contact wire, from either side.

    Parameters
    ----------
    line : LineStatics, Line, str or Path
        The line at rest from `statics`, whose section is taken; or a line, or what `open_line` takes.
    speed : float or str, optional
        Of the wind, in m/s or with a unit; by default that of the line's file.
    pressure : float or str, optional
        In place of the speed: 1/2 rho V^2 G_q, in Pa or with a unit.
    limit : float or str, optional
        How far the wire may be from the middle of the track, in m or with a unit.
    head : {1600, 1950}, optional
        In place of the limit: the permissible deviation for a pantograph head of so many mm.
    section : int
        Section of a line with overlaps, from 1.

    Raises
    ------
    ParameterError
        If the wind, the limit or the section cannot be meant, or no deviation is known for the line's height.

    Examples
    --------
    >>> blown = in_wind("EN50318_2002", speed="20 m/s", limit="0.4 m")
    >>> round(blown.pressure, 1), blown.judgements[0].word
    (250.0, 'passed')
    """
    definition, index = _section(line, section)
    own, chosen = asked_limit(limit, head)
    _, force = asked_wind(
        definition,
        None if speed is None else given("speed", speed, "m/s", fastest=math.inf),
        None if pressure is None else given("pressure", pressure, "Pa"),
        ("speed", "pressure"),
    )
    model = line.model if isinstance(line, LineStatics) else CatenaryModel(definition)
    return in_the_wind(model, index, force, own, chosen)


def asked_wind(
    definition: CatenaryDefinition, speed: float | None, pressure: float | None, names: tuple[str, str]
) -> tuple[DesignWind, float]:
    """Return the wind of a line's definition with another speed [m/s] or pressure [Pa], and its pressure.

    Parameters
    ----------
    names : (str, str)
        What speed and pressure are called where they were given.

    Raises
    ------
    ParameterError
        If it is stronger than any wind, or both are given.
    """
    wind = (definition.wind or Wind()).design
    if speed is not None and pressure is not None:
        raise ParameterError(f"{names[0]} and {names[1]} both say how strong the wind is: give one of them")
    for name, value, most, unit in zip(names, (speed, pressure), (_FASTEST, _HIGHEST), ("m/s", "Pa"), strict=True):
        if value is not None and value > most:
            raise ParameterError(f"{name} {value:g}: no wind is stronger than {most:g} {unit}; check the unit")
    if speed is not None:
        wind = replace(wind, speed=speed)
    return wind, wind.pressure if pressure is None else pressure


def asked_limit(limit: float | str | None, head: int | str | None) -> tuple[float | None, str | None]:
    """Return a limit from Python [m] and the name of a head, as far as they are given.

    Raises
    ------
    ParameterError
        If both are given, the limit is none, or there is no such head.
    """
    if limit is not None and head is not None:
        raise ParameterError("limit and head both say how far the wire may be blown: give one of them")
    names = [h.name for h in lateral_norm().head]
    if head is not None and str(head) not in names:
        raise ParameterError(f"head {head}: there are {', '.join(names)}")
    return None if limit is None else given("limit", limit, "m"), None if head is None else str(head)


def check_limit(limit: float) -> None:
    """Refuse a permissible offset that is none [m].

    Raises
    ------
    ParameterError
    """
    if limit > _FARTHEST:
        raise ParameterError(
            f"limit {limit:g} m: no wire may be as far from the middle of the track, {_FARTHEST:g} m at most; check "
            "the unit"
        )


def in_the_wind(model: CatenaryModel, index: int, pressure: float, limit: float | None, head: str | None) -> LineInWind:
    """Return a section, counted from 0, of a line at rest in a wind of some pressure [Pa].

    Raises
    ------
    ParameterError
        If the limit is none, or a height is outside the range of the permissible deviations.
    """
    if limit is not None:
        check_limit(limit)
    definition = model.definition
    section = definition.sections[index]
    start, end = np.array([s.start for s in section.spans]), np.array([s.end for s in section.spans])
    first, last = (start[0], end[-1]) if section.periodic else section.ends.working
    limits = np.full(len(start), math.nan)
    works = (start >= first) & (end <= last)
    for k in np.flatnonzero(works).tolist():
        limits[k] = _limit(definition, index, float(start[k]), float(end[k]), limit, head)
    source = "as asked for" if head is None else f"EN 50367 and EN 15273, head of {head} mm (norms/lateral.toml)"
    return LineInWind(pressure, blow_off(model, pressure, index), start, end, limits, works, source)


def _section(line: LineStatics | Line | str | Path, number: int) -> tuple[CatenaryDefinition, int]:
    """Return the definition of a line and the index of a section of it, from 0."""
    if isinstance(line, LineStatics):
        return line.model.definition, line.section
    definition = (line if isinstance(line, Line) else open_line(line)).definition
    whole("section", number)
    if not 1 <= number <= len(definition.sections):
        raise ParameterError(f"section {number}: the line has sections 1 to {len(definition.sections)}")
    return definition, number - 1


def _limit(
    definition: CatenaryDefinition, section: int, start: float, end: float, limit: float | None, head: str | None
) -> float:
    """Return the permissible offset in a span [m]: as given, or by the head with the span's curvature and cant."""
    if head is None:
        return math.nan if limit is None else limit
    places = SupportPlaces(definition, definition.sections[section])
    # The higher the wire, the less is permissible.
    height = max(contact_wire_height(places, x) for x in (start, end))
    curvature = cant = 0.0
    if definition.track is not None:
        along = track_at(definition.track, np.linspace(start, end, 51))
        curvature = float(np.abs(along.curvature).max())
        cant = float(np.abs(np.sin(along.cant)).max() * definition.track.base)
    return lateral_norm().permissible(head, height, curvature, cant).permissible

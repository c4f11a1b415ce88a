"""How long spans may be, and how tight curves, in the wind: tables for a contact wire as a string."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from models.arrays import FloatArray
from models.catenary.condition.faults import active_of
from models.catenary.condition.line_condition import find_condition
from models.catenary.definition.fault_definition import TensionLoss
from models.catenary.definition.line_definition import CatenaryDefinition
from models.catenary.definition.track_definition import TIGHTEST_RADIUS
from models.catenary.shape.kept_form import kept_form
from models.catenary.shape.line_mesh import build_mesh, contact_wire_height
from models.catenary.shape.support_places import SupportPlaces
from models.catenary.statics.found_tension import found_tension
from models.catenary.statics.span_table import LENGTHS, Limit, String, radii
from models.definition_files.given_value import quantity
from models.definition_files.parameter import ParameterError
from models.interface.column_frames import Table, Tabled
from models.interface.line_and_pantograph import Line, open_line
from models.interface.line_in_wind import asked_limit, asked_wind, check_limit
from models.interface.line_statics import given, listed
from models.library.norm_tables import lateral_norm

#: Radii for which the largest span is given unless others are asked for; infinite: straight track [m].
RADII: Final = (200.0, 300.0, 400.0, 500.0, 600.0, 800.0, 1000.0, 1500.0, 2000.0, 3000.0, 5000.0, math.inf)
#: Largest stagger [m], as in definitions.
_WIDEST: Final = 1.0
#: Staggers at both ends of a span, positive to the outside of the curve [m].
Staggers = tuple[float, float]


@dataclass(frozen=True)
class SpanTable(Tabled):
    """Smallest radius for a span and largest span for a radius, for pairs of staggers; SI.

    Attributes
    ----------
    pressure, force, tension, limit : float
        Of the wind [Pa], its force on the contact wire [N/m], the wire's tension [N], the permissible offset, of a head
        that on straight track [m].
    staggers : tuple of (float, float)
        At both ends of a span, positive to the outside of the curve [m].
    lengths : tuple of float
        Of spans [m].
    smallest_radius : ndarray, shape (n_staggers, n_lengths)
        [m]; NaN where no curve keeps within the limit.
    radii : tuple of float
        [m]; infinite for straight track.
    largest_span : ndarray, shape (n_staggers, n_radii)
        [m]; NaN where the staggers alone are beyond the limit, infinite where no wind moves the wire.
    limits : tuple of float
        Permissible offset at every radius [m].
    head : str
        Of which pantograph head the limit is, empty if it was given.
    """

    is_indexed = True

    pressure: float
    force: float
    tension: float
    limit: float
    staggers: tuple[Staggers, ...]
    lengths: tuple[float, ...]
    smallest_radius: FloatArray
    radii: tuple[float, ...]
    largest_span: FloatArray
    limits: tuple[float, ...]
    head: str = ""

    def __repr__(self) -> str:
        return f"<SpanTable at {self.pressure:.0f} Pa, limit {self.limit:g} m>"

    @property
    def names(self) -> tuple[str, ...]:
        """Return the pairs of staggers as text."""
        return tuple(" / ".join(f"{100.0 * b:+g} cm" for b in pair) for pair in self.staggers)

    @property
    def tables(self) -> dict[str, Table]:
        """Columns by name: ``radii`` (smallest radius by span) and ``spans`` (largest span and a head's limit)."""
        return {
            "radii": (("span [m]", *self.names), (np.array(self.lengths), *self.smallest_radius)),
            "spans": (
                ("radius [m]", *self.names, *(["limit [m]"] if self.head else [])),
                (np.array(self.radii), *self.largest_span, *([np.array(self.limits)] if self.head else [])),
            ),
        }


def span_table(
    line: Line | str | Path,
    *,
    speed: float | str | None = None,
    pressure: float | str | None = None,
    limit: float | str | None = None,
    head: int | str | None = None,
    radii: Sequence[float | str] = (),
    staggers: Sequence[tuple[float | str, float | str]] = (),
) -> SpanTable:
    """Find the smallest radius for every span, and the largest span for every radius, in a steady wind.

    Parameters
    ----------
    line : Line, str or Path
        From `open_line`, or what it takes.
    speed, pressure : float or str, optional
        Of the wind, in m/s or Pa, or with a unit; by default the speed of the line's file.
    limit : float or str, optional
        How far the wire may be from the middle of the track, in m or with a unit; it or a head is needed.
    head : {1600, 1950}, optional
        In place of the limit: the permissible deviation for a pantograph head of so many mm, by the curve; of more
        cant than 66 mm it takes no account.
    radii : sequence of float or str, optional
        For the largest span, in m or with a unit.
    staggers : sequence of pairs, optional
        At both ends of a span, positive to the outside of the curve, in m or with a unit; by default the line's
        largest, alternating and not.

    Raises
    ------
    ParameterError
        If wind or limit cannot be meant, or neither limit nor head is given.

    Examples
    --------
    >>> table = span_table("CA160", pressure=961.04, limit=0.55, radii=[800], staggers=[(0.2, 0.2)])
    >>> round(float(table.largest_span[0, 0]), 2)
    53.88
    """
    definition = (line if isinstance(line, Line) else open_line(line)).definition
    own, chosen = asked_limit(limit, head)
    if own is None and chosen is None:
        raise ParameterError("how far may the wire be blown? give limit, in m, or head, 1600 or 1950")
    return tabulated(
        definition,
        None if speed is None else given("speed", speed, "m/s", fastest=math.inf),
        None if pressure is None else given("pressure", pressure, "Pa"),
        own,
        chosen or "",
        [given("radius", R, "m") for R in listed("radii", radii, "[800, 1200]")],
        [_pair(pair) for pair in listed("staggers", staggers, "[(0.2, -0.2)]")],
        ("speed", "pressure"),
    )


def tabulated(
    definition: CatenaryDefinition,
    speed: float | None,
    pressure: float | None,
    limit: float | None,
    head: str,
    wanted: Sequence[float],
    staggers: Sequence[Staggers],
    names: tuple[str, str],
) -> SpanTable:
    """Return the tables of a line for a limit or a head, all in SI; `names` are what speed and pressure are called.

    Raises
    ------
    ParameterError
        If wind, limit, a radius or a stagger cannot be meant.
    """
    if limit is not None:
        check_limit(limit)
    permissible = head_limit(definition, head) if limit is None else lambda curvature: limit
    _check(wanted, staggers)
    wind, found = asked_wind(definition, speed, pressure, names)
    string = String(_tension(definition), wind.force(definition.contact_wire.width, found))
    pairs, asked = tuple(staggers or _own_staggers(definition)), tuple(wanted or RADII)
    return SpanTable(
        pressure=found,
        force=string.wind,
        tension=string.tension,
        limit=permissible(0.0),
        staggers=pairs,
        lengths=LENGTHS,
        smallest_radius=np.array([radii(string, permissible, *pair) for pair in pairs]),
        radii=asked,
        largest_span=np.array(
            [[string.largest_span(permissible(1.0 / R), 1.0 / R, *pair) for R in asked] for pair in pairs]
        ),
        limits=tuple(permissible(1.0 / R) for R in asked),
        head=head,
    )


def head_limit(definition: CatenaryDefinition, head: str) -> Limit:
    """Return the permissible offset of a head by the curvature of the track, at the line's largest height.

    The cant of a curve that is only a row of a table is not known: the limit holds for as much as needs no allowance.

    Raises
    ------
    ParameterError
        If the height is outside the range of the permissible deviations.
    """
    height = max(_heights(definition), default=definition.profile.contact_wire_height)
    norm = lateral_norm()
    return lambda curvature: norm.permissible(head, height, curvature, 0.0).permissible


def _heights(definition: CatenaryDefinition) -> Iterator[float]:
    """Yield the heights of the contact wire at the supports where it is at its working height [m]."""
    for section in definition.sections:
        places = SupportPlaces(definition, section)
        first, last = (-math.inf, math.inf) if section.periodic else section.ends.working
        yield from (contact_wire_height(places, s.x) for s in section.inner_supports if first <= s.x <= last)


def _own_staggers(definition: CatenaryDefinition) -> list[Staggers]:
    """Return the line's largest stagger, alternating and not [m]."""
    largest = max((abs(s.stagger) for section in definition.sections for s in section.inner_supports), default=0.0)
    return [(largest, -largest), (largest, largest)] if largest else [(0.0, 0.0)]


def _tension(definition: CatenaryDefinition) -> float:
    """Return the tension of the contact wire, in another condition than the design's the least that it has [N]."""
    is_design = definition.tensioning is None or definition.tensioning.is_design
    if is_design and not any(active_of(definition, TensionLoss)):
        return definition.contact_wire.tension
    static = find_condition(kept_form(definition, build_mesh(definition)))
    return min(
        float(found_tension(static, "contact_wire", index, np.array([0.5 * (s.start + s.end)]))[0])
        for index, section in enumerate(definition.sections)
        for s in section.spans
    )


def _check(radii: Sequence[float], staggers: Sequence[Staggers]) -> None:
    """Refuse radii that no track has, and staggers beyond those that a definition may have."""
    for R in radii:
        if R < TIGHTEST_RADIUS:
            raise ParameterError(f"radius {R:g} m: no track is as tight; {TIGHTEST_RADIUS:g} m or more")
    for b in (b for pair in staggers for b in pair):
        if abs(b) > _WIDEST:
            raise ParameterError(f"stagger {b:g} m is outside -{_WIDEST:g} ... {_WIDEST:g} m: check its unit")


def _pair(pair: Sequence[float | str]) -> Staggers:
    if isinstance(pair, str) or not isinstance(pair, Sequence) or len(pair) != 2:
        raise ParameterError(f"staggers: {pair!r} is not a pair, of both ends of a span; write [(0.2, -0.2)]")
    return _stagger(pair[0]), _stagger(pair[1])


def _stagger(value: float | str) -> float:
    try:
        return quantity("stagger", value, "m")
    except (TypeError, ValueError) as error:
        raise ParameterError(str(error)) from error

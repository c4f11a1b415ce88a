"""Reading a line's definition file, and checking what its tables say of one another."""

from __future__ import annotations

import dataclasses
import math
from bisect import bisect_right
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

from models.catenary.definition.fault_reading import check_faults, read_faults
from models.catenary.definition.line_definition import LINE_TYPES, CatenaryDefinition
from models.catenary.definition.overbridge_definition import Overbridge
from models.catenary.definition.section_definition import Section
from models.catenary.definition.section_reading import SECTION_TABLES, read_section
from models.catenary.definition.surface_definition import RunningSurface
from models.catenary.definition.surface_reading import place_problem, with_surface
from models.definition_files import field_schema
from models.definition_files.toml_reader import Table


def load(path: Path, *, carried: bool = False) -> CatenaryDefinition:
    """Read a line's definition file.

    Parameters
    ----------
    path : Path
    carried : bool
        Whether the files that it names lie beside it under the names that they have in an FMU.

    Raises
    ------
    DefinitionError
        With every mistake found in the file.
    """
    return read(Table.load(path), carried=carried)


def read(table: Table, *, carried: bool = False) -> CatenaryDefinition:
    """Read a line's definition from a parsed table; raises ``DefinitionError``."""
    line = field_schema.read(CatenaryDefinition, table, sections=(), provenance=table.provenance)
    has_arms, has_hangers = line.steady_arm is not None, line.type == "compound"
    tables = table.tables("section") or [table]
    if table.has("section"):
        _check_places(table)
    sections = tuple(read_section(t, has_arms=has_arms, has_hangers=has_hangers) for t in tables)
    faults = table.tables("fault")
    overbridges = table.tables("overbridge")
    over = tuple(field_schema.read(Overbridge, t) for t in overbridges)
    definition = dataclasses.replace(line, sections=sections, fault=read_faults(faults), overbridge=over)
    if line.running_surface is not None:
        surface = with_surface(table, line.running_surface, carried=carried)
        definition = dataclasses.replace(definition, running_surface=surface)
        _check_profile(table, surface, sections)
    for check in (_check_type, _check_stitch, _check_auxiliary, _check_periodic, _check_track, _check_tensioning):
        check(table, definition)
    check_faults(faults, definition)
    _check_overbridges(overbridges, definition)
    table.finish()
    return definition


def _check_profile(table: Table, surface: RunningSurface, sections: Sequence[Section]) -> None:
    """Check that a measured running surface is one of a wire of the line."""
    if surface.points:
        found = [place_problem(surface.points, section) for section in sections]
        if all(found):
            table.problem("running_surface.profile", f"{surface.profile}: {found[0]}")


def _check_places(table: Table) -> None:
    """Check that what belongs to sections is written there, if the line has several."""
    for name in SECTION_TABLES:
        if table.offers(name):
            table.problem(name, f"every section has its own: write [section.{name}] below its [[section]]")


def _check_stitch(table: Table, definition: CatenaryDefinition) -> None:
    stitch = definition.stitch_wire
    if stitch is None:
        return
    if stitch.tension >= definition.messenger_wire.tension:
        table.problem("stitch_wire.tension", "must be less than that of the messenger wire, which it relieves")
    for section in definition.sections:
        _check_stitch_length(table, section, stitch.length)


def _check_stitch_length(table: Table, section: Section, length: float) -> None:
    """Check that stitch wires do not meet, and carry droppers on both sides of every support."""
    half = length / 2.0
    supports = [s.x for s in section.supports]
    if any(b - a <= length for a, b in pairwise(supports)):
        table.problem("stitch_wire.length", f"{length:g} m: the stitch wires of neighbouring supports overlap")
        return
    first, last = section.ends.working
    droppers = sorted(x for span in section.spans for x in span.droppers)
    for support in (x for x in supports[1:-1] if first <= x <= last):
        left = _any_between(droppers, support - half, support)
        if not (left and _any_between(droppers, support, support + half)):
            text = f"{length:g} m: no dropper hangs on one half of the stitch wire at {support:g} m"
            table.problem("stitch_wire.length", text)
            return


def _any_between(x: Sequence[float], low: float, high: float) -> bool:
    """Return whether one of the values, in rising order, lies between two others."""
    after = bisect_right(x, low)
    return after < len(x) and x[after] < high


def _check_auxiliary(table: Table, definition: CatenaryDefinition) -> None:
    profile = definition.profile
    height = profile.auxiliary_height
    own = [s.encumbrance for section in definition.sections for s in section.supports if s.encumbrance is not None]
    encumbrance = min(own, default=profile.encumbrance)
    if height is not None and height >= encumbrance:
        text = f"{height:g} m: the auxiliary wire must lie below the encumbrance, {encumbrance:g} m"
        table.problem("profile.auxiliary_height", text)


def _check_track(table: Table, definition: CatenaryDefinition) -> None:
    """Check that a track says something, and that of a line that closes on itself is the same all around."""
    track = definition.track
    if track is None:
        return
    if not {"curvature", "radius", "cant", "vertical_curvature"} & set(table.data["track"]):
        table.problem("track", "says nothing of the track: give curvature (or radius), cant or vertical_curvature")
    for key, entry in table.data["track"].items():
        if isinstance(entry, list) and entry[:1] == [[]]:
            table.problem(f"track.{key}", "gives no value: one for each position is needed, and one position at least")
    if any(section.periodic for section in definition.sections) and track.positions and not track.is_constant:
        text = "a line that closes on itself takes a constant track only: the same values at every position"
        table.problem("track.positions", text)


def _check_tensioning(table: Table, definition: CatenaryDefinition) -> None:
    """Check that wires have ends that devices can hold, and that places and sides belong to the one section."""
    tensioning, sections = definition.tensioning, definition.sections
    if tensioning is None:
        return
    if any(section.periodic for section in sections):
        table.problem(
            "tensioning", "a line that closes on itself has no ends that devices could hold: remove the table"
        )
        return
    if tensioning.auxiliary_wire is not None and definition.auxiliary_wire is None:
        table.problem("tensioning.auxiliary_wire", "the line has no auxiliary wire: remove this table")
    supports = [len(section.inner_supports) for section in sections]
    given = len(tensioning.mast_side)
    if given != 1 and (len(sections) > 1 or given != supports[0]):
        count = "one, for all sections" if len(sections) > 1 else f"one, or one for each of the {supports[0]} supports"
        table.problem("tensioning.mast_side", f"gives {given} values: give {count}")
    fixed = tensioning.fixed_point
    if fixed is None:
        return
    start, end = sections[0].spans[0].start, sections[0].spans[-1].end
    if len(sections) > 1:
        text = "is of one section, and the line has several: leave it out, and each is fixed in its middle"
        table.problem("tensioning.fixed_point", text)
    elif not start <= fixed <= end:
        table.problem("tensioning.fixed_point", f"{fixed:g} m lies outside the line, {start:g} ... {end:g} m")


def _check_periodic(table: Table, definition: CatenaryDefinition) -> None:
    """Check that a periodic line is one section of wires that something holds, none of them across the seam."""
    if not any(section.periodic for section in definition.sections):
        return
    if len(definition.sections) > 1:
        text = f"{len(definition.sections)} sections: a periodic line has one; write one section, or no 'periodic'"
        table.problem("section", text)
    if definition.steady_arm is None:
        text = "a periodic line needs a table [steady_arm]: it has no anchors, and nothing else holds the contact wire"
        table.problem("steady_arm", text)
    if definition.stitch_wire is not None:
        text = "a periodic line cannot have stitch wires: the one at its first support would lie across the seam"
        table.problem("stitch_wire", f"{text}; take type 'simple' or 'compound'")


def _check_overbridges(tables: Sequence[Table], definition: CatenaryDefinition) -> None:
    """Check that every bridge stands over the line, and no two have one name, by which verdicts call them."""
    first = min((section.spans[0].start for section in definition.sections if section.spans), default=-math.inf)
    last = max((section.spans[-1].end for section in definition.sections if section.spans), default=math.inf)
    seen: dict[str, int] = {}
    for number, (table, over) in enumerate(zip(tables, definition.overbridge, strict=True), 1):
        if other := seen.get(over.name):
            table.problem("name", f"'{over.name}' is that of overbridge[{other}] already: give it another one")
        seen[over.name or f"overbridge[{number}]"] = number
        mistaken = table.mistaken(("start", "end"))
        for key, x in (("start", over.start), ("end", over.end)):
            if key not in mistaken and not first <= x <= last:
                table.problem(key, f"{x:g} m lies outside the line, {first:g} ... {last:g} m")


def _check_type(table: Table, definition: CatenaryDefinition) -> None:
    if definition.type not in LINE_TYPES:
        return  # already reported
    stitched, compound = definition.type == "stitched", definition.type == "compound"
    if stitched != (definition.stitch_wire is not None):
        table.problem("stitch_wire", "a table [stitch_wire] is needed for type 'stitched', and only for it")
    if compound != (definition.auxiliary_wire is not None):
        table.problem("auxiliary_wire", "a table [auxiliary_wire] is needed for type 'compound', and only for it")
    if compound != table.has("hanger"):
        table.problem("hanger", "a table [hanger] is needed for type 'compound', and only for it")
    if compound != (definition.profile.auxiliary_height is not None):
        table.problem("profile.auxiliary_height", "is needed for type 'compound', and only for it")

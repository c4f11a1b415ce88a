"""Line reading."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

from models.catenary.definition.line_definition import (
    COMPONENTS,
    LINE_TYPES,
    SHORTEST_STEP,
    SLACK_LAWS,
    CatenaryDefinition,
    Clamps,
    Contact,
    Damping,
    Dropper,
    Dynamics,
    Mesh,
    MessengerSupport,
    Profile,
    Rayleigh,
    Section,
    SteadyArm,
    StitchWire,
    Wire,
)
from models.catenary.definition.section_reading import _read_section
from models.contact_law import CONTACT_LAWS
from models.definition_files import field_schema
from models.definition_files.toml_reader import Table


def load(path: Path) -> CatenaryDefinition:
    """Read a line's definition file.

    Raises
    ------
    DefinitionError
        With every mistake found in the file.
    """
    return read(Table.load(path))


def read(table: Table) -> CatenaryDefinition:
    """Read a line's definition from a parsed table; raises ``DefinitionError``."""
    line_type = table.text("type", choices=LINE_TYPES)
    stitch = table.table("stitch_wire")
    auxiliary = table.table("auxiliary_wire")
    arm = table.table("steady_arm")
    support = table.table("messenger_support")
    hanger = table.table("hanger")
    profile_table = table.required_table("profile")
    profile = field_schema.read(Profile, profile_table)
    sections = tuple(
        _read_section(t, has_arms=arm is not None, has_hangers=line_type == "compound")
        for t in table.tables("section") or [table]
    )
    _check_type(table, line_type, stitch, auxiliary, profile)
    definition = CatenaryDefinition(
        name=table.text("name"),
        title=table.text("title", default=""),
        type=line_type,  # type: ignore[arg-type]
        profile=profile,
        contact_wire=field_schema.read(Wire, table.required_table("contact_wire")),
        messenger_wire=field_schema.read(Wire, table.required_table("messenger_wire")),
        dropper=_read_dropper(table.required_table("dropper")),
        clamps=field_schema.read(Clamps, table.table("clamps") or Table.from_dict({})),
        damping=_read_damping(table.required_table("damping")),
        contact=_read_contact(table.table("contact") or Table.from_dict({})),
        mesh=field_schema.read(Mesh, table.table("mesh") or Table.from_dict({})),
        sections=sections,
        stitch_wire=field_schema.read(StitchWire, stitch) if stitch is not None else None,
        auxiliary_wire=field_schema.read(Wire, auxiliary) if auxiliary is not None else None,
        hanger=_read_dropper(hanger) if hanger is not None else None,
        steady_arm=field_schema.read(SteadyArm, arm) if arm is not None else None,
        messenger_support=field_schema.read(MessengerSupport, support) if support is not None else None,
        dynamics=field_schema.read(Dynamics, table.table("dynamics") or Table.from_dict({})),
        pre_sag_between=profile_table.text("pre_sag_between", default="supports", choices=("supports", "droppers")),
        time_step=table.quantity("time_step", "s", default=1e-3, minimum=SHORTEST_STEP, maximum=0.1),
        provenance=table.provenance,
    )
    _check_stitch(table, definition)
    _check_auxiliary(table, profile)
    _check_periodic(table, definition)
    table.finish()
    return definition


def _check_stitch(table: Table, definition: CatenaryDefinition) -> None:
    stitch = definition.stitch_wire
    if stitch is None:
        return
    if stitch.tension >= definition.messenger_wire.tension:
        table.problem("stitch_wire.tension", "must be less than that of the messenger wire, which it relieves")
    for section in definition.sections:
        _check_stitch_length(table, section, stitch.length)


def _check_stitch_length(table: Table, section: Section, length: float) -> None:
    """Stitch wires must not meet, and must carry droppers on both sides of every support."""
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
    """Whether one of the values, in rising order, lies between two others."""
    after = bisect_right(x, low)
    return after < len(x) and x[after] < high


def _check_auxiliary(table: Table, profile: Profile) -> None:
    height = profile.auxiliary_height
    if height is not None and height >= profile.encumbrance:
        text = f"{height:g} m: the auxiliary wire must lie below the encumbrance, {profile.encumbrance:g} m"
        table.problem("profile.auxiliary_height", text)


def _check_periodic(table: Table, definition: CatenaryDefinition) -> None:
    """A line that closes on itself is one section of wires that something holds, and none of them crosses the seam."""
    if not any(section.periodic for section in definition.sections):
        return
    if len(definition.sections) > 1:
        text = f"{len(definition.sections)} sections: a periodic line has one; write one section, or no 'periodic'"
        table.problem("section", text)
    if definition.steady_arm is None:
        text = "a periodic line needs a table [steady_arm]: it has no anchors, and nothing else holds the contact wire"
        table.problem("steady_arm", text)
    if definition.stitch_wire is not None:
        text = "a periodic line cannot have stitch wires: that of its first support would lie across the place where it"
        table.problem("stitch_wire", f"{text} closes; take type 'simple' or 'compound'")


def _check_type(table: Table, line_type: str, stitch: Table | None, auxiliary: Table | None, profile: Profile) -> None:
    if line_type not in LINE_TYPES:
        return  # said already
    if (line_type == "stitched") != (stitch is not None):
        table.problem("stitch_wire", "a table [stitch_wire] is needed for type 'stitched', and only for it")
    if (line_type == "compound") != (auxiliary is not None):
        table.problem("auxiliary_wire", "a table [auxiliary_wire] is needed for type 'compound', and only for it")
    if (line_type == "compound") != table.has("hanger"):
        table.problem("hanger", "a table [hanger] is needed for type 'compound', and only for it")
    if (line_type == "compound") != (profile.auxiliary_height is not None):
        table.problem("profile.auxiliary_height", "is needed for type 'compound', and only for it")


def _read_dropper(table: Table) -> Dropper:
    dropper = field_schema.read(
        Dropper, table, slack_law=table.text("slack_law", default="tension", choices=SLACK_LAWS)
    )
    if dropper.stiffness is None and (dropper.area is None or dropper.youngs_modulus is None):
        table.problem("stiffness", "give either stiffness, or area and youngs_modulus")
    return dropper


def _read_contact(table: Table) -> Contact:
    return field_schema.read(Contact, table, law=table.text("law", default="continuous", choices=CONTACT_LAWS))


def _read_damping(table: Table) -> Damping:
    own = {name: table.table(name) for name in COMPONENTS}
    return Damping(
        alpha=table.quantity("alpha", "s", minimum=0.0, maximum=10.0),
        beta=table.quantity("beta", "1/s", minimum=0.0, maximum=100.0),
        **{name: field_schema.read(Rayleigh, t) for name, t in own.items() if t is not None},
    )

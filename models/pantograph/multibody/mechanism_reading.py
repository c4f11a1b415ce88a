"""A mechanism read from its definition file, with what must hold between its bodies, joints and force elements."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

from models.definition_files import field_schema
from models.definition_files.message_text import hint
from models.definition_files.toml_reader import Table
from models.pantograph.multibody.mechanism_definition import (
    JointFriction,
    LiftingForce,
    LiftingMoment,
    MechanismDefinition,
    PairForce,
    PairJoint,
    Prismatic,
    Revolute,
    RevolutePrismatic,
    SlideAndTurnFriction,
    SlidingFriction,
    Spherical,
    TurningFriction,
    Universal,
)


def load_mechanism(path: Path) -> MechanismDefinition:
    """Read a mechanism's definition file; raises ``DefinitionError`` with every mistake."""
    return read_mechanism(Table.load(path))


def read_mechanism(table: Table) -> MechanismDefinition:
    """Read a mechanism's definition from a parsed table; raises ``DefinitionError``."""
    table.text("type", choices=("multibody",))
    definition = field_schema.read(MechanismDefinition, table, provenance=table.provenance)
    definition.check_speed(table)
    unread = field_schema.unread(MechanismDefinition, table)
    _check_references(table, definition)
    if not definition.driven and not unread:
        table.problem("joint", "no body has a prescribed_motion (the base needs one)")
    _check_pairs(table, definition)
    _check_lift(table, definition)
    _check_friction(table, definition, unread)
    table.finish()
    return definition


def _check_references(table: Table, d: MechanismDefinition) -> None:
    names = {b.name for b in d.bodies}
    if not names:
        table.problem("body", "there is no [body.NAME]")
    sections = (("joint", d.joints), ("force", d.forces))
    uses = [
        (f"{section}.{element.name}.{key}", getattr(element, key, ""))
        for section, elements in sections
        for element in elements
        for key in ("body_i", "body_j", "body")
    ]
    uses += [("strip.body", d.strip.body)] if d.strip is not None else []
    uses += [("assembly.body", d.assembly.body)]
    for key, body in uses:
        if body and body not in names:
            table.problem(key, f"there is no body '{body}' (bodies: {', '.join(sorted(names))}){hint(body, names)}")
    if d.strip is not None and d.strip.body in d.driven:
        text = f"body '{d.strip.body}' has a prescribed motion; put the strip on one that the contact can move"
        table.problem("strip.body", text)


def _check_pairs(table: Table, d: MechanismDefinition) -> None:
    for section, elements in (("joint", d.joints), ("force", d.forces)):
        for e in elements:
            if isinstance(e, PairJoint | PairForce) and e.body_i and e.body_i == e.body_j:
                table.problem(f"{section}.{e.name}", f"connects body '{e.body_i}' with itself")


def _check_lift(table: Table, d: MechanismDefinition) -> None:
    lifting = [f.name for f in d.forces if isinstance(f, LiftingForce | LiftingMoment)]
    if len(lifting) > 1:
        table.problem("force", f"only one element can have lift = true ({', '.join(lifting)})")


def _check_friction(table: Table, d: MechanismDefinition, unread: Collection[str]) -> None:
    joints = {j.name: j for j in d.joints}
    for f in (f for f in d.forces if isinstance(f, JointFriction) and f.joint not in unread):
        joint = joints.get(f.joint)
        if joint is None:
            table.problem(
                f"force.{f.name}.joint",
                f"there is no joint '{f.joint}' (joints: {', '.join(joints)}){hint(f.joint, joints)}",
            )
        elif not isinstance(joint, Revolute | Spherical | Prismatic | Universal | RevolutePrismatic):
            table.problem(f"force.{f.name}.joint", f"a {joint.kind} joint takes no friction")
        elif isinstance(f, SlidingFriction) and isinstance(joint, Revolute | Spherical | Universal):
            text = f"a {joint.kind} joint does not slide: write 'moment' [N.m], and 'transition' in rad/s"
            table.problem(f"force.{f.name}.force", text)
        elif isinstance(f, TurningFriction) and isinstance(joint, Prismatic):
            text = f"a {joint.kind} joint does not turn: write 'force' [N], and 'transition' in m/s"
            table.problem(f"force.{f.name}.moment", text)
        elif isinstance(joint, RevolutePrismatic) and isinstance(f, SlidingFriction):
            text = f"that of the slide of a {joint.kind} joint is 'slide_transition'"
            table.problem(f"force.{f.name}.transition", text)
        elif isinstance(f, SlideAndTurnFriction) and not isinstance(joint, RevolutePrismatic):
            text = f"is for a {RevolutePrismatic.kind} joint; '{f.joint}' is {joint.kind}: write 'transition'"
            table.problem(f"force.{f.name}.slide_transition", text)

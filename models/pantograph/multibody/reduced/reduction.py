"""Whether a mechanism can be reduced: a closed arm that one coordinate decides, and a head on one body of it.

Bodies are taken off the end, one joint each, until what is left has one degree of freedom by the rank of its joints.
What does not fit stays in the general form, and is told why.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from models.arrays import FloatArray
from models.pantograph.multibody.mechanism import Mechanism
from models.pantograph.multibody.mechanism_assembly import null_space
from models.pantograph.multibody.mechanism_definition import (
    FORCES,
    ActuatorForce,
    ActuatorMoment,
    AngleStop,
    BumpStop,
    Fixed,
    Force,
    Joint,
    LiftingForce,
    LiftingMoment,
    MechanismDefinition,
    PairJoint,
    Prismatic,
    Revolute,
    RevolutePrismatic,
    SlideAndTurnFriction,
    SlidingFriction,
    SpringDamper,
    TurningFriction,
    WeightSpring,
)
from models.pantograph.operation import NO_DRIVE, Drive

#: Kinds of joint by which a body of the head may hang on the one before.
_IN_HEAD: Final = (Prismatic, Revolute, RevolutePrismatic, Fixed)
#: Kinds of force element that the reduced form has.
_FORCES: Final = (
    SpringDamper,
    WeightSpring,
    BumpStop,
    ActuatorForce,
    LiftingForce,
    ActuatorMoment,
    LiftingMoment,
    AngleStop,
    SlidingFriction,
    TurningFriction,
    SlideAndTurnFriction,
)

#: What of `Drive` the reduced form knows, or what does nothing where it is used; any other takes the general form.
_KNOWN_INPUTS: Final = ("reference_rate", "air", "uplift", "lift", "train")
_OTHER_INPUTS: Final = tuple(k for k, name in enumerate(Drive._fields) if name not in _KNOWN_INPUTS)


class NotReducibleError(ValueError):
    """A mechanism that stays in the general form; says why."""


@dataclass(frozen=True)
class Link:
    """A body of the head, the body that it hangs on, and the joint between them."""

    body: str
    parent: str
    joint: PairJoint


@dataclass(frozen=True)
class Reduction:
    """What becomes of a mechanism's bodies.

    Attributes
    ----------
    arm : Mechanism
        The base and the bodies that theta decides, with the forces among them.
    start : ndarray, shape (13 n,)
        The arm's state where theta is 0.
    driver : Revolute or Prismatic
        The joint that theta is the angle or the way of.
    carrier : str
        The body of the arm that carries the head.
    head : tuple of Link
        From the carrier outwards.
    """

    arm: Mechanism
    start: FloatArray
    driver: Revolute | Prismatic
    carrier: str
    head: tuple[Link, ...]


def unsuitable(definition: MechanismDefinition) -> str:
    """Return why a definition stays in the general form whatever its joints are, empty if nothing speaks against it."""
    if definition.formulation == "general":
        return "the definition says so (formulation)"
    if definition.monitor_energy:
        return "the balance of energy is kept of the bodies (monitor_energy)"
    if definition.lift_input:
        return "its lift is an input (lift_input)"
    profile = definition.speed_profile
    if definition.use_train or (profile is not None and any(slope != 0.0 for *_, slope in profile.segments())):
        return "its speed changes (speed_profile, use_train)"
    if definition.strip is None:
        return "there is no strip"
    for force in definition.forces:
        if type(force) not in _FORCES:
            return f"force '{force.name}' is of a kind that the reduced form does not have ({_kind(force)})"
    return ""


def _kind(force: Force) -> str:
    return next((kind for kind, cls in FORCES.items() if cls is type(force)), type(force).__name__)


def unsuitable_drive(drive: Drive) -> str:
    """Return why what acts on a pantograph from outside takes the general form, empty if it does not."""
    if drive is NO_DRIVE:
        return ""
    acting = [Drive._fields[k] for k in _OTHER_INPUTS if drive[k] != NO_DRIVE[k]]
    return f"inputs act that the reduced form does not know ({', '.join(acting)})" if acting else ""


def reduction_of(mechanism: Mechanism, standing: FloatArray) -> Reduction:
    """Tell arm and head of a mechanism apart.

    Parameters
    ----------
    mechanism : Mechanism
    standing : ndarray, shape (13 n,)
        Where its coordinates are to be 0: closed, at rest.

    Raises
    ------
    NotReducibleError
        If it does not have that form.
    """
    definition = mechanism.definition
    if reason := unsuitable(definition):
        raise NotReducibleError(reason)
    left = [name for name in mechanism.names if name not in definition.driven]
    head: list[Link] = []
    while True:
        arm = _part(mechanism, left)
        start = _state_in(mechanism, standing, arm)
        freedom = null_space(arm, start).shape[1]
        if freedom <= 1:
            break
        link = _outermost(definition, left)
        if link is None:
            raise NotReducibleError(f"its closed part has {freedom} degrees of freedom")
        left.remove(link.body)
        head.insert(0, link)
    if freedom < 1:
        raise NotReducibleError("no part of it has one degree of freedom")
    found = Reduction(arm, start, _driver(definition, left), _carrier(definition, head, left), tuple(head))
    _check_forces(definition, found)
    return found


def _part(mechanism: Mechanism, names: Iterable[str]) -> Mechanism:
    """Return some of a mechanism's bodies with the base, and the joints and forces among them."""
    definition = mechanism.definition
    kept = {*names, *definition.driven}
    joints = tuple(j for j in definition.joints if {j.body_j, getattr(j, "body_i", j.body_j)} <= kept)
    forces = tuple(f for f in definition.forces if _bodies(f, definition.joints) <= kept)
    bodies = tuple(b for b in definition.bodies if b.name in kept)
    part = Mechanism(replace(definition, bodies=bodies, joints=joints, forces=forces, strip=None))
    whole = mechanism.forces.lines
    part.forces.lines.free_length[:] = [whole.free_length[whole.names.index(n)] for n in part.forces.lines.names]
    return part


def _state_in(mechanism: Mechanism, y: FloatArray, part: Mechanism) -> FloatArray:
    s, rows = mechanism.split(y), [mechanism.numbers[name] for name in part.names]
    return part.join(s.r[rows], s.p[rows])


def _bodies(force: Force, joints: Iterable[Joint]) -> set[str]:
    """Return the bodies that a force acts between."""
    if isinstance(force, SlidingFriction | TurningFriction | SlideAndTurnFriction):
        joint = next(j for j in joints if j.name == force.joint)
        return {joint.body_j, getattr(joint, "body_i", joint.body_j)}
    return {getattr(force, "body_i", ""), getattr(force, "body_j", "")}


def _outermost(definition: MechanismDefinition, left: list[str]) -> Link | None:
    """Return a body that one joint of a suitable kind holds, and no body hangs on; the farthest from the base."""
    here = {*left, *definition.driven}
    joints = [j for j in definition.joints if isinstance(j, PairJoint) and {j.body_i, j.body_j} <= here]
    distance = dict.fromkeys(definition.driven, 0)
    for _ in left:
        for j in joints:
            for a, b in ((j.body_i, j.body_j), (j.body_j, j.body_i)):
                if a in distance and b not in distance:
                    distance[b] = distance[a] + 1
    found: list[tuple[int, Link]] = []
    for name in left:
        mine = [j for j in joints if name in (j.body_i, j.body_j)]
        if len(mine) == 1 and isinstance(mine[0], _IN_HEAD):
            parent = mine[0].body_j if name == mine[0].body_i else mine[0].body_i
            if parent not in definition.driven:
                found.append((distance.get(name, 0), Link(name, parent, mine[0])))
    return max(found, key=lambda item: item[0])[1] if found else None


def _driver(definition: MechanismDefinition, arm: list[str]) -> Revolute | Prismatic:
    """Return the joint of the base whose angle or way is theta: that of the lifted body, if it has one."""
    found = [
        j
        for j in definition.joints
        if isinstance(j, Revolute | Prismatic)
        and len({j.body_i, j.body_j} & definition.driven) == 1
        and {j.body_i, j.body_j} & set(arm)
    ]
    if not found:
        raise NotReducibleError("no hinge or slide joins the arm to the base")
    lifting = definition.lifting
    lifted = set() if lifting is None else {lifting.body_i, lifting.body_j}
    return max(found, key=lambda j: len({j.body_i, j.body_j} & lifted))


def _carrier(definition: MechanismDefinition, head: list[Link], arm: list[str]) -> str:
    assert definition.strip is not None
    strip = definition.strip.body
    carriers = {link.parent for link in head} & set(arm)
    if not head:
        return strip
    if len(carriers) > 1:
        raise NotReducibleError(f"parts hang on several bodies of the arm ({', '.join(sorted(carriers))})")
    carrier = carriers.pop()
    if strip in arm and strip != carrier:
        raise NotReducibleError(f"the strip's body '{strip}' is not the one that carries the rest ('{carrier}')")
    return carrier


def _check_forces(definition: MechanismDefinition, found: Reduction) -> None:
    """Refuse forces between the head and anything but the body that carries it."""
    ends = {link.body for link in found.head}
    for force in definition.forces:
        bodies = _bodies(force, definition.joints)
        if bodies & ends and not bodies <= ends | {found.carrier}:
            raise NotReducibleError(f"force '{force.name}' acts between head and arm ({', '.join(sorted(bodies))})")
        if bodies & ends and isinstance(force, LiftingForce | LiftingMoment):
            raise NotReducibleError(f"force '{force.name}' lifts the head alone")
        if isinstance(force, SlideAndTurnFriction) and not bodies & ends:
            raise NotReducibleError(f"force '{force.name}' rubs in a joint of the arm that slides and turns")


def is_still(values: FloatArray, tolerance: float = 1e-9) -> bool:
    """Return whether numbers are all 0 but for rounding."""
    return bool(np.abs(values).max(initial=0.0) <= tolerance)

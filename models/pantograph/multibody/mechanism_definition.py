"""A mechanism as defined: bodies, joints, force elements and collector strip, as frozen data.

Every kind of joint and of force element is a class whose fields know unit, range and meaning; a file has a table
``[body.NAME]``, ``[joint.NAME]`` or ``[force.NAME]`` for each, with the fields' names as keys. Points and axes are in
body-fixed components, points counted from the body's centre of mass.

The file is longer than others because all kinds are declared side by side, and nothing else is in it.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar, Final

from models.definition_files import field_schema
from models.definition_files.field_schema import (
    count,
    direction,
    named,
    part,
    quantity,
    series,
    text,
    vector,
    word_or_part,
)
from models.definition_files.parameter import Parameter
from models.definition_files.toml_reader import Quantity, Table
from models.pantograph.operation import Operation

Triple = tuple[float, float, float]

COORDINATES: Final = ("x", "y", "z", "e1", "e2", "e3")
FORMULATIONS: Final = ("auto", "general")


_Range = dict[str, Any]
#: Ranges of engineering size: beyond them a value was written in another unit.
_PLACE: Final[_Range] = {"minimum": -20.0, "maximum": 20.0}
_LENGTH: Final[_Range] = {"minimum": -10.0, "maximum": 10.0}
_STIFFNESS: Final[_Range] = {"minimum": 0.0, "maximum": 1e9}
_DAMPING: Final[_Range] = {"minimum": 0.0, "maximum": 1e6}
_VALUE: Final[_Range] = {"minimum": -1e5, "maximum": 1e5}
_FRICTION: Final[_Range] = {"minimum": 0.0, "maximum": 1e4}
_ANGLE: Final[_Range] = {"minimum": -3.2, "maximum": 3.2}
_TRANSITION: Final[_Range] = {"minimum": 1e-9, "maximum": 100.0}
_NONE: Final = (0.0, 0.0, 0.0)
_UP: Final = (0.0, 0.0, 1.0)
#: Points that make a spline.
_FEWEST: Final = 3
#: Share by which the largest moment of inertia may exceed the other two together before it is refused [choice]. No
#: body's does at all, but printed tables do: the source's by 43 % (its stabilisation arm).
_LARGEST_EXCESS: Final = 1.0


@dataclass(frozen=True, kw_only=True)
class Body:
    """A rigid body, with the configuration it is written in.

    Attributes
    ----------
    mass : float
        [kg].
    inertia : tuple of float
        Principal moments of inertia about the centre of mass, body-fixed axes [kg.m2].
    position : tuple of float
        Initial position of the centre of mass, from the base's origin [m].
    euler : tuple of float
        Initial Euler parameters e1, e2, e3 [1].
    """

    name: str
    mass: float = quantity("kg", "mass of {name}", minimum=1e-3, maximum=1e3)
    inertia: Triple = vector(
        "kg.m2", "moment of inertia of {name}", labels=("xx", "yy", "zz"), minimum=1e-9, maximum=1e4
    )
    position: Triple = vector("m", "initial position of {name}", **_PLACE, tunable=False)
    euler: Triple = vector("1", "initial Euler parameters of {name}", default=_NONE, tunable=False)

    def problems(self) -> Iterator[tuple[str, str]]:
        """Yield what is wrong with the Euler parameters and the moments of inertia."""
        if sum(e * e for e in self.euler) > 1.0:
            yield "euler", f"{self.euler} is longer than 1: not the vector part of unit Euler parameters"
        if self.inertia_excess > _LARGEST_EXCESS:
            text = (
                "no body has them: none can be larger than the other two together; check values and order (xx, yy, zz)"
            )
            yield "inertia", f"moments {', '.join(f'{j:g}' for j in self.inertia)} kg.m2: {text}"

    @property
    def inertia_excess(self) -> float:
        """Share by which the largest moment of inertia exceeds the other two together [1]; a body's does not."""
        largest = max(self.inertia)
        return largest / (sum(self.inertia) - largest) - 1.0


@dataclass(frozen=True, kw_only=True)
class Joint:
    """What all joints have: the body that is held."""

    kind: ClassVar[str]
    name: str
    body_j: str = text(filled=True)


@dataclass(frozen=True, kw_only=True)
class PrescribedMotion(Joint):
    """Body j moves as the base does."""

    kind = "prescribed_motion"


@dataclass(frozen=True, kw_only=True)
class PairJoint(Joint):
    """What joints between two bodies have."""

    body_i: str = text(filled=True)


@dataclass(frozen=True, kw_only=True)
class Perpendicular(PairJoint):
    """Axis i stays perpendicular to axis j."""

    kind = "perpendicular"
    axis_i: Triple = direction()
    axis_j: Triple = direction()


@dataclass(frozen=True, kw_only=True)
class PointJoint(PairJoint):
    """What joints have whose points on both bodies meet, or slide along each other."""

    point_i: Triple = vector("m", "{name}: point on body i", **_PLACE)
    point_j: Triple = vector("m", "{name}: point on body j", **_PLACE)


@dataclass(frozen=True, kw_only=True)
class Spherical(PointJoint):
    """A ball joint."""

    kind = "spherical"


@dataclass(frozen=True, kw_only=True)
class Fixed(PointJoint):
    """A rigid connection, with the relative orientation as written."""

    kind = "fixed"


@dataclass(frozen=True, kw_only=True)
class Prismatic(PointJoint):
    """A slide along axis i, with the relative orientation as written."""

    kind = "prismatic"
    axis_i: Triple = direction()


@dataclass(frozen=True, kw_only=True)
class TwoAxesJoint(PointJoint):
    """What joints have with points and an axis on both bodies."""

    axis_i: Triple = direction()
    axis_j: Triple = direction()


@dataclass(frozen=True, kw_only=True)
class Revolute(TwoAxesJoint):
    """A hinge about axis i, which stays parallel to axis j."""

    kind = "revolute"


@dataclass(frozen=True, kw_only=True)
class RevolutePrismatic(TwoAxesJoint):
    """Body j turns about axis i and slides along its axis j."""

    kind = "revolute_prismatic"


@dataclass(frozen=True, kw_only=True)
class Universal(TwoAxesJoint):
    """A cardan joint with the perpendicular axes i and j."""

    kind = "universal"


@dataclass(frozen=True, kw_only=True)
class Force:
    """What all force elements have."""

    name: str


@dataclass(frozen=True, kw_only=True)
class PairForce(Force):
    """What force elements between two bodies have."""

    body_i: str = text(filled=True)
    body_j: str = text(filled=True)


@dataclass(frozen=True, kw_only=True)
class PointForce(PairForce):
    """What force elements have with a point of attack on both bodies."""

    point_i: Triple = vector("m", "{name}: point on body i", **_PLACE)
    point_j: Triple = vector("m", "{name}: point on body j", **_PLACE)


@dataclass(frozen=True, kw_only=True)
class LineForce(PointForce):
    """What elements have that act along the line of their points, or along a direction of body i if one is given."""

    direction: Triple | None = direction(default=None)


@dataclass(frozen=True, kw_only=True)
class SpringDamper(LineForce):
    """A spring and a damper side by side."""

    free_length: float = quantity("m", "{name}: length without force", default=0.0, **_LENGTH)
    stiffness: float = quantity("N/m", "{name}: stiffness", default=0.0, **_STIFFNESS)
    damping: float = quantity("N.s/m", "{name}: damping", default=0.0, **_DAMPING)


@dataclass(frozen=True, kw_only=True)
class WeightSpring(LineForce):
    """A spring and a damper, whose free length is found: with it the spring carries the weights."""

    stiffness: float = quantity("N/m", "{name}: stiffness", **_STIFFNESS, positive=True)
    damping: float = quantity("N.s/m", "{name}: damping", default=0.0, **_DAMPING)


@dataclass(frozen=True, kw_only=True)
class BumpStop(LineForce):
    """A spring and a damper that push back beyond a shortest and a longest length."""

    stiffness: float = quantity("N/m", "{name}: stiffness", minimum=1.0, maximum=1e9)
    damping: float = quantity("N.s/m", "{name}: damping", default=0.0, **_DAMPING)
    shortest: float | None = quantity("m", "{name}: shortest length without force", default=None, **_LENGTH)
    longest: float | None = quantity("m", "{name}: longest length without force", default=None, **_LENGTH)

    def problems(self) -> Iterator[tuple[str, str]]:
        """Yield what is missing."""
        if self.shortest is None and self.longest is None:
            yield "", "needs a length 'shortest' or 'longest'"


#: A cam that the tool finds: with it the strip presses with the force set, at every height.
CONSTANT_FORCE: Final = "constant_force"


@dataclass(frozen=True, kw_only=True)
class CamTable:
    """What cams given as tables have: places that rise, and a value for each."""

    @property
    def columns(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Places and values."""
        raise NotImplementedError

    def problems(self) -> Iterator[tuple[str, str]]:
        """Yield what is wrong with the table."""
        (place, value), names = self.columns, tuple(f.name for f in fields(self))
        if len(place) != len(value):
            yield names[1], f"has {len(value)} values for {len(place)} of '{names[0]}'"
        elif len(place) < _FEWEST:
            yield names[0], f"has {len(place)} values where a cam takes at least {_FEWEST}"
        elif falls := [b for a, b in itertools.pairwise(place) if not b > a]:
            yield names[0], f"must rise from value to value; {falls[0]:g} does not"


@dataclass(frozen=True, kw_only=True)
class MomentCam(CamTable):
    """A lifting moment over the angle of its bodies, which is 0 as written."""

    angle: tuple[float, ...] = series("rad", "angle of the lifting element", minimum=-3.0, maximum=3.0)
    moment: tuple[float, ...] = series("N.m", "moment of the cam", **_VALUE)

    @property
    def columns(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Angles [rad] and moments [N.m]."""
        return self.angle, self.moment


@dataclass(frozen=True, kw_only=True)
class ForceCam(CamTable):
    """A lifting force over the length between its points."""

    length: tuple[float, ...] = series("m", "length of the lifting element", **_LENGTH)
    force: tuple[float, ...] = series("N", "force of the cam", **_VALUE)

    @property
    def columns(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Lengths [m] and forces [N]."""
        return self.length, self.force


@dataclass(frozen=True, kw_only=True)
class ActuatorForce(LineForce):
    """A force that pushes the points apart."""

    force: float = quantity("N", "{name}: force", **_VALUE)


@dataclass(frozen=True, kw_only=True)
class LiftingForce(LineForce):
    """The force that raises the pantograph: it pushes the points apart with the definition's ``static_force``.

    With a cam, ``static_force`` is what the strip presses with ("constant_force"), or the table's value at the length
    in the working configuration.
    """

    cam: str | ForceCam | None = word_or_part((CONSTANT_FORCE,), ForceCam, default=None)


@dataclass(frozen=True, kw_only=True)
class AxisMoment(PairForce):
    """What moments on body j about an axis of body i have."""

    axis_i: Triple = direction()


@dataclass(frozen=True, kw_only=True)
class ActuatorMoment(AxisMoment):
    """A moment."""

    moment: float = quantity("N.m", "{name}: moment", **_VALUE)


@dataclass(frozen=True, kw_only=True)
class LiftingMoment(AxisMoment):
    """The moment that raises the pantograph: the definition's ``static_moment``.

    With the cam "constant_force" it is whatever makes the strip press with the definition's ``static_force``; a cam as
    a table is scaled so that its value at angle 0 is ``static_moment``, if that is given.
    """

    cam: str | MomentCam | None = word_or_part((CONSTANT_FORCE,), MomentCam, default=None)


@dataclass(frozen=True, kw_only=True)
class AngleStop(AxisMoment):
    """A spring and a damper that turn body j back, about an axis of body i, beyond a lowest and a highest angle.

    Angles are 0 as written.
    """

    lowest: float | None = quantity("rad", "{name}: lowest angle without moment", default=None, **_ANGLE)
    highest: float | None = quantity("rad", "{name}: highest angle without moment", default=None, **_ANGLE)
    stiffness: float = quantity("N.m/rad", "{name}: stiffness", minimum=1.0, maximum=1e9)
    damping: float = quantity("N.m.s/rad", "{name}: damping", default=0.0, minimum=0.0, maximum=1e7)

    def problems(self) -> Iterator[tuple[str, str]]:
        """Yield what is missing or the wrong way round."""
        if self.lowest is None and self.highest is None:
            yield "", "needs an angle 'lowest' or 'highest'"
        elif self.lowest is not None and self.highest is not None and self.lowest >= self.highest:
            yield "lowest", f"{self.lowest:g} rad is not below 'highest', {self.highest:g} rad"

    def beyond(self, angle: float) -> float:
        """Return how far an angle lies beyond the stops, below the lowest one negative [rad]."""
        if self.highest is not None and angle > self.highest:
            return angle - self.highest
        if self.lowest is not None and angle < self.lowest:
            return angle - self.lowest
        return 0.0


@dataclass(frozen=True, kw_only=True)
class Bushing(PointForce):
    """An elastic joint: springs and dampers along and about the axes of body i."""

    translation_stiffness: Triple = vector(
        "N/m", "{name}: translation stiffness", default=_NONE, minimum=0.0, maximum=1e10
    )
    translation_damping: Triple = vector(
        "N.s/m", "{name}: translation damping", default=_NONE, minimum=0.0, maximum=1e8
    )
    rotation_stiffness: Triple = vector(
        "N.m/rad", "{name}: rotation stiffness", default=_NONE, minimum=0.0, maximum=1e9
    )
    rotation_damping: Triple = vector("N.m.s/rad", "{name}: rotation damping", default=_NONE, minimum=0.0, maximum=1e7)


@dataclass(frozen=True, kw_only=True)
class Aerodynamic(Force):
    """A force of the air on a body: the coefficient times the square of the speed against the air.

    Its direction is one of the track (x along it, z up), not of the body: the air does not turn with the arm.
    """

    body: str = text(filled=True)
    point: Triple = vector("m", "{name}: point of attack", default=_NONE, **_PLACE)
    direction: Triple = direction(default=_UP)
    coefficient: float = quantity(
        "N.s2/m2", "{name}: force per square of the speed against the air", minimum=-1.0, maximum=1.0
    )


@dataclass(frozen=True, kw_only=True)
class SlidingFriction(Force):
    """Dry friction in a joint, given as a force; 76 % of it acts at the speed of transition."""

    joint: str = text()
    force: float = quantity("N", "{name}: friction force", **_FRICTION)
    transition: float = quantity("m/s", "{name}: speed of transition", **_TRANSITION)

    @property
    def level(self) -> float:
        """Friction at speed [N]."""
        return self.force


@dataclass(frozen=True, kw_only=True)
class TurningFriction(Force):
    """Dry friction in a joint, given as a moment; 76 % of it acts at the speed of transition."""

    joint: str = text()
    moment: float = quantity("N.m", "{name}: friction moment", **_FRICTION)
    transition: float = quantity("rad/s", "{name}: speed of transition", **_TRANSITION)

    @property
    def level(self) -> float:
        """Friction at speed [N.m]."""
        return self.moment


@dataclass(frozen=True, kw_only=True)
class SlideAndTurnFriction(Force):
    """Dry friction in a joint that slides and turns: a force against the slide and, if given, a moment besides."""

    joint: str = text()
    force: float = quantity("N", "{name}: friction force", **_FRICTION)
    slide_transition: float = quantity("m/s", "{name}: speed of transition of the slide", **_TRANSITION)
    moment: float = quantity("N.m", "{name}: friction moment", default=0.0, **_FRICTION)
    transition: float | None = quantity("rad/s", "{name}: speed of transition", default=None, **_TRANSITION)

    def problems(self) -> Iterator[tuple[str, str]]:
        """Yield what is missing beside a moment, or means nothing without one."""
        if self.moment > 0.0 and self.transition is None:
            yield "transition", "is missing: the speed in rad/s at which 76 % of the moment act"
        elif self.transition is not None and self.moment == 0.0:
            yield "transition", "does nothing without a 'moment'; the slide has its 'slide_transition'"

    @property
    def level(self) -> float:
        """Friction at speed [N], 0 if there is none at all."""
        return self.force or self.moment

    @property
    def sliding(self) -> SlidingFriction:
        """The part of the slide."""
        return SlidingFriction(name=self.name, joint=self.joint, force=self.force, transition=self.slide_transition)

    @property
    def turning(self) -> TurningFriction | None:
        """The part of the turn, None if there is none."""
        if self.transition is None:
            return None
        return TurningFriction(name=self.name, joint=self.joint, moment=self.moment, transition=self.transition)


JointFriction = SlidingFriction | TurningFriction | SlideAndTurnFriction


def _spring(table: Table) -> type[Force]:
    if not (table.has("stiffness") or table.has("damping")):
        table.problem("", "needs a stiffness or a damping: without either it does nothing")
    return WeightSpring if table.flag("carries_weights", default=False) else SpringDamper


def _lifts(table: Table) -> bool:
    lifts = table.flag("lift", default=False)
    if not lifts and table.has("cam") and table.offers("cam"):
        table.problem("cam", "does nothing: only what raises the pantograph has a cam; write lift = true beside it")
    return lifts


def _force(table: Table) -> type[Force]:
    return LiftingForce if _lifts(table) else ActuatorForce


def _moment(table: Table) -> type[Force]:
    return LiftingMoment if _lifts(table) else ActuatorMoment


def _friction(table: Table) -> type[Force]:
    if table.has("slide_transition"):
        return SlideAndTurnFriction
    return SlidingFriction if table.has("force") else TurningFriction


#: Kind of joint, as a file says it -> its class.
JOINTS: Final[Mapping[str, type[Joint]]] = {
    cls.kind: cls
    for cls in (Revolute, Spherical, Prismatic, RevolutePrismatic, Universal, Fixed, Perpendicular, PrescribedMotion)
}
#: Kind of force element, as a file says it -> its class, or what finds that in the table.
FORCES: Final[Mapping[str, type[Force] | Callable[[Table], type[Force]]]] = {
    "spring_damper": _spring,
    "actuator_force": _force,
    "actuator_moment": _moment,
    "bump_stop": BumpStop,
    "angle_stop": AngleStop,
    "joint_friction": _friction,
    "bushing": Bushing,
    "aerodynamic": Aerodynamic,
}


@dataclass(frozen=True, kw_only=True)
class Strip:
    """The collector strip: the body it is on, along that body's y axis, and its height above the centre of mass [m]."""

    body: str = text(filled=True)
    height: float = quantity("m", "height of the strip above its body's centre", default=0.0, **_LENGTH)


@dataclass(frozen=True, kw_only=True)
class Assembly:
    """How the initial configuration is found.

    Attributes
    ----------
    body, coordinate : str
        Which of ``COORDINATES`` of which body is kept as written; no body: none.
    largest_gap : float
        Gap of a joint as written that still counts as rounding [m].
    """

    body: str = text(default="", filled=True)
    coordinate: str = text(default="z", choices=COORDINATES)
    largest_gap: float = quantity(
        "m", "largest gap of a joint", default=0.02, minimum=1e-9, maximum=10.0, tunable=False
    )


@dataclass(frozen=True, kw_only=True)
class MechanismDefinition(Operation):
    """A checked mechanism, in SI.

    Attributes
    ----------
    name, title : str
    bodies, joints, forces : tuple
        In the order of the file.
    strip : Strip or None
    assembly : Assembly
    static_force, static_moment : float or None
        Full value of the lifting force [N] or moment [N.m]; None of what does not lift.
    gravity : float
        [m/s2].
    formulation : str
        "auto": the reduced form where the mechanism allows it; "general": always that in Cartesian coordinates.
    tolerance : float
        Local error of an internal step [m]; velocities take 100 1/s times it.
    provenance : mapping
        Dotted key -> quantity as written in the file.
    """

    name: str = text()
    title: str = text(default="")
    bodies: tuple[Body, ...] = named("body", Body)
    joints: tuple[Joint, ...] = named("joint", JOINTS)
    forces: tuple[Force, ...] = named("force", FORCES)
    strip: Strip | None = part(Strip, default=None)
    assembly: Assembly = part(Assembly, default=Assembly())
    static_force: float | None = quantity(
        "N", "net uplift at the reference height after the raise", default=None, **_VALUE
    )
    static_moment: float | None = quantity("N.m", "lifting moment after the raise", default=None, **_VALUE)
    gravity: float = quantity("m/s2", "acceleration of gravity", default=9.81, minimum=0.0, maximum=30.0)
    base_height: float | None = quantity(
        "m",
        "height of the base's origin above the rails; with it the arms take the angle that the reference height needs",
        default=None,
        minimum=0.5,
        maximum=9.0,
    )
    start_height: float | None = quantity(
        "m", "height of the strip at time 0, if it is not the reference height: folded, say", default=None,
        minimum=0.5, maximum=10.0,
    )  # fmt: skip
    lift_input: int = count(
        "what lifts: 0 the definition's value, raised; 1 the input lift.value, in place of all that the element gives",
        default=0, maximum=1,
    )  # fmt: skip
    tolerance: float = quantity("m", "local error of an internal step", default=1e-8, minimum=1e-15, maximum=0.1)
    formulation: str = text(default="auto", choices=FORMULATIONS)
    provenance: Mapping[str, Quantity] = field(default_factory=dict, repr=False, compare=False)

    def parameters(self) -> tuple[Parameter, ...]:
        """Return every tunable number, with unit, range and source."""
        return self.tunable(field_schema.parameters(self, self.provenance))

    def with_values(self, values: Mapping[str, float]) -> MechanismDefinition:
        """Return a copy with some parameters changed; raises ``ParameterError``."""
        self.refuse_idle(values)
        return field_schema.with_values(self, values)

    def problems(self) -> Iterator[tuple[str, str]]:
        """Yield what is wrong with the values of what lifts."""
        yield from super().problems()
        if any(self.aerodynamic_uplift) and self.lifting is None:
            yield "aerodynamic_uplift", "does nothing: no force element has lift = true"
        if self.lift_input and self.lifting is None:
            yield "lift_input", "does nothing: no force element has lift = true"
        elif self.lift_input and any(self.aerodynamic_uplift):
            text = "the input lift.value replaces it; write a [force.NAME] with kind = 'aerodynamic' instead"
            yield "aerodynamic_uplift", f"does nothing with lift_input = 1: {text}"
        wanted = self.lift_parameter
        cam = getattr(self.lifting, "cam", None)
        if isinstance(cam, str) and cam != CONSTANT_FORCE:
            return  # no cam that there is: what it takes is not known
        for key in ("static_force", "static_moment"):
            given = getattr(self, key)
            if key == wanted and given is None and not isinstance(cam, MomentCam | ForceCam):
                yield key, "is missing"
            elif key != wanted and given is not None:
                yield key, self._useless(key)

    def _useless(self, key: str) -> str:
        if self.holds_force and self.lifting is not None:
            cam = f"with the cam '{CONSTANT_FORCE}' of '{self.lifting.name}'"
            return f"does nothing: {cam} the strip's force is set, by 'static_force'"
        if self.lifting is None:
            return "does nothing: no force element has lift = true"
        text = f"does nothing: '{self.lifting.name}' lifts by what '{self.lift_parameter}' says"
        by_moment = key == "static_force" and self.lifts_by_moment
        return f"{text}; with cam = '{CONSTANT_FORCE}' the strip's force is set" if by_moment else text

    @property
    def lifting(self) -> LiftingForce | LiftingMoment | None:
        """The element that raises the pantograph, None if nothing does."""
        return next((f for f in self.forces if isinstance(f, LiftingForce | LiftingMoment)), None)

    @property
    def holds_force(self) -> bool:
        """Return whether a cam makes the force of the strip the same at every height."""
        return getattr(self.lifting, "cam", None) == CONSTANT_FORCE

    @property
    def lift_parameter(self) -> str:
        """Name of the parameter that says how much it lifts; empty if nothing does."""
        if self.lifting is None:
            return ""
        return "static_moment" if isinstance(self.lifting, LiftingMoment) and not self.holds_force else "static_force"

    @property
    def lift_unit(self) -> str:
        """Unit of that parameter; "1" of a cam given as a table that is not scaled by one."""
        if self.lift_parameter and getattr(self, self.lift_parameter) is None:
            return "1"
        return "N.m" if self.lift_parameter == "static_moment" else "N"

    @property
    def driven(self) -> frozenset[str]:
        """Names of the bodies that move as the base does."""
        return frozenset(j.body_j for j in self.joints if isinstance(j, PrescribedMotion))

    @property
    def lifts_by_moment(self) -> bool:
        """Return whether a moment raises the pantograph, and not a force."""
        return any(isinstance(f, LiftingMoment) for f in self.forces)

    @property
    def lift(self) -> float:
        """Full value of the lifting force [N] or moment [N.m]; 1 of a cam as a table alone, 0 if nothing lifts."""
        value = getattr(self, self.lift_parameter) if self.lift_parameter else 0.0
        return 1.0 if value is None else value

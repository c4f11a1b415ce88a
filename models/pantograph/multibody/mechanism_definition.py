"""What a mechanism is: bodies, joints and forces as data, read from a definition file.

A file has the tables ``[body.NAME]``, ``[joint.NAME]``, ``[force.NAME]``, one ``[strip]`` and one ``[assembly]``,
besides the numbers of the operation (speed, static force or moment, raise). Every mistake is reported with the
name of the body, joint or force it is in.
"""

from __future__ import annotations

import copy
import dataclasses
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from models.definition_files import field_schema
from models.definition_files.parameter import Parameter, ParameterError
from models.definition_files.si_units import SI
from models.definition_files.toml_reader import DefinitionError, Table
from models.pantograph.operation import Operation

Triple = tuple[float, float, float]

JOINT_KINDS: Final = (
    "revolute",
    "spherical",
    "prismatic",
    "revolute_prismatic",
    "universal",
    "fixed",
    "perpendicular",
    "prescribed_motion",
)
FORCE_KINDS: Final = (
    "spring_damper",
    "actuator_force",
    "actuator_moment",
    "bump_stop",
    "joint_friction",
    "bushing",
)
COORDINATES: Final = ("x", "y", "z", "e1", "e2", "e3")

#: Joint kinds whose points on both bodies meet (or slide along each other).
_WITH_POINTS: Final = ("revolute", "spherical", "prismatic", "revolute_prismatic", "universal", "fixed")
#: Joint kinds with an axis on body i, on body j.
_WITH_AXIS_I: Final = ("revolute", "prismatic", "revolute_prismatic", "universal", "perpendicular")
_WITH_AXIS_J: Final = ("revolute", "revolute_prismatic", "universal", "perpendicular")


@dataclass(frozen=True)
class Body:
    """A rigid body.

    Attributes
    ----------
    name : str
    mass : float
        Mass [kg].
    inertia : tuple of float
        Principal moments of inertia about the centre of mass, body-fixed axes [kg.m2].
    position : tuple of float
        Initial position of the centre of mass, from the base's origin [m].
    euler : tuple of float
        Initial Euler parameters e1, e2, e3 [1].
    """

    name: str
    mass: float
    inertia: Triple
    position: Triple
    euler: Triple


@dataclass(frozen=True)
class Joint:
    """A kinematic joint between two bodies; points and axes in body-fixed components."""

    name: str
    kind: str
    body_i: str
    body_j: str
    point_i: Triple = (0.0, 0.0, 0.0)
    point_j: Triple = (0.0, 0.0, 0.0)
    axis_i: Triple = (0.0, 0.0, 0.0)
    axis_j: Triple = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Force:
    """A force element; which attributes count depends on its kind.

    Attributes
    ----------
    name, kind : str
    body_i, body_j : str
        The bodies it acts between; of a ``joint_friction`` those of its joint.
    point_i, point_j : tuple of float
        Points of attack, body-fixed [m].
    direction : tuple of float or None
        Body-fixed on body i. If given, the element acts along it instead of along the line of its points; of an
        ``actuator_moment`` it is the axis.
    stiffness, damping : float
        [N/m], [N.s/m].
    free_length : float or None
        Length without force [m]; None where the spring is set to carry the weights.
    value : float
        Force that pushes the points apart [N], or moment on body j about the axis [N.m].
    lift : bool
        Whether it is the element that raises the pantograph: its value is then ``static_force`` or
        ``static_moment`` of the definition.
    shortest, longest : float
        Lengths beyond which a bump stop acts [m].
    joint, joint_kind : str
        Of ``joint_friction``: the joint that rubs.
    friction, transition : float
        Friction force or moment [N or N.m] and the relative speed at which 76 % of it acts [m/s or rad/s].
    translation_stiffness, translation_damping, rotation_stiffness, rotation_damping : tuple of float
        Of a bushing, along and about the axes of body i [N/m, N.s/m, N.m/rad, N.m.s/rad].
    """

    name: str
    kind: str
    body_i: str = ""
    body_j: str = ""
    point_i: Triple = (0.0, 0.0, 0.0)
    point_j: Triple = (0.0, 0.0, 0.0)
    direction: Triple | None = None
    stiffness: float = 0.0
    damping: float = 0.0
    free_length: float | None = 0.0
    value: float = 0.0
    lift: bool = False
    shortest: float = -np.inf
    longest: float = np.inf
    joint: str = ""
    joint_kind: str = ""
    friction: float = 0.0
    transition: float = 1.0
    translation_stiffness: Triple = (0.0, 0.0, 0.0)
    translation_damping: Triple = (0.0, 0.0, 0.0)
    rotation_stiffness: Triple = (0.0, 0.0, 0.0)
    rotation_damping: Triple = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Strip:
    """The collector strip: the body it is on, along that body's y axis, and its height above the centre of mass [m]."""

    body: str
    height: float


@dataclass(frozen=True)
class Assembly:
    """How the initial configuration is found.

    Attributes
    ----------
    body, coordinate : str
        Which coordinate (x, y, z, e1, e2 or e3) of which body is kept as written; no body: none.
    largest_gap : float
        Gap of a joint as written that still counts as rounding [m].
    """

    body: str
    coordinate: str
    largest_gap: float


@dataclass(frozen=True)
class MechanismDefinition:
    """A checked mechanism, in SI.

    Attributes
    ----------
    name, title : str
    bodies, joints, forces : tuple
        In the order of the file.
    strip : Strip or None
    assembly : Assembly
    operation : Operation
        Speed, start, raise, strip length: what every kind of pantograph has.
    lift : float
        Full value of the lifting force or moment, ``static_force`` [N] or ``static_moment`` [N.m].
    gravity : float
        [m/s2].
    tolerance : float
        Local error of an internal step [m]; velocities take 100 1/s times it.
    """

    name: str
    title: str
    bodies: tuple[Body, ...]
    joints: tuple[Joint, ...]
    forces: tuple[Force, ...]
    strip: Strip | None
    assembly: Assembly
    operation: Operation
    lift: float
    gravity: float
    tolerance: float
    _parameters: tuple[Parameter, ...] = field(default=(), repr=False)
    _data: dict[str, Any] = field(default_factory=dict, repr=False, compare=False)
    _file: str = field(default="definition", repr=False, compare=False)

    def parameters(self) -> tuple[Parameter, ...]:
        """Return every tunable number, with unit, range and source."""
        return self._parameters

    def with_values(self, values: Mapping[str, float]) -> MechanismDefinition:
        """Return a copy with some parameters changed.

        Parameters
        ----------
        values : mapping
            Parameter name -> value in its SI unit.

        Raises
        ------
        ParameterError
            If a name is unknown or a value not allowed.
        """
        known = {p.name: p for p in self._parameters}
        data = copy.deepcopy(self._data)
        for name, value in values.items():
            if name not in known:
                raise ParameterError(f"parameter '{name}': there is none of this name")
            _write(data, known[name], float(value))
        try:
            changed = parse(Table.from_dict(data, self._file))
        except DefinitionError as error:
            raise ParameterError(str(error)) from error
        return dataclasses.replace(changed, _parameters=_restated(changed._parameters, self._parameters))

    @property
    def lift_force(self) -> Force | None:
        """The force element that raises the pantograph."""
        return next((f for f in self.forces if f.lift), None)


class Range(NamedTuple):
    """Least and largest value of engineering size, in SI: beyond it a value was written in another unit."""

    minimum: float
    maximum: float


_ANY: Final = Range(-np.inf, np.inf)
_MASS: Final = Range(1e-3, 1e3)
_INERTIA: Final = Range(1e-9, 1e4)
_PLACE: Final = Range(-20.0, 20.0)
_LENGTH: Final = Range(-10.0, 10.0)
_STIFFNESS: Final = Range(0.0, 1e9)
_DAMPING: Final = Range(0.0, 1e6)
_STOP: Final = Range(1.0, 1e9)
_FORCE: Final = Range(-1e5, 1e5)
_MOMENT: Final = Range(-1e5, 1e5)
_FRICTION: Final = Range(0.0, 1e4)
_TRANSITION: Final = Range(1e-9, 100.0)
_GRAVITY: Final = Range(0.0, 30.0)
_TOLERANCE: Final = Range(1e-15, 0.1)
_GAP: Final = Range(1e-9, 10.0)
#: Of a bushing, by the unit.
_BUSHING: Final = {
    "N/m": Range(0.0, 1e10),
    "N.s/m": Range(0.0, 1e8),
    "N.m/rad": Range(0.0, 1e9),
    "N.m.s/rad": Range(0.0, 1e7),
}

_COMPONENTS: Final = {"inertia": ("xx", "yy", "zz")}
_XYZ: Final = ("x", "y", "z")
#: Names of bodies, joints and forces: parts of dotted parameter names.
_NAME: Final = re.compile(r"[\w-]+")


def load(path: Path) -> MechanismDefinition:
    """Read a mechanism from a TOML file.

    Raises
    ------
    models.definition_files.toml_reader.DefinitionError
        With every mistake of the file.
    """
    return parse(Table.load(path))


def parse(table: Table) -> MechanismDefinition:
    """Read a mechanism from the root table of a definition.

    Raises
    ------
    models.definition_files.toml_reader.DefinitionError
        With every mistake.
    """
    return _Reader(table).definition()


def from_dict(data: dict[str, Any], name: str = "definition") -> MechanismDefinition:
    """Read a mechanism from an already parsed mapping."""
    return parse(Table.from_dict(data, name))


class _Reader:
    """Reads the tables in turn and keeps what is tunable."""

    def __init__(self, root: Table) -> None:
        self.root = root
        self.parameters: list[Parameter] = []

    def definition(self) -> MechanismDefinition:
        root = self.root
        root.text("type", choices=("multibody",))
        name = root.text("name")
        title = root.text("title", default="")
        operation = field_schema.read(Operation, root)
        self.parameters += field_schema.parameters(operation, root.provenance)
        bodies = self._each("body", self._body)
        joints = self._each("joint", self._joint)
        forces = self._each("force", self._force)
        moment_driven = any(f.lift and f.kind == "actuator_moment" for f in forces)
        result = MechanismDefinition(
            name=name,
            title=title,
            bodies=bodies,
            joints=joints,
            forces=self._with_joints(forces, joints),
            strip=self._strip(),
            assembly=self._assembly(),
            operation=operation,
            lift=self._lift(moment_driven, any(f.lift for f in forces)),
            gravity=self.number(root, "gravity", "m/s2", "acceleration of gravity", _GRAVITY, default=9.81),
            tolerance=self.number(root, "tolerance", "m", "local error of an internal step", _TOLERANCE, default=1e-8),
            _data=copy.deepcopy(root.data),
            _file=root.file,
        )
        self._check_references(result)
        root.finish()
        return dataclasses.replace(result, _parameters=tuple(self.parameters))

    def _lift(self, moment_driven: bool, driven: bool) -> float:
        if not driven:
            return 0.0
        if moment_driven:
            return self.number(self.root, "static_moment", "N.m", "lifting moment after the raise", _MOMENT)
        text = "net uplift at the reference height after the raise"
        return self.number(self.root, "static_force", "N", text, _FORCE)

    def _each(self, section: str, read: Any) -> tuple[Any, ...]:
        table = self.root.table(section)
        if table is None:
            return ()
        for name in table.names():
            if not _NAME.fullmatch(name):
                table.problem(name, "a name is made of letters, digits, '_' and '-'")
        children = ((name, table.table(name)) for name in table.names())
        return tuple(read(name, child) for name, child in children if child is not None)

    def _body(self, name: str, table: Table) -> Body:
        return Body(
            name,
            self.number(table, "mass", "kg", f"mass of {name}", _MASS),
            self.triple(table, "inertia", "kg.m2", f"moment of inertia of {name}", _INERTIA),
            self._plain_triple(table, "position", "m", _PLACE),
            self._euler(table),
        )

    def _joint(self, name: str, table: Table) -> Joint:
        kind = table.text("kind", choices=JOINT_KINDS)
        given: dict[str, Any] = {}
        for side in ("i", "j"):
            if kind == "prescribed_motion" and side == "i":
                continue
            if kind in _WITH_POINTS:
                given[f"point_{side}"] = self.triple(
                    table, f"point_{side}", "m", f"{name}: point on body {side}", _PLACE
                )
        if kind in _WITH_AXIS_I:
            given["axis_i"] = self._axis(table, "axis_i")
        if kind in _WITH_AXIS_J:
            given["axis_j"] = self._axis(table, "axis_j")
        body_i = "" if kind == "prescribed_motion" else self._body_name(table, "body_i")
        return Joint(name, kind, body_i, self._body_name(table, "body_j"), **given)

    def _body_name(self, table: Table, key: str) -> str:
        """Read which body is meant; that there is one of the name is checked when all are known."""
        name = table.text(key)
        if not name and isinstance(table.data.get(key), str):
            table.problem(key, "names no body: it is empty")
        return name

    def _force(self, name: str, table: Table) -> Force:
        kind = table.text("kind", choices=FORCE_KINDS)
        if kind == "joint_friction":
            return self._friction(name, table)
        given: dict[str, Any] = {key: self._body_name(table, key) for key in ("body_i", "body_j")}
        if kind != "actuator_moment":
            for side in ("i", "j"):
                given[f"point_{side}"] = self.triple(
                    table, f"point_{side}", "m", f"{name}: point on body {side}", _PLACE
                )
        if kind in FORCE_KINDS:  # of another the table has told already
            given |= self._force_readers[kind](name, table)
        return Force(name, kind, **given)

    @property
    def _force_readers(self) -> dict[str, Callable[[str, Table], dict[str, Any]]]:
        """What reads the values of a force of each kind, but for the friction of a joint."""
        return {
            "spring_damper": self._spring_damper,
            "actuator_force": self._actuator_force,
            "actuator_moment": self._actuator_moment,
            "bump_stop": self._bump_stop,
            "bushing": self._bushing,
        }

    def _direction(self, table: Table) -> dict[str, Any]:
        return {"direction": self._axis(table, "direction") if table.has("direction") else None}

    def _spring_damper(self, name: str, table: Table) -> dict[str, Any]:
        carries = table.flag("carries_weights", default=False)
        length = None
        if carries and table.has("free_length"):
            table.problem("free_length", "is given although the spring is set to carry the weights")
        if not carries:
            length = self.number(table, "free_length", "m", f"{name}: length without force", _LENGTH, default=0.0)
        if not (table.has("stiffness") or table.has("damping")):
            table.problem("", "needs a stiffness or a damping: without either it does nothing")
        stiffness = self.number(table, "stiffness", "N/m", f"{name}: stiffness", _STIFFNESS, default=0.0)
        if carries and stiffness == 0.0:
            table.problem("stiffness", "must be greater than 0: a spring set to carry the weights has to give way")
        return self._direction(table) | {
            "stiffness": stiffness,
            "damping": self.number(table, "damping", "N.s/m", f"{name}: damping", _DAMPING, default=0.0),
            "free_length": length,
        }

    def _actuator_force(self, name: str, table: Table) -> dict[str, Any]:
        return self._direction(table) | self._value(name, table, "N", "force", _FORCE)

    def _actuator_moment(self, name: str, table: Table) -> dict[str, Any]:
        return {"direction": self._axis(table, "axis_i")} | self._value(name, table, "N.m", "moment", _MOMENT)

    def _value(self, name: str, table: Table, unit: str, word: str, within: Range) -> dict[str, Any]:
        if table.flag("lift", default=False):
            return {"lift": True}
        return {"value": self.number(table, word, unit, f"{name}: {word}", within)}

    def _bump_stop(self, name: str, table: Table) -> dict[str, Any]:
        given = self._direction(table) | {
            "stiffness": self.number(table, "stiffness", "N/m", f"{name}: stiffness", _STOP),
            "damping": self.number(table, "damping", "N.s/m", f"{name}: damping", _DAMPING, default=0.0),
        }
        if not (table.has("shortest") or table.has("longest")):
            table.problem("", "needs a length 'shortest' or 'longest'")
        for key in ("shortest", "longest"):
            if table.has(key):
                given[key] = self.number(table, key, "m", f"{name}: {key} length without force", _LENGTH)
        return given

    def _bushing(self, name: str, table: Table) -> dict[str, Any]:
        zero = (0.0, 0.0, 0.0)
        units = {
            "translation_stiffness": "N/m",
            "translation_damping": "N.s/m",
            "rotation_stiffness": "N.m/rad",
            "rotation_damping": "N.m.s/rad",
        }
        return {
            key: self.triple(table, key, unit, f"{name}: {key.replace('_', ' ')}", _BUSHING[unit], default=zero)
            for key, unit in units.items()
        }

    def _friction(self, name: str, table: Table) -> Force:
        slides = table.has("force")
        key, unit, rate = ("force", "N", "m/s") if slides else ("moment", "N.m", "rad/s")
        level = self.number(table, key, unit, f"{name}: friction {key}", _FRICTION)
        transition = self.number(table, "transition", rate, f"{name}: speed of transition", _TRANSITION)
        joint = table.text("joint")
        return Force(name, "joint_friction", joint=joint, friction=level, transition=transition)

    def _strip(self) -> Strip | None:
        table = self.root.table("strip")
        if table is None:
            return None
        return Strip(
            self._body_name(table, "body"),
            self.number(table, "height", "m", "height of the strip above its body's centre", _LENGTH, default=0.0),
        )

    def _assembly(self) -> Assembly:
        table = self.root.table("assembly")
        if table is None:
            return Assembly("", "", 0.02)
        return Assembly(
            self._body_name(table, "body") if table.has("body") else "",
            table.text("coordinate", default="z", choices=COORDINATES),
            table.quantity("largest_gap", "m", default=0.02, minimum=_GAP.minimum, maximum=_GAP.maximum),
        )

    def number(
        self,
        table: Table,
        name: str,
        unit: str,
        description: str,
        within: Range,
        *,
        default: float | None = None,
    ) -> float:
        """Read a value and list it as a parameter."""
        value = table.quantity(name, unit, default=default, minimum=within.minimum, maximum=within.maximum)
        self._list(table, name, "", value, unit, description, within)
        return value

    def triple(
        self,
        table: Table,
        name: str,
        unit: str,
        description: str,
        within: Range,
        *,
        default: Triple | None = None,
    ) -> Triple:
        """Read three values and list them as parameters NAME.x, .y, .z."""
        value = table.quantities(name, unit, length=3, default=default, minimum=within.minimum, maximum=within.maximum)
        for label, component in zip(_COMPONENTS.get(name, _XYZ), value, strict=True):
            text = f"{description}, {label}"
            self._list(table, name, label, component, unit, text, within)
        return value[0], value[1], value[2]

    def _list(
        self, table: Table, name: str, label: str, value: float, unit: str, description: str, within: Range
    ) -> None:
        key = table.key(name)
        origin = table.provenance.get(key)
        self.parameters.append(
            Parameter(
                f"{key}.{label}" if label else key,
                value,
                unit,
                description,
                minimum=within.minimum,
                maximum=within.maximum,
                source=origin.source if origin is not None else "choice: default",
            )
        )

    def _plain_triple(self, table: Table, name: str, unit: str, within: Range = _ANY) -> Triple:
        value = table.quantities(name, unit, length=3, minimum=within.minimum, maximum=within.maximum)
        return value[0], value[1], value[2]

    def _axis(self, table: Table, name: str) -> Triple:
        x, y, z = self._plain_triple(table, name, "1")
        length = float(np.sqrt(x * x + y * y + z * z))
        if length == 0.0:
            table.problem(name, "the axis has no direction: all its components are 0")
            return x, y, z
        return x / length, y / length, z / length

    def _euler(self, table: Table) -> Triple:
        e = table.quantities("euler", "1", length=3, default=(0.0, 0.0, 0.0))
        if sum(v * v for v in e) > 1.0:
            table.problem("euler", f"{e} is longer than 1: not the vector part of unit Euler parameters")
        return e[0], e[1], e[2]

    def _with_joints(self, forces: tuple[Force, ...], joints: tuple[Joint, ...]) -> tuple[Force, ...]:
        """Give every joint friction the bodies, point and axis of its joint."""
        by_name = {j.name: j for j in joints}
        return tuple(
            dataclasses.replace(
                f,
                joint_kind=by_name[f.joint].kind,
                body_i=by_name[f.joint].body_i,
                body_j=by_name[f.joint].body_j,
                point_i=by_name[f.joint].point_i,
                point_j=by_name[f.joint].point_j,
                direction=by_name[f.joint].axis_i,
            )
            if f.joint in by_name
            else f
            for f in forces
        )

    def _check_references(self, d: MechanismDefinition) -> None:
        names = {b.name for b in d.bodies}
        if not names:
            self.root.problem("body", "there is no [body.NAME]")
        uses = [(f"joint.{j.name}", key, getattr(j, key)) for j in d.joints for key in ("body_i", "body_j")]
        uses += [(f"force.{f.name}", key, getattr(f, key)) for f in d.forces for key in ("body_i", "body_j")]
        uses += [("strip", "body", d.strip.body)] if d.strip is not None else []
        uses += [("assembly", "body", d.assembly.body)] if d.assembly.body else []
        for where, key, body in uses:
            if body and body not in names:
                listed = ", ".join(sorted(names))
                self.root.problem(f"{where}.{key}", f"there is no body '{body}' (bodies: {listed})")
        driven = {j.body_j for j in d.joints if j.kind == "prescribed_motion"}
        if d.strip is not None and d.strip.body in driven:
            text = f"body '{d.strip.body}' has a prescribed motion; put the strip on one that the contact can move"
            self.root.problem("strip.body", text)
        self._check_pairs(d)
        self._check_friction(d)

    def _check_pairs(self, d: MechanismDefinition) -> None:
        for section, elements in (("joint", d.joints), ("force", d.forces)):
            for e in elements:
                if e.body_i and e.body_i == e.body_j:
                    self.root.problem(f"{section}.{e.name}", f"connects body '{e.body_i}' with itself")
        if sum(f.lift for f in d.forces) > 1:
            lifts = ", ".join(f.name for f in d.forces if f.lift)
            self.root.problem("force", f"only one element can have lift = true ({lifts})")
        if not any(j.kind == "prescribed_motion" for j in d.joints):
            self.root.problem("joint", "no body has a prescribed_motion (the base needs one)")

    def _check_friction(self, d: MechanismDefinition) -> None:
        kinds = {j.name: j.kind for j in d.joints}
        for f in (f for f in d.forces if f.kind == "joint_friction"):
            if f.joint not in kinds:
                self.root.problem(f"force.{f.name}.joint", f"there is no joint '{f.joint}'")
            elif kinds[f.joint] not in ("revolute", "spherical", "prismatic", "universal"):
                self.root.problem(f"force.{f.name}.joint", f"a {kinds[f.joint]} joint takes no friction")


def _write(data: dict[str, Any], parameter: Parameter, value: float) -> None:
    """Put a value into the raw mapping, in SI, at a parameter's dotted name."""
    path = parameter.name.split(".")
    labels = (*_XYZ, *_COMPONENTS["inertia"])
    index = labels.index(path[-1]) % 3 if path[-1] in labels else None
    if index is not None:
        path = path[:-1]
    table = data
    for key in path[:-1]:
        table = table.setdefault(key, {})
    if index is None:
        table[path[-1]] = [value, parameter.unit, parameter.source]
        return
    values, unit, source = table.get(path[-1], [[0.0, 0.0, 0.0], parameter.unit, parameter.source])
    values = list(values)
    values[index] = value / SI[unit][1]
    table[path[-1]] = [values, unit, source]


def _restated(new: tuple[Parameter, ...], old: tuple[Parameter, ...]) -> tuple[Parameter, ...]:
    """Keep the sources of the values that were there before."""
    sources = {p.name: p.source for p in old}
    return tuple(dataclasses.replace(p, source=sources.get(p.name, p.source)) for p in new)

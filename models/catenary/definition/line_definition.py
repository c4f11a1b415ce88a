"""Definition of an overhead contact line, as read from its file: SI, checked, frozen.

A line has one or more *sections*, mechanically independent wires; each section has supports, spans and droppers.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

from models.catenary.definition.calculation_definition import Dynamics, Mesh
from models.catenary.definition.condition_definition import Irregularity
from models.catenary.definition.fault_definition import Fault
from models.catenary.definition.overbridge_definition import Overbridge
from models.catenary.definition.section_definition import Section
from models.catenary.definition.surface_definition import RunningSurface
from models.catenary.definition.tensioning_definition import Tensioning
from models.catenary.definition.track_definition import Track
from models.catenary.definition.wind_definition import Wind
from models.contact_law import CONTACT_LAWS
from models.definition_files import field_schema
from models.definition_files.field_schema import count, monitoring, part, quantity, text
from models.definition_files.parameter import Parameter, ParameterError
from models.definition_files.toml_reader import Quantity

LineType = Literal["simple", "stitched", "compound"]
LINE_TYPES: tuple[LineType, ...] = ("simple", "stitched", "compound")
SlackLaw = Literal["tension", "elastic_only"]
SLACK_LAWS: tuple[SlackLaw, ...] = ("tension", "elastic_only")
GRAVITY = 9.81
#: Poisson ratio 0.3: G = E / 2.6 (round solid section).
SHEAR_RATIO = 2.6
#: Shortest internal step [s]: a thousandth of the usual one, below which a run would never end.
SHORTEST_STEP = 1e-6
#: Line-wide numbers, and the key of [supports] that replaces them.
_OF_SUPPORTS = {
    "profile.contact_wire_height": "contact_wire_height",
    "profile.encumbrance": "encumbrance",
    "steady_arm.length": "arm_length",
    "steady_arm.angle": "arm_angle",
}
_ACTIVE = re.compile(r"fault\[(\d+)\]\.active")


@dataclass(frozen=True, kw_only=True)
class Wire:
    """A tensioned wire of round section.

    The limits here and below are physical ones, not those of good design: a value beyond them was written in the wrong
    unit, or belongs to something else.
    """

    area: float = quantity("m2", "cross-section", positive=True, minimum=1e-6, maximum=1e-2)
    mass: float = quantity("kg/m", "mass per length", positive=True, minimum=0.01, maximum=20.0)
    youngs_modulus: float = quantity("Pa", "Young's modulus", positive=True, minimum=1e7, maximum=1e12)
    tension: float = quantity("N", "tension", positive=True, minimum=500.0, maximum=1e5)
    bending_stiffness: float | None = quantity("N.m2", "bending stiffness EI", default=None, minimum=0.0, maximum=1e5)
    diameter: float | None = quantity(
        "m", "diameter that the wind meets", default=None, minimum=1e-3, maximum=0.1, tunable=False
    )

    @property
    def width(self) -> float:
        """Return the diameter that the wind meets, as given or of a solid round section [m]."""
        return self.diameter or math.sqrt(4.0 * self.area / math.pi)

    @property
    def EI(self) -> float:
        """Return the bending stiffness as given, or that of a solid round section, I = A^2 / (4 pi)."""
        if self.bending_stiffness is not None:
            return self.bending_stiffness
        return self.youngs_modulus * self.area**2 / (4.0 * math.pi)


@dataclass(frozen=True, kw_only=True)
class StitchWire(Wire):
    """A wire hung from the messenger wire on both sides of a support."""

    length: float = quantity(
        "m", "length, centred on the support", default=18.0, minimum=1.0, maximum=100.0, tunable=False
    )


@dataclass(frozen=True, kw_only=True)
class Dropper:
    """A dropper: carries tension only.

    With the stiffness k, the elongation e and the damping c = alpha k, ``slack_law`` says what it carries: under
    "tension" N = max(0, k e + c e'), nothing when it is slack; under "elastic_only" N = max(0, k e) plus c e' whether
    it is slack or not, as in the 2012 thesis [2.11].
    """

    stiffness: float | None = quantity(
        "N/m", "axial stiffness (instead of EA/L)", default=None, minimum=100.0, maximum=1e10
    )
    area: float | None = quantity("m2", "cross-section", default=None, minimum=1e-7, maximum=1e-2)
    youngs_modulus: float | None = quantity("Pa", "Young's modulus", default=None, minimum=1e6, maximum=1e12)
    mass: float = quantity("kg/m", "mass per length", minimum=0.0, maximum=20.0)
    compression_ratio: float = quantity(
        "1", "stiffness in compression over that in tension", default=0.0, minimum=0.0, maximum=1.0
    )
    slack_law: SlackLaw = text(default="tension", choices=SLACK_LAWS)

    def problems(self) -> Iterator[tuple[str, str]]:
        """Yield a problem if nothing gives the stiffness."""
        if self.stiffness is None and (self.area is None or self.youngs_modulus is None):
            yield "stiffness", "give either stiffness, or area and youngs_modulus"


@dataclass(frozen=True, kw_only=True)
class SteadyArm:
    """A steady arm: pinned at its registration end, clamped to the contact wire."""

    area: float = quantity("m2", "cross-section", positive=True, minimum=1e-6, maximum=1e-1)
    mass: float = quantity("kg/m", "mass per length", minimum=0.0, maximum=50.0)
    youngs_modulus: float = quantity("Pa", "Young's modulus", positive=True, minimum=1e9, maximum=1e12)
    length: float = quantity("m", "length", positive=True, minimum=0.1, maximum=10.0)
    angle: float = quantity(
        "rad", "angle to the rail plane, from the registration end; negative: falls towards the wire",
        minimum=-1.2, maximum=1.2,
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Clamps:
    """Lumped masses on the wires."""

    dropper_upper: float = quantity("kg", "claw of a dropper on the wire above", default=0.0, minimum=0.0, maximum=50.0)
    dropper_lower: float = quantity("kg", "claw of a dropper on the wire below", default=0.0, minimum=0.0, maximum=50.0)
    steady_arm: float = quantity("kg", "clamp of a steady arm", default=0.0, minimum=0.0, maximum=50.0)
    stitch_wire: float = quantity(
        "kg", "clamp of a stitch wire on the messenger wire", default=0.0, minimum=0.0, maximum=50.0
    )


@dataclass(frozen=True, kw_only=True)
class MessengerSupport:
    """Vertical spring-damper under the messenger wire at a support; without it the support is a rigid roller."""

    stiffness: float = quantity("N/m", "vertical stiffness of a support", minimum=1e3, maximum=1e10)
    damping: float = quantity("N.s/m", "vertical damping of a support", default=0.0, minimum=0.0, maximum=1e6)


@dataclass(frozen=True)
class Rayleigh:
    """Damping C = alpha K + beta M of a component."""

    alpha: float = quantity("s", "damping: factor of the stiffness matrix", minimum=0.0, maximum=10.0)
    beta: float = quantity("1/s", "damping: factor of the mass matrix", minimum=0.0, maximum=100.0)


#: Component types, each with its own stiffness, mass and damping.
COMPONENTS = ("contact_wire", "messenger_wire", "stitch_wire", "auxiliary_wire", "steady_arm", "dropper")


@dataclass(frozen=True, kw_only=True)
class Damping(Rayleigh):
    """Damping of the whole line, and of the component types that have their own."""

    contact_wire: Rayleigh | None = part(Rayleigh, default=None)
    messenger_wire: Rayleigh | None = part(Rayleigh, default=None)
    stitch_wire: Rayleigh | None = part(Rayleigh, default=None)
    auxiliary_wire: Rayleigh | None = part(Rayleigh, default=None)
    steady_arm: Rayleigh | None = part(Rayleigh, default=None)
    dropper: Rayleigh | None = part(Rayleigh, default=None)

    def of(self, component: str) -> Rayleigh:
        """Return the damping of one of ``COMPONENTS``."""
        own: Rayleigh | None = getattr(self, component)
        return own if own is not None else Rayleigh(self.alpha, self.beta)


@dataclass(frozen=True, kw_only=True)
class Contact:
    """Contact of collector strip and contact wire; ``law`` is one of ``CONTACT_LAWS``."""

    law: str = text(default="continuous", choices=CONTACT_LAWS)
    stiffness: float = quantity(
        "N/m", "contact stiffness (N/m^n for an exponent n)", default=20000.0, minimum=100.0, maximum=1e10
    )
    exponent: float = quantity("1", "exponent n of the penetration", default=1.0, minimum=1.0, maximum=3.0)
    restitution: float = quantity("1", "coefficient of restitution", default=1.0, minimum=0.0, maximum=1.0)
    wire_radius: float = quantity("m", "radius of the contact wire", default=0.0, minimum=0.0, maximum=0.05)
    strip_radius: float = quantity("m", "radius of the collector strip", default=0.0, minimum=0.0, maximum=0.5)


@dataclass(frozen=True, kw_only=True)
class Profile:
    """Static heights of the wires.

    The parabola of the pre-sag lies between the supports, or between the first and the last dropper of a span.
    """

    contact_wire_height: float = quantity("m", "height of the contact wire at the supports", minimum=2.0, maximum=10.0)
    encumbrance: float = quantity("m", "messenger wire above contact wire at the supports", minimum=0.05, maximum=5.0)
    pre_sag: float = quantity(
        "1", "sag of the contact wire over the span length", default=0.0, minimum=-0.01, maximum=0.01
    )
    auxiliary_height: float | None = quantity(
        "m", "auxiliary wire above the contact wire", default=None, minimum=0.01, maximum=3.0
    )
    pre_sag_between: str = text(default="supports", choices=("supports", "droppers"))


@dataclass(frozen=True, kw_only=True)
class CatenaryDefinition:
    """An overhead contact line.

    Attributes
    ----------
    name : str
    type : {"simple", "stitched", "compound"}
    time_step : float
        Longest internal step [s].
    provenance : mapping
        Dotted key -> quantity as written in the file.
    """

    name: str = text()
    title: str = text(default="")
    type: LineType = text(choices=LINE_TYPES)
    profile: Profile = part(Profile)
    contact_wire: Wire = part(Wire)
    messenger_wire: Wire = part(Wire)
    dropper: Dropper = part(Dropper)
    clamps: Clamps = part(Clamps, default=Clamps())
    damping: Damping = part(Damping)
    contact: Contact = part(Contact, default=Contact())
    mesh: Mesh = part(Mesh, default=Mesh())
    sections: tuple[Section, ...]
    stitch_wire: StitchWire | None = part(StitchWire, default=None)
    auxiliary_wire: Wire | None = part(Wire, default=None)
    hanger: Dropper | None = part(Dropper, default=None)
    steady_arm: SteadyArm | None = part(SteadyArm, default=None)
    messenger_support: MessengerSupport | None = part(MessengerSupport, default=None)
    dynamics: Dynamics = part(Dynamics, default=Dynamics())
    track: Track | None = part(Track, default=None)
    tensioning: Tensioning | None = part(Tensioning, default=None)
    wind: Wind | None = part(Wind, default=None)
    irregularity: Irregularity = part(Irregularity, default=Irregularity())
    fault: tuple[Fault, ...] = ()
    overbridge: tuple[Overbridge, ...] = ()
    running_surface: RunningSurface | None = part(RunningSurface, default=None)
    extrapolation_order: int = count(
        "order of the extrapolation of the strip inside a step: 0 held, 1 velocity, 2 acceleration",
        default=2, minimum=0, maximum=2,
    )  # fmt: skip
    monitor_energy: int = monitoring()
    time_step: float = quantity("s", "longest internal time step", default=1e-3, minimum=SHORTEST_STEP, maximum=0.1)
    provenance: Mapping[str, Quantity] = field(default_factory=dict, repr=False, compare=False)

    def parameters(self) -> tuple[Parameter, ...]:
        """Return every tunable number of the line, without line-wide ones that every support has of its own."""
        replaced = self._replaced()
        every = field_schema.parameters(self, self.provenance)
        return tuple(self._with_place(p) for p in every if p.name not in replaced)

    def _replaced(self) -> dict[str, str]:
        """Return the line-wide numbers in whose place every support has its own, with the key that gives these."""
        inner = [support for section in self.sections for support in section.inner_supports]
        return {
            wide: key
            for wide, key in _OF_SUPPORTS.items()
            if inner and all(getattr(support, key) is not None for support in inner)
        }

    def _with_place(self, parameter: Parameter) -> Parameter:
        """Return a parameter; the description of one that makes a fault act says what it is of."""
        match = _ACTIVE.fullmatch(parameter.name)
        if match is None:
            return parameter
        place = self.fault[int(match[1]) - 1].described(self.sections)
        return replace(parameter, description=f"{parameter.description}; {place}")

    def with_values(self, values: Mapping[str, float]) -> CatenaryDefinition:
        """Return a copy with some parameters changed.

        Raises
        ------
        ParameterError
            If a name is unknown, a value out of its range, or every support has its own in its place.
        """
        replaced = self._replaced() if values else {}
        for name in values:
            if name in replaced:
                raise ParameterError(f"parameter '{name}': every support has its own, in [supports] {replaced[name]}")
        return field_schema.with_values(self, values)

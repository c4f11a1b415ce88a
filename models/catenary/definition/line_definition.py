"""Definition of an overhead contact line, as read from its file: SI, checked, frozen.

A line has one or more *sections*, mechanically independent wires; each section has supports, spans and droppers.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Literal

from models.contact_law import CONTACT_LAWS
from models.definition_files import field_schema
from models.definition_files.field_schema import count, monitoring, quantity
from models.definition_files.parameter import Parameter
from models.definition_files.toml_reader import Quantity, Table

LineType = Literal["simple", "stitched", "compound"]
LINE_TYPES: tuple[LineType, ...] = ("simple", "stitched", "compound")
SlackLaw = Literal["tension", "elastic_only"]
SLACK_LAWS: tuple[SlackLaw, ...] = ("tension", "elastic_only")
GRAVITY = 9.81
#: Poisson ratio 0.3: G = E / 2.6 (round solid section).
SHEAR_RATIO = 2.6
#: Shortest internal step [s]: a thousandth of the usual one, below which a run would never end.
SHORTEST_STEP = 1e-6
#: Most spans of a section, droppers of a span and droppers of a section.
MAX_SPANS, MAX_HUNG, MAX_DROPPERS = 10_000, 1000, 100_000


@dataclass(frozen=True, kw_only=True)
class Wire:
    """A tensioned wire of round section.

    The limits here and below are those of the things themselves, not of good design: beyond them a value was written
    in another unit, or for another thing.
    """

    area: float = quantity("m2", "cross-section", positive=True, minimum=1e-6, maximum=1e-2)
    mass: float = quantity("kg/m", "mass per length", positive=True, minimum=0.01, maximum=20.0)
    youngs_modulus: float = quantity("Pa", "Young's modulus", positive=True, minimum=1e7, maximum=1e12)
    tension: float = quantity("N", "tension", positive=True, minimum=500.0, maximum=1e5)
    bending_stiffness: float | None = quantity("N.m2", "bending stiffness EI", default=None, minimum=0.0, maximum=1e5)

    @property
    def EI(self) -> float:
        """Bending stiffness: as given, or of a solid round section, I = A^2 / (4 pi)."""
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

    With k its stiffness, e its elongation and c = alpha k what its damping makes of that, ``slack_law`` says what it
    carries: with "tension" N = max(0, k e + c e'), nothing where it is slack; with "elastic_only" N = max(0, k e), and
    c e' beside it whether it is slack or not, as the 2012 thesis has it [2.11].
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
    slack_law: SlackLaw = "tension"


@dataclass(frozen=True, kw_only=True)
class SteadyArm:
    """A steady arm: pinned at its registration end, clamped to the contact wire."""

    area: float = quantity("m2", "cross-section", positive=True, minimum=1e-6, maximum=1e-1)
    mass: float = quantity("kg/m", "mass per length", minimum=0.0, maximum=50.0)
    youngs_modulus: float = quantity("Pa", "Young's modulus", positive=True, minimum=1e9, maximum=1e12)
    length: float = quantity("m", "length", positive=True, minimum=0.1, maximum=10.0)
    angle: float = quantity(
        "rad", "angle to the horizontal, from the registration end; negative: falls towards the wire",
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
    """Vertical spring-damper under the messenger wire at a support; rigid roller without it."""

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
class Damping:
    """Damping C = alpha K + beta M, of the whole line or of a component type where it has its own."""

    alpha: float = quantity("s", "damping: factor of the stiffness matrix", minimum=0.0, maximum=10.0)
    beta: float = quantity("1/s", "damping: factor of the mass matrix", minimum=0.0, maximum=100.0)
    contact_wire: Rayleigh | None = None
    messenger_wire: Rayleigh | None = None
    stitch_wire: Rayleigh | None = None
    auxiliary_wire: Rayleigh | None = None
    steady_arm: Rayleigh | None = None
    dropper: Rayleigh | None = None

    def of(self, component: str) -> Rayleigh:
        """Return the damping of one of ``COMPONENTS``."""
        own: Rayleigh | None = getattr(self, component)
        return own if own is not None else Rayleigh(self.alpha, self.beta)


@dataclass(frozen=True, kw_only=True)
class Contact:
    """Contact of collector strip and contact wire; ``law`` is one of ``CONTACT_LAWS``."""

    law: str = "continuous"
    stiffness: float = quantity(
        "N/m", "contact stiffness (N/m^n for an exponent n)", default=20000.0, minimum=100.0, maximum=1e10
    )
    exponent: float = quantity("1", "exponent n of the penetration", default=1.0, minimum=1.0, maximum=3.0)
    restitution: float = quantity("1", "coefficient of restitution", default=1.0, minimum=0.0, maximum=1.0)
    wire_radius: float = quantity("m", "radius of the contact wire", default=0.0, minimum=0.0, maximum=0.05)
    strip_radius: float = quantity("m", "radius of the collector strip", default=0.0, minimum=0.0, maximum=0.5)


@dataclass(frozen=True, kw_only=True)
class Mesh:
    """Fineness of the mesh."""

    elements_between_droppers: int = count(
        "elements of contact and messenger wire between neighbouring droppers", default=6, minimum=1, maximum=64
    )


@dataclass(frozen=True, kw_only=True)
class Dynamics:
    """What of the line's motion about its static shape is computed."""

    highest_frequency: float = quantity(
        "Hz", "natural frequency above which modes of the wires between attachments are left out; 0: none are",
        default=0.0, minimum=0.0, maximum=1e9,
    )  # fmt: skip
    geometric_stiffness: int = count(
        "whether the tension of droppers and steady arms holds them back as pendulums, by N/L across them: 1 yes, "
        "0 no, as in the 2012 thesis",
        default=1, minimum=0, maximum=1,
    )  # fmt: skip


@dataclass(frozen=True)
class Span:
    """A span: where it begins and ends, its droppers, and in a compound line the hangers of its auxiliary wire.

    Attributes
    ----------
    start, end : float
        Supports [m].
    droppers, hangers : tuple of float
        Positions along the track [m].
    dropper_lengths, hanger_lengths : tuple of float or empty
        Given unstrained lengths [m]; empty where form finding is to find them.
    """

    start: float
    end: float
    droppers: tuple[float, ...]
    hangers: tuple[float, ...] = ()
    dropper_lengths: tuple[float, ...] = ()
    hanger_lengths: tuple[float, ...] = ()

    @property
    def length(self) -> float:
        """Distance between the supports [m]."""
        return self.end - self.start


@dataclass(frozen=True)
class Support:
    """A support of the messenger wire; with a steady arm where the contact wire is registered."""

    x: float
    stagger: float
    has_steady_arm: bool


@dataclass(frozen=True)
class EndSpans:
    """The wires' rise to their anchors: parabolas outside the registered part of the line.

    Attributes
    ----------
    anchors, working : (float, float)
        Where the wires end, and where they leave the working height [m].
    rises : (float, float)
        Height of the contact wire above its working height at the anchors [m].
    """

    anchors: tuple[float, float]
    working: tuple[float, float]
    rises: tuple[float, float]

    def rise_at(self, x: float) -> float:
        """Return the height above the working height at ``x`` [m]."""
        (start, end), (first, last) = self.anchors, self.working
        if x < first:
            return self.rises[0] * ((first - x) / (first - start)) ** 2
        if x > last:
            return self.rises[1] * ((x - last) / (end - last)) ** 2
        return 0.0


@dataclass(frozen=True)
class Section:
    """One mechanically independent set of wires.

    Attributes
    ----------
    supports : tuple of Support
        From anchor to anchor; the first and last are the anchors of the wires. Of a periodic line all are supports, and
        the one where it closes is the first.
    spans : tuple of Span
    ends : EndSpans
        Where the wires rise to their anchors.
    measured : tuple of (x, z) or empty
        Wanted heights of the contact wire instead of nominal height minus pre-sag.
    periodic : bool
        Whether the last span ends at the support where the first begins.
    """

    supports: tuple[Support, ...]
    spans: tuple[Span, ...]
    ends: EndSpans
    measured: tuple[tuple[float, float], ...] = ()
    periodic: bool = False

    @property
    def period(self) -> float:
        """Return the length after which a periodic line repeats [m]; 0 if it does not."""
        return self.spans[-1].end - self.spans[0].start if self.periodic else 0.0


@dataclass(frozen=True, kw_only=True)
class Profile:
    """Static heights of the wires."""

    contact_wire_height: float = quantity("m", "height of the contact wire at the supports", minimum=2.0, maximum=10.0)
    encumbrance: float = quantity("m", "messenger wire above contact wire at the supports", minimum=0.05, maximum=5.0)
    pre_sag: float = quantity(
        "1", "sag of the contact wire over the span length", default=0.0, minimum=-0.01, maximum=0.01
    )
    auxiliary_height: float | None = quantity(
        "m", "auxiliary wire above the contact wire", default=None, minimum=0.01, maximum=3.0
    )


@dataclass(frozen=True, kw_only=True)
class CatenaryDefinition:
    """An overhead contact line.

    Attributes
    ----------
    name : str
    type : {"simple", "stitched", "compound"}
    pre_sag_between : {"supports", "droppers"}
        Whether the pre-sag parabola begins at the supports or at the first and last dropper of the span.
    time_step : float
        Longest internal step [s].
    provenance : mapping
        Dotted key -> quantity as written in the file.
    """

    name: str
    title: str
    type: LineType
    profile: Profile
    contact_wire: Wire
    messenger_wire: Wire
    dropper: Dropper
    clamps: Clamps
    damping: Damping
    contact: Contact
    mesh: Mesh
    sections: tuple[Section, ...]
    stitch_wire: StitchWire | None = None
    auxiliary_wire: Wire | None = None
    hanger: Dropper | None = None
    steady_arm: SteadyArm | None = None
    messenger_support: MessengerSupport | None = None
    dynamics: Dynamics = field(default_factory=Dynamics)
    pre_sag_between: str = "supports"
    extrapolation_order: int = count(
        "order of the extrapolation of the strip inside a step: 0 held, 1 velocity, 2 acceleration",
        default=2, minimum=0, maximum=2,
    )  # fmt: skip
    monitor_energy: int = monitoring()
    time_step: float = quantity("s", "longest internal time step", default=1e-3, minimum=SHORTEST_STEP, maximum=0.1)
    provenance: Mapping[str, Quantity] = field(default_factory=dict, repr=False, compare=False)

    def parameters(self) -> tuple[Parameter, ...]:
        """Return every tunable number of the line."""
        return tuple(field_schema.parameters(self, self.provenance))

    def with_values(self, values: Mapping[str, float]) -> CatenaryDefinition:
        """Return a copy with some parameters changed.

        Raises
        ------
        ParameterError
            If a name is unknown or a value out of its range.
        """
        return field_schema.with_values(self, values)


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


@dataclass(frozen=True)
class _Hung:
    """Droppers or hangers of one span: offsets from its start, given lengths (or none) [m]."""

    offsets: tuple[float, ...] = ()
    lengths: tuple[float, ...] = ()


def _read_section(table: Table, *, has_arms: bool, has_hangers: bool) -> Section:
    spans_table = table.required_table("spans")
    boundaries = _read_boundaries(spans_table)
    droppers = _read_hung(spans_table, boundaries, "droppers", "listed")
    hangers = [_Hung()] * len(droppers)
    if has_hangers:
        hangers = _read_hung(spans_table, boundaries, "hangers", "listed_hangers")
    periodic = spans_table.flag("periodic", default=False)
    if periodic:
        ends, supports = _read_ring(table, boundaries, has_arms=has_arms)
    else:
        free, ends = _read_ends(table.required_table("ends"), boundaries)
        supports = _read_supports(table, boundaries, free, has_arms=has_arms)
    spans = tuple(_span(a, b, d, h) for (a, b), d, h in zip(pairwise(boundaries), droppers, hangers, strict=True))
    measured = _read_measured(table, boundaries)
    if measured and any(s.dropper_lengths for s in spans):
        table.problem("measured", "gives the contact wire's profile, and so do the droppers' lengths: give one of them")
    if periodic and measured and abs(measured[-1][1] - measured[0][1]) > 1e-6:
        text = f"a periodic line ends as it begins: the last height must be the first, {measured[0][1]:g} m"
        table.problem("measured.heights", f"{text}, not {measured[-1][1]:g} m")
    return Section(supports, spans, ends, measured, periodic)


def _span(start: float, end: float, droppers: _Hung, hangers: _Hung) -> Span:
    return Span(
        start,
        end,
        droppers=tuple(start + x for x in droppers.offsets),
        hangers=tuple(start + x for x in hangers.offsets),
        dropper_lengths=droppers.lengths,
        hanger_lengths=hangers.lengths,
    )


def _read_boundaries(table: Table) -> list[float]:
    start = table.quantity("start", "m", minimum=-1e7, maximum=1e7)
    if table.has("length"):
        length = table.quantity("length", "m", minimum=1.0, maximum=200.0)
        lengths = [length] * table.integer("count", minimum=1, maximum=MAX_SPANS)
    else:
        lengths = list(table.quantities("lengths", "m", minimum=1.0, maximum=200.0))
        if table.has("lengths") and not 1 <= len(lengths) <= MAX_SPANS:
            table.problem("lengths", f"gives {len(lengths)} spans, not 1 ... {MAX_SPANS}")
    boundaries = [start]
    for length in lengths or [math.nan]:
        boundaries.append(round(boundaries[-1] + length, 9))
    if table.has("end"):
        end = table.quantity("end", "m")
        if abs(end - boundaries[-1]) > 1e-6:
            table.problem("end", f"the spans do not add up: they end at {boundaries[-1]:g} m, not at {end:g} m")
    return boundaries


def _read_hung(table: Table, boundaries: Sequence[float], rule_name: str, list_name: str) -> list[_Hung]:
    """Read droppers (or hangers) of every span: by the rule, or as listed for the span."""
    count = len(boundaries) - 1
    listed = _read_listed(table, count, list_name)
    rule = table.table(rule_name)
    if rule is None and len(listed) < count:
        table.problem(rule_name, f"a table [{table.key(rule_name)}] is missing, and not every span lists its own")
    result: list[_Hung] = []
    total = 0
    for index, (a, b) in enumerate(pairwise(boundaries), 1):
        own = listed.get(index, rule)
        result.append(_hung(own, index, b - a) if own is not None else _Hung())
        total += len(result[-1].offsets)
        if total > MAX_DROPPERS:
            table.problem(rule_name, f"the first {index} spans have more than {MAX_DROPPERS} droppers already")
            return [_Hung()] * count
    return result


def _read_listed(table: Table, count: int, list_name: str) -> dict[int, Table]:
    listed: dict[int, Table] = {}
    for entry in table.tables(list_name):
        first = entry.integer("span", minimum=1)
        last = entry.integer("to", default=first, minimum=first)
        if last > count:
            entry.problem("span", f"there is no span {last}: the line has {count}")
        if repeated := [i for i in range(first, min(last, count) + 1) if i in listed]:
            entry.problem("span", f"span {repeated[0]} is listed twice")
        if last > count or repeated:
            _hung(entry, first, math.nan)
        else:
            listed |= dict.fromkeys(range(first, last + 1), entry)
    return listed


def _hung(table: Table, index: int, length: float) -> _Hung:
    """Read positions and given lengths of a span's droppers; ``length`` is the span's, NaN if it has none [m]."""
    given = table.has("positions")
    offsets = table.quantities("positions", "m") if given else _dropper_rule(table, length)
    _check_droppers(table, index, length, offsets)
    lengths = table.quantities("lengths", "m", default=(), minimum=1e-3, maximum=10.0)
    if len(lengths) == 1:
        lengths = lengths * len(offsets)
    if lengths and len(lengths) != len(offsets):
        text = f"gives {len(lengths)} lengths for the {len(offsets)} droppers of span {index}"
        table.problem("lengths", f"{text}: give one for each, or one for all")
        lengths = ()
    return _Hung(offsets, lengths)


def _dropper_rule(table: Table, length: float) -> tuple[float, ...]:
    first = table.quantity("first", "m", positive=True)
    if table.has("spacing"):
        spacing = table.quantity("spacing", "m", positive=True)
        number = _fitting_number(table, length, first, spacing)
    else:
        number = table.integer("count", minimum=2, maximum=MAX_HUNG)
        spacing = (length - 2.0 * first) / (number - 1)
    return tuple(first + i * spacing for i in range(number))


def _fitting_number(table: Table, length: float, first: float, spacing: float) -> int:
    """Return how many droppers fill a span; that they do not fit is a problem and gives 0."""
    gaps = (length - 2.0 * first) / spacing if spacing else math.nan
    if not math.isfinite(gaps):
        return 0
    if gaps < 0.0 or abs(gaps - round(gaps)) > 1e-6:
        text = f"droppers from {first:g} m every {spacing:g} m do not fit a span of {length:g} m"
        table.problem("spacing", text)
        return 0
    if gaps >= MAX_HUNG:
        table.problem("spacing", f"{spacing:g} m: makes more than {MAX_HUNG} droppers in a span of {length:g} m")
        return 0
    return round(gaps) + 1


def _check_droppers(table: Table, index: int, length: float, offsets: Sequence[float]) -> None:
    if not (length > 0.0 and all(map(math.isfinite, offsets))):
        return  # said already
    key = "positions" if table.has("positions") else "first"
    outside = [f"{x:g}" for x in offsets if not 0.0 < x < length]
    if outside:
        table.problem(key, f"dropper at {', '.join(outside)} m lies outside its span, number {index} of {length:g} m")
    elif any(b - a < 1e-3 for a, b in pairwise(offsets)):
        table.problem(key, f"span {index}: droppers are not in rising order")


@dataclass(frozen=True)
class _End:
    """One end of a section: unregistered spans, where the wires leave the working height, their rise from there [m]."""

    free: int
    working: float
    rise: float


def _read_ends(table: Table, boundaries: Sequence[float]) -> tuple[tuple[int, int], EndSpans]:
    """Return how many spans at each end are unregistered, and the wires' rise; an end may have a table of its own."""
    start = _read_end(table.table("start") or table, boundaries)
    end = _read_end(table.table("end") or table, boundaries[::-1])
    anchors = boundaries[0], boundaries[-1]
    return (start.free, end.free), EndSpans(anchors, (start.working, end.working), (start.rise, end.rise))


def _read_end(table: Table, boundaries: Sequence[float]) -> _End:
    """Read one end; ``boundaries`` count from there."""
    free = table.integer("spans", default=0, minimum=0, maximum=max(0, (len(boundaries) - 2) // 2))
    rise = table.quantity("rise", "m", default=0.0, minimum=0.0, maximum=5.0)
    working = boundaries[free]
    if table.has("length"):
        whole = boundaries[-1] - boundaries[0]
        length = table.quantity("length", "m", positive=True, maximum=max(1e-3, 0.5 * abs(whole)))
        working = boundaries[0] + math.copysign(length, whole)
    return _End(free, working, rise)


def _read_ring(table: Table, boundaries: Sequence[float], *, has_arms: bool) -> tuple[EndSpans, tuple[Support, ...]]:
    """Return the ends, which a line that closes on itself has not, and its supports, the one where it closes once."""
    if table.has("ends"):
        table.problem("ends", "a periodic line has no ends: take this table away")
        _read_ends(table.required_table("ends"), boundaries)
    inner, ends = boundaries[:-1], (boundaries[0], boundaries[-1])
    stagger = table.required_table("stagger")
    if stagger.has("anchor"):
        stagger.problem("anchor", "a periodic line has no anchors: take this value away")
        stagger.quantity("anchor", "m")
    if stagger.has("amplitude") and len(inner) % 2:
        text = f"changes sides at every support, and after {len(inner)} spans the line would close on the other side:"
        stagger.problem("amplitude", f"{text} take an even number of spans, or list the stagger of every support")
    supports = zip(inner, _registered_stagger(stagger, len(inner)), strict=True)
    return EndSpans(ends, ends, (0.0, 0.0)), tuple(Support(x, y, has_steady_arm=has_arms) for x, y in supports)


def _read_supports(
    table: Table, boundaries: Sequence[float], free: tuple[int, int], *, has_arms: bool
) -> tuple[Support, ...]:
    """Supports with their stagger: alternating at registered supports, straight on to the anchors."""
    last = len(boundaries) - 1
    registered = [max(free[0], 1) <= i <= last - max(free[1], 1) for i in range(last + 1)]
    staggers = _read_stagger(table.required_table("stagger"), boundaries, registered)
    return tuple(
        Support(x, y, has_steady_arm=has_arms and ok) for x, y, ok in zip(boundaries, staggers, registered, strict=True)
    )


def _read_stagger(table: Table, boundaries: Sequence[float], registered: Sequence[bool]) -> list[float]:
    inner = [i for i, ok in enumerate(registered) if ok]
    values = dict(zip(inner, _registered_stagger(table, len(inner)), strict=True))
    anchors = table.quantity("anchor", "m", default=0.0, minimum=-10.0, maximum=10.0)
    known = {0: anchors, len(boundaries) - 1: anchors} | values
    held = sorted(known)
    return [_straight(known, held, boundaries, i) for i in range(len(boundaries))]


def _registered_stagger(table: Table, count: int) -> tuple[float, ...]:
    """Return the stagger of the registered supports: listed, or alternating."""
    if table.has("listed"):
        return table.quantities("listed", "m", length=count, minimum=-1.0, maximum=1.0)
    amplitude = table.quantity("amplitude", "m", minimum=0.0, maximum=1.0)
    return tuple(amplitude * (-1.0) ** n for n in range(count))


def _straight(known: Mapping[int, float], held: Sequence[int], x: Sequence[float], i: int) -> float:
    """Interpolate the wire's plan position between the supports that hold it, ``held`` in rising order."""
    if i in known:
        return known[i]
    after = bisect_left(held, i)
    left, right = held[after - 1], held[after]
    share = (x[i] - x[left]) / (x[right] - x[left])
    return known[left] + share * (known[right] - known[left])


def _read_measured(table: Table, boundaries: Sequence[float]) -> tuple[tuple[float, float], ...]:
    measured = table.table("measured")
    if measured is None:
        return ()
    x = measured.quantities("positions", "m")
    z = measured.quantities("heights", "m", length=len(x), minimum=2.0, maximum=10.0)
    if any(b <= a for a, b in pairwise(x)):
        measured.problem("positions", "are not in rising order")
    elif x and (x[0] > boundaries[0] or x[-1] < boundaries[-1]):
        measured.problem("positions", f"must reach from {boundaries[0]:g} m to {boundaries[-1]:g} m")
    return tuple(zip(x, z, strict=True))

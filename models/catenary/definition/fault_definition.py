"""Faults of a line, as read and checked: each kind with what it is of, and how large it is."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar, Final, Literal

from models.catenary.definition.section_definition import Section
from models.definition_files.field_schema import count, quantity, text

FaultKind = Literal[
    "dropper_broken", "dropper_slipped", "arm_loose", "support_sunk", "tension_loss", "wear", "hard_point"
]
#: Wires that have tensioning devices.
TensionedWire = Literal["contact_wire", "messenger_wire", "auxiliary_wire"]
TENSIONED_WIRES: Final[tuple[TensionedWire, ...]] = ("contact_wire", "messenger_wire", "auxiliary_wire")
#: What is worn away for less than this is shorter than what a wire is divided into [m].
SHORTEST_WEAR: Final = 0.1


@dataclass(frozen=True, kw_only=True)
class Fault:
    """A fault, there from the start of a run if it is active.

    Attributes
    ----------
    asks : str
        The question that its value answers, empty for a kind without a value.
    """

    asks: ClassVar[str] = ""

    kind: FaultKind = text()
    section: int = count("section, from 1", default=1, minimum=1, tunable=False)
    active: int = count("whether the fault acts: 1 yes, 0 no", default=1, maximum=1)
    value: float | None = None

    @property
    def amount(self) -> float:
        """Return how large it is, in the unit of its kind."""
        assert self.value is not None
        return self.value

    def problems(self) -> Iterator[tuple[str, str]]:
        """Yield a problem if the value is missing."""
        if self.asks and self.value is None:
            yield "value", f"is missing: {self.asks}"

    def missing_part(self, section: Section) -> tuple[str, str] | None:
        """Return the key and the text if its section has not what the fault is of."""
        raise NotImplementedError

    def of(self) -> tuple[str, str]:
        """Return the key and the name of what it is of; two faults of the same are one too many."""
        raise NotImplementedError

    def place(self, section: Section) -> str:
        """Return where along the track it is, as the end of a sentence."""
        raise NotImplementedError

    def described(self, sections: Sequence[Section]) -> str:
        """Return in words what it is of, and where."""
        own = f" of section {self.section}" if len(sections) > 1 else ""
        return f"{self.of()[1]}{own} {self.place(sections[self.section - 1])}".strip()


@dataclass(frozen=True, kw_only=True)
class DropperFault(Fault):
    """A fault of one dropper."""

    span: int = count("span of the section, from 1", minimum=1, tunable=False)
    dropper: int = count("dropper of the span, from 1", minimum=1, tunable=False)

    def missing_part(self, section: Section) -> tuple[str, str] | None:
        """Return the key and the text if there is no such dropper."""
        if self.span > len(section.spans):
            return "span", f"there is no span {self.span}: the section has {len(section.spans)}"
        count = len(section.spans[self.span - 1].droppers)
        if self.dropper > count:
            return "dropper", f"there is no dropper {self.dropper}: span {self.span} has {count}"
        return None

    def of(self) -> tuple[str, str]:
        """Return the key and the name of the dropper."""
        return "dropper", f"dropper {self.dropper} of span {self.span}"

    def place(self, section: Section) -> str:
        """Return where it hangs, and between which supports."""
        span = section.spans[self.span - 1]
        return f"at {span.droppers[self.dropper - 1]:.2f} m, supports at {span.start:.2f} and {span.end:.2f} m"


@dataclass(frozen=True, kw_only=True)
class DropperBroken(DropperFault):
    """A dropper that is broken: its clamps and half of its mass are left on each wire."""


@dataclass(frozen=True, kw_only=True)
class DropperSlipped(DropperFault):
    """A dropper that has slipped, and is longer by it."""

    asks = "how far has the dropper slipped?"
    value: float | None = quantity(
        "m", "how far the dropper has slipped: what it is longer than designed", default=None, minimum=-5.0, maximum=5.0
    )


@dataclass(frozen=True, kw_only=True)
class SupportFault(Fault):
    """A fault at one support; as in the outputs of an FMU, supports are counted between the anchors."""

    support: int = count("support of the section between its anchors, from 1", minimum=1, tunable=False)

    def missing_part(self, section: Section) -> tuple[str, str] | None:
        """Return the key and the text if there is no such support."""
        if self.support > len(section.inner_supports):
            text = f"there is no support {self.support}: between its anchors the section has"
            return "support", f"{text} {len(section.inner_supports)}"
        return None

    def of(self) -> tuple[str, str]:
        """Return the key and the name of the support."""
        return "support", f"support {self.support}"

    def place(self, section: Section) -> str:
        """Return where it stands."""
        return f"at {section.inner_supports[self.support - 1].x:.2f} m"


@dataclass(frozen=True, kw_only=True)
class ArmLoose(SupportFault):
    """A steady arm that has come off: it and its mass are gone, its clamp is left on the wire, which is free there."""

    def missing_part(self, section: Section) -> tuple[str, str] | None:
        """Return the key and the text if the support has no steady arm."""
        missing = super().missing_part(section)
        if missing is None and not section.inner_supports[self.support - 1].has_steady_arm:
            return "support", f"support {self.support} has no steady arm that could come off"
        return missing

    def of(self) -> tuple[str, str]:
        """Return the key and the name of the arm."""
        return "support", f"steady arm of support {self.support}"


@dataclass(frozen=True, kw_only=True)
class SupportSunk(SupportFault):
    """A support that stands lower: seat of the messenger wire and registration end."""

    asks = "how far has the support sunk?"
    value: float | None = quantity(
        "m", "how far the support has sunk: messenger wire and registration end are lower by it", default=None,
        minimum=-1.0, maximum=1.0,
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class TensionLoss(Fault):
    """A wire that has lost some of its tension, all along its section."""

    asks = "which share of the tension is lost?"
    wire: TensionedWire = text(choices=TENSIONED_WIRES)
    value: float | None = quantity(
        "1", "share of the wire's tension that is lost", default=None, minimum=0.0, maximum=0.5
    )

    def missing_part(self, section: Section) -> tuple[str, str] | None:
        """Return None: every section has its wires."""
        return None

    def of(self) -> tuple[str, str]:
        """Return the key and the name of the wire."""
        return "wire", f"tension of the {self.wire.replace('_', ' ')}"

    def place(self, section: Section) -> str:
        """Return nothing: it is all along its section."""
        return ""


@dataclass(frozen=True, kw_only=True)
class Wear(Fault):
    """A length of contact wire that is worn, of the share ``value`` of its cross-section."""

    asks = "which share of the cross-section is worn away?"
    from_: float = quantity("m", "where the contact wire begins to be worn, along the track", tunable=False)
    to: float = quantity("m", "where it ends to be worn, along the track", tunable=False)
    value: float | None = quantity(
        "1", "share of the contact wire's cross-section that is worn away", default=None, minimum=0.0, maximum=0.5
    )
    lost_thickness: float | None = quantity(
        "m", "what is worn away of the contact wire's underside, on which strips run higher by it", default=None,
        minimum=0.0, maximum=0.02, tunable=False,
    )  # fmt: skip

    def problems(self) -> Iterator[tuple[str, str]]:
        """Yield a problem if it does not go from somewhere to a place beyond."""
        yield from super().problems()
        if self.to - self.from_ < SHORTEST_WEAR:
            yield "to", f"{self.to:g} m: must be {SHORTEST_WEAR:g} m or more beyond 'from', {self.from_:g} m"

    def missing_part(self, section: Section) -> tuple[str, str] | None:
        """Return the key and the text if the section does not reach so far."""
        first, last = section.spans[0].start, section.spans[-1].end
        for key, x in (("from", self.from_), ("to", self.to)):
            if not (first <= x <= last or math.isnan(x)):
                return key, f"{x:g} m lies outside the section, {first:g} ... {last:g} m"
        return None

    def of(self) -> tuple[str, str]:
        """Return the key and the name of the piece of wire."""
        return "from", f"contact wire from {self.from_:g} m"

    def place(self, section: Section) -> str:
        """Return where it ends."""
        return f"to {self.to:g} m"


@dataclass(frozen=True, kw_only=True)
class HardPoint(Fault):
    """A mass on the contact wire, on whose underside it may stand out: a section insulator, a splice, ice."""

    asks = "how heavy is it?"
    position: float = quantity("m", "where along the track it is", tunable=False)
    value: float | None = quantity("kg", "mass on the contact wire", default=None, minimum=0.0, maximum=200.0)
    height: float | None = quantity(
        "m", "height of a bump of the wire's underside, less than 0 where something stands out downwards", default=None,
        minimum=-0.05, maximum=0.05, tunable=False,
    )  # fmt: skip
    length: float | None = quantity(
        "m", "length of the bump along the track", default=None, minimum=0.01, maximum=20.0, tunable=False
    )

    def problems(self) -> Iterator[tuple[str, str]]:
        """Yield a problem if a bump has a height and no length, or the other way round."""
        yield from super().problems()
        if self.height is not None and self.length is None:
            yield "length", "is missing: how long is the bump whose height is given?"
        if self.length is not None and self.height is None:
            yield "height", "is missing: how high is the bump whose length is given?"

    def missing_part(self, section: Section) -> tuple[str, str] | None:
        """Return the key and the text if the section does not reach so far."""
        first, last = section.spans[0].start, section.spans[-1].end
        if not (first < self.position < last or math.isnan(self.position)):
            return "position", f"{self.position:g} m lies outside the section, {first:g} ... {last:g} m"
        return None

    def of(self) -> tuple[str, str]:
        """Return the key and the name of the place."""
        return "position", f"contact wire at {self.position:g} m"

    def place(self, section: Section) -> str:
        """Return nothing more than its name says."""
        return ""


#: Word of a definition -> class of the fault.
FAULT_KINDS: Final[dict[FaultKind, type[Fault]]] = {
    "dropper_broken": DropperBroken,
    "dropper_slipped": DropperSlipped,
    "arm_loose": ArmLoose,
    "support_sunk": SupportSunk,
    "tension_loss": TensionLoss,
    "wear": Wear,
    "hard_point": HardPoint,
}

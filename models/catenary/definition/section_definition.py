"""The parts of a line along the track: sections with their supports, spans and ends; see `line_definition`."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Span:
    """A span: its ends, its droppers, and in a compound line the hangers of its auxiliary wire.

    Attributes
    ----------
    start, end : float
        Supports [m].
    droppers, hangers : tuple of float
        Positions along the track [m].
    dropper_lengths, hanger_lengths : tuple of float or empty
        Given unstrained lengths [m]; empty if form finding determines them.
    """

    start: float
    end: float
    droppers: tuple[float, ...]
    hangers: tuple[float, ...] = ()
    dropper_lengths: tuple[float, ...] = ()
    hanger_lengths: tuple[float, ...] = ()

    @property
    def length(self) -> float:
        """Return the distance between the supports [m]."""
        return self.end - self.start


@dataclass(frozen=True)
class Support:
    """A support of the messenger wire; with a steady arm where the contact wire is registered.

    What is None is line-wide: of the profile, of the steady arms. The messenger wire is then above the contact wire,
    and the arm on the side from which it pulls. ``structure`` names the mast.
    """

    x: float
    stagger: float
    has_steady_arm: bool
    contact_wire_height: float | None = None
    encumbrance: float | None = None
    messenger_stagger: float | None = None
    arm_length: float | None = None
    arm_angle: float | None = None
    arm_side: int | None = None
    structure: str = ""


@dataclass(frozen=True)
class EndSpans:
    """The wires' rise to their anchors: parabolas outside the registered part of the line.

    Attributes
    ----------
    anchors, working : (float, float)
        Positions at which the wires end, and at which they leave the working height [m].
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
        From anchor to anchor; the first and last are the anchors of the wires. In a periodic line all are supports, and
        the first is the one where it closes.
    spans : tuple of Span
    ends : EndSpans
        Where the wires rise to their anchors.
    measured : tuple of (x, z) or empty
        Specified heights of the contact wire, in place of nominal height minus pre-sag.
    periodic : bool
        Whether the last span ends at the support where the first begins.
    length_errors : tuple of float or empty
        What each dropper is longer than designed, in the order of the track [m].
    """

    supports: tuple[Support, ...]
    spans: tuple[Span, ...]
    ends: EndSpans
    measured: tuple[tuple[float, float], ...] = ()
    periodic: bool = False
    length_errors: tuple[float, ...] = ()

    @property
    def inner_supports(self) -> tuple[Support, ...]:
        """Return the supports without the anchors, which a periodic line has not."""
        return self.supports if self.periodic else self.supports[1:-1]

    @property
    def period(self) -> float:
        """Return the length after which a periodic line repeats [m]; 0 if it does not."""
        return self.spans[-1].end - self.spans[0].start if self.periodic else 0.0

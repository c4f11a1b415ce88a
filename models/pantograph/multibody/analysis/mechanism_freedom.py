"""Which motions a mechanism is left with, in words: what a joint too few, or one too soft, gives away at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from models.arrays import ComplexArray, FloatArray
from models.pantograph.multibody.analysis.linearisation import Mode, linearise, modes
from models.pantograph.multibody.analysis.mechanism_statics import USUAL_FREEDOM, equilibrium
from models.pantograph.multibody.mechanism import Mechanism, MechanismError
from models.pantograph.multibody.mechanism_assembly import null_space

#: Below this rate a motion neither dies out nor grows: it is neutral [1/s].
NEUTRAL: Final = 1e-3
#: Stiffness per mass, the product of the rates of a pair of motions, that a cam found to 0.01 N may leave [1/s2].
_NO_STIFFNESS: Final = 1e-3
#: Growth that deserves a warning: e-fold within 20 s, longer than a span takes [1/s].
NOTABLE_GROWTH: Final = 0.05
#: What carries the strip rises with it by at least this share, or it is the head alone that moves [choice].
_RAISED_SHARE: Final = 0.5


@dataclass(frozen=True)
class FreeMotion:
    """A motion that the joints allow, about a state of rest.

    Attributes
    ----------
    name : str
        "raise", "head heave", "head roll", or the body that moves most and how.
    eigenvalue : complex
        exp(s t) [1/s].
    frequency : float
        0 if it does not oscillate [Hz].
    damping : float
        Damping ratio, below 0 if it grows [1].
    is_undamped_rest : bool
        Whether it is one of a pair, s^2 = -k / m, of an arm that neither a spring nor a damper holds: what is left of
        k decides alone whether it creeps away or swings within minutes.
    """

    name: str
    eigenvalue: complex
    frequency: float
    damping: float
    is_undamped_rest: bool = False

    @property
    def growth(self) -> float:
        """Rate at which the motion grows, negative if it dies out [1/s]."""
        return self.eigenvalue.real

    @property
    def remark(self) -> str:
        """What is special about it, empty if nothing is."""
        if self.growth > NEUTRAL and not self.is_undamped_rest:
            return f"grows at {self.growth:.2g} 1/s"
        if abs(self.eigenvalue) < NEUTRAL or self.is_undamped_rest:
            return "neutral: rests at any height" if self.name == "raise" else "neutral: rests anywhere"
        return ""


def degrees_of_freedom(mechanism: Mechanism, y: FloatArray) -> int:
    """Return the number of independent motions that the joints allow in a state, shape (13 n,)."""
    return null_space(mechanism, y).shape[1]


def name_motions(mechanism: Mechanism, found: Sequence[Mode]) -> tuple[FreeMotion, ...]:
    """Return the modes with their motions in words, in the order given."""
    rates = [m.eigenvalue for m in found]
    return tuple(
        FreeMotion(_name(mechanism, m.shape), m.eigenvalue, m.frequency, m.damping, _is_undamped_rest(m, rates))
        for m in found
    )


def _is_undamped_rest(mode: Mode, rates: Sequence[complex]) -> bool:
    s = mode.eigenvalue
    if abs(s) > NOTABLE_GROWTH:
        return False
    if s.imag != 0.0:
        return abs(s) ** 2 < _NO_STIFFNESS
    others = (r.real for r in rates if r.imag == 0.0 and r.real * s.real < 0.0 and abs(r) < NOTABLE_GROWTH)
    return any(abs(s.real * r) < _NO_STIFFNESS and max(abs(r), abs(s)) < 10.0 * min(abs(r), abs(s)) for r in others)


def freedom_warning(mechanism: Mechanism, standing: FloatArray, contact_force: float) -> str:
    """Say so if a pantograph is freer than one should be, or a motion of it grows; empty if neither.

    Parameters
    ----------
    mechanism : Mechanism
        Of a pantograph, its springs settled.
    standing : ndarray, shape (13 n,)
        State with the strip at the reference height.
    contact_force : float
        That the wire then presses with [N].
    """
    try:
        found = equilibrium(mechanism, mechanism.strip_height(standing), contact_force=contact_force, start=standing)
        motions = name_motions(mechanism, modes(mechanism, linearise(mechanism, found.y, found.inputs)))
    except (MechanismError, np.linalg.LinAlgError):
        return ""  # a state that the run reports on, if it gets there
    return _told(degrees_of_freedom(mechanism, standing), motions, contact_force)


def _told(freedom: int, motions: Sequence[FreeMotion], contact_force: float) -> str:
    growing = sorted((m for m in motions if m.growth > NOTABLE_GROWTH), key=lambda m: -m.growth)
    parts = []
    if freedom > USUAL_FREEDOM:
        usual = "raise, heave and roll of the head"
        parts.append(f"the joints leave {freedom} degrees of freedom, a pantograph has {USUAL_FREEDOM} ({usual})")
    if growing:
        listed = ", ".join(dict.fromkeys(f"{m.name} at {m.growth:.2g} 1/s" for m in growing))
        parts.append(f"under {contact_force:.4g} N small motions grow: {listed}")
    return "; ".join(parts) + ": look for a joint that is missing or too free" if parts else ""


def _name(mechanism: Mechanism, shape: ComplexArray) -> str:
    """Return what moves in a shape, displacements and body-fixed rotations of all bodies, shape (n, 6)."""
    strip = mechanism.strip_body
    moved, turned = np.abs(shape[:, :3]).max(axis=1), np.abs(shape[:, 3:]).max(axis=1)
    largest = int(np.argmax(moved + turned))
    if strip >= 0 and (name := _strip_motion(mechanism, shape, max(moved.max(), turned.max()))):
        return name
    body = mechanism.names[largest]
    if turned[largest] <= moved[largest]:
        along = ("along the track", "sideways", "up and down")[int(np.argmax(np.abs(shape[largest, :3])))]
        return f"{body} moves {along}"
    axis = int(np.argmax(np.abs(shape[largest, 3:])))
    kind = "spins" if moved[largest] < 0.1 * turned[largest] else "turns"
    return f"{body} {kind} about its {'xyz'[axis]} axis"


def _strip_motion(mechanism: Mechanism, shape: ComplexArray, largest: float) -> str:
    """Return the name of a motion of the strip, empty if something else moves."""
    strip, half = mechanism.strip_body, 0.5 * max(mechanism.definition.strip_length, 1e-3)
    rise, tilt = abs(shape[strip, 2]), half * abs(shape[strip, 3])
    if max(rise, tilt) < 0.1 * largest:
        return ""
    if tilt > rise:
        return "head roll" if half * largest <= 3.0 * tilt else ""
    carriers = _carriers(mechanism)
    if not carriers:
        return "head heave"
    share = max(float((shape[k, 2] / shape[strip, 2]).real) for k in carriers)
    return "raise" if share >= _RAISED_SHARE else "head heave"


def _carriers(mechanism: Mechanism) -> tuple[int, ...]:
    """Return the bodies, but the base, that a joint or a force element connects with the strip's."""
    strip, driven = mechanism.names[mechanism.strip_body], mechanism.definition.driven
    found = set()
    for element in (*mechanism.definition.joints, *mechanism.definition.forces):
        pair = {getattr(element, "body_i", ""), getattr(element, "body_j", "")}
        if strip in pair:
            found |= pair - {strip, ""} - driven
    return tuple(mechanism.numbers[name] for name in sorted(found))

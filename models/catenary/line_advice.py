"""Physical limits beyond which a run still works, but its results deserve a second look.

Every warning is a sentence for the user, empty if there is nothing to say.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, Protocol

import numpy as np

from models.arrays import BoolArray, ComplexArray, FloatArray
from models.catenary.condition.faults import active_of
from models.catenary.definition.fault_definition import HardPoint
from models.catenary.definition.line_definition import CatenaryDefinition, Contact
from models.catenary.statics.wire_waves import OPERATION_LIMIT, contact_wire_wave_speed

#: Contact force at which the stiffness of a law with an exponent is taken [N].
_REFERENCE_FORCE: Final = 200.0
#: Largest step relative to the relaxation time of wire and contact spring; fewest steps per period of a mass on it.
_LARGEST_SHARE: Final = 0.25
_STEPS_PER_PERIOD: Final = 20.0
#: Largest number of droppers named one by one.
_NAMED: Final = 8
#: Longest delay of slack [s], and the rate of elongation of a dropper at which the warning quotes its effect [m/s].
_LONGEST_DELAY: Final = 1e-3
_STRETCHING: Final = 0.5
#: Fewest steps within a wave of the running surface, the share of a measured one in shorter waves that goes without a
#: word, and the number of places at which it is looked at.
_STEPS_PER_WAVE: Final = 8.0
_SHORT_SHARE: Final = 0.1
_LONGEST_PROFILE: Final = 2**18
#: Curvature up to which the equations of curves are meant [1/m], and cant beyond which a track deserves a look [m].
_TIGHTEST: Final = 1.0 / 150.0
_HIGHEST_CANT: Final = 0.18


class Named(Protocol):
    """A dropper: its name and where it is."""

    @property
    def name(self) -> str:
        """Return the name."""

    @property
    def x(self) -> float:
        """Return the position along the track [m]."""


def speed_warning(definition: CatenaryDefinition, speed: float) -> str:
    """Return a warning if a train is too fast for the waves in the contact wire.

    Lines are operated at up to 0.7 of the wave speed. From the wave speed on, no wave runs ahead of the strip, and the
    deflection of the wire grows as it would under a supersonic source. The wave speed is taken for the longest span,
    where it is lowest.

    Parameters
    ----------
    definition : CatenaryDefinition
    speed : float
        Speed of the train in either direction [m/s].
    """
    C = contact_wire_wave_speed(definition)
    ratio = abs(speed) / C
    if ratio <= OPERATION_LIMIT:
        return ""
    text = f"the train's {3.6 * abs(speed):.0f} km/h are {ratio:.2f} of the contact wire's wave speed"
    text += f", {3.6 * C:.0f} km/h"
    if ratio < 1.0:
        return f"{text}: lines are operated at up to {OPERATION_LIMIT:g} of it (EN 50119)"
    return f"{text}: no wave runs ahead of the strip, which small displacements do not describe; run slower"


def longest_step(definition: CatenaryDefinition, head_mass: float = math.inf) -> float:
    """Return the longest step at which exchanging force and position once per step does no harm [s].

    Seen from the contact, a long wire is a damper: a force sends transverse waves in both directions,
    F = 2 sqrt(T rho) v. With the contact spring K it forms a system with the relaxation time 2 sqrt(T rho) / K. Force
    and position one step H apart act like a damping of -K H across that spring, so the ratio H K / (2 sqrt(T rho)) is
    the share of the wire's damping that is lost; a quarter is allowed. On the other side the mass m of the collector
    head oscillates on the spring with the period 2 pi sqrt(m / K), which twenty steps resolve (with a phase error
    below one per cent).

    Parameters
    ----------
    definition : CatenaryDefinition
    head_mass : float
        Mass next to the contact [kg]; by default only the wire counts.
    """
    K = tangent_stiffness(definition.contact)
    wire = definition.contact_wire
    relaxation = 2.0 * math.sqrt(wire.tension * wire.mass) / K
    period = 2.0 * math.pi * math.sqrt(head_mass / K)
    return min(_LARGEST_SHARE * relaxation, period / _STEPS_PER_PERIOD)


def tangent_stiffness(contact: Contact) -> float:
    """Return dF/dp of F = K p^n at a typical contact force [N/m].

    Examples
    --------
    >>> tangent_stiffness(Contact(stiffness=20000.0))
    20000.0
    """
    n, K = contact.exponent, contact.stiffness
    return n * K ** (1.0 / n) * _REFERENCE_FORCE ** (1.0 - 1.0 / n)


def step_warning(definition: CatenaryDefinition, step: float, head_mass: float = math.inf) -> str:
    """Return a warning if a step of the coupling, or one inside a part, is longer than `longest_step` [s]."""
    longest = longest_step(definition, head_mass)
    if step <= longest:
        return ""
    return (
        f"a step of {1e3 * step:.3g} ms is long for a contact stiffness of {definition.contact.stiffness:g} N/m: "
        f"take {1e3 * longest:.2g} ms or less"
    )


def slack_warning(droppers: Sequence[Named], is_slack: BoolArray) -> str:
    """Return a warning that names the droppers that are slack at rest.

    Parameters
    ----------
    droppers : sequence
        In the order of ``is_slack``.
    is_slack : ndarray, shape (n_droppers,)
    """
    slack = [d for d, loose in zip(droppers, is_slack.tolist(), strict=True) if loose]
    if not slack:
        return ""
    listed = ", ".join(f"{d.name} at {d.x:.2f} m" for d in slack[:_NAMED])
    more = f" and {len(slack) - _NAMED} more" if len(slack) > _NAMED else ""
    is_one = len(slack) == 1
    return f"{'dropper' if is_one else 'droppers'} {listed}{more} {'is' if is_one else 'are'} slack at rest"


def track_warning(definition: CatenaryDefinition) -> str:
    """Return a warning of a track that deserves a second look: cant against its curve, very tight, very high."""
    track = definition.track
    if track is None:
        return ""
    knots = list(zip(track.positions, track.curvatures, track.cants, strict=True))
    found = []
    if against := [x for x, kappa, D in knots if kappa * D < 0.0]:
        found.append(f"at {against[0]:g} m the cant is that of a curve to the other side")
    if tight := [(x, kappa) for x, kappa, _ in knots if abs(kappa) > _TIGHTEST]:
        x, kappa = max(tight, key=lambda knot: abs(knot[1]))
        text = f"at {x:g} m the radius is {1.0 / abs(kappa):.0f} m"
        found.append(f"{text}, below the {1.0 / _TIGHTEST:.0f} m for which the equations of curves are meant")
    if high := [(x, D) for x, _, D in knots if abs(D) > _HIGHEST_CANT]:
        x, D = max(high, key=lambda knot: abs(knot[1]))
        found.append(f"at {x:g} m the cant is {1e3 * abs(D):.0f} mm: tracks have {1e3 * _HIGHEST_CANT:.0f} mm at most")
    return f"track: {'; '.join(found)}" if found else ""


def surface_warning(definition: CatenaryDefinition, speed: float, step: float) -> str:
    """Return a warning if the running surface has waves that steps pass over.

    A wave that a strip passes within fewer than eight steps loses force, and is heard at another frequency. Of a
    measured surface the part in such waves counts, found on its own points, if it is more than a tenth of the whole.

    Parameters
    ----------
    definition : CatenaryDefinition
    speed : float
        Speed of the train in either direction [m/s].
    step : float
        Longest step of the line [s].
    """
    surface, shortest = definition.running_surface, _STEPS_PER_WAVE * abs(speed) * step
    bumps = (p.length for p in active_of(definition, HardPoint) if p.height and p.length)
    bump = min(bumps, default=math.inf)
    if shortest == 0.0:
        return ""
    if bump < shortest:
        what = f"a hard point has a bump of {bump:.3g} m"
    elif surface is None:
        return ""
    elif surface.sigma and surface.to is not None and surface.to * shortest > 1.0:
        what = f"the running surface has waves down to {1.0 / surface.to:.3g} m"
    elif surface.points and short_waves(np.array(surface.points), shortest) > _SHORT_SHARE:
        what = f"the running surface of {surface.profile} has waves"
    else:
        return ""
    return (
        f"{what}, and steps of {1e3 * step:.3g} ms at {3.6 * abs(speed):.0f} km/h follow none below {shortest:.2g} m: "
        "take a smaller time_step"
    )


def short_waves(points: FloatArray, shortest: float) -> float:
    """Return which share of a profile's height, in root mean squares, is in waves shorter than ``shortest`` [m].

    Parameters
    ----------
    points : ndarray, shape (n, 2)
        Position and height [m].
    """
    x, r = points.T
    count = min(math.ceil((x[-1] - x[0]) / min(0.25 * shortest, float(np.diff(x).min()))), _LONGEST_PROFILE)
    places = np.linspace(x[0], x[-1], 1 << (max(count, 2) - 1).bit_length())
    heights = np.interp(places, x, r)
    heights -= np.linspace(heights[0], heights[-1], len(heights))  # what is left closes on itself
    power = np.abs(_transform(heights)[1 : len(heights) // 2 + 1]) ** 2
    waves = np.arange(1, len(power) + 1) / (x[-1] - x[0])
    total = float(power.sum())
    return math.sqrt(float(power[waves * shortest > 1.0].sum()) / total) if total else 0.0


def _transform(values: FloatArray) -> ComplexArray:
    """Return the discrete Fourier transform of as many values as a power of two.

    By halves (Cooley and Tukey 1965): standalone FMUs bring numpy without its transforms.
    """
    terms = values.astype(np.complex128)[None]
    while len(terms) < len(values):
        half = terms.shape[1] // 2
        turned = np.exp(-1j * np.pi * np.arange(len(terms)) / len(terms))[:, None] * terms[:, half:]
        terms = np.concatenate([terms[:, :half] + turned, terms[:, :half] - turned])
    return terms[:, 0]


def slack_law_warning(definition: CatenaryDefinition) -> str:
    """Return a warning if droppers pull well before they are taut: N = max(0, k e + alpha k e') with a large alpha."""
    alpha = definition.damping.of("dropper").alpha
    hung = (("dropper", definition.dropper), ("hanger", definition.hanger))
    named = [f"[{name}]" for name, item in hung if item is not None and item.slack_law == "tension"]
    if not named or alpha <= _LONGEST_DELAY:
        return ""
    return (
        f'with slack_law = "tension" and alpha = {alpha:g} s a dropper that lengthens at {_STRETCHING:g} m/s pulls '
        f"{1e3 * alpha * _STRETCHING:.2g} mm before it is taut: give droppers a damping of their own, "
        f'[damping.dropper] with alpha up to {_LONGEST_DELAY:g} s, or write slack_law = "elastic_only" in '
        f"{' and '.join(named)}"
    )

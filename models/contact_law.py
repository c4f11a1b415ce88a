"""Contact of a collector strip with a contact wire: the normal force [1]_, and where the resultant acts.

References
----------
.. [1] P. Antunes, Co-simulation methods for multidisciplinary problems in railway dynamics (2012), section 4.1.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from itertools import pairwise
from types import MappingProxyType
from typing import Final, NamedTuple, Protocol

import numpy as np

from models.arrays import FloatArray

#: Lowest impact velocity to which the damping of a contact refers [m/s].
_SLOWEST_IMPACT = 1e-6


class ContactParameters(Protocol):
    """Parameters of a contact law."""

    @property
    def stiffness(self) -> float:
        """Return the stiffness [N/m^n]."""

    @property
    def exponent(self) -> float:
        """Return the exponent n."""

    @property
    def restitution(self) -> float:
        """Return the coefficient of restitution."""


class NormalForce(NamedTuple):
    """Normal force and its derivatives with respect to penetration [N/m] and penetration velocity [N s/m]."""

    force: float
    by_penetration: float
    by_velocity: float

    def scaled(self, share: float) -> NormalForce:
        """Return a share of the force."""
        if share == 1.0:
            return self
        return NormalForce(share * self.force, share * self.by_penetration, share * self.by_velocity)


def continuous_contact(
    penetration: float, velocity: float, impact_velocity: float, parameters: ContactParameters
) -> NormalForce:
    """Return K delta^n (1 + 3/4 (1 - e^2) delta'/delta'(-)), never negative [2.47].

    Parameters
    ----------
    penetration, velocity : float
        delta [m] and delta' [m/s].
    impact_velocity : float
        delta'(-), the velocity at impact [m/s].

    Examples
    --------
    >>> from models.catenary.definition.line_definition import Contact
    >>> continuous_contact(0.005, 0.1, 0.1, Contact()).force
    100.0
    """
    if penetration <= 0.0:
        return NormalForce(0.0, 0.0, 0.0)
    n = parameters.exponent
    elastic = parameters.stiffness * penetration**n
    hysteresis = 0.75 * (1.0 - parameters.restitution**2) / max(impact_velocity, _SLOWEST_IMPACT)
    factor = 1.0 + hysteresis * velocity
    if factor <= 0.0:
        return NormalForce(0.0, 0.0, 0.0)
    return NormalForce(elastic * factor, n * elastic / penetration * factor, elastic * hysteresis)


#: Penetration, its velocity, the velocity at impact, parameters -> normal force and its slopes.
#:
#: A law must be continuous in penetration and velocity, give no force without penetration and never pull. A step solves
#: for the force that the law gives at the penetration which this force leaves; where the law jumps there is no
#: solution, however short the step. So every law is registered through `register_contact_law`, which looks for jumps.
ContactLaw = Callable[[float, float, float, ContactParameters], NormalForce]
_laws: dict[str, ContactLaw] = {}
#: Contact laws by name.
CONTACT_LAWS: Final[Mapping[str, ContactLaw]] = MappingProxyType(_laws)


class ContactLawError(ValueError):
    """A contact law with which a step has no solution."""


class _Trial(NamedTuple):
    """Parameters with which a law is tested."""

    stiffness: float
    exponent: float
    restitution: float


#: Test range of a law: parameters, penetrations [m] and velocities [m/s] typical of a pantograph.
_TRIALS: Final = (_Trial(5e4, 1.0, 1.0), _Trial(2e5, 1.5, 0.7))
_DEEPEST: Final = 0.02
_FASTEST: Final = 1.0
_IMPACT: Final = 0.3
_PIECES: Final = 32
#: Largest change of the force over a vanishing change of its arguments [N].
_JUMP: Final = 1e-3
_HALVINGS: Final = 48


def register_contact_law(name: str, law: ContactLaw) -> None:
    """Register a contact law under a name.

    Raises
    ------
    ContactLawError
        If the name is taken, or if the law jumps, pulls, is not finite or acts without penetration; says where.
    """
    if name in _laws:
        raise ContactLawError(f"there is already a contact law '{name}'")
    for trial in _TRIALS:
        for velocity in (-0.4, 0.0, 0.4):
            _check_sweep(name, _over_penetration(law, trial, velocity), -_DEEPEST, _DEEPEST, "penetration")
        for penetration in (0.001, 0.01):
            _check_sweep(name, _over_velocity(law, trial, penetration), -_FASTEST, _FASTEST, "velocity")
    _laws[name] = law


def _over_penetration(law: ContactLaw, trial: _Trial, velocity: float) -> Callable[[float], float]:
    return lambda penetration: law(penetration, velocity, _IMPACT, trial).force


def _over_velocity(law: ContactLaw, trial: _Trial, penetration: float) -> Callable[[float], float]:
    return lambda velocity: law(penetration, velocity, _IMPACT, trial).force


def _check_sweep(name: str, force: Callable[[float], float], low: float, high: float, what: str) -> None:
    """Reject a law whose force is invalid somewhere between two values of an argument."""
    at = [low + (high - low) * i / _PIECES for i in range(_PIECES + 1)]
    values = [force(x) for x in at]
    for x, value in zip(at, values, strict=True):
        if not 0.0 <= value < math.inf:
            raise ContactLawError(f"contact law '{name}' gives {value:g} N at a {what} of {x:g}: not a push")
        if what == "penetration" and x <= 0.0 and value > 0.0:
            raise ContactLawError(f"contact law '{name}' gives {value:g} N at a {what} of {x:g} m: without contact")
    for (a, b), (low_force, high_force) in zip(pairwise(at), pairwise(values), strict=True):
        jump, place = _jump(force, (a, low_force), (b, high_force))
        if jump > _JUMP:
            text = f"jumps by {jump:g} N at a {what} of {place:g}: a step beside it would have no solution"
            raise ContactLawError(f"contact law '{name}' {text}")


def _jump(
    force: Callable[[float], float], first: tuple[float, float], last: tuple[float, float]
) -> tuple[float, float]:
    """Return the change of a force over the shortest piece of an interval with the largest change, and where it is.

    Examples
    --------
    >>> _jump(lambda x: 3.0 * x + 2.0 * (x > 0.3), (0.0, 0.0), (1.0, 5.0))
    (2.0, 0.3)
    """
    for _ in range(_HALVINGS):
        middle = 0.5 * (first[0] + last[0])
        if abs(last[1] - first[1]) <= _JUMP or not first[0] < middle < last[0]:
            break
        between = (middle, force(middle))
        if abs(between[1] - first[1]) >= abs(last[1] - between[1]):
            last = between
        else:
            first = between
    return round(abs(last[1] - first[1]), 9), round(last[0], 9)


register_contact_law("continuous", continuous_contact)


def application_point(force: FloatArray, point: FloatArray, strip: FloatArray) -> FloatArray:
    """Return where the resultant of the vertical forces on one strip acts, shape (3,) [m].

    Without force it is the point where the strip crosses a wire, or else the middle of the strip.

    Parameters
    ----------
    force : ndarray, shape (n_sections,)
        Force on each wire, none negative [N].
    point : ndarray, shape (n_sections, 3)
        Points of contact [m]; NaN where strip and wire do not cross.
    strip : ndarray, shape (2, 2, 3)
        Ends A and B; position and velocity.

    Examples
    --------
    >>> point = np.array([[10.0, 0.2, 5.1], [10.0, -0.1, 5.1]])
    >>> application_point(np.array([100.0, 50.0]), point, np.zeros((2, 2, 3))).round(6).tolist()
    [10.0, 0.1, 5.1]
    """
    forces, points = force.tolist(), point.tolist()  # plain floats are faster than arrays for so few wires
    total = sum(forces)
    if total > 0.0:
        moment_x = moment_y = moment_z = 0.0
        for f, (x, y, z) in zip(forces, points, strict=True):
            if f > 0.0:
                moment_x, moment_y, moment_z = moment_x + f * x, moment_y + f * y, moment_z + f * z
        return np.array((moment_x / total, moment_y / total, moment_z / total))
    for crossed in points:
        if not math.isnan(crossed[0]):
            return np.array(crossed)
    middle: FloatArray = strip[:, 0].mean(axis=0)
    return middle

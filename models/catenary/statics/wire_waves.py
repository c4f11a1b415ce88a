"""Waves in the contact wire: speed, reflection at droppers, Doppler and amplification factors [1]_.

References
----------
.. [1] F. Kiessling, R. Puschmann, A. Schmieder, E. Schneider, Contact Lines for Electric Railways.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from models.catenary.condition.faults import active_of
from models.catenary.definition.fault_definition import TensionLoss
from models.catenary.definition.line_definition import CatenaryDefinition, Wire

#: Highest speed of operation over the wave speed (EN 50119; section 2.1 of the 2012 thesis).
OPERATION_LIMIT = 0.7


@dataclass(frozen=True)
class Waves:
    """Waves in the contact wire.

    Attributes
    ----------
    speed : float
        Wave speed C [m/s].
    train_speed : float
        Train speed V [m/s].
    reflection : float
        r, share of a wave that a dropper reflects.
    doppler : float
        alpha = (C - V) / (C + V).
    """

    speed: float
    train_speed: float
    reflection: float
    doppler: float

    @property
    def limit(self) -> float:
        """Return the highest speed of operation, 0.7 C [m/s]."""
        return OPERATION_LIMIT * self.speed

    @property
    def amplification(self) -> float:
        """Return r / alpha, infinite at the wave speed and above."""
        return self.reflection / self.doppler if self.doppler > 0.0 else math.inf


def wave_speed(wire: Wire, length: float) -> float:
    """Return C = sqrt((F + EI (pi / L)^2) / rho) of a wire [m/s] [2.1].

    Parameters
    ----------
    wire : Wire
    length : float
        L, the span length [m].
    """
    return math.sqrt((wire.tension + wire.EI * (math.pi / length) ** 2) / wire.mass)


def contact_wire_wave_speed(definition: CatenaryDefinition) -> float:
    """Return the wave speed of the contact wire in the longest span, where it is lowest [m/s].

    Of a wire that has lost tension in some section it is the speed there.
    """
    longest = max(span.length for section in definition.sections for span in section.spans)
    lost = (f.amount for f in active_of(definition, TensionLoss) if f.wire == "contact_wire")
    wire = definition.contact_wire
    return wave_speed(replace(wire, tension=wire.tension * (1.0 - max(lost, default=0.0))), longest)


def reflection_factor(upper: Wire, contact: Wire) -> float:
    """Return r = sqrt(F_u rho_u) / (sqrt(F_u rho_u) + sqrt(F_c rho_c)) of a dropper between two wires."""
    above, below = (math.sqrt(w.tension * w.mass) for w in (upper, contact))
    return above / (above + below)


def waves(
    definition: CatenaryDefinition,
    speed: float,
    length: float,
    contact: float | None = None,
    upper: float | None = None,
) -> Waves:
    """Return the wave figures of a line at a train speed in a span.

    The upper wire of the droppers is the messenger wire, or in a compound line the auxiliary wire.

    Parameters
    ----------
    definition : CatenaryDefinition
    speed, length : float
        Speed of the train [m/s], length of the span [m].
    contact, upper : float, optional
        Tensions that contact wire and upper wire have there [N]; by default those of the design.
    """
    below, above = definition.contact_wire, definition.auxiliary_wire or definition.messenger_wire
    below = below if contact is None else replace(below, tension=contact)
    above = above if upper is None else replace(above, tension=upper)
    C = wave_speed(below, length)
    return Waves(C, speed, reflection_factor(above, below), (C - speed) / (C + speed))

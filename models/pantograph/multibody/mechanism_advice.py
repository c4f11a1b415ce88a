"""Warnings about a multibody pantograph under a wire: what a run may do, but whose results deserve a second look."""

from __future__ import annotations

import numpy as np

from models.arrays import FloatArray
from models.pantograph.multibody.analysis.mechanism_freedom import freedom_warning
from models.pantograph.multibody.analysis.mechanism_statics import contact_force_at
from models.pantograph.multibody.mechanism import Mechanism, MechanismError
from models.pantograph.multibody.mechanism_definition import MechanismDefinition
from models.pantograph.working_height import Raised


def working_height_warning(mechanism: Mechanism, standing: FloatArray, x: float, z: float) -> str:
    """Say so if the lifting value that is for the reference height leaves less at the wire's; empty if it does not.

    Parameters
    ----------
    mechanism : Mechanism
        Of a pantograph, its springs settled.
    standing : ndarray, shape (13 n,)
        State with the strip at the reference height.
    x, z : float
        Where the wire is above the strip as it starts [m].
    """
    definition = mechanism.definition
    raised = _raised(definition)
    is_unused = definition.lift_input or not raised.value
    if is_unused or not raised.is_under_another_height(x, z):
        return ""
    above = mechanism.strip_height(standing)
    at_reference = _force(mechanism, standing, above)
    if at_reference is None or at_reference <= 0.0:
        return ""  # it lifts nothing even there, which the run reports
    return raised.warning(z, _force(mechanism, standing, above + z - raised.reference), at_reference)


def mechanism_warning(mechanism: Mechanism, standing: FloatArray) -> str:
    """Say so if a mechanism has motions too many, or some that grow; empty if not.

    Parameters
    ----------
    mechanism : Mechanism
        Of a pantograph, its springs settled.
    standing : ndarray, shape (13 n,)
        State with the strip at the reference height.
    """
    force = _force(mechanism, standing, mechanism.strip_height(standing))
    return freedom_warning(mechanism, standing, max(force or 0.0, 0.0))


def inertia_warning(definition: MechanismDefinition) -> str:
    """Say which bodies have a moment of inertia larger than the other two together, as no body has."""
    wrong = [f"{b.name} by {100.0 * b.inertia_excess:.2g} %" for b in definition.bodies if b.inertia_excess > 1e-9]
    text = "the largest moment of inertia exceeds the other two together, as no body's does"
    return f"{text}: {', '.join(wrong)}; results hold for these numbers" if wrong else ""


def _raised(definition: MechanismDefinition) -> Raised:
    name, unit = definition.lift_parameter or "static_force", definition.lift_unit
    return Raised(name, definition.lift, unit, definition.reference_height, definition.start_position)


def _force(mechanism: Mechanism, standing: FloatArray, height: float) -> float | None:
    """Return the static contact force at a strip height above the base [N], None if there is no equilibrium."""
    try:
        return contact_force_at(mechanism, height, mechanism.definition.lift, start=standing).inputs.force
    except (MechanismError, np.linalg.LinAlgError):
        return None

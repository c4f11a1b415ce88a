"""Where a pantograph stands: its base above the rails, its arms for the reference height and at the start."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from models.arrays import FloatArray
from models.pantograph.multibody.analysis.cam_design import reach, stand, strip_height_where, working_range
from models.pantograph.multibody.analysis.mechanism_statics import Equilibrium, equilibrium, settle_springs
from models.pantograph.multibody.mechanism import Mechanism, MechanismError
from models.pantograph.multibody.mechanism_definition import MechanismDefinition


class Posture(NamedTuple):
    """A pantograph at rest on its base.

    Attributes
    ----------
    base_height : float
        Of the base's origin above the rails [m].
    reference : ndarray, shape (13 n,)
        State with the strip at the reference height.
    start : Equilibrium
        Where it is at time 0, held by what carries the weights.
    """

    base_height: float
    reference: FloatArray
    start: Equilibrium


def take_posture(mechanism: Mechanism) -> Posture:
    """Settle springs, fit the cam, and put the strip at its reference height and at its start height.

    Raises
    ------
    MechanismError
        If the mechanism cannot be assembled or balanced, or a height is out of reach; says which can be reached.
    """
    definition = mechanism.definition
    standing = stand(mechanism)
    if definition.base_height is None:
        base = definition.reference_height - mechanism.strip_height(standing)
        working = equilibrium(mechanism, start=standing)
    else:
        base = definition.base_height
        working = _raised_to(mechanism, standing, base, "reference_height", definition.reference_height)
    reference = working.y if definition.base_height is not None else standing
    if definition.start_height is not None:
        working = _raised_to(mechanism, standing, base, "start_height", definition.start_height)
    if definition.base_height is None and definition.start_height is None:
        base = definition.reference_height - working.strip_height
    return Posture(base, reference, working)


def check_heights(definition: MechanismDefinition) -> str:
    """Return why a pantograph cannot stand where its heights say, which takes no cam; empty if it can, or has none.

    Only heights that the arms have to take by their angle are looked at, so that it takes a fraction of a second.
    """
    if definition.base_height is None and definition.start_height is None:
        return ""
    try:
        mechanism = Mechanism(definition)
        standing = settle_springs(mechanism)
        base = definition.base_height or definition.reference_height - mechanism.strip_height(standing)
        if definition.base_height is not None:
            _raised_to(mechanism, standing, base, "reference_height", definition.reference_height)
        if definition.start_height is not None:
            _raised_to(mechanism, standing, base, "start_height", definition.start_height)
    except (MechanismError, np.linalg.LinAlgError) as error:
        return str(error).removeprefix(f"{definition.name}: ")
    return ""


def _check_stops(mechanism: Mechanism, standing: FloatArray, base: float, given: str, found: Equilibrium) -> None:
    """Refuse a height at which the arms are beyond their stops."""
    touched = mechanism.forces.stops.touched(mechanism.kinematics(found.y).frames)
    if not touched:
        return
    text = f"{mechanism.definition.name}: {given} is beyond the stop '{touched[0]}'"
    if mechanism.forces.lift_place is not None:
        places = working_range(mechanism, standing)
        low, high = sorted(base + strip_height_where(mechanism, standing, place) for place in places)
        text += f": between its stops the strip goes from {low:.3f} to {high:.3f} m"
    raise MechanismError(text)


def _raised_to(mechanism: Mechanism, standing: FloatArray, base: float, key: str, height: float) -> Equilibrium:
    try:
        found = equilibrium(mechanism, height - base, start=standing)
    except (MechanismError, np.linalg.LinAlgError) as error:
        if mechanism.forces.lift_place is None:
            raise
        low, high = sorted(base + reach(mechanism, standing, way)[1] for way in (-1.0, 1.0))
        raise MechanismError(
            f"{mechanism.definition.name}: {key} = {height:g} m is out of reach: with the base at {base:.3f} m the "
            f"strip goes from {low:.3f} to {high:.3f} m"
        ) from error
    _check_stops(mechanism, standing, base, f"{key} = {height:g} m", found)
    return found

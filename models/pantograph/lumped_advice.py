"""Warnings about a lumped pantograph under a wire: what a run may do, but whose results deserve a second look.

Every function returns a sentence for the user, empty where there is nothing to say.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from models.pantograph.lumped_characteristics import contact_force_over_height
from models.pantograph.parameters import LumpedDefinition

#: A wire farther than this above the reference height is at another working height, and not merely sagging less [m].
_SAME_HEIGHT: Final = 0.1
#: Largest share of the static force that the chain's lowest spring may take away by then.
_LARGEST_LOSS: Final = 0.1
#: A wire farther than this from the pantograph's start is not the one above it [m].
_NEAR: Final = 1.0


def working_height_warning(definition: LumpedDefinition, x: float, z: float) -> str:
    """Say so if the static force, which is that at the reference height, is not what is left at the wire's.

    Parameters
    ----------
    definition : LumpedDefinition
    x, z : float
        Where the wire is above the strip as it starts [m].
    """
    reference, force = definition.reference_height, definition.static_force
    if abs(x - definition.start_position) > _NEAR or z - reference <= _SAME_HEIGHT or not force:
        return ""
    try:
        left = float(contact_force_over_height(definition, np.array([z]))[0])
    except np.linalg.LinAlgError:  # nothing joins a mass to the one below
        return ""
    if left >= (1.0 - _LARGEST_LOSS) * force:
        return ""
    what = f"{left:.0f} N are left" if left > 0.0 else "nothing is left, and the strip does not reach it"
    return (
        f"the static force of {force:g} N is that at the reference height, {reference:g} m; at the wire's, {z:.2f} m, "
        f"{what}: set reference_height to the wire's height, or find static_force anew"
    )

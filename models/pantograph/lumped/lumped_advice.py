"""Warnings about a lumped pantograph under a wire: what a run may do, but whose results deserve a second look.

Every function returns a sentence for the user, empty where there is nothing to say.
"""

from __future__ import annotations

import numpy as np

from models.pantograph.lumped.lumped_definition import LumpedDefinition
from models.pantograph.lumped.lumped_rig import contact_force_over_height
from models.pantograph.working_height import Raised


def working_height_warning(definition: LumpedDefinition, x: float, z: float) -> str:
    """Say so if the static force, which is that at the reference height, is not what is left at the wire's.

    Parameters
    ----------
    definition : LumpedDefinition
    x, z : float
        Where the wire is above the strip as it starts [m].
    """
    force, reference = definition.static_force, definition.reference_height
    raised = Raised("static_force", force, "N", reference, definition.start_position)
    if not raised.is_under_another_height(x, z) or not force:
        return ""
    try:
        left = float(contact_force_over_height(definition, np.array([z]))[0])
    except np.linalg.LinAlgError:  # nothing joins a mass to the one below
        return ""
    return raised.warning(z, left, force)

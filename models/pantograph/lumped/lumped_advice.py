"""Warnings about a lumped pantograph under a wire: what a run may do, but whose results deserve a second look.

Every function returns a sentence for the user, empty where there is nothing to say.
"""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from models.pantograph.lumped.lumped_definition import LumpedDefinition, Stage
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


def idle_values(definition: LumpedDefinition) -> str:
    """Say which values do nothing, since what they belong to is switched off; empty if none is."""
    usual = {f.name: f.default for f in (*fields(LumpedDefinition), *fields(Stage))}
    has_stops = definition.lowest_height is not None or definition.highest_height is not None
    switched = [
        ("reference_time", "follow_height = 1", bool(definition.follow_height)),
        ("aerodynamic_share", "aerodynamic_uplift", any(definition.aerodynamic_uplift)),
        ("stop_stiffness", "lowest_height or highest_height", has_stops),
        ("stop_damping", "lowest_height or highest_height", has_stops),
    ]
    given = definition.provenance
    idle = [
        (key, by) for key, by, on in switched if not on and (key in given or getattr(definition, key) != usual[key])
    ]
    for i, stage in enumerate(definition.stage, 1):
        key = f"stage[{i}].friction_slip"
        if stage.friction == 0.0 and (key in given or stage.friction_slip != usual["friction_slip"]):
            idle.append((key, f"stage[{i}].friction"))
    return "; ".join(f"{key} does nothing without {by}" for key, by in idle)

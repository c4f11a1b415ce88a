"""A mechanism as the kernels take it: tables of numbers, one after the other in one array."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from models.arrays import FloatArray, IntArray
from models.numerics.cubic_curve import CubicCurve
from models.pantograph.multibody.elements.angle_elements import BodyAngle, PointDistance
from models.pantograph.multibody.elements.force_elements import ElementTables
from models.pantograph.multibody.mechanism import Mechanism
from models.pantograph.multibody.mechanism_definition import (
    ActuatorForce,
    ActuatorMoment,
    Aerodynamic,
    AngleStop,
    BumpStop,
    Bushing,
    LiftingForce,
    LiftingMoment,
    SlideAndTurnFriction,
    SlidingFriction,
    SpringDamper,
    TurningFriction,
    WeightSpring,
)

#: In the order in which the kernels know them.
TABLES: Final = (
    "bodies", "base", "vectors", "gaps", "levers", "crosses", "rows", *ElementTables._fields, "lifting", "for_weights",
    "per_lift", "per_force", "strip",
)  # fmt: skip
#: Classes of force elements that kernels compute; whoever adds one adds a table and a kernel, or it stays plain.
COMPILED: frozenset[type] = frozenset(
    (
        ActuatorForce,
        ActuatorMoment,
        Aerodynamic,
        AngleStop,
        BumpStop,
        Bushing,
        LiftingForce,
        LiftingMoment,
        SlideAndTurnFriction,
        SlidingFriction,
        SpringDamper,
        TurningFriction,
        WeightSpring,
    )
)
_NO_CURVE: Final = np.zeros((0, 5))


class MechanismTables(NamedTuple):
    """All tables of a mechanism.

    Attributes
    ----------
    numbers : ndarray, shape (k,)
        Their numbers, row by row.
    layout : ndarray, shape (19, 3)
        Where each begins, its rows and columns.
    """

    numbers: FloatArray
    layout: IntArray


def unknown_to_kernels(mechanism: Mechanism) -> str:
    """Name a kind of force element that no kernel computes, or return an empty text."""
    return next((type(f).__name__ for f in mechanism.definition.forces if type(f) not in COMPILED), "")


def tables_of(mechanism: Mechanism) -> MechanismTables:
    """Return the tables of a mechanism as it is: assembled, its springs settled, the curves of its lift fitted."""
    forces = mechanism.forces
    curves = (forces.cam.for_weights, forces.cam.per_lift) if forces.cam is not None else (None, None)
    found = [
        mechanism.body_table(),
        mechanism.base_table(),
        *mechanism.pool.tables(),
        mechanism.constraints.table(),
        *forces.tables(),
        _lifting(forces.lift_place),
        *(_rows(curve) for curve in (*curves, forces.per_force)),
        np.array([[mechanism.strip_body, *mechanism.strip_point, mechanism.definition.strip_length]]),
    ]
    sizes = [table.shape for table in found]
    begins = np.cumsum([0, *(rows * columns for rows, columns in sizes[:-1])])
    layout = np.column_stack([begins, np.array(sizes)]).astype(np.int64)
    return MechanismTables(np.concatenate([table.ravel() for table in found]), layout)


def _rows(curve: CubicCurve | None) -> FloatArray:
    return _NO_CURVE if curve is None else curve.rows


def _lifting(place: BodyAngle | PointDistance | None) -> FloatArray:
    """Return where the lifting element stands: the numbers of its angle or length, then which of them."""
    if place is None:
        return np.zeros((0, 15))
    numbers = place.numbers()
    kind = 0.0 if isinstance(place, BodyAngle) else 2.0 if place.is_directed else 1.0
    return np.array([[*numbers, *[0.0] * (14 - len(numbers)), kind]])

"""The line at rest in figures: shapes of its wires, droppers, loads of its steady arms."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from models.arrays import BoolArray, FloatArray
from models.catenary.definition.section_definition import Span
from models.catenary.line_model import CatenaryModel


@dataclass(frozen=True)
class Droppers:
    """Static state of droppers, arrays of shape (n,).

    Attributes
    ----------
    x : ndarray
        Position along the track [m].
    length : ndarray
        Unstrained length [m].
    force : ndarray
        Tension [N].
    is_hanger : ndarray of bool
        Between auxiliary and messenger wire of a compound line.
    """

    x: FloatArray
    length: FloatArray
    force: FloatArray
    is_hanger: BoolArray


@dataclass(frozen=True)
class Profile:
    """A wire in its static shape, arrays of shape (n,) [m]."""

    component: str
    x: FloatArray
    y: FloatArray
    z: FloatArray


@dataclass(frozen=True)
class ArmLoads:
    """Steady arms, arrays of shape (n,).

    Attributes
    ----------
    x : ndarray
        Position along the track [m].
    lateral : ndarray
        Lateral force of the contact wire on the arm [N], positive where the arm is in tension.
    lift : ndarray
        Vertical force on the contact wire from the tension of the arm [N], positive upwards; the weight of the arm is
        not included.
    pendulum : ndarray
        Stiffness of the arm against motion across its axis, N/l [N/m].
    """

    x: FloatArray
    lateral: FloatArray
    lift: FloatArray
    pendulum: FloatArray


def droppers(model: CatenaryModel, start: float = -math.inf, end: float = math.inf, section: int = 0) -> Droppers:
    """Return a section's droppers between two positions of the track, in the order of the track."""
    lower = model.mesh.droppers[:, 0]
    x = model.mesh.points[lower, 0]
    chosen = np.flatnonzero((x >= start) & (x <= end) & (model.mesh.section[lower] == section))
    chosen = chosen[np.argsort(x[chosen], kind="stable")]
    static = model.static
    return Droppers(
        x[chosen], static.unstrained_length[chosen], static.dropper_force[chosen], model.mesh.is_hanger[chosen]
    )


def profiles(model: CatenaryModel, section: int = 0) -> tuple[Profile, ...]:
    """Return every wire of a section in its static shape."""
    positions = model.static.positions
    chains = [c for c in model.mesh.chains if c.section == section]
    return tuple(Profile(c.component, *positions[c.nodes].T.copy()) for c in chains)


def within(profile: Profile, span: Span) -> BoolArray:
    """Return which points of a wire lie in a span, its ends included (stretch moves points by 0.1 mm)."""
    return (profile.x >= span.start - 0.01) & (profile.x <= span.end + 0.01)


def largest_offset(wire: Profile, supports: FloatArray) -> tuple[float, float]:
    """Return where a wire is farthest from the middle of the track, and its y there [m].

    Sought from the first to the last support: beyond them the wires run to their anchors.
    """
    first, last = (supports[0], supports[-1]) if len(supports) else (-np.inf, np.inf)
    between = np.flatnonzero((wire.x >= first - 0.01) & (wire.x <= last + 0.01))
    worst = between[np.abs(wire.y[between]).argmax()]
    return float(wire.x[worst]), float(wire.y[worst])


def arm_loads(model: CatenaryModel, section: int = 0) -> ArmLoads:
    """Return the loads of a section's steady arms, from their elongation."""
    mesh, static = model.mesh, model.static
    chosen = mesh.section[mesh.arms[:, 1]] == section
    end, node = mesh.arms[chosen].T
    along = static.shape.points[node] - static.shape.points[end]
    length = np.linalg.norm(along, axis=1)
    along /= length[:, None]
    tension = static.arm_force[chosen]
    return ArmLoads(
        static.positions[node, 0],
        tension * np.linalg.norm(along[:, :2], axis=1),
        -tension * along[:, 2],
        np.maximum(tension, 0.0) / length,
    )

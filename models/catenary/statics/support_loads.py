"""The supports of a line at rest: where they hold the wires, what loads their arms, how steep the wire is."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from models.arrays import FloatArray
from models.catenary.definition.section_definition import Section
from models.catenary.line_model import CatenaryModel
from models.catenary.shape.line_mesh import contact_wire_height
from models.catenary.shape.support_places import SupportPlaces


@dataclass(frozen=True)
class SupportLoads:
    """Supports between the anchors, arrays of shape (n,); NaN where there is no arm, or no next support.

    Attributes
    ----------
    x, height, encumbrance, stagger : ndarray
        Place along the track, specified height of the contact wire, messenger wire above that, lateral place [m].
    side : ndarray
        Of the arm's registration end: 1 left of the wire, -1 right of it.
    lateral : ndarray
        Lateral force of the arm on the contact wire, to the left positive [N].
    lift : ndarray
        Vertical force of the arm's tension on the contact wire, upwards positive [N].
    tension, pendulum : ndarray
        N of the arm [N], and N/l, its stiffness across [N/m].
    gradient : ndarray
        Of the contact wire's specified heights to the next support, where both are at the working height.
    change : ndarray
        Of the gradient at the support, its size.
    """

    x: FloatArray
    height: FloatArray
    encumbrance: FloatArray
    stagger: FloatArray
    side: FloatArray
    lateral: FloatArray
    lift: FloatArray
    tension: FloatArray
    pendulum: FloatArray
    gradient: FloatArray
    change: FloatArray


def support_loads(model: CatenaryModel, section: int = 0) -> SupportLoads:
    """Return the supports of a section between its anchors."""
    definition = model.definition
    held = definition.sections[section]
    places = SupportPlaces(definition, held)
    x = np.array([s.x for s in held.inner_supports])
    height = np.array([contact_wire_height(places, at) for at in x.tolist()])
    gradient = _gradients(x, height, held)
    before = np.roll(gradient, 1) if held.period else np.concatenate([[math.nan], gradient[:-1]])
    return SupportLoads(
        x=x,
        height=height,
        encumbrance=np.array([places.encumbrance(at) for at in x.tolist()]),
        stagger=np.array([s.stagger for s in held.inner_supports]),
        gradient=gradient,
        change=np.abs(gradient - before),
        **_arms(model, section, x),
    )


def _gradients(x: FloatArray, height: FloatArray, section: Section) -> FloatArray:
    """Return the gradient from every support to the next one; NaN where the wires rise to their anchors."""
    if not len(x):
        return x.copy()
    if section.periodic:
        return (np.roll(height, -1) - height) / np.diff(np.append(x, x[0] + section.period))
    first, last = section.ends.working
    works = (x >= first) & (x <= last)
    between = np.where(works[:-1] & works[1:], np.diff(height) / np.diff(x), math.nan)
    return np.append(between, math.nan)


def _arms(model: CatenaryModel, section: int, x: FloatArray) -> dict[str, FloatArray]:
    """Return what the arms of supports at ``x`` do, by name."""
    mesh, static = model.mesh, model.static
    found = {name: np.full(len(x), math.nan) for name in ("side", "lateral", "lift", "tension", "pendulum")}
    chosen = np.flatnonzero(mesh.section[mesh.arms[:, 1]] == section)
    end, node = mesh.arms[chosen].T
    at = np.abs(mesh.points[node, 0][:, None] - x).argmin(axis=1) if len(x) else np.zeros(0, dtype=np.int64)
    pull = static.shape.points[end] - static.shape.points[node]
    length = np.linalg.norm(pull, axis=1)
    tension = static.arm_force[chosen]
    force = (tension / length)[:, None] * pull
    found["side"][at] = np.sign(pull[:, 1])
    found["lateral"][at], found["lift"][at] = force[:, 1], force[:, 2]
    found["tension"][at], found["pendulum"][at] = tension, np.maximum(tension, 0.0) / length
    return found

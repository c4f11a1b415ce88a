"""Static elasticity of the contact wire along a span, and its non-uniformity [1]_.

References
----------
.. [1] F. Kiessling, R. Puschmann, A. Schmieder, E. Schneider, Contact Lines for Electric Railways.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from models.arrays import FloatArray
from models.catenary.contact_and_slack.contact_wire import ContactWire
from models.catenary.contact_and_slack.local_problem import LocalProblem
from models.catenary.definition.section_definition import Span
from models.catenary.line_model import CatenaryModel
from models.catenary.linear_motion.attachment_solver import factorised
from models.catenary.linear_motion.compliance import Compliance
from models.catenary.shape.beam_elements import NODE_DOFS
from models.contact_law import CONTACT_LAWS


@dataclass(frozen=True)
class Elasticity:
    """Elasticity of the contact wire along a span.

    Attributes
    ----------
    x : ndarray, shape (n,)
        Positions of the force [m].
    value : ndarray, shape (n,)
        Uplift per force [m/N].
    force : float
        The force [N], on which the elasticity depends, as droppers go slack.
    """

    x: FloatArray
    value: FloatArray
    force: float

    @property
    def minimum(self) -> float:
        """Return the smallest elasticity [m/N]."""
        return float(self.value.min())

    @property
    def maximum(self) -> float:
        """Return the largest elasticity [m/N]."""
        return float(self.value.max())

    @property
    def non_uniformity(self) -> float:
        """Return u = (e_max - e_min) / (e_max + e_min)."""
        return (self.maximum - self.minimum) / (self.maximum + self.minimum)


def elasticity(model: CatenaryModel, x: FloatArray, force: float, section: int = 0) -> Elasticity:
    """Return the static elasticity of the contact wire, droppers in tension only.

    Parameters
    ----------
    x : ndarray, shape (n,)
        Positions along the track [m].
    force : float
        Vertical force, applied at one position after the other [N].
    section : int
        Section of the contact wire.

    Raises
    ------
    LocalSolutionError
        If the set of slack droppers under the force is not found.
    """
    response = _StaticResponse(model)
    wire = model.wires[section]
    return Elasticity(x, np.array([response.uplift(wire, float(at), force) / force for at in x]), force)


def rise_of_nodes(model: CatenaryModel, x: FloatArray, force: float, section: int = 0) -> FloatArray:
    """Return how far nodes rise under a force on the contact wire; those between attachments of the pushed wire less.

    Parameters
    ----------
    x : ndarray, shape (n,)
        Positions along the track [m].
    force : float
        Vertical force, applied at one position after the other [N].
    section : int
        Section of the contact wire.

    Returns
    -------
    ndarray, shape (n, n_nodes)
        [m].

    Raises
    ------
    LocalSolutionError
        If the set of slack droppers under the force is not found.
    """
    response, still = _StaticResponse(model), np.zeros(model.modes.coupling.shape[0])
    rises = np.zeros((len(x), len(model.mesh.points)))
    for row, place in zip(rises, x.tolist(), strict=True):
        _, attached = response.under(model.wires[section], place, force)
        row[:] = model.modes.nodal(still, attached).reshape(-1, NODE_DOFS)[model.mesh.owner, 2]
    return rises


def positions_in_span(span: Span, between: int = 6) -> FloatArray:
    """Return the positions of supports, droppers and points that divide every gap into ``between`` intervals [m]."""
    breaks = [span.start, *span.droppers, span.end]
    pieces = [np.linspace(a, b, between, endpoint=False) for a, b in pairwise(breaks)]
    return np.append(np.concatenate(pieces), span.end)


class _StaticResponse:
    """Static compliance of the line, with the slack droppers found exactly.

    At rest the modes of the intervals and the attachments do not act on each other.
    """

    def __init__(self, model: CatenaryModel) -> None:
        self._model = model
        factor = factorised(model.modes.K)
        self._solve = factor.solve
        columns = Compliance(factor, model.dropper_law.B, model.dropper_law.stiffness).dropper_columns
        self._columns = columns
        self._local = LocalProblem(
            unilateral=model.dropper_law.unilateral,
            dropper_columns=columns,
            velocity_factor=0.0,
            law=CONTACT_LAWS[model.definition.contact.law],
            parameters=model.definition.contact,
        )
        self._rest = model.dropper_law.B.T @ model.dropper_law.rest_compensation

    def uplift(self, wire: ContactWire, x: float, force: float) -> float:
        """Return the rise of a contact wire under a vertical force on it [m]."""
        return self.under(wire, x, force)[0]

    def under(self, wire: ContactWire, x: float, force: float) -> tuple[float, FloatArray]:
        """Return the rise of a contact wire under a vertical force on it [m], and displacements of all attachments."""
        model = self._model
        element, xi = wire.locate(x)
        interval = wire.interval(element)
        modal, ends = interval.split(interval.lift(element, xi)[0])
        load = self._rest.copy()
        load[interval.ends] += force * ends
        displacement = self._solve(load)
        elastic = model.static.elastic_force + model.dropper_law.stiffness * (model.dropper_law.B @ displacement)
        found = self._local.solve(elastic, (), np.zeros(0), np.flatnonzero(elastic < 0.0))
        for j, compensation in zip(found.slack, found.compensation, strict=True):
            column = self._columns[int(j)]
            displacement[column.rows] -= compensation * column.values[:, 0]
        inside = force * modal @ (modal / model.modes.eigenvalue[interval.modes])
        return float(ends @ displacement[interval.ends] + inside), displacement

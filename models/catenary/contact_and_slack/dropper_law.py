"""What droppers carry, taut and slack.

A dropper of elongation e that could push as well would pull T: the elastic force k e where the spring goes slack
alone, and k e + c e' where its damper does so too. Within a step the rate e' is a1 times the change of the elongation
plus what is known, so that T is linear in both cases. A slack dropper lacks f = max(0, -(1 - r) T) to that, with r its
stiffness ratio in compression: the forces f are unknowns of the local problem.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from models.arrays import FloatArray, IntArray
from models.catenary.linear_motion.sparse_products import Product
from models.catenary.shape.form_finding import StaticState
from models.numerics.newmark import Newmark


class DropperLaw:
    """The droppers of a line about its static shape.

    Parameters
    ----------
    static : StaticState
    attached : ndarray, shape (n_attached,)
        Which degrees of freedom of the nodes the attachments' displacements are.

    Attributes
    ----------
    B : sparse, shape (n_droppers, n_attached)
        Rows of dropper elongation over the attachments' displacements, which are in global axes.
    stiffness : ndarray, shape (n_droppers,)
        k [N/m].
    unilateral : ndarray, shape (n_droppers,)
        1 - r.
    slack_delay : ndarray, shape (n_droppers,)
        c / k where spring and damper go slack together [s]; 0 where the spring does so alone.
    elastic_at_rest : ndarray, shape (n_droppers,)
        k e in the static shape [N].
    rest_compensation : ndarray, shape (n_droppers,)
        What droppers that are slack at rest lack to their elastic force [N]; given lengths may leave some slack.
    rest_load : ndarray, shape (n_attached,)
        What that does to the attachments [N].
    """

    def __init__(self, static: StaticState, attached: IntArray) -> None:
        droppers, alpha = static.droppers, static.shape.definition.damping.of("dropper").alpha
        self.B, self.stiffness = droppers.rows[:, attached].tocsr(), droppers.stiffness
        self.unilateral, self.slack_delay = 1.0 - droppers.compression_ratio, droppers.slack_delay
        self.elastic_at_rest = static.elastic_force
        self.rest_compensation = static.dropper_force - static.elastic_force
        self.rest_load = self.B.T @ self.rest_compensation
        #: Elastic forces from the attachments' displacements; those of the dampers from velocities.
        self._tighten = Product(sp.diags(self.stiffness) @ self.B)
        self._damp = Product(alpha * sp.diags(self.stiffness) @ self.B)
        self._pull = self._pulls()
        #: What each dropper pulls at.
        self._stretch = [(row.indices, row.data) for row in self.B]

    def spring_force(self, displacement: FloatArray) -> FloatArray:
        """Return stiffness times elongation of every dropper [N], shape (n_droppers,): negative where too long."""
        force = self.elastic_at_rest.copy()
        self._tighten.add(displacement, force)
        return force

    def force(self, attached: FloatArray, slack: IntArray, compensation: FloatArray) -> FloatArray:
        """Return what every dropper carries [N], its damper's part included, shape (n_droppers,).

        By the law "tension" that is nothing where it is slack; by "elastic_only" what the damper, which knows no slack
        there, pulls or pushes.

        Parameters
        ----------
        attached : ndarray, shape (2, n_attached)
            Displacements of the attachments and their velocities.
        slack, compensation : ndarray
            Which droppers are slack, and their forces f [N].
        """
        released, damper = self.spring_force(attached[0]), np.zeros(len(self.stiffness))
        self._damp.add(attached[1], damper)
        together = self.slack_delay > 0.0  # spring and damper are released as one
        released[together] += damper[together]
        released[slack] = np.where(self.unilateral[slack] == 1.0, 0.0, released[slack] + compensation)
        return released + np.where(together, 0.0, damper)

    def known_load(self, slack: IntArray, compensation: FloatArray) -> FloatArray:
        """Return what slack does to the attachments in a step, as far as known [N], shape (n_attached,).

        What a dropper that is slack at rest lacks is part of the static state, so it acts at both ends of the step.
        """
        load = 2.0 * self.rest_load
        for j, force in zip(slack.tolist(), compensation.tolist(), strict=True):
            places, stretch = self._stretch[j]
            load[places] -= force * stretch
        return load

    def pull(self, attached: FloatArray) -> FloatArray:
        """Return the pulls T at the end of a step that the motion at its beginning makes [N], shape (n_droppers,)."""
        pull = self.elastic_at_rest.copy()
        self._pull.add(attached.ravel(), pull)
        return pull

    def by_change(self, newmark: Newmark) -> FloatArray:
        """Return what a change of the elongation within a step adds to the pulls T [N/m], shape (n_droppers,)."""
        return self.stiffness * (1.0 + newmark.a1 * self.slack_delay)

    def _pulls(self) -> Product:
        """Return k (x - w v), w the delay of the slack: v turns to a1 dx - v in a step."""
        k = self.stiffness
        by_velocity = sp.csr_matrix(sp.diags(-k * self.slack_delay) @ self.B)
        by_velocity.eliminate_zeros()
        return Product(sp.hstack([sp.diags(k) @ self.B, by_velocity]))

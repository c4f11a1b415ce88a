"""A line in plain nodal coordinates: what the coordinates of the intervals are checked against."""

import numpy as np
import scipy.sparse as sp

from models.catenary.contact_and_slack.contact_wire import height_polynomials
from models.catenary.shape.beam_elements import NODE_DOFS
from models.catenary.shape.element_pattern import element_dofs


def pendulum_stiffness(mesh, static):
    """Return N/L (I - e e') of every dropper and steady arm, bar by bar, shape (6 n, 6 n)."""
    bars = [*zip(mesh.droppers.tolist(), static.dropper_force.tolist(), strict=True)]
    bars += zip(mesh.arms.tolist(), static.arm_force.tolist(), strict=True)
    entries = []
    for (a, b), tension in bars:
        along = static.positions[b] - static.positions[a]
        length = np.linalg.norm(along)
        across = max(tension, 0.0) / length * (np.eye(3) - np.outer(along, along) / length**2)
        for i, j, sign in ((a, a, 1.0), (b, b, 1.0), (a, b, -1.0), (b, a, -1.0)):
            entries += [
                (NODE_DOFS * i + row, NODE_DOFS * j + column, sign * across[row, column])
                for row in range(3)
                for column in range(3)
            ]
    rows, columns, values = (np.array(part) for part in zip(*entries, strict=True))
    return sp.csr_matrix((values, (rows.astype(int), columns.astype(int))), shape=(mesh.fixed.size, mesh.fixed.size))


def pulls(model, elongation, rate):
    """Return what droppers would pull if they could push [N]: spring and damper where these go slack together."""
    alpha = model.definition.damping.of("dropper").alpha
    together = np.array([_dropper(model, hanger).slack_law == "tension" for hanger in model.mesh.is_hanger])
    return model.static.elastic_force + model.dropper_law.stiffness * (elongation + together * alpha * rate)


def _dropper(model, is_hanger):
    return model.definition.hanger if is_hanger else model.definition.dropper


class NodalLine:
    """Matrices over the free degrees of freedom of the nodes in global axes, droppers included."""

    def __init__(self, model):
        self.model, mesh, static = model, model.mesh, model.static
        self.free = np.flatnonzero(~mesh.fixed.ravel())
        index = np.full(mesh.fixed.size, -1)
        index[self.free] = np.arange(len(self.free))
        self.B = static.droppers.rows[:, self.free].tocsr()
        droppers = self.B.T @ sp.diags(model.dropper_law.stiffness) @ self.B
        pendulums = model.definition.dynamics.geometric_stiffness * pendulum_stiffness(mesh, static)
        matrices = (static.shape.matrices.K + pendulums, static.shape.matrices.M, static.shape.matrices.C)
        K, M, C = (matrix.tocsr()[self.free][:, self.free] for matrix in matrices)
        self.K, self.M = (K + droppers).tocsc(), M.tocsc()
        self.C = (C + model.definition.damping.of("dropper").alpha * droppers).tocsc()
        self.size = len(self.free)
        self._wires = [self._wire(chain, index) for chain in mesh.contact_chains()]

    def _wire(self, chain, index):
        pairs = np.stack([chain.nodes[:-1], chain.nodes[1:]], axis=1)
        rows, static = height_polynomials(chain.nodes, self.model.static, np.zeros(len(self.model.mesh.points)))
        return chain.nodes, index[element_dofs(pairs)], rows, static

    def full(self, displacement):
        """Return displacements of all nodes, zero where held, shape (n, 6)."""
        result = np.zeros(self.model.mesh.fixed.size)
        result[self.free] = displacement
        return result.reshape(-1, NODE_DOFS)

    def find(self, section, strip, displacement, guess):
        """Return where a strip crosses a contact wire."""
        nodes = self._wires[section][0]
        moved = self.model.static.positions[nodes, :2] + self.full(displacement)[nodes, :2]

        def positions(interval):
            return moved[interval.first : interval.first + len(interval.plan_static) // 2].ravel().tolist()

        return self.model.wires[section].find(strip, positions, guess)

    def row(self, section, element, xi):
        """Return the row of the height of a point of a contact wire, and its static height."""
        _, dofs, rows, static = self._wires[section]
        powers = xi ** np.arange(4)
        row = np.zeros(self.size)
        inside = dofs[element] >= 0
        row[dofs[element][inside]] = (powers @ rows[element])[inside]
        return row, float(powers @ static[element])

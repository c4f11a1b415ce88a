"""A line as a truss in space: bars with unstrained lengths on exact geometry, nothing linearised, nothing of the model.

Wires do not bend; droppers carry tension only. Of the package it takes the definition and the mesh, which is to say
what is where and of what; shape, tensions and uplift it finds itself.
"""

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from models.catenary.definition.line_definition import COMPONENTS
from models.catenary.shape.line_mesh import build_mesh

GRAVITY = 9.81
_SETTLED = 1e-9  # [m]


class Truss:
    """A simple line at rest, without or with a vertical force somewhere.

    Attributes
    ----------
    rest : ndarray, shape (n, 3)
        Its shape under gravity [m].
    """

    def __init__(self, line):
        self.mesh = mesh = build_mesh(line)
        self.count = len(mesh.points)
        names = np.array(COMPONENTS)[mesh.component]
        is_arm = names == "steady_arm"
        self.wires, self.arms = mesh.beams[~is_arm], mesh.arms
        wires = [getattr(line, name) for name in names[~is_arm]]
        self.tension = np.array([w.tension for w in wires])
        self.wire_EA = np.array([w.area * w.youngs_modulus for w in wires])
        self.wire_mass = np.array([w.mass for w in wires])
        self.line, self.droppers = line, mesh.droppers
        self.spring = 0.0 if line.messenger_support is None else line.messenger_support.stiffness
        self.rest = self._at_rest(self._shape())

    def uplift(self, x, force):
        """Return the rise of the contact wire's node at ``x`` under a vertical force there [m]."""
        (chain,) = self.mesh.contact_chains()
        node = chain.nodes[np.abs(self.rest[chain.nodes, 0] - x).argmin()]
        assert abs(self.rest[node, 0] - x) < 1e-3
        load = self.weight.copy()
        load[node, 2] += force
        return self._settled(self.rest, load)[node, 2] - self.rest[node, 2]

    def _shape(self):
        """Let wires have their tensions, and find the forces that give heights at droppers and stagger at arms.

        Nodes keep their places along the track; arms their angle, as their ends go up and down with the wire.
        """
        points, arms = self.mesh.points.copy(), self.arms
        force, pull = np.full(len(self.droppers), 80.0), np.zeros(len(arms))
        free = ~self.mesh.fixed[:, :3]
        free[:, 0] = False
        free = np.flatnonzero(free.ravel())
        towards = points[arms[:, 0]] - points[arms[:, 1]]
        towards /= np.linalg.norm(towards, axis=1)[:, None]
        heights, staggers = self.mesh.droppers[:, 0] * 3 + 2, arms[:, 1] * 3 + 1
        wanted = np.concatenate([self.mesh.target, self.mesh.points[arms[:, 1], 1]])
        rows = _selection(np.concatenate([heights, staggers]), 3 * self.count)[:, free]
        for _ in range(60):
            self.weight = self._weight(points)
            wire, _ = _axes(points, self.wires)
            hung, _ = _axes(points, self.droppers)
            nodal = self.weight.copy()
            _add(nodal, self.wires, self.tension[:, None] * wire)
            _add(nodal, self.droppers, force[:, None] * hung)
            np.add.at(nodal, arms[:, 1], pull[:, None] * towards)
            self._add_springs(nodal, points)
            K = self._tangent(points, self.wires, 0.0 * self.tension, self.tension)
            K += self._tangent(points, self.droppers, 0.0 * force, force) + self._springs()
            pulls = _columns(self.droppers, hung, self.count), _columns(arms[:, ::-1], towards, self.count, one=True)
            system = sp.bmat([[K[free][:, free], -sp.hstack(pulls).tocsr()[free]], [rows, None]], format="csc")
            gap = wanted - np.concatenate([points.ravel()[heights], points.ravel()[staggers]])
            move = splu(system).solve(np.concatenate([nodal.ravel()[free], gap]))
            shift = np.zeros(3 * self.count)
            shift[free] = move[: len(free)]
            points += shift.reshape(-1, 3)
            points[arms[:, 0], 2] += shift.reshape(-1, 3)[arms[:, 1], 2]
            force = force + move[len(free) : len(free) + len(force)]
            pull = pull + move[len(free) + len(force) :]
            if np.abs(shift).max() < _SETTLED:
                return points, force, pull
        raise AssertionError(f"the truss has not settled: {np.abs(shift).max():.2g} m")

    def _at_rest(self, shape):
        """Cut all bars to the lengths that their forces leave them, and let go."""
        points, force, pull = shape
        arm, hung = self.line.steady_arm, self.line.dropper
        self.bars = np.vstack([self.wires, self.droppers, self.arms])
        self.hangs = np.repeat([False, True, False], [len(self.wires), len(self.droppers), len(self.arms)])
        wires, droppers, arms = (_axes(points, pairs)[1] for pairs in (self.wires, self.droppers, self.arms))
        held = np.full(len(droppers), hung.stiffness) if hung.stiffness else hung.area * hung.youngs_modulus / droppers
        stiff = (self.wire_EA + self.tension) / wires, held, arm.area * arm.youngs_modulus / arms
        self.stiffness, lengths = np.concatenate(stiff), np.concatenate([wires, droppers, arms])
        self.unstrained = lengths - np.concatenate([self.tension, force, pull]) / self.stiffness
        return self._settled(points, self.weight)

    def _settled(self, points, load):
        """Newton's method on the exact forces of the bars, droppers in tension only."""
        points, pairs = points.copy(), self.bars
        free = np.flatnonzero(~self.mesh.fixed[:, :3].ravel())
        for _ in range(60):
            axis, length = _axes(points, pairs)
            N, k = self.stiffness * (length - self.unstrained), self.stiffness.copy()
            slack = self.hangs & (N < 0.0)
            N[slack] = k[slack] = 0.0
            nodal = load.copy()
            _add(nodal, pairs, N[:, None] * axis)
            self._add_springs(nodal, points)
            K = (self._tangent(points, pairs, k, N) + self._springs())[free][:, free]
            shift = np.zeros(3 * self.count)
            shift[free] = splu(K.tocsc()).solve(nodal.ravel()[free])
            points += shift.reshape(-1, 3)
            if np.abs(shift).max() < _SETTLED:
                return points
        raise AssertionError(f"the truss has not settled: {np.abs(shift).max():.2g} m")

    def _weight(self, points):
        """Return the weight on the nodes: half of every bar on each end, and the clamps."""
        mass = self.mesh.clamp_mass.copy()
        hung, arm = self.line.dropper.mass, self.line.steady_arm.mass
        for pairs, per_metre in ((self.wires, self.wire_mass), (self.droppers, hung), (self.arms, arm)):
            _, length = _axes(points, pairs)
            half = 0.5 * per_metre * length
            np.add.at(mass, pairs[:, 0], half)
            np.add.at(mass, pairs[:, 1], half)
        return np.column_stack([0.0 * mass, 0.0 * mass, -GRAVITY * mass])

    def _tangent(self, points, pairs, k, N):
        """Return the tangent stiffness of bars of stiffness k under tension N."""
        axis, length = _axes(points, pairs)
        outer = axis[:, :, None] * axis[:, None, :]
        across = np.broadcast_to(N / length, length.shape)[:, None, None] * (np.eye(3) - outer)
        block = np.asarray(k)[:, None, None] * outer + across
        dofs = 3 * pairs[:, :, None] + np.arange(3)
        parts = []
        for a in (0, 1):
            for b in (0, 1):
                i, j = np.broadcast_arrays(dofs[:, a, :, None], dofs[:, b, None, :])
                value = (1.0 if a == b else -1.0) * block
                parts.append((value.ravel(), i.ravel(), j.ravel()))
        value, i, j = (np.concatenate(p) for p in zip(*parts, strict=True))
        return sp.csr_matrix((value, (i, j)), shape=(3 * self.count, 3 * self.count))

    def _springs(self):
        at = self.mesh.sprung * 3 + 2
        return sp.csr_matrix((np.full(len(at), self.spring), (at, at)), shape=(3 * self.count, 3 * self.count))

    def _add_springs(self, nodal, points):
        nodal[self.mesh.sprung, 2] += self.spring * (self.mesh.seat - points[self.mesh.sprung, 2])


def _axes(points, pairs):
    along = points[pairs[:, 1]] - points[pairs[:, 0]]
    length = np.linalg.norm(along, axis=1)
    return along / length[:, None], length


def _add(nodal, pairs, pull):
    """Let bars pull their ends together."""
    np.add.at(nodal, pairs[:, 0], pull)
    np.add.at(nodal, pairs[:, 1], -pull)


def _selection(places, size):
    return sp.csr_matrix((np.ones(len(places)), (np.arange(len(places)), places)), shape=(len(places), size))


def _columns(pairs, axis, count, one=False):
    """Return the nodal forces of unit tensions in bars, on their first ends alone if ``one``."""
    n = len(pairs)
    rows, values, at = (3 * pairs[:, 0, None] + np.arange(3)).ravel(), axis.ravel(), np.repeat(np.arange(n), 3)
    if not one:
        rows = np.concatenate([rows, (3 * pairs[:, 1, None] + np.arange(3)).ravel()])
        values, at = np.concatenate([values, -axis.ravel()]), np.concatenate([at, at])
    return sp.csr_matrix((values, (rows, at)), shape=(3 * count, n))

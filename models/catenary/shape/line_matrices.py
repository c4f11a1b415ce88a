"""Global matrices of a line about reference points: K, M, C and the static load."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from models.arrays import FloatArray, IntArray
from models.catenary.definition.line_definition import COMPONENTS, GRAVITY, SHEAR_RATIO, CatenaryDefinition
from models.catenary.definition.track_definition import Track
from models.catenary.shape.beam_elements import (
    NODE_DOFS,
    bar_geometric_stiffness,
    bar_stiffness,
    beam_geometric_stiffness,
    beam_mass,
    beam_stiffness,
    frames,
    to_global,
)
from models.catenary.shape.element_pattern import ElementPattern, element_dofs, translation_dofs
from models.catenary.shape.line_mesh import CatenaryMesh
from models.catenary.shape.track import acceleration, curve_load

#: Stiffness that holds a wire without anchors along the track at every support [N/m]: soft enough not to matter (a span
#: of messenger wire on it has a period of half a minute), but enough to fix the position of the wire.
ANCHORAGE = 1.0


@dataclass(frozen=True)
class BeamProperties:
    """Properties of the beam elements, each of shape (n_beams,)."""

    EA: FloatArray
    EI: FloatArray
    GJ: FloatArray
    mass: FloatArray
    gyration: FloatArray
    tension: FloatArray
    alpha: FloatArray
    beta: FloatArray


@dataclass(frozen=True)
class Matrices:
    """Matrices of the beams and supports of a line, without droppers, over all degrees of freedom (fixed ones too).

    Attributes
    ----------
    K, M, C : sparse, shape (6 n, 6 n)
        Stiffness, mass (with clamps and droppers) and damping.
    load : ndarray, shape (6 n,)
        Gravity, tensioning, curves of the track, and the load that keeps the kinks of the reference polygon from being
        stress-free.
    """

    K: sp.csc_matrix
    M: sp.csc_matrix
    C: sp.csc_matrix
    load: FloatArray


def beam_properties(definition: CatenaryDefinition, mesh: CatenaryMesh) -> BeamProperties:
    """Return the properties of every beam element by its component type, and by what its wire has become."""
    table = np.array([_component(definition, name) for name in COMPONENTS])
    properties = BeamProperties(*table[mesh.component].T.copy())
    properties.tension[:] *= mesh.tension_factor
    for value in (properties.EA, properties.mass, properties.gyration):
        value[:] *= mesh.area_factor
    for value in (properties.EI, properties.GJ):
        value[:] *= mesh.area_factor**2
    if definition.stitch_wire is not None:
        # Balance along the track at the clamps: the messenger wire between them lacks what the stitch wire pulls.
        properties.tension[mesh.beside_stitch] -= definition.stitch_wire.tension
    return properties


class LineAssembly:
    """Assembles a line about one set of points after another: what does not depend on these is made once.

    Parameters
    ----------
    definition : CatenaryDefinition
    mesh : CatenaryMesh
        Its points are not looked at.
    """

    def __init__(self, definition: CatenaryDefinition, mesh: CatenaryMesh) -> None:
        self.definition, self.mesh = definition, mesh
        self._size = mesh.fixed.size
        self._properties = beam_properties(definition, mesh)
        self._dofs = element_dofs(mesh.owner[mesh.beams])
        self._beams = ElementPattern.of(self._dofs, self._size)
        self._bars = self._beams.among(translation_dofs(np.array([[0, 1]]))[0])
        self._droppers = ElementPattern.of(translation_dofs(mesh.droppers), self._size)
        self._clamps = _clamp_mass(mesh, self._size)

    def matrices(self, points: FloatArray, dropper_mass: FloatArray, *, damped: bool = True) -> Matrices:
        """Return the matrices and the static load of the line about reference positions.

        Parameters
        ----------
        points : ndarray, shape (n, 3)
            [m].
        dropper_mass : ndarray, shape (n_droppers,)
            [kg].
        damped : bool
            C is zero unless this is set: at rest nobody asks for it.
        """
        definition, mesh, properties, size = self.definition, self.mesh, self._properties, self._size
        start, end = mesh.beams.T
        axes, length = frames(points[start], points[end])
        K_local = beam_stiffness(properties.EA, properties.GJ, properties.EI, length)
        K_local += beam_geometric_stiffness(properties.tension, length)
        K_e = to_global(K_local, axes)
        M_e = to_global(beam_mass(properties.mass, properties.gyration, length), axes)
        lumped = self._clamps + self._droppers.assembled(_dropper_mass(mesh, dropper_mass))
        M = self._beams.assembled(M_e) + lumped
        load = _gravity(M, definition.track, points) + _tensioning(mesh, axes, properties.tension, size)
        if definition.track is not None:
            load += _curve(definition.track, mesh, points, axes, properties.tension)
        load += _kinks(K_e, axes, self._dofs, properties.tension > 0.0, size)
        K = self._beams.assembled(K_e)
        if len(mesh.adrift):
            K += ANCHORAGE * _on_nodes(mesh.adrift, 0, size)
        support = definition.messenger_support
        if support is not None:
            load[mesh.sprung * NODE_DOFS + 2] += support.stiffness * (mesh.seat - points[mesh.sprung, 2])
            K += support.stiffness * _on_nodes(mesh.sprung, 2, size)
        return Matrices(K, M, self._damping(K_e, M_e, lumped) if damped else sp.csc_matrix(K.shape), load)

    def axial_stiffness(self, points: FloatArray, *, arms: bool) -> sp.csc_matrix:
        """Return the part of K that comes from the axial stiffness of the wires, EA/l, and of the arms if asked for."""
        start, end = self.mesh.beams.T
        axes, length = frames(points[start], points[end])
        EA = self._properties.EA
        if not arms:
            EA = np.where(self.mesh.component == COMPONENTS.index("steady_arm"), 0.0, EA)
        return self._bars.assembled(bar_stiffness(axes[:, 0, :], EA / length))

    def _damping(self, K_e: FloatArray, M_e: FloatArray, lumped: sp.csc_matrix) -> sp.csc_matrix:
        alpha, beta = self._properties.alpha[:, None, None], self._properties.beta[:, None, None]
        # The part of the droppers' damping that is proportional to their stiffness is added together with it.
        C = self._beams.assembled(alpha * K_e + beta * M_e) + self.definition.damping.of("dropper").beta * lumped
        support = self.definition.messenger_support
        if support is not None:
            C += support.damping * _on_nodes(self.mesh.sprung, 2, self._size)
        return C


def axial_stiffness(
    definition: CatenaryDefinition, mesh: CatenaryMesh, points: FloatArray, *, arms: bool
) -> sp.csc_matrix:
    """Return the part of K that comes from the axial stiffness of the wires, EA/l, and of the arms if asked for."""
    return LineAssembly(definition, mesh).axial_stiffness(points, arms=arms)


def _on_nodes(nodes: IntArray, axis: int, size: int) -> sp.csc_matrix:
    """Return a matrix with 1 on the diagonal at the displacements of some nodes along an axis."""
    dofs = nodes * NODE_DOFS + axis
    return sp.csc_matrix((np.ones(len(dofs)), (dofs, dofs)), shape=(size, size))


def pendulum_stiffness(bars: IntArray, tension: FloatArray, points: FloatArray) -> sp.csc_matrix:
    """Return the stiffness of bars across their axes due to tension, over all degrees of freedom (fixed ones too).

    Parameters
    ----------
    bars : ndarray, shape (n, 2)
        End nodes of the bars: droppers, steady arms.
    tension : ndarray, shape (n,)
        [N].
    points : ndarray, shape (n_nodes, 3)
        Positions of the nodes [m].

    Returns
    -------
    sparse, shape (6 n_nodes, 6 n_nodes)
    """
    along = points[bars[:, 1]] - points[bars[:, 0]]
    length = np.linalg.norm(along, axis=1)
    stiffness = bar_geometric_stiffness(along / length[:, None], tension, length)
    return ElementPattern.of(translation_dofs(bars), NODE_DOFS * len(points)).assembled(stiffness)


def arm_load(definition: CatenaryDefinition, mesh: CatenaryMesh, points: FloatArray, design: FloatArray) -> FloatArray:
    """Return the load of steady arms whose shape without forces is that between other points, shape (6 n,).

    It pulls by what they have become longer. What they have turned by (a few degrees) bends them as little as it did
    their wires: their ends are free to turn as well.

    Parameters
    ----------
    points, design : ndarray, shape (n, 3)
        Reference positions, and those between which the arms are without forces [m].
    """
    end, node = mesh.arms.T
    axes, length = frames(points[end], points[node])
    along, before = axes[:, 0, :], design[node] - design[end]
    free = np.linalg.norm(before, axis=1)
    unloaded = np.zeros((len(end), 12))
    unloaded[:, 6:9] = -(length - free)[:, None] * along
    unloaded[:, 3:6] = unloaded[:, 9:12] = np.cross(before / free[:, None], along)
    EA, EI, GJ = (np.full(len(end), value) for value in _component(definition, "steady_arm")[:3])
    K_e = to_global(beam_stiffness(EA, GJ, EI, length), axes)
    load = np.zeros(NODE_DOFS * len(points))
    np.add.at(load, element_dofs(mesh.owner[mesh.arms]), np.einsum("nij,nj->ni", K_e, unloaded))
    return load


def steady_arm_tension(
    definition: CatenaryDefinition,
    mesh: CatenaryMesh,
    points: FloatArray,
    displacement: FloatArray,
    design: FloatArray | None = None,
) -> FloatArray:
    """Return the axial force of every steady arm from its elongation [N], shape (n_arms,); negative where it pushes.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Reference positions [m].
    displacement : ndarray, shape (6 n,)
        Displacement from there [m, rad].
    design : ndarray, shape (n, 3), optional
        Points between which the arms are without forces, the reference positions by default [m].
    """
    if definition.steady_arm is None:
        return np.zeros(0)
    end, node = mesh.arms.T
    along = points[node] - points[end]
    length = np.linalg.norm(along, axis=1)
    move = displacement.reshape(-1, NODE_DOFS)[:, :3]
    EA = definition.steady_arm.youngs_modulus * definition.steady_arm.area
    tension: FloatArray = EA / length**2 * np.einsum("ij,ij->i", along, move[node] - move[end])
    if design is not None:
        tension += EA / length * (length - np.linalg.norm(design[node] - design[end], axis=1))
    return tension


def _component(definition: CatenaryDefinition, name: str) -> list[float]:
    """Return EA, EI, GJ, mass, J/A, tension, alpha, beta of a component type; zeros if the line has none."""
    item = getattr(definition, name)
    if item is None or name == "dropper":
        return [0.0] * 8
    rayleigh = definition.damping.of(name)
    inertia = item.area**2 / (4.0 * np.pi)
    EA = item.youngs_modulus * item.area
    EI = getattr(item, "EI", item.youngs_modulus * inertia)
    GJ = item.youngs_modulus / SHEAR_RATIO * 2.0 * inertia
    tension = getattr(item, "tension", 0.0)
    return [EA, EI, GJ, item.mass, 2.0 * inertia / item.area, tension, rayleigh.alpha, rayleigh.beta]


def _clamp_mass(mesh: CatenaryMesh, size: int) -> sp.csc_matrix:
    """Return the mass of the clamps, on the translations."""
    diagonal = np.zeros((size // NODE_DOFS, NODE_DOFS))
    diagonal[:, :3] = mesh.clamp_mass[:, None]
    return sp.diags(diagonal.ravel(), format="csc")


def _dropper_mass(mesh: CatenaryMesh, mass: FloatArray) -> FloatArray:
    """Return the consistent mass of the droppers as bars, shape (n, 6, 6): 1/3, 1/6 of theirs, in all three directions.

    Of a broken one a half swings with each wire.
    """
    bar = np.kron(np.array([[1.0 / 3.0, 1.0 / 6.0], [1.0 / 6.0, 1.0 / 3.0]]), np.eye(3))
    return mass[:, None, None] * np.where(mesh.broken[:, None, None], 0.5 * np.eye(6), bar)


def _gravity(M: sp.csc_matrix, track: Track | None, points: FloatArray) -> FloatArray:
    """Return the weight: the consistent mass times a field of acceleration, which a cant turns in the line's axes."""
    field = np.zeros((M.shape[0] // NODE_DOFS, NODE_DOFS))
    if track is None:
        field[:, 2] = -GRAVITY
    else:
        field[:, :3] = acceleration(track, points[:, 0])
    return np.asarray(M @ field.ravel())


def _curve(track: Track, mesh: CatenaryMesh, points: FloatArray, axes: FloatArray, tension: FloatArray) -> FloatArray:
    """Return the load of the track's curves and ramps on tensioned wires."""
    wires = np.flatnonzero(mesh.component != COMPONENTS.index("steady_arm"))
    elements = mesh.beams[wires]
    load = np.zeros(NODE_DOFS * len(points))
    nodal = curve_load(track, points[elements], axes[wires], tension[wires])
    np.add.at(load, element_dofs(mesh.owner[elements]), nodal)
    return load


def _tensioning(mesh: CatenaryMesh, axes: FloatArray, tension: FloatArray, size: int) -> FloatArray:
    """Return the load of the constant tension in every wire element, which pulls its two nodes together [2.9]."""
    load = np.zeros((size // NODE_DOFS, NODE_DOFS))
    pull = tension[:, None] * axes[:, 0, :]
    np.add.at(load[:, :3], mesh.owner[mesh.beams[:, 0]], pull)
    np.add.at(load[:, :3], mesh.owner[mesh.beams[:, 1]], -pull)
    return load.ravel()


def _kinks(K_e: FloatArray, axes: FloatArray, dofs: IntArray, is_wire: np.ndarray, size: int) -> FloatArray:
    """Return the load that refers rotations to a straight wire, not to the chords of the mesh.

    Without it the polygon through the reference points would be the unbent shape of the wire.
    """
    rotation = np.zeros((len(axes), 12))
    along = axes[:, 0, :]
    for first in (3, 9):
        rotation[:, first + 1] = -along[:, 2]
        rotation[:, first + 2] = along[:, 1]
    rotation[~is_wire] = 0.0
    load = np.zeros(size)
    np.add.at(load, dofs, np.einsum("nij,nj->ni", K_e, rotation))
    return load

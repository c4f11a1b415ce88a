"""Element matrices: 3D Euler-Bernoulli beam under tension, and bar [1]_.

All functions work on arrays of elements. The degrees of freedom of a node are u, v, w, rx, ry, rz; those of a beam are
the 12 of its two nodes.

References
----------
.. [1] P. Antunes, Co-simulation methods for multidisciplinary problems in railway dynamics (2012),
   equations 2.3 to 2.6.
"""

from __future__ import annotations

import numpy as np

from models.arrays import FloatArray

#: Degrees of freedom of a node.
NODE_DOFS = 6
#: Degrees of freedom of bending in the local x-y plane: v1, rz1, v2, rz2.
_XY = np.array([1, 5, 7, 11])
#: ... and in the local x-z plane: w1, ry1, w2, ry2, with the sign of ry by the right-hand rule.
_XZ = np.array([2, 4, 8, 10])
_XZ_SIGN = np.array([1.0, -1.0, 1.0, -1.0])
_AXIAL = np.array([0, 6])
#: Hermite's cubics on an element of length 1, rows of the factors of 1, xi, xi^2, xi^3 over displacement and slope of
#: either end [2.44]: what belongs to displacements, and what belongs to slopes.
_HERMITE_DISPLACED = np.array([[1.0, 0, 0, 0], [0, 0, 0, 0], [-3.0, 0, 3.0, 0], [2.0, 0, -2.0, 0]])
_HERMITE_TURNED = np.array([[0, 0, 0, 0], [0, 1.0, 0, 0], [0, -2.0, 0, -1.0], [0, 1.0, 0, 1.0]])
_TORSION = np.array([3, 9])


def beam_stiffness(EA: FloatArray, GJ: FloatArray, EI: FloatArray, length: FloatArray) -> FloatArray:
    """Return the local elastic stiffness K_L of beams [2.4].

    Parameters
    ----------
    EA, GJ, EI : ndarray, shape (n,)
        Axial [N], torsional and bending [N m2] stiffness.
    length : ndarray, shape (n,)
        Length [m].

    Returns
    -------
    ndarray, shape (n, 12, 12)
    """
    K = np.zeros((len(length), 12, 12))
    _add(K, _AXIAL, (EA / length)[:, None, None] * np.array([[1.0, -1.0], [-1.0, 1.0]]))
    _add(K, _TORSION, (GJ / length)[:, None, None] * np.array([[1.0, -1.0], [-1.0, 1.0]]))
    _add_bending(K, (EI / length**3)[:, None, None] * _hermite(length, 12.0, 6.0, 4.0, 2.0))
    return K


def beam_geometric_stiffness(tension: FloatArray, length: FloatArray) -> FloatArray:
    """Return the local geometric stiffness F K_G of beams under tension [2.5].

    Parameters
    ----------
    tension, length : ndarray, shape (n,)
        Axial tension [N], length [m].

    Returns
    -------
    ndarray, shape (n, 12, 12)
    """
    K = np.zeros((len(length), 12, 12))
    _add_bending(K, (tension / (30.0 * length))[:, None, None] * _hermite(length, 36.0, 3.0, 4.0, -1.0))
    return K


def bar_stiffness(direction: FloatArray, stiffness: FloatArray) -> FloatArray:
    """Return the stiffness of bars along their axes, k [[e e', -e e'], [-e e', e e']] on the translations of both ends.

    Parameters
    ----------
    direction : ndarray, shape (n, 3)
        Unit vectors e along the bars.
    stiffness : ndarray, shape (n,)
        Axial stiffness k = EA/L [N/m].

    Returns
    -------
    ndarray, shape (n, 6, 6)
    """
    block = (stiffness[:, None] * direction)[:, :, None] * direction[:, None, :]
    result = np.empty((len(block), 6, 6))
    result[:, :3, :3] = result[:, 3:, 3:] = block
    result[:, :3, 3:] = result[:, 3:, :3] = -block
    return result


def bar_geometric_stiffness(direction: FloatArray, tension: FloatArray, length: FloatArray) -> FloatArray:
    """Return the stiffness N/L across bars under tension, the one that makes a pendulum swing back.

    (N/L) [[P, -P], [-P, P]] on the translations of both ends, with P = I - e e' the projection across the bar.

    Parameters
    ----------
    direction : ndarray, shape (n, 3)
        Unit vectors e along the bars.
    tension, length : ndarray, shape (n,)
        Axial tension N [N], length L [m].

    Returns
    -------
    ndarray, shape (n, 6, 6)
    """
    across = np.eye(3) - direction[:, :, None] * direction[:, None, :]
    return np.kron(np.array([[1.0, -1.0], [-1.0, 1.0]]), (tension / length)[:, None, None] * across)


def beam_mass(mass: FloatArray, gyration: FloatArray, length: FloatArray) -> FloatArray:
    """Return the local consistent mass matrix of beams [2.6].

    Parameters
    ----------
    mass : ndarray, shape (n,)
        Mass per length [kg/m].
    gyration : ndarray, shape (n,)
        Polar moment of area over area, J/A [m2].
    length : ndarray, shape (n,)
        Length [m].

    Returns
    -------
    ndarray, shape (n, 12, 12)
    """
    M = np.zeros((len(length), 12, 12))
    total = (mass * length)[:, None, None]
    linear = np.array([[1.0 / 3.0, 1.0 / 6.0], [1.0 / 6.0, 1.0 / 3.0]])
    _add(M, _AXIAL, total * linear)
    _add(M, _TORSION, total * gyration[:, None, None] * linear)
    _add_bending(M, total / 420.0 * _bending_mass(length))
    return M


def frames(start: FloatArray, end: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the local axes of elements: along, lateral (horizontal), upward.

    Parameters
    ----------
    start, end : ndarray, shape (n, 3)

    Returns
    -------
    axes : ndarray, shape (n, 3, 3)
        Rows are the unit vectors of the local x, y and z axes.
    length : ndarray, shape (n,)
    """
    along = end - start
    length = np.linalg.norm(along, axis=1)
    along = along / length[:, None]
    lateral = np.cross(np.array([0.0, 0.0, 1.0]), along)
    lateral /= np.linalg.norm(lateral, axis=1)[:, None]
    return np.stack([along, lateral, np.cross(along, lateral)], axis=1), length


def to_global(local: FloatArray, axes: FloatArray) -> FloatArray:
    """Rotate element matrices from local to global axes: T^T K T.

    Parameters
    ----------
    local : ndarray, shape (n, 12, 12)
    axes : ndarray, shape (n, 3, 3)
    """
    T = np.zeros_like(local)
    for block in range(0, 12, 3):
        T[:, block : block + 3, block : block + 3] = axes
    return np.einsum("nki,nkl,nlj->nij", T, local, T, optimize=True)


def point_loads(points: FloatArray, axes: FloatArray, xi: FloatArray, force: FloatArray) -> FloatArray:
    """Return the consistent nodal loads of forces on elements, shape (n, 12) [N, N m].

    Parameters
    ----------
    points : ndarray, shape (n, 2, 3)
        Both ends of every element [m].
    axes : ndarray, shape (n, 3, 3)
        Their local axes.
    xi : ndarray, shape (n,)
        Where the force acts, as a share of the element.
    force : ndarray, shape (n, 3)
        In global axes [N].
    """
    length = np.linalg.norm(points[:, 1] - points[:, 0], axis=1)
    along, lateral, upward = np.einsum("nij,nj->in", axes, force)
    shape = np.stack(
        [
            1.0 - 3.0 * xi**2 + 2.0 * xi**3,
            length * (xi - 2.0 * xi**2 + xi**3),
            3.0 * xi**2 - 2.0 * xi**3,
            length * (xi**3 - xi**2),
        ],
        axis=1,
    )
    local = np.zeros((len(points), 12))
    local[:, _AXIAL] = along[:, None] * np.stack([1.0 - xi, xi], axis=1)
    local[:, _XY] = lateral[:, None] * shape
    local[:, _XZ] = upward[:, None] * shape * _XZ_SIGN
    return np.asarray(np.einsum("nij,nbi->nbj", axes, local.reshape(-1, 4, 3)).reshape(-1, 12))


def hermite_rows(axes: FloatArray, length: FloatArray) -> FloatArray:
    """Return the heights of elements' axes as polynomials of xi = 0 ... 1.

    Row k of an element holds the factor of xi^k: height(xi) = [1, xi, xi^2, xi^3] @ rows @ d, with the 12 global
    displacements d of the element [2.44].

    Parameters
    ----------
    axes : ndarray, shape (n, 3, 3)
    length : ndarray, shape (n,)

    Returns
    -------
    ndarray, shape (n, 4, 12)
    """
    n = len(length)
    cubic = _HERMITE_DISPLACED + length[:, None, None] * _HERMITE_TURNED
    local = np.zeros((3, n, 4, 12))
    local[0][:, :2, _AXIAL] = np.array([[1.0, 0.0], [-1.0, 1.0]])
    local[1][:, :, _XY] = cubic
    local[2][:, :, _XZ] = cubic * _XZ_SIGN
    rows = np.zeros((n, 4, 12))
    for axis in range(3):
        weighted = axes[:, axis, 2, None, None] * local[axis]
        rows += (weighted.reshape(n, 16, 3) @ axes).reshape(n, 4, 12)
    return rows


def _hermite(length: FloatArray, a: float, b: float, c: float, d: float) -> FloatArray:
    """Return [[a, bl, -a, bl], [bl, cl2, -bl, dl2], ...], the pattern of bending and of tension."""
    result = np.empty((len(length), 4, 4))
    bl, cl, dl = b * length, c * length**2, d * length**2
    result[:, 0, 0] = result[:, 2, 2] = a
    result[:, 0, 2] = result[:, 2, 0] = -a
    result[:, 0, 1] = result[:, 1, 0] = result[:, 0, 3] = result[:, 3, 0] = bl
    result[:, 1, 2] = result[:, 2, 1] = result[:, 2, 3] = result[:, 3, 2] = -bl
    result[:, 1, 1] = result[:, 3, 3] = cl
    result[:, 1, 3] = result[:, 3, 1] = dl
    return result


def _bending_mass(length: FloatArray) -> FloatArray:
    result = np.empty((len(length), 4, 4))
    l1, l2 = length, length**2
    result[:, 0, 0] = result[:, 2, 2] = 156.0
    result[:, 0, 2] = result[:, 2, 0] = 54.0
    result[:, 0, 1] = result[:, 1, 0] = 22.0 * l1
    result[:, 2, 3] = result[:, 3, 2] = -22.0 * l1
    result[:, 0, 3] = result[:, 3, 0] = -13.0 * l1
    result[:, 1, 2] = result[:, 2, 1] = 13.0 * l1
    result[:, 1, 1] = result[:, 3, 3] = 4.0 * l2
    result[:, 1, 3] = result[:, 3, 1] = -3.0 * l2
    return result


def _add(matrices: FloatArray, dofs: np.ndarray, part: FloatArray) -> None:
    matrices[:, dofs[:, None], dofs[None, :]] += part


def _add_bending(matrices: FloatArray, part: FloatArray) -> None:
    _add(matrices, _XY, part)
    _add(matrices, _XZ, part * np.outer(_XZ_SIGN, _XZ_SIGN))

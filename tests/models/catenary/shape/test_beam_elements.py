"""Element matrices against rigid-body motion, theory of strings and beams, and observed convergence."""

import numpy as np
import pytest
from scipy.linalg import eigh

from models.catenary.shape.beam_elements import (
    bar_stiffness,
    beam_geometric_stiffness,
    beam_mass,
    beam_stiffness,
    frames,
    hermite_rows,
    to_global,
)

EA, GJ, EI, F, MASS = 1.8e7, 300.0, 215.0, 20000.0, 1.334
LENGTH = 1.125


def _one(value):
    return np.array([value])


@pytest.fixture
def oblique():
    """An element that lies along no axis."""
    start, end = np.array([[1.0, 2.0, 3.0]]), np.array([[1.9, 1.6, 3.4]])
    axes, length = frames(start, end)
    return start, end, axes, length


def _rigid_body_modes(start, end):
    """Displacements (6, 12) of two nodes under unit translations and small rotations."""
    modes = np.zeros((6, 12))
    for k in range(3):
        modes[k, [k, 6 + k]] = 1.0
        rotation = np.eye(3)[k]
        modes[3 + k, 3:6] = modes[3 + k, 9:12] = rotation
        modes[3 + k, 6:9] = np.cross(rotation, end - start)
    return modes


def test_elastic_stiffness_is_blind_to_rigid_body_motion(oblique):
    start, end, axes, length = oblique
    K = to_global(beam_stiffness(_one(EA), _one(GJ), _one(EI), length), axes)[0]
    modes = _rigid_body_modes(start[0], end[0])
    assert np.abs(K @ modes.T).max() < 1e-9 * np.abs(K).max()
    assert np.linalg.matrix_rank(K, tol=1e-9 * np.abs(K).max()) == 6


def test_a_beam_without_bending_and_torsion_is_a_bar(oblique):
    _, _, axes, length = oblique
    beam = to_global(beam_stiffness(_one(EA), _one(0.0), _one(0.0), length), axes)[0]
    bar = bar_stiffness(axes[:, 0, :], EA / length)[0]
    moves = np.array([0, 1, 2, 6, 7, 8])
    assert np.array_equal(bar, beam[np.ix_(moves, moves)])
    assert np.count_nonzero(beam) == np.count_nonzero(bar)


def test_geometric_stiffness_is_blind_to_translation_and_resists_rotation(oblique):
    start, end, axes, length = oblique
    K = to_global(beam_geometric_stiffness(_one(F), length), axes)[0]
    modes = _rigid_body_modes(start[0], end[0])
    assert np.abs(K @ modes[:3].T).max() < 1e-9 * np.abs(K).max()
    # Turning a bar of length l under tension F by theta about a normal takes the energy F l theta^2 / 2.
    normal = axes[0, 1]
    turn = normal @ modes[3:]
    assert turn @ K @ turn == pytest.approx(F * length[0], rel=1e-12)


@pytest.mark.parametrize("matrix", ["stiffness", "geometric", "mass"])
def test_element_matrices_are_symmetric(oblique, matrix):
    *_, axes, length = oblique
    local = {
        "stiffness": beam_stiffness(_one(EA), _one(GJ), _one(EI), length),
        "geometric": beam_geometric_stiffness(_one(F), length),
        "mass": beam_mass(_one(MASS), _one(1e-5), length),
    }[matrix]
    K = to_global(local, axes)[0]
    assert np.abs(K - K.T).max() <= 1e-13 * np.abs(K).max()


def test_mass_matrix_carries_the_elements_mass_and_moment_of_inertia(oblique):
    start, end, axes, length = oblique
    M = to_global(beam_mass(_one(MASS), _one(0.0), length), axes)[0]
    modes = _rigid_body_modes(start[0], end[0])
    for k in range(3):
        assert modes[k] @ M @ modes[k] == pytest.approx(MASS * length[0])
    about_start = axes[0, 1] @ modes[3:]
    assert about_start @ M @ about_start == pytest.approx(MASS * length[0] ** 3 / 3.0)


def _pinned_frequencies(elements, tension, bending, span=20.0, modes=3):
    """Vertical natural frequencies [Hz] of a pinned tensioned beam."""
    length = np.full(elements, span / elements)
    K_e = beam_stiffness(np.full(elements, EA), np.full(elements, GJ), np.full(elements, bending), length)
    K_e = K_e + beam_geometric_stiffness(np.full(elements, tension), length)
    M_e = beam_mass(np.full(elements, MASS), np.full(elements, 1e-5), length)
    n = 2 * (elements + 1)
    K, M = np.zeros((n, n)), np.zeros((n, n))
    dofs = np.array([2, 4, 8, 10])
    for e in range(elements):
        at = slice(2 * e, 2 * e + 4)
        K[at, at] += K_e[e][np.ix_(dofs, dofs)]
        M[at, at] += M_e[e][np.ix_(dofs, dofs)]
    free = [i for i in range(n) if i not in (0, n - 2)]
    omega2 = eigh(K[np.ix_(free, free)], M[np.ix_(free, free)], eigvals_only=True)
    return np.sqrt(omega2[:modes]) / (2.0 * np.pi)


def _theory(tension, bending, span=20.0, modes=3):
    k = np.arange(1, modes + 1) * np.pi / span
    return k * np.sqrt((tension + bending * k**2) / MASS) / (2.0 * np.pi)


def test_frequencies_of_a_tensioned_string():
    assert _pinned_frequencies(20, F, 1e-6) == pytest.approx(_theory(F, 1e-6), rel=1e-4)


def test_frequencies_of_a_beam_without_tension():
    assert _pinned_frequencies(10, 0.0, EI) == pytest.approx(_theory(0.0, EI), rel=1e-3)


def test_frequencies_of_a_beam_converge_with_fourth_order():
    exact = _theory(F, EI)
    errors = [np.abs(_pinned_frequencies(n, F, EI)[2] / exact[2] - 1.0) for n in (4, 8, 16)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders.min() > 3.7


def test_height_polynomial_takes_the_nodes_values_and_slopes():
    axes, length = frames(np.zeros((1, 3)), np.array([[LENGTH, 0.0, 0.0]]))
    rows = hermite_rows(axes, length)[0]
    d = np.zeros(12)
    d[[2, 4, 8, 10]] = 0.01, -0.02, 0.03, 0.04  # z, ry: a slope dz/dx is -ry

    def height(xi):
        return np.array([1.0, xi, xi**2, xi**3]) @ rows @ d

    def slope(xi):
        return np.array([0.0, 1.0, 2.0 * xi, 3.0 * xi**2]) @ rows @ d / LENGTH

    assert (height(0.0), height(1.0)) == pytest.approx((0.01, 0.03))
    assert (slope(0.0), slope(1.0)) == pytest.approx((0.02, -0.04))


def test_height_polynomial_of_an_inclined_element_follows_rigid_motion(oblique):
    start, end, axes, length = oblique
    rows = hermite_rows(axes, length)[0]
    for mode in _rigid_body_modes(start[0], end[0]):
        for xi in (0.0, 0.3, 1.0):
            expected = mode[2] + xi * (mode[8] - mode[2])
            assert np.array([1.0, xi, xi**2, xi**3]) @ rows @ mode == pytest.approx(expected, abs=1e-12)

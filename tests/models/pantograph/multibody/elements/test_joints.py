"""Every joint's Jacobian and acceleration terms against differences, and what each joint leaves free."""

import numpy as np
import pytest

from models.pantograph.multibody.elements.rotations import euler_parameters, rotation_matrices, turned
from models.pantograph.multibody.mechanism import Inputs, Mechanism
from models.pantograph.multibody.mechanism_assembly import assemble, constraint_rank, joint_gaps
from tests.models.pantograph.multibody.mechanisms import body, joint, mechanism, mechanism_from, one_of_each_joint

FREEDOM = {
    "revolute": 1, "spherical": 3, "prismatic": 1, "universal": 2, "fixed": 0, "revolute_prismatic": 2,
    "perpendicular": 5,
}  # fmt: skip


@pytest.fixture(scope="module")
def chain():
    m = Mechanism(mechanism_from(one_of_each_joint()))
    y = m.written_state()
    random = np.random.default_rng(4)
    s = m.split(y)
    s.v[:] = random.normal(size=s.v.shape)
    s.w[:] = random.normal(size=s.w.shape)
    return m, y


def violation(m, y):
    return m.constraint_values(m.kinematics(y)).violation


def displaced(m, y, shifts, turns):
    return m.shifted(y, shifts, turns)


def test_jacobians_equal_differences(chain):
    m, y = chain
    jacobian = m.constraint_values(m.kinematics(y)).jacobian
    A = m.kinematics(y).frames[:, :3]
    h = 1e-5
    for k in range(m.count):
        for axis in range(6):
            step = np.zeros((m.count, 6))
            step[k, axis] = h
            turns = np.einsum("nji,nj->ni", A, step[:, 3:])  # global rotation in body-fixed components
            ahead = violation(m, displaced(m, y, step[:, :3], turns))
            behind = violation(m, displaced(m, y, -step[:, :3], -turns))
            np.testing.assert_allclose(jacobian[:, k, axis], (ahead - behind) / (2 * h), atol=1e-9)


def test_rates_equal_jacobian_times_velocity(chain):
    m, y = chain
    kinematics = m.kinematics(y)
    values, s = m.constraint_values(kinematics), m.split(y)
    global_w = np.einsum("nij,nj->ni", kinematics.frames[:, :3], s.w)
    velocity = np.concatenate([s.v, global_w], axis=1)
    np.testing.assert_allclose(values.rate, values.jacobian.reshape(m.constraints.count, -1) @ velocity.ravel())


def test_gamma_equals_minus_the_change_of_the_jacobian_along_the_motion(chain):
    """gamma = -d(Phi_q q')/dt at constant q' (global components of the angular velocities held)."""
    m, y = chain
    h = 1e-5
    kinematics = m.kinematics(y)
    gamma, s = m.constraint_values(kinematics).gamma, m.split(y)
    global_w = np.einsum("nij,nj->ni", kinematics.frames[:, :3], s.w)

    def rate_after(t):
        p = turned(s.p, t * s.w)
        held = np.einsum("nji,nj->ni", rotation_matrices(p), global_w)
        return m.constraint_values(m.kinematics(m.join(s.r + t * s.v, p, s.v, held))).rate

    np.testing.assert_allclose(gamma, -(rate_after(h) - rate_after(-h)) / (2 * h), atol=1e-8)


@pytest.mark.parametrize("kind", FREEDOM)
def test_each_joint_leaves_its_degrees_of_freedom(kind):
    vectors = {"point_i": (0, 0, 0), "point_j": (0, 0, 0), "axis_i": (1, 0, 0), "axis_j": (0, 0, 1)}
    if kind == "revolute":
        vectors["axis_j"] = (1, 0, 0)
    keys = {
        "spherical": ["point_i", "point_j"], "fixed": ["point_i", "point_j"],
        "prismatic": ["point_i", "point_j", "axis_i"], "perpendicular": ["axis_i", "axis_j"],
    }.get(kind, list(vectors))  # fmt: skip
    m = mechanism(
        {"one": body(1.0, (1, 1, 1), (0, 0, 0))}, {"it": joint(kind, "base", "one", **{k: vectors[k] for k in keys})}
    )
    assert constraint_rank(m, m.written_state()) == m.constraints.count == 6 - FREEDOM[kind]


def test_chain_of_all_joints_assembles_and_stays_together():
    data = one_of_each_joint()
    data["assembly"] = {"largest_gap": [2.0, "m", "test"]}
    m = Mechanism(mechanism_from(data))
    y = assemble(m)
    assert max(max(gap) for gap in joint_gaps(m, y).values()) < 1e-11
    acceleration = m.evaluate(y, Inputs()).constraints
    assert np.abs(acceleration.violation).max() < 1e-11


def test_euler_parameters_turn_as_rotation_vectors_do():
    angle = np.array([[0.3, -0.2, 0.5]])
    p = turned(np.array([[1.0, 0.0, 0.0, 0.0]]), angle)
    size = np.linalg.norm(angle)
    np.testing.assert_allclose(p[0, 1:], angle[0] / size * np.sin(size / 2))
    np.testing.assert_allclose(rotation_matrices(p)[0] @ angle[0], angle[0])
    np.testing.assert_allclose(euler_parameters(p[:, 1:]), p)

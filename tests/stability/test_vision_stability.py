"""Closed forms of a servo's stability with an exact robot, against the criterion in general."""

import math

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import cross_matrix, rotation_from_vector, rotation_vector
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.servoing.pose_features import theta_u_interaction
from cdpr_drake.stability.criterion import ModelAtPose, stability_margin, stability_matrix
from cdpr_drake.stability.criterion_closed_forms import (
    PlanarVisionLimits,
    largest_object_error,
    planar_margin,
    seen_turned,
    worst_object_error,
)
from tests.stability.stability_cases import ROUNDING

# In the plane.


def model(name, X_PC, theta_u, e):
    """With L of PBVS and the thesis' [e_t]x, ordered (rotation, translation)."""
    L = np.zeros((6, 6))
    L[:3, :3] = theta_u_interaction(theta_u)
    L[3:, :3] = cross_matrix(e)
    L[3:, 3:] = -np.eye(3)
    robot = load_robot(name)
    return ModelAtPose(robot.home.transform(), robot.cable_set().without_pulleys(), X_PC, L)


def camera(x, y, angle):
    return RigidTransform(RotationMatrix.MakeZRotation(angle), [x, y, 0.0])


def planar_offsets(e, e_hat, shift, theta_pc, psi):
    """(d_1, d_2), what couples rotation and translation in planar analysis II [m].

    Source: servoing thesis (3.15), (3.16).
    """
    c, s = math.cos(psi), math.sin(psi)
    C, S = math.cos(theta_pc), math.sin(theta_pc)
    d1 = e_hat[1] * c - e[1] + e_hat[0] * s - shift[1] * C + shift[0] * S
    d2 = -e_hat[0] * c + e[0] + e_hat[1] * s + shift[1] * S + shift[0] * C
    return float(d1), float(d2)


@pytest.mark.parametrize("seed", range(10))
def test_planar_offsets_are_those_of_the_criterion(seed):
    random = np.random.default_rng(seed)
    e, e_hat, t, t_hat = random.uniform(-2.0, 2.0, (4, 2))
    theta, psi = random.uniform(-3.0, 3.0), random.uniform(-1.5, 1.5)
    truth = model("planar", camera(*t, theta), np.zeros(3), np.r_[e, 0.0])
    estimate = model("planar", camera(*t_hat, theta + psi), np.zeros(3), np.r_[e_hat, 0.0])
    Pi = stability_matrix(truth, estimate, planar=True)
    d1, d2 = planar_offsets(e, e_hat, t - t_hat, theta, psi)
    # Ordered (rotation, x, y), and with the sign of the thesis' rotation.
    c, s = math.cos(psi), math.sin(psi)
    assert Pi == pytest.approx(np.array([[1, 0, 0], [-d1, c, -s], [-d2, s, c]]), abs=ROUNDING)
    margin = planar_margin(psi, math.hypot(d1, d2))
    assert margin == pytest.approx(stability_margin(Pi), abs=ROUNDING)


def test_vision_alone_allows_two_metres():
    assert planar_margin(0.0, 1.999) > 0.0
    assert planar_margin(0.0, 2.0) == pytest.approx(0.0, abs=ROUNDING)
    assert planar_margin(math.radians(90.1), 0.0) < 0.0


@pytest.mark.parametrize("seed", range(6))
def test_no_value_in_the_boxes_is_below_the_worst(seed):
    random = np.random.default_rng(seed)
    limits = PlanarVisionLimits(*random.uniform(0.0, [5.0, 0.6, 0.4]))
    largest, theta = random.uniform(0.1, 1.5), random.uniform(-3.0, 3.0)
    worst = limits.worst_margin(largest, theta)
    lowest = math.inf
    for _ in range(2000):
        signs = np.sign(random.uniform(-1.0, 1.0, (3, 2)))
        e = limits.error * signs[0] * random.uniform(0.9, 1.0, 2)
        d, shift, psi = limits.d_error * signs[1], limits.shift * signs[2], random.uniform(-1, 1)
        offsets = planar_offsets(e, e + d, shift, theta, largest * psi)
        lowest = min(lowest, planar_margin(largest * psi, math.hypot(*offsets)))
    assert lowest >= worst
    # Nor is it far below: some of so many values come close to the worst corner.
    assert lowest < worst + 0.1 * (1.0 + limits.error)


def test_the_worst_turn_need_not_be_the_largest():
    limits = PlanarVisionLimits(0.0, 0.6, 0.4)  # corners line up at psi = 0
    near, far = limits.largest_offset(np.array([0.0, math.radians(45.0)]))
    assert near == pytest.approx(math.sqrt(2.0))
    assert far < 0.97 * near


@pytest.mark.parametrize("combination", [(5.0, 0.5, 0.3, 6.0), (0.5, 0.3, 0.2, 61.0)])
def test_published_combinations_are_stable(combination):
    limits, turn = PlanarVisionLimits(*combination[:3]), math.radians(combination[3])
    for theta in np.radians([0.0, 30.0, 45.0, 90.0]):
        assert limits.worst_margin(turn, theta) > 0.0


# In space.


def spatial_vision_matrix(theta_u, theta_u_hat, d_error):
    """Pi of spatial analysis I: servoing thesis (3.19), where the translation comes first."""
    inverse = np.linalg.inv(theta_u_interaction(theta_u_hat))
    Pi = np.eye(6)
    Pi[:3, :3] = theta_u_interaction(theta_u) @ inverse
    Pi[3:, :3] = cross_matrix(d_error) @ inverse
    return Pi


def turns(random, count, largest):
    u = random.standard_normal((count, 3))
    return u * (random.uniform(0.0, largest, count) / np.linalg.norm(u, axis=1))[:, np.newaxis]


@pytest.mark.parametrize("seed", range(6))
def test_spatial_matrix_is_the_criterion(seed):
    random = np.random.default_rng(seed)
    (theta_u, theta_u_hat), (e, e_hat) = turns(random, 2, 3.0), random.uniform(-1.0, 1.0, (2, 3))
    X_PC = camera(0.1, -0.2, 0.4)
    numbers = ((theta_u, e), (theta_u_hat, e_hat))
    pair = [model("acrobot_small", X_PC, *each) for each in numbers]
    found = spatial_vision_matrix(theta_u, theta_u_hat, e - e_hat)
    assert found == pytest.approx(stability_matrix(*pair), abs=ROUNDING)


def test_largest_object_error_is_where_stability_ends():
    random = np.random.default_rng(1)
    theta_u = turns(random, 20, 2.8)
    theta_u_hat = seen_turned(theta_u, turns(random, 20, 1.0))
    limits = largest_object_error(theta_u, theta_u_hat)
    assert np.sum(limits > 0.0) > 12
    assert np.all(limits <= 2.0 + ROUNDING)
    for u, u_hat, limit in zip(theta_u, theta_u_hat, limits, strict=True):
        ways = random.standard_normal((400, 3))
        ways /= np.linalg.norm(ways, axis=1)[:, np.newaxis]
        below, above = (
            min(stability_margin(spatial_vision_matrix(u, u_hat, share * limit * d)) for d in ways)
            for share in (0.999, 1.02)
        )
        # The worst direction is any normal to one vector, so that some of 400 are close.
        assert above <= 0.0 if limit == 0.0 else above < 0.0 < below


def test_equal_rotations_allow_two_metres():
    theta_u = turns(np.random.default_rng(2), 20, 3.1)
    assert largest_object_error(theta_u, theta_u) == pytest.approx(2.0, abs=1e-6)


def test_seen_turned_is_the_product():
    random = np.random.default_rng(3)
    u, d = turns(random, 30, 3.1), turns(random, 30, 3.1)
    for a, b, both in zip(u, d, seen_turned(u, d), strict=True):
        expected = rotation_vector(rotation_from_vector(b) @ rotation_from_vector(a))
        assert both == pytest.approx(expected, abs=1e-7)
    zero = np.zeros((1, 3))
    assert seen_turned(zero, zero) == pytest.approx(zero)


@pytest.mark.parametrize(("turn", "error"), [(0.5, 0.3), (1.5, 0.5), (2.2, 0.8)])
def test_worst_object_error_is_below_random_ones(turn, error):
    random = np.random.default_rng(4)
    theta_u = turns(random, 2000, turn)
    least = largest_object_error(theta_u, seen_turned(theta_u, turns(random, 2000, error))).min()
    assert 0.9 * least < worst_object_error(turn, error) <= least + ROUNDING


def test_opposite_sides_of_half_a_turn_are_fatal():
    # An angle of 160 deg and an error of 30 deg about the same axis end at -170 deg.
    u = np.array([[0.0, 0.0, math.radians(160.0)]])
    turned = seen_turned(u, np.array([[0.0, 0.0, math.radians(30.0)]]))
    assert turned[0, 2] == pytest.approx(math.radians(-170.0))
    assert largest_object_error(u, turned)[0] == 0.0
    assert worst_object_error(math.radians(160.0), math.radians(30.0)) == 0.0
    assert worst_object_error(math.radians(160.0), math.radians(19.0)) > 1.9


def test_the_plain_form_knows_pulleys():
    robot = load_robot("caroca")
    cables, X_WP = robot.cable_set(), robot.home.transform()
    assert cables.has_pulleys()
    X_PC = RigidTransform(RotationMatrix.MakeYRotation(0.3), [0.1, -0.2, 0.05])
    step = 1e-6

    def lengths(V_C):
        moved = X_PC @ RigidTransform(rotation_from_vector(V_C[:3]), V_C[3:]) @ X_PC.inverse()
        return cable_paths(X_WP @ moved, cables).lengths

    def jacobian(cables):
        return ModelAtPose(X_WP, cables, X_PC, np.eye(6)).camera_jacobian()

    differences = [lengths(step * V) - lengths(-step * V) for V in np.eye(6)]
    expected = np.transpose(differences) / (2 * step)
    np.testing.assert_allclose(jacobian(cables), expected, atol=1e-8)
    assert np.max(np.abs(jacobian(cables) - jacobian(cables.without_pulleys()))) > 1e-3

"""Wrenches of moving platforms: each lies in the set that stands for all, and that is tight."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.tree import SpatialInertia, UnitInertia
from scipy.optimize import linprog

from cdpr_drake.control.task_space import PlatformDynamics, TaskGains, computed_torque
from cdpr_drake.geometry.poses import rotation_from_angles
from cdpr_drake.workspaces.inertial_wrenches import (
    LEAST_MOMENT,
    inertia_about_mass_centre,
    moment_box,
    turn_bounds,
    turning_wrenches,
)

ROUNDING = 1e-9
MASS, C = 3.0, np.array([0.02, -0.05, 0.1])
G = np.array([0.05, 0.07, 0.04])
M_PPo_P = SpatialInertia(MASS, C, UnitInertia(*G, 0.004, -0.003, 0.002).ShiftFromCenterOfMass(C))
I_PPo = M_PPo_P.CalcRotationalInertia().CopyToFullMatrix3()
MIDDLE, HALVES = np.array([0.2, -0.3, 0.9]), np.radians([5.0, 8.0, 20.0])
LINEAR, ANGULAR = np.array([0.5, 0.7, 0.3]), np.array([1.0, 2.0, 0.5])


def moments():
    return moment_box(MASS, C, I_PPo, ANGULAR)


def wanted(R, w, alpha, a_Po):
    """The wrench of a motion by the kernel of computed torque, without weight."""
    V, A = np.concatenate([w, np.zeros(3)]), np.concatenate([alpha, a_Po])
    X = RigidTransform(RotationMatrix(R), np.zeros(3))
    dynamics = PlatformDynamics(M_PPo_P, gravity=0.0)
    return computed_torque(X, V, X, V, A, dynamics=dynamics, gains=TaskGains(0.0, 0.0))


def share(vertices, wrench):
    """By how much of a convex set round zero a wrench lies in it; 1: on its border."""
    k = len(vertices)
    found = linprog(
        np.ones(k), A_eq=vertices.T, b_eq=wrench, bounds=[(0.0, None)] * k, method="highs"
    )
    assert found.status == 0
    return found.fun


def motion(random, corner):
    """R, w, alpha and the acceleration of Po that use the bounds; a corner of them, or inside."""
    pick = (lambda: random.choice([-1.0, 1.0], 3)) if corner else (lambda: random.uniform(-1, 1, 3))
    R = rotation_from_angles(MIDDLE + HALVES * pick()).matrix()
    I_Co, w_P = inertia_about_mass_centre(MASS, C, I_PPo), random.normal(0.0, 2.0, 3)
    n, a_Co = moments() * pick(), LINEAR * pick()
    alpha_P = np.linalg.solve(I_Co, n - np.cross(w_P, I_Co @ w_P))
    w, alpha, c = R @ w_P, R @ alpha_P, R @ C
    return R, w, alpha, a_Co - np.cross(alpha, c) - np.cross(w, np.cross(w, c))


def test_every_motion_within_the_bounds_asks_a_wrench_of_the_set():
    random = np.random.default_rng(0)
    vertices = turning_wrenches(MASS, C, moments(), LINEAR, MIDDLE, HALVES).vertices
    assert vertices.shape == (64, 6)
    shares = [share(vertices, -wanted(*motion(random, k % 2 == 0))) for k in range(200)]
    assert max(shares) <= 1.0 + ROUNDING
    assert max(shares) > 0.9  # and it is hardly larger than needed


def test_without_a_range_the_set_is_attained_at_all_corners():
    random = np.random.default_rng(1)
    vertices = turning_wrenches(MASS, C, moments(), LINEAR, MIDDLE, np.zeros(3)).vertices
    R = rotation_from_angles(MIDDLE).matrix()
    I_Co = inertia_about_mass_centre(MASS, C, I_PPo)
    for _ in range(20):
        a_Co, n = LINEAR * random.choice([-1, 1], 3), moments() * random.choice([-1, 1], 3)
        alpha = R @ np.linalg.solve(I_Co, n)
        wrench = wanted(R, np.zeros(3), alpha, a_Co - np.cross(alpha, R @ C))
        assert share(vertices, -wrench) == pytest.approx(1.0, abs=ROUNDING)


def test_the_inertia_about_the_mass_centre_is_that_of_drake():
    found = inertia_about_mass_centre(MASS, C, I_PPo)
    drake = M_PPo_P.Shift(C).CalcRotationalInertia().CopyToFullMatrix3()
    np.testing.assert_allclose(found, drake, atol=1e-12)
    only = moment_box(MASS, C, I_PPo, np.array([0.0, 0.0, 2.0]))
    assert only[2] == pytest.approx(2.0 * drake[2, 2])
    assert np.min(only) >= LEAST_MOMENT * np.max(only)


@pytest.mark.parametrize("middle", [np.zeros(3), MIDDLE])
def test_turns_from_the_middle_are_bounded_entry_by_entry(middle):
    random = np.random.default_rng(2)
    size, change = turn_bounds(middle, HALVES)
    R = rotation_from_angles(middle).matrix()
    most, off = np.zeros((3, 3)), np.zeros((3, 3))
    for k in range(2000):
        pick = random.choice([-1.0, 1.0], 3) if k % 2 else random.uniform(-1.0, 1.0, 3)
        E = R.T @ rotation_from_angles(middle + HALVES * pick).matrix()
        most, off = np.maximum(most, np.abs(E)), np.maximum(off, np.abs(E - np.eye(3)))
    assert np.all(most <= size + ROUNDING)
    assert np.all(off <= change + ROUNDING)
    assert np.max(size - most) < 0.1
    yaw = turn_bounds(np.zeros(3), np.array([0.0, 0.0, 0.3]))[0]
    np.testing.assert_allclose(yaw[[0, 1, 2, 2], [2, 2, 0, 1]], 0.0)  # no moment gets from z to x
    assert yaw[0, 1] == pytest.approx(np.sin(0.3))

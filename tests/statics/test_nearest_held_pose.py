"""The nearest held pose, beside non-negative least squares at poses that are drawn."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw
from scipy.optimize import linprog, lsq_linear
from scipy.spatial.transform import Rotation

from cdpr_drake.geometry.cable_paths import cable_jacobian
from cdpr_drake.geometry.poses import rotation_from_vector
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.statics.nearest_held_pose import (
    Load,
    holding_tensions,
    nearest_held_pose,
    pose_distance,
)

ROBOT = load_robot("acrobot_large")
CABLES = ROBOT.cable_set().without_pulleys()
LOAD = Load(ROBOT.platform.mass, ROBOT.box_center(), ROBOT.gravity_vector())
"""In the middle of the box: the poses below were found for it."""
SIZE = 0.135
LEAST, MOST = 0.5, 60.0
HOME = ROBOT.home.transform()

HELD = 1e-4
"""Wrench that is missing, per weight, of what least squares count as held: their own tolerance."""


def bounds(broken):
    own = np.arange(CABLES.count) != broken
    return np.array([LEAST * own, MOST * own])


def missing(X_WP, broken, load=LOAD):
    """Wrench per weight that no tensions give, by bounded least squares."""
    own = np.arange(CABLES.count) != broken
    scale = load.weight * np.array([SIZE] * 3 + [1.0] * 3)
    W = -cable_jacobian(X_WP, CABLES).T[:, own] / scale[:, np.newaxis]
    weight = load.mass * load.gravity
    wrench = np.concatenate([np.cross(X_WP.rotation() @ load.p_PCo, weight), weight])
    solved = lsq_linear(W, -wrench / scale, bounds=(LEAST, MOST), method="bvls")
    return float(np.linalg.norm(solved.fun))


def apart(X, Y):
    """|(l theta, p)| of two poses by SciPy's rotations [m]."""
    turn = Rotation.from_matrix(Y.rotation().matrix() @ X.rotation().matrix().T).as_rotvec()
    way = Y.translation() - X.translation()
    return float(np.hypot(SIZE * np.linalg.norm(turn), np.linalg.norm(way)))


def posed(angles, position):
    return RigidTransform(RollPitchYaw(angles), position)


@pytest.mark.parametrize("broken", [0, 4, 7])
def test_it_is_held_and_none_nearer_is(broken):
    found = nearest_held_pose(HOME, CABLES, LOAD, bounds(broken), size=SIZE)
    assert found is not None
    assert 0.001 < found.distance < 0.05
    assert found.distance == pytest.approx(pose_distance(HOME, found.X_WP, SIZE))
    assert missing(found.X_WP, broken) < HELD
    assert missing(HOME, broken) > 10.0 * HELD
    draws = np.random.default_rng(broken)
    for _ in range(200):
        away = draws.standard_normal(6)
        away *= 0.9 * found.distance * draws.uniform() ** (1.0 / 6.0) / np.linalg.norm(away)
        turn = rotation_from_vector(away[:3] / SIZE) @ HOME.rotation()
        near = RigidTransform(turn, HOME.translation() + away[3:])
        assert missing(near, broken) > HELD


@pytest.mark.parametrize("broken", [0, 6])
def test_from_a_turned_pose_with_a_load_off_the_middle(broken):
    X_WP = posed([0.1, -0.15, 0.6], HOME.translation() + np.array([0.03, -0.02, 0.04]))
    load = Load(LOAD.mass, np.array([0.02, -0.015, 0.03]), LOAD.gravity)
    found = nearest_held_pose(X_WP, CABLES, load, bounds(broken), size=SIZE)
    assert found is not None
    assert found.distance == pytest.approx(apart(X_WP, found.X_WP), rel=1e-9)
    assert missing(found.X_WP, broken, load) < HELD
    assert missing(X_WP, broken, load) > 10.0 * HELD
    draws = np.random.default_rng(broken)
    for _ in range(200):
        away = draws.standard_normal(6)
        away *= 0.9 * found.distance * draws.uniform() ** (1.0 / 6.0) / np.linalg.norm(away)
        turn = rotation_from_vector(away[:3] / SIZE) @ X_WP.rotation()
        assert missing(RigidTransform(turn, X_WP.translation() + away[3:]), broken, load) > HELD


@pytest.mark.parametrize(
    ("broken", "angles", "position"),
    [
        (4, [-0.0799, 0.5155, -0.0077], [0.0147, 0.1429, 0.1073]),
        (1, [0.1567, -0.6117, 0.0781], [0.0117, -0.2055, 0.391]),
    ],
)
def test_other_starts_find_nearer_ones_and_the_nearest_counts(broken, angles, position):
    """From these poses alone the search ends in a local solution that is farther away."""
    X_WP = posed(angles, position)
    alone = nearest_held_pose(X_WP, CABLES, LOAD, bounds(broken), size=SIZE)
    helped = nearest_held_pose(X_WP, CABLES, LOAD, bounds(broken), size=SIZE, starts=[HOME])
    assert alone is not None
    assert helped is not None
    assert helped.distance < 0.9 * alone.distance
    assert apart(X_WP, helped.X_WP) == pytest.approx(helped.distance, rel=1e-9)
    assert missing(helped.X_WP, broken) < HELD
    # A start that is farther changes nothing where the own one is best.
    near = nearest_held_pose(HOME, CABLES, LOAD, bounds(broken), size=SIZE)
    same = nearest_held_pose(HOME, CABLES, LOAD, bounds(broken), size=SIZE, starts=[X_WP])
    assert near is not None
    assert same is not None
    assert same.distance <= near.distance * (1.0 + 1e-6)


def test_a_cable_whose_tension_is_given_has_it():
    """At home the others cannot hold against 45 N of one; the pose that is found is held so."""
    given = np.tile([[LEAST], [MOST]], (1, CABLES.count))
    given[:, 2] = 45.0
    assert holding_tensions(HOME, CABLES, LOAD, given, SIZE) is None
    found = nearest_held_pose(HOME, CABLES, LOAD, given, size=SIZE)
    assert found is not None
    assert found.distance > 1e-3
    assert found.tensions[2] == pytest.approx(45.0, abs=1e-9)
    W, wrench = -cable_jacobian(found.X_WP, CABLES).T, LOAD.wrench(found.X_WP)
    ROOM = 1e-5 * LOAD.weight  # balance is asked to 1e-6 of the weight
    np.testing.assert_allclose(W @ found.tensions, -wrench, atol=ROOM)


def test_tensions_that_hold_a_pose_have_the_least_sum():
    """Beside the same program with equations in place of a room."""
    every = np.tile([[LEAST], [MOST]], (1, CABLES.count))
    tensions = holding_tensions(HOME, CABLES, LOAD, every, SIZE)
    assert tensions is not None
    W = -cable_jacobian(HOME, CABLES).T
    ends = [
        linprog(sign * np.ones(CABLES.count), A_eq=W, b_eq=-LOAD.wrench(HOME), bounds=every.T)
        for sign in (1.0, -1.0)
    ]
    assert np.sum(tensions) == pytest.approx(ends[0].fun, rel=1e-4)
    assert -ends[1].fun > 1.001 * ends[0].fun


def test_a_pose_that_is_held_stays():
    every = np.tile([[LEAST], [MOST]], (1, CABLES.count))
    found = nearest_held_pose(HOME, CABLES, LOAD, every, size=SIZE)
    assert found is not None
    assert found.distance < 1e-6
    W = -cable_jacobian(found.X_WP, CABLES).T
    assert W @ found.tensions == pytest.approx(-LOAD.wrench(found.X_WP), abs=1e-4)


def test_none_where_the_cables_are_too_weak():
    weak = np.tile([[0.0], [1.0]], (1, CABLES.count))
    assert nearest_held_pose(HOME, CABLES, LOAD, weak, size=SIZE) is None
    assert holding_tensions(HOME, CABLES, LOAD, weak, SIZE) is None

"""The nearest held pose, beside non-negative least squares at poses that are drawn."""

import numpy as np
import pytest
from pydrake.math import RigidTransform
from scipy.optimize import lsq_linear

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
LOAD = Load(ROBOT.platform.mass, ROBOT.center_of_mass(), ROBOT.gravity_vector())
SIZE = 0.135
LEAST, MOST = 0.5, 60.0
HOME = ROBOT.home.transform()

HELD = 1e-4
"""Wrench that is missing, per weight, of what least squares count as held: their own tolerance."""


def bounds(broken):
    own = np.arange(CABLES.count) != broken
    return np.array([LEAST * own, MOST * own])


def missing(X_WP, broken):
    """Wrench per weight that no tensions give, by bounded least squares."""
    own = np.arange(CABLES.count) != broken
    scale = LOAD.weight * np.array([SIZE] * 3 + [1.0] * 3)
    W = -cable_jacobian(X_WP, CABLES).T[:, own] / scale[:, np.newaxis]
    solved = lsq_linear(W, -LOAD.wrench(X_WP) / scale, bounds=(LEAST, MOST), method="bvls")
    return float(np.linalg.norm(solved.fun))


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

"""The tension problem of a robot at a pose."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.errors import CableGeometryError, TensionProblemError
from cdpr_drake.geometry.straight_cables import PLANAR_ROWS, gravity_wrench, wrench_matrix
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem
from tests.models.representative_robots import REPRESENTATIVE_ROBOTS


@pytest.mark.parametrize("name", REPRESENTATIVE_ROBOTS)
def test_problem_is_that_of_the_weight(name):
    robot = load_robot(name)
    X_WP = robot.home.transform()
    problem = tension_problem(robot, X_WP, cables=robot.cable_set(pulleys=False))
    rows = list(PLANAR_ROWS) if robot.is_planar() else list(range(6))
    W = wrench_matrix(X_WP, robot.exit_points(), robot.anchor_points())
    np.testing.assert_array_equal(problem.W, W[rows])
    weight = gravity_wrench(X_WP, robot.platform.mass, robot.center_of_mass(), robot.gravity)
    np.testing.assert_array_equal(problem.wrench, weight[rows])
    assert np.all(problem.lower == robot.tension_bounds.lower)
    assert np.all(problem.upper == robot.tension_bounds.upper)


def test_everything_can_be_replaced():
    robot = load_robot("acrobot_large")
    X_WP = robot.home.transform()
    push = np.array([0.1, 0.2, 0.3, 1.0, 2.0, 3.0])
    problem = tension_problem(
        robot, X_WP, push, limits=(2.0, 30.0), mass=0.0, reference=np.full(8, 5.0)
    )
    np.testing.assert_array_equal(problem.wrench, push)
    assert set(problem.lower) == {2.0}
    assert set(problem.upper) == {30.0}
    assert set(problem.reference) == {5.0}


@pytest.mark.parametrize(("name", "moments"), [("acrobot_large", 3), ("planar", 1)])
def test_moments_are_compared_to_forces_at_the_size_of_the_platform(name, moments):
    robot = load_robot(name)
    X_WP = robot.home.transform()
    by_hand = np.sqrt(np.mean([np.dot(c.anchor_point, c.anchor_point) for c in robot.cables]))
    scale = tension_problem(robot, X_WP).row_scale
    np.testing.assert_allclose(scale[:moments], by_hand, rtol=1e-14)
    np.testing.assert_array_equal(scale[moments:], 1.0)
    given = tension_problem(robot, X_WP, length_scale=0.5).row_scale
    np.testing.assert_array_equal(given[:moments], 0.5)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"X_WP": RigidTransform([0, 0, 5])}, "outside the frame of acrobot_large"),
        ({"mass": -1.0}, "mass: found -1"),
        ({"mass": np.nan}, "mass: found nan"),
        ({"wrench": np.zeros(3)}, "wrench: found 3 numbers"),
        ({"limits": (5.0, 2.0)}, "lower <= upper"),
        ({"length_scale": 0.0}, r"length_scale: found 0; accepted: above 0 \[m\]"),
        ({"length_scale": np.inf}, "length_scale: found inf"),
    ],
)
def test_refusals(arguments, words):
    robot = load_robot("acrobot_large")
    with pytest.raises(TensionProblemError, match=words):
        tension_problem(robot, **{"X_WP": robot.home.transform(), **arguments})


def test_a_cable_without_length_is_refused_with_and_without_pulleys():
    robot = load_robot("acrobot_large")
    cables = robot.cable_set().without_pulleys()
    X_WP = robot.home.transform()
    A = cables.p_WA.copy()
    A[:, 2] = X_WP.multiply(cables.p_PB[:, 2])
    with pytest.raises(CableGeometryError, match=r"cable 3: .* on its exit point"):
        tension_problem(robot, X_WP, cables=replace(cables, p_WA=A))


def test_given_limits_stand_in_the_place_of_the_robots():
    robot = load_robot("caroca")
    assert robot.tension_limits() == (robot.tension_bounds.lower, robot.tension_bounds.upper)
    assert robot.tension_limits((2.0, 30.0)) == (2.0, 30.0)

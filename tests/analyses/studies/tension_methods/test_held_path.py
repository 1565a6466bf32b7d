"""Paths that were moved inside: all of them can be held, and no less would do."""

import numpy as np
import pytest
from scipy.optimize import linprog

from cdpr_drake.analyses.studies.tension_methods.experiments import THESIS_END, THESIS_START
from cdpr_drake.analyses.studies.tension_methods.feasible_path import (
    FINE,
    STEPS,
    can_hold,
    held_path,
)
from cdpr_drake.errors import InfeasibleTensionError
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem

MIDDLE = np.array([0.0, 0.0, 0.2])
"""Middle of the platform in P [m]."""


@pytest.fixture
def robot():
    return load_robot("caroca_gazebo")


def holds_by_linprog(robot, position):
    """An independent verdict."""
    X_WP, cables = pose_from_angles(position, np.zeros(3)), robot.cable_set(pulleys=False)
    problem = tension_problem(robot, X_WP, cables=cables)
    bounds = np.column_stack([problem.lower, problem.upper])
    return linprog(np.ones(8), A_eq=problem.W, b_eq=-problem.wrench, bounds=bounds).status == 0


def test_printed_start_is_moved_by_the_least_amount(robot):
    start, end = np.array(THESIS_START) - MIDDLE, np.array(THESIS_END) - MIDDLE
    home = robot.home.position
    path = held_path(robot, start, end, home)
    assert not can_hold(robot, start)
    np.testing.assert_array_equal(path.end, end)
    assert path.end_limit == path.end_shift == 0.0
    way = (home - start) / np.linalg.norm(home - start)
    np.testing.assert_allclose(path.start, start + path.start_shift * way)
    assert 0.0 < path.start_limit <= path.start_shift
    assert holds_by_linprog(robot, start + (path.start_limit + FINE) * way)
    assert not holds_by_linprog(robot, start + (path.start_limit - 2.0 * FINE) * way)
    for share in np.linspace(0.0, 1.0, STEPS // 20):
        assert holds_by_linprog(robot, path.start + share * (path.end - path.start))


def test_a_path_that_can_be_held_stays(robot):
    home = robot.home.position
    away = home + np.array([0.5, 0.2, 0.3])
    path = held_path(robot, home, away, home)
    np.testing.assert_array_equal(path.start, home)
    np.testing.assert_allclose(path.end, away)
    assert path.start_shift == path.end_shift == 0.0


def test_the_inside_must_be_held(robot):
    with pytest.raises(InfeasibleTensionError, match="no tensions hold"):
        held_path(robot, robot.home.position, robot.home.position, np.array(THESIS_START))

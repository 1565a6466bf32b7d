"""Exit points on rails: gradients by differences, the optimum by brute force, refusals."""

from functools import cache

import numpy as np
import pytest
from pydrake.autodiffutils import ExtractGradient, InitializeAutoDiff
from pydrake.math import RigidTransform

from cdpr_drake.analyses.workspaces.static_feasible import static_case
from cdpr_drake.errors import PlanningError
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.planning.reconfiguration import Rails, RailTask, ReconfigurationProgram
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet
from cdpr_drake.workspaces.static_feasibility import wrench_matrices

SLOPE = 1e-6  # of entries of W, by central differences of 1e-6 m
CONVERGED = 1e-5  # of half the range: tolerances of the solver
GRID = 11  # positions of each rail


@cache
def small():
    """The planar robot; exit points of its first and of its third cable slide along y."""
    robot = load_robot("planar")
    bases = robot.exit_points()
    directions = np.zeros((2, *bases.shape))
    directions[0, 1, 0] = directions[1, 1, 2] = 1.0
    sides = np.sign(bases[1, [0, 2]])
    low = np.where(sides > 0, -0.4, -0.1)
    rails = Rails(directions, low, low + 0.5, np.zeros(2), bases)
    poses = [
        pose_from_angles(np.array([x, y, robot.plane_height]), np.radians([0.0, 0.0, turn]))
        for x, y, turn in ((0.15, 0.1, 5.0), (-0.1, -0.15, 0.0))
    ]
    box = SpatialSet(box=np.array([0.0, 0.0, 0.0, 2.0, 2.0, 0.0]))
    return RailTask(static_case(robot, (1.0, 60.0)), rails, poses, box)


def test_wrench_matrices_are_those_of_the_moved_robot_and_slopes_their_derivatives():
    task = small()
    c, h = np.array([0.05, -0.02]), 1e-6
    W, slopes = task.matrices(c)
    robot = load_robot("planar")
    for k, cable in enumerate(robot.cables):
        cable.exit_point = task.rails.exit_points(c)[:, k]
    R = np.array([X.rotation().matrix() for X in task.poses])
    p = np.array([X.translation() for X in task.poses])
    cables = robot.cable_set().without_pulleys()
    expected = wrench_matrices(p, R, cables)[:, list(task.case.rows)]
    np.testing.assert_allclose(W, expected, atol=1e-12)
    for g in range(2):
        step = h * np.eye(2)[g]
        numeric = (task.matrices(c + step)[0] - task.matrices(c - step)[0]) / (2.0 * h)
        np.testing.assert_allclose(slopes[:, g], numeric, atol=SLOPE)


def test_gradients_of_the_program_are_exact():
    program = ReconfigurationProgram(small())
    evaluator = program.balances()[3].evaluator()
    x = np.random.default_rng(1).uniform(0.1, 0.9, 2 + 4)
    exact = ExtractGradient(np.array(evaluator.Eval(InitializeAutoDiff(x).ravel())))
    h = 1e-6
    numeric = [(evaluator.Eval(x + h * e) - evaluator.Eval(x - h * e)) / (2 * h) for e in np.eye(6)]
    np.testing.assert_allclose(exact, np.array(numeric).T, atol=1e-6 * np.max(np.abs(exact)))


@pytest.mark.parametrize("goal", ["margin", "tension"])
def test_it_finds_what_brute_force_finds(goal):
    task = small()
    program = ReconfigurationProgram(task)
    if goal == "margin":
        program.AddLargestMargin()
    else:
        program.AddLeastLargestTension()
    found = program.Solve(3)
    assert found.success

    def value(c):
        if goal == "margin":
            return float(np.min(task.margins(c)))
        if np.min(task.margins(c)) < 0.0:
            return -np.inf
        return -float(np.max(task.largest_tensions(c)))

    at = value(found.coordinates - 1e-9 * np.sign(found.coordinates))
    scale = 1.0 if goal == "margin" else 60.0
    sign = 1.0 if goal == "margin" else -1.0
    assert at == pytest.approx(sign * found.value, abs=CONVERGED * scale)
    axes = [
        np.linspace(a, b, GRID) for a, b in zip(task.rails.lower, task.rails.upper, strict=True)
    ]
    best = max(value(np.array([a, b])) for a in axes[0] for b in axes[1])
    assert at >= best - CONVERGED * scale  # no point of the grid is better
    assert at > value(task.rails.at) + 1e-3 * scale  # and it is better than it was


def test_what_is_refused():
    task = small()
    rails = task.rails
    with pytest.raises(PlanningError, match="without length"):
        Rails(rails.directions, rails.lower, rails.lower, rails.at, rails.bases)
    with pytest.raises(PlanningError, match="directions of shape"):
        Rails(rails.directions[:, :, :2], rails.lower, rails.upper, rails.at, rails.bases)
    with pytest.raises(PlanningError, match="other numbers of limits"):
        Rails(rails.directions, rails.lower[:1], rails.upper, rails.at, rails.bases)
    with pytest.raises(PlanningError, match="found 0 poses"):
        RailTask(task.case, rails, []).loads()
    there = RigidTransform(rails.bases[:, 0] - task.case.cables.p_PB[:, 0])
    with pytest.raises(PlanningError, match="cable without length"):
        RailTask(task.case, rails, [there]).matrices(np.zeros(2))
    far = RailTask(task.case, rails, task.poses, SpatialSet(box=np.array([0, 0, 0, 1e4, 0, 0])))
    with pytest.raises(PlanningError, match="no tensions"):
        far.largest_tensions(np.zeros(2))

"""The static feasible workspace against closed forms, the linear program and one-pose functions."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix
from scipy.optimize import linprog

from cdpr_drake.analyses.workspaces.static_feasible import static_case
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import rotation_from_angles
from cdpr_drake.geometry.straight_cables import ALL_ROWS, gravity_wrench, wrench_matrix
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.tensions.methods import exact_tensions
from cdpr_drake.workspaces.static_feasibility import (
    StaticCase,
    statically_feasible,
    wrench_matrices,
)

ROUNDING = 1e-12
G = 9.81


def acrobot(lower=1.0, upper=60.0, mass=3.5, wrench=None):
    robot = load_robot("acrobot_large")
    return StaticCase(
        robot.cable_set().without_pulleys(),
        np.full(8, lower),
        np.full(8, upper),
        mass * G,
        robot.center_of_mass(),
        wrench=np.zeros(6) if wrench is None else np.array(wrench, float),
        rows=ALL_ROWS,
    )


def point_mass(p_WA):
    """Forces only."""
    return StaticCase(
        CableSet.make(p_WA, np.zeros((3, 3)), 1.0),
        np.zeros(3),
        np.full(3, 1e6),
        10.0,
        np.zeros(3),
        wrench=np.zeros(6),
        rows=(3, 4, 5),
    )


def random_poses(count, seed=0):
    random = np.random.default_rng(seed)
    positions = random.uniform([-0.6, -0.6, 0.0], [0.6, 0.6, 1.1], (count, 3))
    angles = random.uniform(-0.4, 0.4, (count, 3))
    return positions, np.array([rotation_from_angles(a).matrix() for a in angles])


def test_wrench_matrices_are_those_of_single_poses():
    case = acrobot()
    positions, rotations = random_poses(20)
    many = wrench_matrices(positions, rotations, case.cables)
    for W, p, R in zip(many, positions, rotations, strict=True):
        X_WP = RigidTransform(RotationMatrix(R), p)
        one = wrench_matrix(X_WP, case.cables.p_WA, case.cables.p_PB)
        np.testing.assert_allclose(W, one, atol=ROUNDING)


def test_agrees_with_a_linear_program():
    case = acrobot(wrench=[0.2, -0.1, 0.05, 3.0, -2.0, 1.0])
    positions, rotations = random_poses(300, seed=1)
    found = statically_feasible(case, positions, rotations)
    assert 0.1 < np.mean(found) < 0.9
    for feasible, p, R in zip(found, positions, rotations, strict=True):
        X_WP = RigidTransform(RotationMatrix(R), p)
        W = wrench_matrix(X_WP, case.cables.p_WA, case.cables.p_PB)
        load = gravity_wrench(X_WP, 3.5, case.p_PCo, G) + case.wrench
        bounds = list(zip(case.lower, case.upper, strict=True))
        program = linprog(np.zeros(8), A_eq=W, b_eq=-load, bounds=bounds, method="highs")
        assert feasible == program.success


def test_over_pulleys_it_agrees_with_tension_problems():
    robot = load_robot("caroca")
    cables = robot.cable_set()
    mixed = replace(cables, pulley_radius=np.where(np.arange(8) % 2, cables.pulley_radius, 0.0))
    random = np.random.default_rng(4)
    lower, upper = robot.frame.lower, robot.frame.upper
    positions = random.uniform(0.9 * lower + 0.1 * upper, 0.1 * lower + 0.9 * upper, (200, 3))
    angles = random.uniform(-0.6, 0.6, (200, 3))
    rotations = np.array([rotation_from_angles(a).matrix() for a in angles])
    straight = static_case(robot, pulleys=False)
    assert not straight.cables.has_pulleys()
    some = statically_feasible(straight, positions, rotations)
    for chosen in (cables, mixed):
        case = replace(straight, cables=chosen)
        found = statically_feasible(case, positions, rotations)
        assert 0.1 < np.mean(found) < 0.9
        assert np.any(found != some)
        many = wrench_matrices(positions, rotations, chosen)
        for W, feasible, p, R in zip(many, found, positions, rotations, strict=True):
            problem = tension_problem(robot, RigidTransform(RotationMatrix(R), p), cables=chosen)
            np.testing.assert_allclose(W, problem.W, atol=ROUNDING)
            assert feasible == (exact_tensions(problem) is not None)


def test_an_anchor_point_in_a_groove_is_not_feasible():
    p_WA = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 1.0]])
    case = point_mass(p_WA)
    case = replace(case, cables=replace(case.cables, pulley_radius=np.full(3, 0.05)))
    positions = np.array([[0.05, 0.03, 1.0], [0.3, 0.3, 0.5]])
    found = statically_feasible(case, positions, np.tile(np.eye(3), (2, 1, 1)))
    assert list(found) == [False, True]


def test_a_point_mass_on_three_cables_is_held_inside_the_triangle_only():
    # Exit points at height 1 above a triangle; forces only, so the closed form is: below the
    # triangle, and light enough.
    p_WA = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 1.0]])
    case = point_mass(p_WA)
    random = np.random.default_rng(2)
    positions = random.uniform([-0.5, -0.5, 0.0], [1.5, 1.5, 0.9], (500, 3))
    x, y = positions[:, 0], positions[:, 1]
    inside = (x >= 0.0) & (y >= 0.0) & (x + y <= 1.0)
    rotations = np.tile(np.eye(3), (500, 1, 1))
    np.testing.assert_array_equal(statically_feasible(case, positions, rotations), inside)


def test_narrower_bounds_never_add_a_pose():
    positions, rotations = random_poses(400, seed=3)
    wide = statically_feasible(acrobot(0.0, 60.0), positions, rotations)
    narrow = statically_feasible(acrobot(2.0, 30.0), positions, rotations)
    assert np.all(wide | ~narrow)
    assert np.sum(narrow) < np.sum(wide)


def test_a_place_on_an_exit_point_is_not_feasible():
    p_WA = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 1.0]])
    case = point_mass(p_WA)
    positions = np.array([[0.0, 0.0, 1.0], [0.3, 0.3, 0.5]])
    found = statically_feasible(case, positions, np.tile(np.eye(3), (2, 1, 1)))
    assert list(found) == [False, True]


def test_refuses_what_makes_no_sense():
    points = CableSet.make(np.zeros((3, 2)), np.zeros((3, 2)), 1.0)
    with pytest.raises(TensionProblemError, match="found 2 for 6 degrees"):
        StaticCase(
            points, np.zeros(2), np.ones(2), 1.0, np.zeros(3), wrench=np.zeros(6), rows=ALL_ROWS
        )
    with pytest.raises(TensionProblemError, match="weight"):
        acrobot(mass=-1.0)
    with pytest.raises(TensionProblemError, match="lower"):
        statically_feasible(acrobot(lower=-1.0), *random_poses(2))

"""Verbs on one pose: tensions, rest, poses from lengths."""

import json

import numpy as np
from matplotlib.figure import Figure

import cdpr_drake as cdpr
from cdpr_drake.analyses.statics.equilibria_query import equilibria_at_lengths
from cdpr_drake.analyses.statics.static_query import static_at_lengths, static_at_pose
from cdpr_drake.analyses.statics.tension_query import underactuated_answer
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem, wrench_balance
from cdpr_drake.statics.forward_kinematics import ForwardKinematics
from cdpr_drake.tensions.methods import METHODS, distribute
from tests.analyses.front.front_checks import as_json, one_line, shows_itself


def test_tensions(planar, aside):
    push = np.array([0.0, 0.0, 0.1, 2.0, 0.0, 0.0])
    problem = tension_problem(planar, aside.transform(), push)
    found = cdpr.solve_tensions(planar, aside, push, "infinity_norm")
    expected = distribute(problem, "infinity_norm")
    np.testing.assert_array_equal(found.tensions, expected.tensions)
    about = {
        "robot": "planar", "geometry": "with pulleys of 4.5 mm", "redundancy": 1,
        "rows": ["moment about z", "force along x", "force along y"],
        "wrench_n_m_n": problem.wrench.tolist(), "infeasible_by": None,
    }  # fmt: skip
    assert found.as_dict() == about | expected.as_dict()
    assert "*" in shows_itself(found)
    assert "feasible" in shows_itself(expected)
    every = cdpr.compare_tensions(planar, aside, push)
    assert [one.method for one in every.solutions] == [
        name for name, method in METHODS.items() if method.takes(1) and not method.needs_reference
    ]
    shows_itself(every)
    assert isinstance(every.plot_wrenches(), Figure)
    given = {"limits": (2.0, 30.0), "length_scale": 0.1, "mass": 2.0}
    relaxed = cdpr.solve_tensions(planar, aside, push, "slack_relaxed", **given)
    problem = tension_problem(planar, aside.transform(), push, **given)
    assert relaxed.solution.as_dict() == distribute(problem, "slack_relaxed").as_dict()
    wanted = cdpr.solve_tensions(planar, method="reference_program", reference=6.0)
    assert np.max(np.abs(wanted.tensions - 6.0)) < 1.0
    one_line(lambda: cdpr.solve_tensions(planar, method="dijkstra"), "dijkstra", "dykstra")


def test_tensions_of_fewer_cables():
    robot = load_robot("grab_three")
    found = cdpr.solve_tensions(robot)
    balance = wrench_balance(robot, robot.home.transform())
    geometry = {"geometry": "with pulleys of 25 mm"}
    assert found.as_dict() == underactuated_answer(robot, balance) | geometry
    assert found.tensions.shape == (3,)
    shows_itself(found)
    one_line(lambda: cdpr.solve_tensions(robot, method="dykstra"), "quadratic_program")


def test_rest_at_a_pose_and_with_lengths(planar, aside):
    held = cdpr.solve_static(planar, aside)
    assert as_json(held) == json.loads(
        json.dumps(static_at_pose(planar, aside.transform(), "elastic", True).as_dict())
    )
    assert "stable" in shows_itself(held)
    assert isinstance(held.plot(), Figure)
    hanging = cdpr.solve_static(planar, lengths=list(held.l0))
    assert hanging.as_dict() == static_at_lengths(planar, held.l0, "elastic", True).as_dict()
    one_line(lambda: cdpr.solve_static(planar, aside, held.l0), "both")
    one_line(lambda: cdpr.solve_static(planar, lengths=[1.0, 1.0]), "shape (2,)")
    one_line(lambda: cdpr.solve_static(planar, model="rubber"), "rubber")


def test_all_poses_of_rest():
    robot = load_robot("spider_camera")
    cables = robot.cable_set().without_pulleys()
    lengths = cable_paths(robot.home.transform(), cables).lengths
    found = cdpr.find_equilibria(robot, lengths)
    assert found.as_dict() == equilibria_at_lengths(robot, lengths).as_dict()
    shows_itself(found)
    three = load_robot("grab_three")
    shows_itself(cdpr.find_equilibria(three, position=three.home.position))
    one_line(lambda: cdpr.find_equilibria(robot), "neither")
    one_line(lambda: cdpr.find_equilibria(robot, position=[0, 0, 0.3], taut=["C9"]), "C9")
    one_line(lambda: cdpr.find_equilibria(robot, lengths, taut=["C1"]), "taut")
    one_line(lambda: cdpr.find_equilibria(robot, lengths, searches=0), "searches")


def test_a_pose_from_lengths(planar, aside):
    solver = ForwardKinematics(planar.cable_set(), planar.motion_type())
    lengths = solver.lengths(aside.transform())
    found = cdpr.solve_forward_kinematics(planar, lengths)
    expected = solver.pose(lengths, planar.home.transform())
    np.testing.assert_array_equal(found.X_WP.GetAsMatrix4(), expected.X_WP.GetAsMatrix4())
    np.testing.assert_allclose(found.X_WP.translation(), aside.position, atol=1e-6)
    assert as_json(found)["lengths_m"] == lengths.tolist()
    assert "residuals" in shows_itself(found)
    one_line(lambda: cdpr.solve_forward_kinematics(planar, 9.0 * lengths), "")
    one_line(lambda: cdpr.solve_forward_kinematics(planar, -lengths), "lengths")

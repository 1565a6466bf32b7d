"""First kinematics: lengths and directions, wrench matrix, poses from measured lengths, names."""

import inspect
import re

import numpy as np
import pytest
from matplotlib.figure import Figure
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from scipy.optimize import least_squares

import cdpr_drake as cdpr
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import rotation_from_vector, rotation_vector
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem
from tests.analyses.verbs.verb_checks import as_json, one_line, shows_itself
from tests.models.mechanisms.test_refusals import ASKED, TAKES

POSE = [0.1, 0.05, 0.5, 2.0, -3.0, 5.0]
"""Of ACROBOT and CAROCA [m, deg]."""

STEP = 1e-6
"""Of central differences [m, rad]; their error is below 1e-9 on cables of metres."""


def moved(X_WP, k, step):
    """A pose turned (k < 3) or moved along an axis of W."""
    turn = rotation_from_vector(np.where(np.arange(3) == k, step, 0.0))
    shift = np.where(np.arange(3) == k - 3, step, 0.0)
    return RigidTransform(turn @ X_WP.rotation(), X_WP.translation() + shift)


def lengths_at(robot, X_WP, pulleys=True):
    """Lengths at any pose, also where a planar robot cannot be."""
    return cable_paths(X_WP, robot.cable_set(pulleys)).lengths


@pytest.mark.parametrize("name", ["acrobot_large", "caroca", "planar"])
@pytest.mark.parametrize("pulleys", [True, False])
def test_lengths_directions_and_wrench_matrix_agree_by_differences(name, pulleys):
    robot = load_robot(name)
    X_WP = robot.home.transform()
    result = cdpr.solve_inverse_kinematics(name, X_WP, pulleys=pulleys)
    assert result.geometry == robot.geometry_words(pulleys)
    slopes = []
    for k in range(6):
        more, less = (lengths_at(robot, moved(X_WP, k, s * STEP), pulleys) for s in (1, -1))
        slopes.append((more - less) / (2.0 * STEP))
    np.testing.assert_allclose(result.directions, slopes[3:], atol=1e-8)
    W = -np.array(slopes)
    rows = [2, 3, 4] if robot.is_planar() else range(6)
    np.testing.assert_allclose(robot.wrench_matrix(pulleys=pulleys), W[rows], atol=1e-8)
    expected = tension_problem(robot, X_WP, cables=robot.cable_set(pulleys)).W
    np.testing.assert_array_equal(robot.wrench_matrix(X_WP, pulleys), expected)


def test_lengths_without_pulleys_are_distances():
    robot = load_robot("acrobot_large")
    result = cdpr.solve_inverse_kinematics(robot, POSE, pulleys=False)
    spans = result.X_WP @ robot.anchor_points() - robot.exit_points()
    np.testing.assert_allclose(result.lengths, np.linalg.norm(spans, axis=0), rtol=1e-14)
    np.testing.assert_allclose(result.directions, spans / result.lengths, atol=1e-14)
    assert as_json(result)["lengths_m"] == result.lengths.tolist()
    assert "pulleys ignored" in shows_itself(result)
    assert "with pulleys of" in shows_itself(cdpr.solve_inverse_kinematics(robot, POSE))
    one_line(lambda: cdpr.solve_inverse_kinematics(robot, [9.0, 0.0, 0.3]), "outside the frame")


def test_a_robot_is_drawn_by_name_or_as_itself(planar):
    for arguments in (("planar",), (planar,), ("acrobot_large", POSE)):
        assert isinstance(cdpr.plot(*arguments), Figure)


def test_poses_of_three_and_six_numbers_are_poses():
    """In metres and degrees, as `--pose` of commands takes them."""
    robot, position, angles = load_robot("acrobot_large"), np.array(POSE[:3]), np.array(POSE[3:])
    six = [POSE, tuple(POSE), np.array(POSE), cdpr.Pose(position=position, angles_deg=angles)]
    three = [POSE[:3], RigidTransform(RotationMatrix(), POSE[:3])]
    for call in (
        lambda pose: cdpr.solve_inverse_kinematics(robot, pose).lengths,
        lambda pose: cdpr.solve_tensions(robot, pose).tensions,
        lambda pose: cdpr.solve_static(robot, pose).lengths,
        robot.wrench_matrix,
    ):
        for forms in (six, three):
            first, *others = map(call, forms)
            for other in others:
                np.testing.assert_array_equal(other, first)
    for wrong in ([0.1, 0.2], [0.1] * 5, [np.nan, 0.0, 0.3], [[0.1, 0.0, 0.3]], "0,0,0.3", 3):
        one_line(lambda wrong=wrong: robot.wrench_matrix(wrong), "pose: found", "phi, theta, psi")


NOISE = 1e-5
"""Standard deviation of measured lengths [m]."""


def test_measured_lengths_give_the_pose_with_its_deviation():
    """Noise of 0.01 mm was once refused: "accepted: up to 0.001 mm"."""
    robot, random = load_robot("acrobot_large"), np.random.default_rng(0)
    truth = cdpr.solve_inverse_kinematics(robot, POSE)
    squares, scatters = [], []
    for _ in range(200):
        fit = cdpr.solve_forward_kinematics(robot, truth.lengths + random.normal(0.0, NOISE, 8))
        turn = rotation_vector(fit.X_WP.rotation() @ truth.X_WP.rotation().inverse())
        shift = fit.X_WP.translation() - truth.X_WP.translation()
        error = np.concatenate([turn, shift])
        squares.append(error @ np.linalg.solve(fit.fit.covariance(NOISE), error))
        scatters.append(fit.fit.scatter() ** 2)
        assert not fit.remarks()
    # Means of 200 of chi-squares of 6 and of 2 degrees of freedom, within four deviations.
    assert abs(np.mean(squares) - 6.0) < 4.0 * np.sqrt(12.0 / 200)
    assert abs(np.mean(scatters) / NOISE**2 - 1.0) < 4.0 * np.sqrt(1.0 / 200)
    told = as_json(fit)
    C = fit.fit.covariance(fit.fit.scatter())  # of turns, then of the position
    np.testing.assert_allclose(
        np.square(fit.deviations()), [np.trace(C[3:, 3:]), np.trace(C[:3, :3])]
    )
    assert told["position_deviation_m"] < 2e-4
    assert told["length_scatter_m"] > 0.0
    assert "standard deviation" in shows_itself(fit)


@pytest.mark.parametrize("name", ["acrobot_large", "segesta", "spider_camera", "planar"])
def test_no_other_pose_has_smaller_squares(name):
    """Against a general solver, for robots of several motion types with redundant cables."""
    robot, random = load_robot(name), np.random.default_rng(1)
    lengths = cdpr.solve_inverse_kinematics(robot).lengths
    lengths = lengths + random.normal(0.0, 1e-3, len(lengths))
    fit = cdpr.solve_forward_kinematics(robot, lengths)
    motion = robot.motion_type()

    def residuals(x):
        twist = motion.basis(fit.X_WP.rotation().matrix()) @ x
        R = rotation_from_vector(twist[:3]) @ fit.X_WP.rotation()
        X_WP = RigidTransform(R, fit.X_WP.translation() + twist[3:])
        return lengths_at(robot, X_WP) - lengths

    start = np.full(motion.freedom, 1e-3)
    other = least_squares(residuals, start, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    np.testing.assert_allclose(other.x, 0.0, atol=1e-7)  # its own tolerance
    assert np.sum(fit.residuals**2) <= 2.0 * other.cost * (1.0 + 1e-9)


def test_lengths_that_contradict_each_other_say_so_by_the_residual():
    robot = load_robot("acrobot_large")
    lengths = cdpr.solve_inverse_kinematics(robot, POSE).lengths
    wrong = lengths + np.where(np.arange(8) == 2, 0.05, 0.0)
    fit = cdpr.solve_forward_kinematics(robot, wrong)
    assert np.max(np.abs(fit.residuals)) > 0.01
    (remark,) = fit.remarks()
    assert f"{1e3 * np.max(np.abs(fit.residuals)):.3g} mm" in remark
    assert remark in as_json(fit)["remarks"]
    assert "belong to no pose" in shows_itself(fit)
    half = lengths * np.tile([1.0, 0.3], 4)
    one_line(lambda: cdpr.solve_forward_kinematics(robot, half), "misses cable")
    outside = cdpr.solve_forward_kinematics(robot, 2.0 * lengths)
    assert any("outside the frame" in words for words in outside.remarks())


def test_as_many_lengths_as_unknowns_have_no_deviation():
    robot = load_robot("nist_robocrane")
    fit = cdpr.solve_forward_kinematics(robot, cdpr.solve_inverse_kinematics(robot).lengths)
    assert fit.deviations() is None
    assert as_json(fit)["position_deviation_m"] is None


ABOUT_ROBOTS = ASKED | {name: getattr(cdpr, name) for name in TAKES - {"add_mechanism"}}


@pytest.mark.parametrize("verb", sorted(ABOUT_ROBOTS))
def test_a_name_stands_for_a_robot_in_every_verb(verb):
    """A wrong one is answered by the nearest; so it is looked up, and nothing else is tried."""
    one_line(lambda: ABOUT_ROBOTS[verb]("acrobot_smal"), "did you mean acrobot_small")


def test_the_table_of_verbs_that_take_a_robot_is_whole():
    """`add_robot` is no verb about a robot but builds: it takes a plant first."""
    functions = {name: getattr(cdpr, name) for name in cdpr.__all__}
    takes = {
        name: inspect.signature(function).parameters
        for name, function in functions.items()
        if inspect.isfunction(function)
    }
    kinds = r"Robot \| str|RobotWord|ModelWord"
    taking = {name for name, given in takes.items() if re.search(kinds, str(given.get("robot")))}
    building = {name for name in taking if "plant" in takes[name]}
    assert taking - building <= set(ABOUT_ROBOTS)
    assert building == {"add_robot"}
    plant = MultibodyPlant(0.0)
    one_line(lambda: cdpr.add_robot(plant, "acrobot_smal"), "did you mean acrobot_small")


@pytest.mark.parametrize(
    ("wrong", "near"),
    [("solve_tension", "solve_tensions"), ("CabelRobot", "CableRobot"), ("forward_kinematics",
     "solve_forward_kinematics"), ("load_robots", "load_robot")],
)  # fmt: skip
def test_a_wrong_name_of_the_package_is_answered_by_the_nearest(wrong, near):
    with pytest.raises(AttributeError, match=f"{wrong}.*did you mean.*{near}") as problem:
        getattr(cdpr, wrong)
    assert problem.value.name == wrong
    assert not hasattr(cdpr, "nothing_like_it_at_all")

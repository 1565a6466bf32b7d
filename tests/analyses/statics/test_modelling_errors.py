"""Errors of the controller's model, and slack that moves between cables along a path."""

from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.statics.modelling_errors import (
    Belief,
    commanded_lengths,
    errors_figure,
    pose_errors,
    poses_in,
    slack_along_path,
    slack_figure,
    usual_beliefs,
    wrong_geometry,
)
from cdpr_drake.models.robot_loader import load_robot

START, END = np.array([-0.25, -0.2, 0.3]), np.array([0.25, 0.2, 0.5])


@pytest.mark.parametrize("name", ["acrobot_large", "caroca"])
def test_a_right_model_leads_to_the_pose(name):
    robot = load_robot(name)
    errors = pose_errors(
        robot, Belief("nothing", "catenary", robot.cable_set()), poses_in(robot, 2)
    )
    assert np.max(errors.distances) < 1e-8
    assert np.max(errors.angles) < 1e-8
    assert np.all(errors.taut == 8)


def test_pulleys_matter_more_than_sag_and_stretch():
    robot = load_robot("caroca")
    poses = poses_in(robot, 3)
    pulleys, stretch, sag, none = (pose_errors(robot, b, poses) for b in usual_beliefs(robot))
    assert np.all(pulleys.distances > 10.0 * stretch.distances)
    assert np.all(pulleys.distances > 10.0 * sag.distances)
    assert np.median(pulleys.distances) > 5e-3
    np.testing.assert_allclose(none.distances, pulleys.distances, rtol=0.2)
    figure = errors_figure({"caroca": [pulleys, stretch, sag, none]})
    assert [axes.get_xlabel() for axes in figure.axes] == ["distance [mm]", "angle [deg]"]


def test_errors_of_points_grow_in_proportion():
    robot = load_robot("acrobot_large")
    poses = poses_in(robot, 2)
    small, large = (pose_errors(robot, wrong_geometry(robot, s, 0), poses) for s in (1e-3, 2e-3))
    np.testing.assert_allclose(large.distances, 2.0 * small.distances, rtol=0.1)
    assert np.all(small.distances < 3e-3)
    off = wrong_geometry(robot, 1e-3, 0).cables.p_WA - robot.exit_points()
    np.testing.assert_allclose(np.linalg.norm(off, axis=0), 1e-3)


def test_lengths_are_right_at_home():
    robot = load_robot("acrobot_large")
    home = robot.home.transform()
    right = commanded_lengths(robot, Belief("nothing", "catenary", robot.cable_set()), [home])
    for belief in usual_beliefs(robot):
        np.testing.assert_allclose(commanded_lengths(robot, belief, [home]), right, atol=1e-12)
    upset = commanded_lengths(robot, usual_beliefs(robot)[0], [home], np.full(8, 1e-3))
    np.testing.assert_allclose(upset, right + 1e-3)


def test_at_most_six_cables_stay_taut_and_slack_moves_along_a_path():
    """The reported effect: eight nearly inextensible cables, lengths wrong by a millimetre."""
    robot = load_robot("acrobot_large")
    upset = 1e-3 * np.random.default_rng(0).normal(size=8)
    path = slack_along_path(robot, START, END, 150, upset)
    taut = np.sum(path.taut, axis=1)
    assert path.most_six > 0.98
    assert np.max(taut) <= 7
    assert np.min(taut) == 4  # in between, gravity alone holds two motions
    assert path.transfers >= 2
    first, last = path.taut[0], path.taut[-1]
    assert np.sum(first) == np.sum(last) == 6
    assert np.sum(first != last) == 4  # two cables fell slack, two others came taut
    assert 1e-3 < np.max(path.distances) < 1e-2
    figure = slack_figure(path, "title")
    assert figure.axes[1].get_ylabel() == "distance from it [mm]"


def test_soft_cables_stay_taut_on_the_same_path():
    robot = load_robot("acrobot_large")
    soft = replace(robot, cable=replace(robot.cable, youngs_modulus=1e-4 * 111e9))
    path = slack_along_path(soft, START, END, 10, 1e-4 * np.arange(8.0))
    assert np.all(path.taut)

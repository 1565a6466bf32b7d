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
ROBOT = load_robot("acrobot_large")


@pytest.mark.parametrize("name", ["acrobot_large", "caroca"])
def test_a_right_model_leads_to_the_pose(name):
    robot = load_robot(name)
    right = Belief("nothing", "catenary", robot.cable_set())
    errors = pose_errors(robot, [right], poses_in(robot, 2))
    assert errors["distance"].max() < 1e-8
    assert errors["angle"].max() < 1e-8
    assert (errors["taut"] == 8).all()


def test_pulleys_matter_more_than_sag_and_stretch():
    robot = load_robot("caroca")
    errors = pose_errors(robot, usual_beliefs(robot), poses_in(robot, 3))
    pulleys, stretch, sag, none = errors["distance"].to_numpy().reshape(4, 3)
    assert np.all(pulleys > 10.0 * stretch)
    assert np.all(pulleys > 10.0 * sag)
    assert np.median(pulleys) > 5e-3
    np.testing.assert_allclose(none, pulleys, rtol=0.2)
    figure = errors_figure({"caroca": errors})
    assert [axes.get_xlabel() for axes in figure.axes] == ["distance [mm]", "angle [deg]"]


def test_errors_of_points_grow_in_proportion():
    beliefs = [wrong_geometry(ROBOT, size, 0) for size in (1e-3, 2e-3)]
    errors = pose_errors(ROBOT, beliefs, poses_in(ROBOT, 2))
    small, large = errors["distance"].to_numpy().reshape(2, 2)
    np.testing.assert_allclose(large, 2.0 * small, rtol=0.1)
    assert np.all(small < 3e-3)
    off = beliefs[0].cables.p_WA - ROBOT.exit_points()
    np.testing.assert_allclose(np.linalg.norm(off, axis=0), 1e-3)


def test_lengths_are_right_at_home():
    home = ROBOT.home.transform()
    right = commanded_lengths(ROBOT, Belief("nothing", "catenary", ROBOT.cable_set()), [home])
    for belief in usual_beliefs(ROBOT):
        np.testing.assert_allclose(commanded_lengths(ROBOT, belief, [home]), right, atol=1e-12)
    upset = commanded_lengths(ROBOT, usual_beliefs(ROBOT)[0], [home], np.full(8, 1e-3))
    np.testing.assert_allclose(upset, right + 1e-3)


def test_at_most_six_cables_stay_taut_and_slack_moves_along_a_path():
    """The reported effect: eight nearly inextensible cables, lengths wrong by a millimetre."""
    path = slack_along_path(ROBOT, START, END, 150, 1e-3 * np.random.default_rng(0).normal(size=8))
    taut = path.drop(columns="distance").to_numpy() > 0.0
    count = np.sum(taut, axis=1)
    few = taut[count <= 6]
    assert len(few) > 0.98 * len(taut)
    assert np.max(count) <= 7
    assert np.min(count) == 4  # in between, gravity alone holds two motions
    assert np.sum(np.any(few[1:] != few[:-1], axis=1)) >= 2  # another set of cables takes over
    assert count[0] == count[-1] == 6
    assert np.sum(taut[0] != taut[-1]) == 4  # two cables fell slack, two others came taut
    assert 1e-3 < path["distance"].max() < 1e-2
    assert slack_figure(path, "title").axes[1].get_ylabel() == "distance from it [mm]"


def test_soft_cables_stay_taut_on_the_same_path():
    soft = replace(ROBOT, cable=replace(ROBOT.cable, youngs_modulus=1e-4 * 111e9))
    path = slack_along_path(soft, START, END, 10, 1e-4 * np.arange(8.0))
    assert (path.drop(columns="distance") > 0.0).all(axis=None)

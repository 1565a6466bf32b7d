"""Poses that are proposed after a calibration."""

from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.fits.calibration import fit_robot
from cdpr_drake.analyses.fits.poses import rest_poses
from cdpr_drake.analyses.fits.prediction import next_poses
from cdpr_drake.analyses.fits.robots import calibration_model
from cdpr_drake.analyses.planning.path_files import read_path
from cdpr_drake.calibration.measurements import simulated_lengths, simulated_poses
from cdpr_drake.calibration.pose_design import expected_std
from cdpr_drake.geometry.poses import pose_error
from tests.analyses.fits.logs import ROBOT, SIGMAS, recorded, task

COUNT = 5
PREDICTED = 0.03
"""Standard deviations are told where the robot was believed to be, millimetres away."""


def again(first, poses, seed):
    """A calibration of the log with rows for further poses."""
    log = first.setup.task.log
    random, true = np.random.default_rng(seed), calibration_model(ROBOT)
    readings = simulated_lengths(true, poses, log.lengths[0], SIGMAS.lengths, random)
    tracked = simulated_poses(poses, SIGMAS.turn, SIGMAS.place, random)
    log = replace(
        log, count=log.count + len(poses), lengths=np.vstack([log.lengths, readings]),
        poses=[*log.poses, *tracked],
    )  # fmt: skip
    return fit_robot(replace(first.setup.task, log=log)).result


@pytest.fixture(scope="module")
def first():
    """A calibration from few poses."""
    return fit_robot(task(("exit_points",), recorded(calibration_model(ROBOT), count=6)))


@pytest.fixture(scope="module")
def proposed(first):
    return next_poses(first.setup, first.result, COUNT)


def test_what_is_expected_of_them_is_what_they_give(first, proposed):
    then = again(first, proposed.poses, 7)
    np.testing.assert_allclose(then.std, proposed.std_then, rtol=PREDICTED)
    assert np.all(proposed.std_then < proposed.std_now)
    np.testing.assert_array_equal(proposed.std_now, first.result.std)


def test_they_tell_more_than_poses_at_random(first, proposed):
    def left(poses):
        return again(first, poses, 8).std

    others = [rest_poses(ROBOT, COUNT, np.random.default_rng(k))[0] for k in (11, 12, 13)]
    assert np.prod(left(proposed.poses)) < min(np.prod(left(poses)) for poses in others)


def test_the_file_is_a_path(proposed, tmp_path):
    (tmp_path / "next_poses.csv").write_text(proposed.text())
    read = read_path(tmp_path / proposed.as_dict()["file"])
    assert len(read.poses) == COUNT
    for X, Y in zip(read.poses, proposed.poses, strict=True):
        assert max(pose_error(X, Y)) < 1e-7
    assert len(proposed.as_dict()["std_then"]) == 24
    assert len(proposed.table().rows) == 1


def test_nothing_is_expected_of_what_nothing_tells():
    information = np.diag([4.0, 0.0])
    np.testing.assert_allclose(expected_std(information, np.array([0.01, 0.01])), [0.005, 0.0])

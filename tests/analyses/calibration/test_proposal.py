"""Poses that are proposed after a calibration."""

from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.calibration.calibrated_robots import calibration_model
from cdpr_drake.analyses.calibration.calibration_task import calibrate
from cdpr_drake.analyses.calibration.candidate_poses import rest_poses
from cdpr_drake.analyses.calibration.pose_proposal import next_poses
from cdpr_drake.analyses.planning.path_files import read_path
from cdpr_drake.calibration.measurements import simulated_lengths, simulated_poses
from cdpr_drake.calibration.pose_design import expected_std
from cdpr_drake.geometry.poses import pose_error
from tests.analyses.calibration.logs import ROBOT, SIGMAS, asked, recorded

COUNT = 5
PREDICTED = 0.03
"""Standard deviations are told where the robot was believed to be, millimetres away."""


def measured(log, poses, seed):
    """The log with rows for further poses."""
    random, true = np.random.default_rng(seed), calibration_model(ROBOT)
    readings = simulated_lengths(true, poses, log.lengths[0], SIGMAS.lengths, random)
    tracked = simulated_poses(poses, SIGMAS.turn, SIGMAS.place, random)
    return replace(
        log, count=log.count + len(poses), lengths=np.vstack([log.lengths, readings]),
        poses=[*log.poses, *tracked],
    )  # fmt: skip


@pytest.fixture(scope="module")
def first():
    """A calibration from few poses."""
    return calibrate(asked(("exit_points",)), recorded(calibration_model(ROBOT), count=6))


@pytest.fixture(scope="module")
def proposed(first):
    return next_poses(first, COUNT)


def test_what_is_expected_of_them_is_what_they_give(first, proposed):
    then = calibrate(first.task, measured(first.log, proposed.poses, 7)).result
    np.testing.assert_allclose(then.std, proposed.std_then, rtol=PREDICTED)
    assert np.all(proposed.std_then < proposed.std_now)
    np.testing.assert_array_equal(proposed.std_now, first.result.std)


def test_they_tell_more_than_poses_at_random(first, proposed):
    def left(poses):
        return calibrate(first.task, measured(first.log, poses, 8)).result.std

    others = [rest_poses(ROBOT, COUNT, np.random.default_rng(k))[0] for k in (11, 12, 13)]
    assert np.prod(left(proposed.poses)) < min(np.prod(left(poses)) for poses in others)


def test_the_file_is_a_path(proposed, tmp_path):
    proposed.write(tmp_path)
    read = read_path(tmp_path / proposed.as_dict()["file"])
    assert len(read.poses) == COUNT
    for X, Y in zip(read.poses, proposed.poses, strict=True):
        assert max(pose_error(X, Y)) < 1e-7
    assert len(proposed.as_dict()["std_then"]) == 24
    assert proposed.table().row_count == 1


def test_nothing_is_expected_of_what_nothing_tells():
    information = np.diag([4.0, 0.0])
    np.testing.assert_allclose(expected_std(information, np.array([0.01, 0.01])), [0.005, 0.0])

"""A robot with fewer cables than degrees of freedom finds from where its sensors count."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

import cdpr_drake as cdpr
from cdpr_drake.analyses.calibration.calibrated_robots import calibration_model
from cdpr_drake.analyses.calibration.calibration_request import HOMING, default_unknown
from cdpr_drake.analyses.calibration.log_file import CalibrationLog
from cdpr_drake.analyses.calibration.turned_sensors import upside_down
from cdpr_drake.calibration.stations import Point, Stations
from cdpr_drake.geometry.poses import pose_error, pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.statics.equilibrium import equilibrium_near

NOISE = 0.1
"""Of the sensors, in parts of what they are taken to miss."""

YAW = 0.4
"""Where the yaw of the log counts from [rad]."""


def recorded():
    """Four cables of a robot hold its platform; lengths, swivels, tensions and tilts that count
    from the first row; the poses."""
    robot = load_robot("acrobot_small")
    cables = [robot.cables[i] for i in (0, 3, 4, 7)]
    corners = [np.append(0.055 * np.sign(c.exit_point[:2]), 0.09) for c in cables]
    held = [replace(c, anchor_point=p) for c, p in zip(cables, corners, strict=True)]
    robot = replace(robot, cables=held)
    model, random = calibration_model(robot), np.random.default_rng(2)
    X_WP = pose_from_angles(np.array([0.02, 0.03, 0.4]), np.zeros(3))
    lengths = Point(model, Stations.at([X_WP])).numbers[0, :, 0]
    poses, tensions = [], []
    for _ in range(30):
        l0 = lengths + random.uniform(-0.08, 0.08, 4)
        rest = equilibrium_near(robot.cable_set(), "elastic", rigid_platform(robot), l0, X_WP)
        if np.min(rest.tensions) > 0.1:
            poses.append(rest.X_WP)
            tensions.append(rest.tensions)
    numbers = Point(model, Stations.at(poses)).numbers
    tilts = np.array([RollPitchYaw(X.rotation()).vector() for X in poses])
    tilts[:, 2] -= YAW

    def noisy(values, sigma):
        return values + NOISE * sigma * random.standard_normal(values.shape)

    counted, turned = (
        noisy(numbers[:, :, 0], HOMING.lengths),
        noisy(numbers[:, :, 2], HOMING.swivels),
    )
    log = CalibrationLog(
        Path("homing"), len(poses), lengths=counted - counted[0], swivels=turned - turned[0],
        tensions=noisy(np.array(tensions), 0.5), tilts=noisy(tilts, HOMING.tilt),
    )  # fmt: skip
    return robot, log, poses


@pytest.fixture(scope="module")
def homing():
    return recorded()


def test_nothing_has_to_be_said(homing):
    robot, log, poses = homing
    assert default_unknown(robot, log) == ("length_offsets", "swivel_offsets", "tilt_zero.yaw")
    found = cdpr.calibrate(robot, log)
    assert found.result.status == "converged"
    assert found.task.sigmas == HOMING
    distance, angle = pose_error(poses[0], found.result.stations.poses()[0])
    assert distance < 5.0 * found.result.pose_std[0, 1]
    assert distance < 0.02
    assert np.degrees(angle) < 2.0
    assert found.result.model.tilt_zero[2] == pytest.approx(YAW, abs=0.05)
    assert found.as_dict()["tilt_zeros_rad"][:2] == [0.0, 0.0]


def test_swivels_whose_sign_is_turned_are_named(homing):
    robot, log, _ = homing
    count = log.count
    found = cdpr.calibrate(robot, replace(log, swivels=-log.swivels), sigmas={"swivels": 3e-3})
    assert found.result.status == "misfit"
    assert "swivel angles fit with the sign turned" in found.misfit[0]
    assert int(found.misfit[0].split()[0]) > 0.9 * 4 * count


def test_poses_upside_down_are_told_from_upright_ones():
    up = np.array([0.0, 0.0, 1.0])
    turns = [(0.0, 0.0, 0.0), (1.5, 0.0, 0.0), (np.pi, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 3.0)]
    stations = Stations.at([pose_from_angles(np.zeros(3), np.array(t)) for t in turns])

    class Result:
        pass

    result = Result()
    result.stations = stations
    assert upside_down(result, up).tolist() == [False, False, True, True, False]


def test_a_platform_upside_down_is_a_misfit(homing):
    robot, log, poses = homing
    X = poses[0]
    flip = pose_from_angles(np.zeros(3), np.array([np.pi, 0.0, 0.0])).rotation()
    start = RigidTransform(X.rotation() @ flip, X.translation())
    found = cdpr.calibrate(robot, replace(log, tensions=None), start=start)
    assert found.result.status == "misfit"
    assert found.misfit

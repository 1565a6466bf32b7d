"""A robot on three cables at rest finds where it began, by winches and swivel angles."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from cdpr_drake.analyses.calibration.calibrated_robots import calibration_model
from cdpr_drake.analyses.calibration.calibration_request import CalibrationTask, Sigmas
from cdpr_drake.analyses.calibration.calibration_task import calibrate
from cdpr_drake.analyses.calibration.log_file import CalibrationLog
from cdpr_drake.calibration.stations import Point, Stations
from cdpr_drake.geometry.poses import pose_error, pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.statics.equilibrium import equilibrium_near

SIGMAS = Sigmas(lengths=5e-4, swivels=3e-3, moments=0.02, forces=0.1)
TAUT = 0.1
"""Least tension at a pose that is recorded [N]."""


def three_cables():
    """ACROBOT on three cables that hold the platform by its corners."""
    robot = load_robot("acrobot_small")
    cables = [robot.cables[i] for i in (0, 3, 5)]
    corners = [np.append(0.055 * np.sign(c.exit_point[:2]), 0.09) for c in cables]
    held = [replace(c, anchor_point=p) for c, p in zip(cables, corners, strict=True)]
    return replace(robot, cables=held)


def test_three_cables_without_tension_sensors_find_where_they_began():
    robot, random = three_cables(), np.random.default_rng(0)
    model, X_WP = (
        calibration_model(robot),
        pose_from_angles(np.array([0.02, 0.03, 0.4]), np.zeros(3)),
    )
    lengths = Point(model, Stations.at([X_WP])).numbers[0, :, 0]
    poses = []
    for _ in range(20):
        l0 = lengths + random.uniform(-0.1, 0.1, 3)
        rest = equilibrium_near(robot.cable_set(), "elastic", rigid_platform(robot), l0, X_WP)
        if np.min(rest.tensions) > TAUT:
            poses.append(rest.X_WP)
    assert len(poses) >= 8
    numbers = Point(model, Stations.at(poses)).numbers
    counted = numbers[:, :, 0] + SIGMAS.lengths * random.standard_normal((len(poses), 3))
    turned = numbers[:, :, 2] + SIGMAS.swivels * random.standard_normal((len(poses), 3))
    log = CalibrationLog(
        Path("homing"), len(poses), lengths=counted - counted[0], swivels=turned - turned[0]
    )
    start = pose_from_angles(np.array([0.1, -0.1, 0.3]), np.zeros(3))
    task = CalibrationTask(robot, ("length_offsets",), sigmas=SIGMAS, start=start)
    result = calibrate(task, log).result
    assert result.status == "converged"
    assert result.spread() < 2.0
    far = pose_error(start, poses[0])[0]
    for X, found in zip(poses, result.stations.poses(), strict=True):
        distance, angle = pose_error(X, found)
        assert distance < 5.0 * np.max(result.std[:3])
        assert distance < 0.3 * far
        assert np.degrees(angle) < 2.0

"""A robot with fewer cables than degrees of freedom finds from where its sensors count."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

import cdpr_drake as cdpr
from cdpr_drake.analyses.fits.calibration import fit_robot
from cdpr_drake.analyses.fits.robots import calibration_model
from cdpr_drake.analyses.fits.setup import (
    HOMING,
    CalibrationTask,
    Sigmas,
    default_unknown,
)
from cdpr_drake.analyses.fits.starts import upright_minima, upside_down
from cdpr_drake.analyses.fits.verdict import impossible_poses
from cdpr_drake.analyses.logs.measurements import Measurements
from cdpr_drake.calibration.stations import Point, Stations
from cdpr_drake.geometry.poses import pose_error, pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.statics.equilibrium import equilibrium_near

TAUT = 0.1
"""Least tension at a pose that is recorded [N]."""

NOISE = 0.1
"""Of the sensors, in parts of what they are taken to miss."""

YAW = 0.4
"""Where the yaw of the log counts from [rad]."""

SIGMAS = Sigmas(lengths=5e-4, swivels=3e-3, moments=0.02, forces=0.1)
"""Without tension sensors."""

LEAST = 8
"""Poses that tell thirteen unknowns of a robot on three cables."""


def three_cables():
    """ACROBOT on three cables that hold the platform by its corners."""
    robot = load_robot("acrobot_small")
    cables = [robot.cables[i] for i in (0, 3, 5)]
    corners = [np.append(0.055 * np.sign(c.exit_point[:2]), 0.09) for c in cables]
    held = [replace(c, anchor_point=p) for c, p in zip(cables, corners, strict=True)]
    return replace(robot, cables=held)


@pytest.fixture(scope="module")
def resting():
    """Poses at which three cables hold a platform at rest, tensions, lengths, swivel angles."""
    robot, random = three_cables(), np.random.default_rng(0)
    model, X_WP = calibration_model(robot), RigidTransform([0.02, 0.03, 0.4])
    lengths = Point(model, Stations.at([X_WP])).numbers[0, :, 0]
    rests = [
        equilibrium_near(robot.cable_set(), "elastic", rigid_platform(robot),
                         lengths + random.uniform(-0.1, 0.1, 3), X_WP)
        for _ in range(20)
    ]  # fmt: skip
    taut = [rest for rest in rests if np.min(rest.tensions) > TAUT][:LEAST]
    poses = [rest.X_WP for rest in taut]
    assert len(poses) == LEAST
    numbers = Point(model, Stations.at(poses)).numbers
    return poses, np.array([rest.tensions for rest in taut]), numbers[:, :, 0], numbers[:, :, 2]


def counted(values, sigma, random):
    """With noise, counted from the first row."""
    noisy = values + sigma * random.standard_normal(values.shape)
    return noisy - noisy[0]


@pytest.fixture(scope="module")
def homing(resting):
    """Lengths and swivels that count from the first row, tensions, tilts; and the poses."""
    poses, tensions, lengths, swivels = resting
    random = np.random.default_rng(1)
    tilts = np.array([RollPitchYaw(X.rotation()).vector() for X in poses])
    tilts[:, 2] -= YAW
    log = Measurements(
        Path("homing"), len(poses), lengths=counted(lengths, NOISE * HOMING.lengths, random),
        swivels=counted(swivels, NOISE * HOMING.swivels, random),
        tensions=tensions + NOISE * 0.5 * random.standard_normal(tensions.shape),
        tilts=tilts + NOISE * HOMING.tilt * random.standard_normal(tilts.shape),
    )  # fmt: skip
    return three_cables(), log, poses


def test_nothing_has_to_be_said(homing):
    robot, log, poses = homing
    assert default_unknown(robot, log) == ("length_offsets", "swivel_offsets", "tilt_zero.yaw")
    found = cdpr.calibrate(robot, log)
    assert found.result.status == "converged"
    assert found.source.setup.task.sigmas == HOMING
    distance, angle = pose_error(poses[0], found.result.stations.poses()[0])
    assert distance < 5.0 * NOISE * found.result.pose_std[0, 1]
    assert angle < 5.0 * NOISE * found.result.pose_std[0, 0]
    assert found.result.model.tilt_zero[2] == pytest.approx(YAW, abs=0.05)
    assert found.as_dict()["tilt_zeros_rad"][:2] == [0.0, 0.0]


def test_three_cables_without_tension_sensors_find_where_they_began(resting):
    """By winches and swivel angles alone."""
    (poses, _, lengths, swivels), random = resting, np.random.default_rng(2)
    log = Measurements(
        Path("homing"), len(poses), lengths=counted(lengths, SIGMAS.lengths, random),
        swivels=counted(swivels, SIGMAS.swivels, random),
    )  # fmt: skip
    start = RigidTransform([0.1, -0.1, 0.3])
    task = CalibrationTask(
        robot=three_cables(), log=log, unknown=("length_offsets",), sigmas=SIGMAS, start=start
    )
    result = fit_robot(task).result
    assert result.status == "converged"
    assert result.spread() < 2.0
    far = pose_error(start, poses[0])[0]
    for X, found in zip(poses, result.stations.poses(), strict=True):
        distance, angle = pose_error(X, found)
        assert distance < 5.0 * np.max(result.std[:3])
        assert distance < 0.3 * far
        assert np.degrees(angle) < 2.0


def test_swivels_whose_sign_is_turned_are_named(homing):
    robot, log, _ = homing
    turned = replace(log, swivels=-log.swivels)
    found = cdpr.calibrate(robot, turned, sigmas={"swivels": 3e-3}, keep_outliers=True)
    assert found.result.status == "misfit"
    assert "swivel angles fit with the sign turned" in found.misfit[0]
    assert int(found.misfit[0].split()[0]) > 0.9 * log.swivels.size


def stations(*angles):
    return Stations.at([pose_from_angles(np.zeros(3), np.array(turn)) for turn in angles])


def test_poses_upside_down_are_told_from_upright_ones():
    turns = (0.0, 0.0, 0.0), (1.5, 0.0, 0.0), (np.pi, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 3.0)
    result = SimpleNamespace(stations=stations(*turns))
    found = upside_down(result, np.array([0.0, 0.0, 1.0]))
    assert found.tolist() == [False, False, True, True, False]


def test_a_pose_without_a_reading_to_spare_is_no_reason_to_blame_a_sensor():
    turns = (0.0, 0.0, 0.0), (np.pi, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.1, 0.0)
    robot, up = three_cables(), np.array([0.0, 0.0, 1.0])
    spare = SimpleNamespace(stations=stations(*turns), surplus=np.array([9, 0, 2, 0]))
    misfit, remarks = impossible_poses(robot, spare, up)
    assert [words.split(" in ")[1] for words in misfit] == [
        "1 of 4 rows: sign or zero of a sensor?"
    ]
    assert [words.split(":")[0] for words in remarks] == ["row 2"]
    upright = SimpleNamespace(stations=stations(turns[0]), surplus=np.array([0]))
    assert impossible_poses(robot, upright, up) == ([], [])
    most = SimpleNamespace(stations=stations(*turns[1:]), surplus=np.zeros(3, int))
    misfit, remarks = impossible_poses(robot, most, up)
    assert "in 2 of 3 rows" in misfit[0]
    assert remarks == []


def test_an_upright_minimum_goes_before_one_upside_down_that_costs_less():
    upright, flipped = (
        SimpleNamespace(result=SimpleNamespace(stations=stations((0.1, 0.0, 0.0), turn)), cost=cost)
        for turn, cost in (((0.0, 0.2, 0.0), 20.0), ((3.0, 0.0, 0.0), 10.0))
    )
    prepared = SimpleNamespace(first=RigidTransform())
    assert upright_minima(prepared, [flipped, upright]) == [upright]
    assert upright_minima(prepared, [flipped]) == [flipped]

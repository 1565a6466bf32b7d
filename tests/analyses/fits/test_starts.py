"""Starts are compared by one cost; what fits as well, and what does not fit, is said."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pydrake.math import RollPitchYaw

from cdpr_drake.analyses.fits import calibration
from cdpr_drake.analyses.fits.calibration import calibration_fit, fit_robot
from cdpr_drake.analyses.fits.robots import calibration_model
from cdpr_drake.analyses.fits.setup import CalibrationTask, Sigmas
from cdpr_drake.analyses.logs.measurements import Measurements
from cdpr_drake.calibration.stations import Point, Stations
from cdpr_drake.geometry.poses import pose_error, pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from tests.analyses.fits import logs, spoiled_log


@pytest.fixture(scope="module")
def found():
    return spoiled_log.calibrated(spoiled_log.first_pose(0))


def test_a_log_with_bad_readings_ends_in_the_right_minimum(found):
    assert spoiled_log.wrong_rows(found) == []
    assert found.result.status == "converged"
    assert 0 < len(found.result.outliers) <= spoiled_log.recorded()[2]


def test_another_start_ends_in_the_same_minimum(found):
    other = spoiled_log.calibrated(spoiled_log.first_pose(1))
    assert spoiled_log.wrong_rows(other) == []
    assert other.result.robust_cost == pytest.approx(found.result.robust_cost, abs=1e-3)


def test_an_outlier_costs_sixteen(found):
    result = found.result
    whole = result.chi_square + 16.0 * len(result.outliers)
    assert result.robust_cost == pytest.approx(whole, rel=1e-9)
    assert [one.sigmas for one in result.largest[:2]] == [o.sigmas for o in result.outliers[:2]]


def planar_log(bad, sigma=2e-4, outliers=True):
    """Lengths of four cables in a plane, one more than it takes; one of them off by metres [m]."""
    robot, random = load_robot("planar"), np.random.default_rng(3)
    low, high = np.asarray(robot.frame.lower), np.asarray(robot.frame.upper)
    poses = []
    for _ in range(14):
        place = 0.5 * (low + high) + 0.3 * (high - low) * random.uniform(-1, 1, 3)
        place[2] = robot.plane_height or 0.0
        poses.append(pose_from_angles(place, np.array([0.0, 0.0, random.uniform(-0.3, 0.3)])))
    lengths = Point(calibration_model(robot), Stations.at(poses)).numbers[:, :, 0]
    readings = lengths + 2e-4 * random.standard_normal(lengths.shape)
    readings[8, 1] += bad
    log = Measurements(Path("plane"), 14, lengths=readings - readings[0])
    task = CalibrationTask(
        robot=robot, log=log, unknown=("length_offsets",), sigmas=Sigmas(lengths=sigma),
        start=poses[0], outliers=outliers,
    )  # fmt: skip
    return poses, fit_robot(task)


def test_a_row_that_fits_as_well_elsewhere_is_told():
    # Of four lengths one is bad: that three agree at the true pose tells no more than three others.
    poses, found = planar_log(0.02)
    others = [tie for tie in found.ties if tie.pose == 8]
    assert max(tie.more for tie in others) < 9.0
    places = [found.result.stations.poses()[8], *(tie.X_WP for tie in others)]
    assert len(places) > 1
    assert min(pose_error(poses[8], X)[0] for X in places) < 2e-3
    said = calibration_fit(found).as_dict()
    assert 9 in [row["row"] for row in said["ties"]]
    assert any("another pose that fits as well" in words for words in said["remarks"])


def test_without_bad_readings_a_plane_is_found():
    poses, found = planar_log(0.0)
    assert found.result.outliers == found.misfit == ()
    for X, Y in zip(poses, found.result.stations.poses(), strict=True):
        assert pose_error(X, Y)[0] < 2e-3


@pytest.fixture(scope="module")
def turned_round():
    """Swivel angles of the other sign."""
    poses, log, _ = spoiled_log.recorded()
    true = Point(calibration_model(spoiled_log.ROBOT), Stations.at(poses)).numbers
    lengths, swivels = true[:, :, 0] - true[0, :, 0], true[0, :, 2] - true[:, :, 2]
    mirrored = replace(log, lengths=lengths, swivels=swivels).only(np.arange(6))
    return spoiled_log.calibrated(poses[0], mirrored)


def test_swivels_of_the_other_sign_are_a_misfit(turned_round):
    assert turned_round.result.status == "misfit"
    dropped = turned_round.result.residuals["swivel angles"].dropped
    words = f"{dropped} of 48 swivel angles do not fit: sign or zero?"
    assert any(words in said for said in turned_round.misfit)
    worst = turned_round.result.largest[0]
    assert f"row {worst.pose + 1}, {worst.what}" in turned_round.misfit[-1]
    said = calibration_fit(turned_round).as_dict()
    assert said["status"] == "misfit"
    assert said["misfit_factor"] == 3.0
    first = said["largest_residuals"][0]
    told = (first["row"], first["measurement"], first["unit"])
    assert told == (worst.pose + 1, worst.what, worst.unit)


def test_residuals_beyond_three_sigmas_are_a_misfit_without_outliers_too(monkeypatch):
    monkeypatch.setattr(calibration, "turned_sensors", lambda *_: ())  # nor is one to blame
    _, found = planar_log(0.0, sigma=2e-5, outliers=False)
    assert found.result.spread() > 3.0
    assert found.result.status == "misfit"
    assert found.misfit[0].startswith("residuals are ")
    assert planar_log(0.0, outliers=False)[1].misfit == ()


def test_an_inclinometer_holds_what_lengths_leave_open():
    # Four cables, lengths alone: six coordinates of a pose are told with roll and pitch.
    robot = load_robot("acrobot_small")
    robot = replace(robot, cables=[robot.cables[i] for i in (0, 3, 5, 6)])
    poses = logs.poses(6)
    lengths = Point(calibration_model(robot), Stations.at(poses)).numbers[:, :, 0]
    tilts = np.array([RollPitchYaw(X.rotation()).vector() for X in poses])
    log = Measurements(
        Path("tilted"), 6, lengths=lengths, tilts=tilts, torques=np.zeros((6, 4)),
        headers={"rpy": ("roll_rad",), "motor torques": ("C1_torque_nm", "C2_torque_nm")},
    )  # fmt: skip
    task = CalibrationTask(
        robot=robot, log=log, unknown=(), sigmas=Sigmas(tilt=1e-3, yaw=1e-3), start=poses[0]
    )
    found = fit_robot(task)
    assert found.result.residuals["inclination"].count == 18
    for X, Y in zip(poses, found.result.stations.poses(), strict=True):
        assert pose_error(X, Y)[0] < 1e-4
    assert found.remarks[0] == (
        "not used: C1_torque_nm, C2_torque_nm: a calibration has no use of motor torques"
    )

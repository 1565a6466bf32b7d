"""First poses: starts are compared by one cost, and a robot finds where its sensors count from."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from pydrake.math import RigidTransform
from scipy.spatial.distance import pdist

import cdpr_drake as cdpr
from cdpr_drake.analyses.fits import calibration
from cdpr_drake.analyses.fits.calibration import calibration_fit
from cdpr_drake.analyses.fits.robots import calibration_model
from cdpr_drake.analyses.fits.setup import HOMING, Sigmas, default_unknown
from cdpr_drake.analyses.fits.starts import upright_minima, upside_down
from cdpr_drake.analyses.fits.verdict import impossible_poses
from cdpr_drake.analyses.logs.measurements import Measurements
from cdpr_drake.calibration.guesses import unfolded_points
from cdpr_drake.calibration.stations import Stations
from cdpr_drake.geometry.poses import pose_error, pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.statics.equilibrium import equilibrium_near
from tests.analyses.fits import logs
from tests.analyses.fits.logs import blind_fit, first_pose, numbers, wrong_rows


@pytest.fixture(scope="module")
def spoiled():
    return blind_fit(first_pose(0))


def test_a_log_with_bad_readings_ends_in_the_right_minimum(spoiled):
    assert wrong_rows(spoiled) == []
    assert spoiled.result.status == "converged"
    assert 0 < len(spoiled.result.outliers) <= logs.spoiled()[2]


def test_another_start_ends_in_the_same_minimum(spoiled):
    other = blind_fit(first_pose(1))
    assert wrong_rows(other) == []
    assert other.result.robust_cost == pytest.approx(spoiled.result.robust_cost, abs=1e-3)


def test_an_outlier_costs_sixteen(spoiled):
    result = spoiled.result
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
    lengths = numbers(calibration_model(robot), poses)[:, :, 0]
    readings = lengths + 2e-4 * random.standard_normal(lengths.shape)
    readings[8, 1] += bad
    log = Measurements(Path("plane"), 14, lengths=readings - readings[0])
    more = {"sigmas": Sigmas(lengths=sigma), "start": poses[0], "outliers": outliers}
    return poses, logs.fitted(robot, log, ("length_offsets",), **more)


def test_a_row_that_fits_as_well_elsewhere_is_remarked():
    # Of four lengths one is bad: that three agree at the true pose tells no more than three others.
    poses, fit = planar_log(0.02)
    others = [tie for tie in fit.ties if tie.pose == 8]
    assert max(tie.more for tie in others) < 9.0
    places = [fit.result.stations.poses()[8], *(tie.X_WP for tie in others)]
    assert len(places) > 1
    assert min(pose_error(poses[8], X)[0] for X in places) < 2e-3
    said = calibration_fit(fit).as_dict()
    assert 9 in [row["row"] for row in said["ties"]]
    assert any("another pose that fits as well" in words for words in said["remarks"])


def test_without_bad_readings_a_plane_is_found():
    poses, fit = planar_log(0.0)
    assert fit.result.outliers == fit.misfit == ()
    assert np.max(logs.errors(poses, fit.result)[:, 0]) < 2e-3


def test_residuals_beyond_three_sigmas_are_a_misfit_without_outliers_too(monkeypatch):
    monkeypatch.setattr(calibration, "turned_sensors", lambda *_: ())  # nor is one to blame
    _, fit = planar_log(0.0, sigma=2e-5, outliers=False)
    assert fit.result.spread() > 3.0
    assert fit.result.status == "misfit"
    assert fit.misfit[0].startswith("residuals are ")
    assert planar_log(0.0, outliers=False)[1].misfit == ()


def test_an_inclinometer_holds_what_lengths_leave_open():
    # Four cables, lengths alone: six coordinates of a pose are told with roll and pitch.
    robot = replace(logs.ROBOT, cables=[logs.ROBOT.cables[i] for i in (0, 3, 5, 6)])
    poses = logs.poses(6)
    log = Measurements(
        Path("tilted"), 6, lengths=numbers(calibration_model(robot), poses)[:, :, 0],
        tilts=logs.inclinations(poses), torques=np.zeros((6, 4)),
        headers={"rpy": ("roll_rad",), "motor torques": ("C1_torque_nm", "C2_torque_nm")},
    )  # fmt: skip
    fit = logs.fitted(robot, log, (), sigmas=Sigmas(tilt=1e-3, yaw=1e-3), start=poses[0])
    assert fit.result.residuals["inclination"].count == 18
    assert np.max(logs.errors(poses, fit.result)[:, 0]) < 1e-4
    assert fit.remarks[0] == (
        "not used: C1_torque_nm, C2_torque_nm: a calibration has no use of motor torques"
    )


# Lengths alone, of a point mass.

ANCHORS = np.array([[0.0, 2.07], [1.45, 2.07], [0.0, 0.0], [1.445, 0.0]])
"""Of a frame for which others are guessed [m]."""


def test_points_unfold_from_lengths_in_space():
    random = np.random.default_rng(0)
    anchors, places = random.uniform(-1, 1, (5, 3)), random.uniform(-1, 1, (20, 3))
    lengths = np.linalg.norm(places[:, None] - anchors, axis=2)
    found, there = unfolded_points(lengths, 3)
    np.testing.assert_allclose(np.linalg.norm(there[:, None] - found, axis=2), lengths, atol=1e-9)
    np.testing.assert_allclose(pdist(found), pdist(anchors), atol=1e-9)
    assert unfolded_points(lengths[:9], 3) is None
    assert unfolded_points(lengths[:, :3], 3) is None
    assert unfolded_points(np.ones((20, 5)), 3) is None


def test_lengths_alone_tell_anchors_whatever_the_size_of_the_frame(tmp_path):
    x, y = np.linspace(0.05, 1.395, 9), np.linspace(0.3, 1.77, 9)  # near anchors minima are many
    places = np.stack(np.meshgrid(x, y), axis=2).reshape(-1, 1, 2)
    noise = 1e-3 * np.random.default_rng(0).standard_normal((81, 4))
    lengths = 1e3 * (np.linalg.norm(places - ANCHORS, axis=2) + noise)
    rows = [",".join(f"{c}_length_mm" for c in ("tl", "tr", "bl", "br"))]
    (tmp_path / "log.csv").write_text("\n".join(rows + [",".join(map(str, r)) for r in lengths]))
    apart = []
    for width, height in ((1500, 2000), (300, 300), (30000, 30000)):
        corners = {"tl": (0, height), "tr": (width, height), "bl": (0, 0), "br": (width, 0)}
        lines = [f"    {c}X: {x}\n    {c}Y: {y}\n    {c}Z: 0" for c, (x, y) in corners.items()]
        robot = tmp_path / f"{width}.yaml"
        head = "Maslow_vertical: true\nkinematics:\n  MaslowKinematics:\n"
        robot.write_text(head + "\n".join(lines) + "\n")
        fit = cdpr.calibrate(str(robot), str(tmp_path / "log.csv"))
        assert fit.status == "converged"
        apart.append(pdist(fit.model.exit_points().T))
    np.testing.assert_allclose(apart[1:], [apart[0]] * 2, atol=1e-5)
    np.testing.assert_allclose(apart[0], pdist(ANCHORS), atol=0.01)


# A robot with fewer cables than degrees of freedom.

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
    cables = [logs.ROBOT.cables[i] for i in (0, 3, 5)]
    corners = [np.append(0.055 * np.sign(c.exit_point[:2]), 0.09) for c in cables]
    held = [replace(c, anchor_point=p) for c, p in zip(cables, corners, strict=True)]
    return replace(logs.ROBOT, cables=held)


@pytest.fixture(scope="module")
def resting():
    """Poses at which three cables hold a platform at rest, tensions, lengths, swivel angles."""
    robot, random = three_cables(), np.random.default_rng(0)
    model, X_WP = calibration_model(robot), RigidTransform([0.02, 0.03, 0.4])
    lengths = numbers(model, [X_WP])[0, :, 0]
    rests = [
        equilibrium_near(robot.cable_set(), "elastic", rigid_platform(robot),
                         lengths + random.uniform(-0.1, 0.1, 3), X_WP)
        for _ in range(20)
    ]  # fmt: skip
    taut = [rest for rest in rests if np.min(rest.tensions) > TAUT][:LEAST]
    assert len(taut) == LEAST
    poses = [rest.X_WP for rest in taut]
    at = numbers(model, poses)
    return poses, np.array([rest.tensions for rest in taut]), at[:, :, 0], at[:, :, 2]


def counted(values, sigma, random):
    """With noise, counted from the first row."""
    noisy = values + sigma * random.standard_normal(values.shape)
    return noisy - noisy[0]


@pytest.fixture(scope="module")
def homing(resting):
    """Lengths and swivels that count from the first row, tensions, tilts; and the poses."""
    poses, tensions, lengths, swivels = resting
    random, tilts = np.random.default_rng(1), logs.inclinations(poses)
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
    fit = cdpr.calibrate(robot, log)
    assert fit.result.status == "converged"
    assert fit.source.setup.task.sigmas == HOMING
    first = logs.errors(poses, fit.result)[0]
    assert np.all(first < 5.0 * NOISE * fit.result.pose_std[0, ::-1])
    assert fit.result.model.tilt_zero[2] == pytest.approx(YAW, abs=0.05)
    assert fit.as_dict()["tilt_zeros_rad"][:2] == [0.0, 0.0]


def test_three_cables_without_tension_sensors_find_where_they_began(resting):
    """By winches and swivel angles alone."""
    (poses, _, lengths, swivels), random = resting, np.random.default_rng(2)
    log = Measurements(
        Path("homing"), len(poses), lengths=counted(lengths, SIGMAS.lengths, random),
        swivels=counted(swivels, SIGMAS.swivels, random),
    )  # fmt: skip
    start = RigidTransform([0.1, -0.1, 0.3])
    fit = logs.fitted(three_cables(), log, ("length_offsets",), sigmas=SIGMAS, start=start)
    result = fit.result
    assert result.status == "converged"
    assert result.spread() < 2.0
    distance, angle = np.max(logs.errors(poses, result), axis=0)
    assert distance < 5.0 * np.max(result.std[:3])
    assert distance < 0.3 * pose_error(start, poses[0])[0]
    assert np.degrees(angle) < 2.0


def test_swivels_whose_sign_is_turned_are_named(homing):
    robot, log, _ = homing
    turned = replace(log, swivels=-log.swivels)
    fit = cdpr.calibrate(robot, turned, sigmas={"swivels": 3e-3}, keep_outliers=True)
    assert fit.result.status == "misfit"
    assert "swivel angles fit with the sign turned" in fit.misfit[0]
    assert int(fit.misfit[0].split()[0]) > 0.9 * log.swivels.size


UP = np.array([0.0, 0.0, 1.0])


def turned(*angles, **more):
    """A result with poses of these roll, pitch and yaw."""
    poses = [pose_from_angles(np.zeros(3), np.array(turn)) for turn in angles]
    model = calibration_model(three_cables())
    return SimpleNamespace(model=model, stations=Stations.at(poses), **more)


def test_poses_upside_down_are_distinguished_from_upright_ones():
    result = turned((0, 0, 0), (1.5, 0, 0), (np.pi, 0, 0), (0, 2.0, 0), (0, 0, 3.0))
    assert upside_down(result, UP).tolist() == [False, False, True, True, False]


def test_a_pose_without_a_reading_to_spare_is_no_reason_to_blame_a_sensor():
    robot = three_cables()
    turns = (0, 0, 0), (np.pi, 0, 0), (0, 2.0, 0), (0, 0.1, 0)
    spare = turned(*turns, surplus=np.array([9, 0, 2, 0]))
    misfit, remarks = impossible_poses(robot, spare, UP)
    assert [words.split(" in ")[1] for words in misfit] == [
        "1 of 4 rows: sign or zero of a sensor?"
    ]
    assert [words.split(":")[0] for words in remarks] == ["row 2"]
    assert impossible_poses(robot, turned((0, 0, 0), surplus=np.array([0])), UP) == ([], [])
    most = turned(*turns[1:], surplus=np.zeros(3, int))
    misfit, remarks = impossible_poses(robot, most, UP)
    assert "in 2 of 3 rows" in misfit[0]
    assert remarks == []


def test_an_upright_minimum_goes_before_one_upside_down_that_costs_less():
    upright, flipped = (
        SimpleNamespace(result=turned((0.1, 0, 0), turn), cost=cost)
        for turn, cost in (((0, 0.2, 0), 20.0), ((3.0, 0, 0), 10.0))
    )
    prepared = SimpleNamespace(first=RigidTransform())
    assert upright_minima(prepared, [flipped, upright]) == [upright]
    assert upright_minima(prepared, [flipped]) == [flipped]

"""Logs beside the model of a robot, from motions that the tests know."""

import json

import numpy as np
import pytest

from cdpr_drake.analyses.logs.replay import replay_log
from cdpr_drake.cables.elastic_law import unstrained_lengths
from cdpr_drake.errors import CdprError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from tests.analyses.logs import recorders

OFFSETS = np.array([0.02, -0.01, 0.0, 0.005])
"""Errors of lengths in the log [m]."""

TURNED = 1e-8
"""Lengths of angles with twelve digits, on a drum of constant radius [m]."""

SMALL = 2e-3
"""Lengths of the simulated robot's cables are those of the log; what it is off is their stretch,
below a millimetre each, and its swing at 60 Hz [m]."""


def written(tmp_path, offsets, shift=(0.0, 0.0, 0.0), tension=None):
    """A slow motion of gt_graffiti; the tracker's origin may be another one. With a tension, the
    lengths are without stretch."""
    cables = load_robot("gt_graffiti").cable_set()
    t = np.arange(0.0, 3.0, 0.02)
    p = np.column_stack([1.5 + 0.2 * np.sin(t) ** 2, 0.0 * t, 1.1 + 0.1 * np.sin(1.7 * t) ** 2])
    lengths = np.array([cable_paths(pose_from_angles(x, np.zeros(3)), cables).lengths for x in p])
    header, rest = [f"C{k}_length_m" for k in (1, 2, 3, 4)], []
    if tension is not None:
        lengths = unstrained_lengths(lengths, np.full(4, tension), cables.stiffness)
        rest, header = (
            [np.full((len(t), 4), tension)],
            [*header, *(f"C{k}_tension_n" for k in "1234")],
        )
    table = np.column_stack([t, lengths + offsets, *rest, p - np.array(shift)])
    path, header = tmp_path / "log.csv", ",".join(["time_s", *header, "x_m", "y_m", "z_m"])
    np.savetxt(path, table, delimiter=",", header=header, comments="", fmt="%.9f")
    return path


@pytest.mark.parametrize("tension", [None, 60.0])
def test_residuals_by_cable_are_the_errors_of_lengths(tension, tmp_path):
    replay = replay_log(written(tmp_path, OFFSETS, tension=tension), robot="gt_graffiti")
    cables = replay.as_dict()["cables"]
    offsets = [cables[f"C{k}"]["length_offset_m"] for k in (1, 2, 3, 4)]
    np.testing.assert_allclose(offsets, OFFSETS, atol=1e-8)
    assert all(cables[name]["length_residual_rms_m"] < 1e-8 for name in cables)


def test_a_model_that_is_right_has_the_measured_poses(tmp_path):
    found = replay_log(written(tmp_path, 0.0 * OFFSETS), robot="gt_graffiti")
    assert found.as_dict()["position_by_lengths_largest_m"] < 1e-7


def test_the_frame_of_a_tracker_is_fitted_when_asked(tmp_path):
    path = written(tmp_path, 0.0 * OFFSETS, shift=(0.3, 0.1, -0.2))
    assert replay_log(path, robot="gt_graffiti").as_dict()["position_by_lengths_rms_m"] > 0.3
    found = replay_log(path, robot="gt_graffiti", fit_frame=True)
    assert found.as_dict()["position_by_lengths_rms_m"] < 1e-6
    np.testing.assert_allclose(found.frame.translation(), [0.3, 0.1, -0.2], atol=1e-6)


def test_the_simulated_robot_follows_and_results_are_written(tmp_path):
    path = written(tmp_path, OFFSETS)
    found = replay_log(path, robot="gt_graffiti", drive=True, out=tmp_path / "out")
    assert found.as_dict()["followed"]["position_error_largest_m"] < SMALL
    names = {entry.name for entry in (tmp_path / "out").iterdir()}
    assert {"summary.json", "replay.csv", "replay.html", "residuals.png"} <= names
    told = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert told["followed"] == found.as_dict()["followed"]


def test_motor_angles_and_positions_in_a_plane_are_taken_as_calibrate_takes_them(tmp_path):
    """Both were ignored: no residual, no row with a pose, and no word about it."""
    whole = replay_log(written(tmp_path, 0.0 * OFFSETS), robot="gt_graffiti")
    robot = load_robot("gt_graffiti")
    angles = whole.lengths / robot.drum().length_per_angle(np.zeros(4))
    table = np.column_stack([whole.time, angles, whole.poses[:, [4, 6]]])
    header = "time_s," + ",".join(f"C{k}_motor_angle_rad" for k in (1, 2, 3, 4)) + ",x_m,z_m"
    path = tmp_path / "angles.csv"
    np.savetxt(path, table, delimiter=",", header=header, comments="", fmt="%.12g")
    found = replay_log(path, robot="gt_graffiti")
    assert found.as_dict()["rows_with_pose"] == len(table)
    np.testing.assert_allclose(found.lengths, whole.lengths, atol=TURNED)
    assert found.as_dict()["cables"]["C1"]["length_residual_largest_m"] < TURNED
    np.testing.assert_allclose(found.poses[:, 5], robot.home.position[1])


def test_a_log_with_nothing_to_compare_is_refused(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("time_s,C1_length_m\n0,1\n1,1\n")
    with pytest.raises(CdprError, match="accepted for gt_graffiti: poses, or lengths"):
        replay_log(path, robot="gt_graffiti")


def test_a_topic_of_a_bag_is_replayed(tmp_path):
    """Topics that are not named are another matter, and what a log does not use is said."""
    recorders.rosbag(tmp_path / "run", "SQLITE3")
    robot = load_robot("acrobot_small")
    told = {"robot": robot, "topic": ["/tracker/pose"], "rate": 5.0}
    replay = replay_log(tmp_path / "run", **told)
    assert replay.as_dict()["rows_with_pose"] == len(replay.poses) == 50
    assert any("not used: a rate of 5" in remark for remark in replay.remarks)
    assert dict(replay.log.ledger[["header", "fate"]].to_numpy())["/winches"] == "another topic"


def test_tensions_that_carry_the_weight_are_predicted_where_the_weight_determines_them(tmp_path):
    robot = load_robot("nist_robocrane")
    x, y, z = robot.home.position
    qw, qx, qy, qz = robot.home.transform().rotation().ToQuaternion().wxyz()
    names = ",".join(f"{cable.name}_tension_n" for cable in robot.cables)
    path = tmp_path / "log.csv"
    path.write_text(
        f"x_m,y_m,z_m,qw,qx,qy,qz,{names}\n{x},{y},{z},{qw},{qx},{qy},{qz},{'0,' * 5}0\n"
    )
    replay = replay_log(path, robot=robot)
    up = replay.unbalanced[0, 3:] @ robot.gravity_vector()  # without tensions all of the weight
    assert up == pytest.approx(
        robot.platform.mass * robot.gravity_vector() @ robot.gravity_vector()
    )
    assert np.all(replay.predicted_tensions > 0.0)

"""Logs beside the model of a robot, from motions that the tests know."""

import json

import numpy as np
import pytest

from cdpr_drake.analyses.logs.replay import replay_log
from cdpr_drake.errors import CdprError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot

OFFSETS = np.array([0.02, -0.01, 0.0, 0.005])
"""Errors of lengths in the log [m]."""

SMALL = 2e-3
"""Lengths of the simulated robot's cables are those of the log; what it is off is their stretch,
below a millimetre each, and its swing at 60 Hz [m]."""


def written(tmp_path, offsets, shift=(0.0, 0.0, 0.0), tensions=False):
    """A slow motion of gt_graffiti; the tracker's origin may be another one."""
    robot = load_robot("gt_graffiti")
    t = np.arange(0.0, 3.0, 0.02)
    p = np.column_stack([1.5 + 0.2 * np.sin(t) ** 2, 0.0 * t, 1.1 + 0.1 * np.sin(1.7 * t) ** 2])
    lengths = np.array(
        [cable_paths(pose_from_angles(x, np.zeros(3)), robot.cable_set()).lengths for x in p]
    )
    table = np.column_stack([t, lengths + offsets, p - np.array(shift)])
    header = "time_s," + ",".join(f"C{k}_length_m" for k in (1, 2, 3, 4)) + ",x_m,y_m,z_m"
    path = tmp_path / "log.csv"
    np.savetxt(path, table, delimiter=",", header=header, comments="", fmt="%.9f")
    return path


def test_residuals_by_cable_are_the_errors_of_lengths(tmp_path):
    found = replay_log(written(tmp_path, OFFSETS), robot="gt_graffiti")
    told = found.as_dict()["cables"]
    offsets = [told[f"C{k}"]["length_offset_m"] for k in (1, 2, 3, 4)]
    np.testing.assert_allclose(offsets, OFFSETS, atol=1e-8)
    assert all(told[name]["length_residual_rms_m"] < 1e-8 for name in told)


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


def test_a_log_with_nothing_to_compare_is_refused(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("time_s,C1_length_m\n0,1\n1,1\n")
    with pytest.raises(CdprError, match="accepted for gt_graffiti: poses, or lengths"):
        replay_log(path, robot="gt_graffiti")

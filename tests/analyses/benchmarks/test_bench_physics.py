"""The rows of `cdpr bench physics`: what they time is what they say; no times are asserted."""

import numpy as np
import pytest
from scipy.optimize import leastsq

from cdpr_drake.analyses.benchmarks.statics import _starts, length_residuals, physics_rows
from cdpr_drake.geometry.poses import pose_error, pose_from_row, pose_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.statics.forward_kinematics import ForwardKinematics
from tests.analyses.benchmarks.once import without_repeats


def test_scipy_finds_the_same_pose_from_the_same_residual():
    cables = load_robot("acrobot_large").cable_set()
    fk = ForwardKinematics(cables)
    for lengths, guess in _starts(cables, 5):
        found = pose_from_row(leastsq(length_residuals, guess, args=(cables.packed(), lengths))[0])
        ours = fk.pose(lengths, pose_from_row(guess)).X_WP
        assert pose_error(found, ours) < (1e-6, 1e-6)
        residuals = length_residuals(pose_row(ours), cables.packed(), lengths)
        np.testing.assert_allclose(residuals, 0.0, atol=1e-9)


def test_rows(monkeypatch):
    without_repeats(monkeypatch)
    rows = physics_rows(quick=True)
    assert len({(row.name, row.baseline) for row in rows}) == len(rows) == 19
    for row in rows:
        assert row.value > 0.0
        assert row.ratio > 0.0
        assert np.isfinite(row.ratio)
        assert row.as_dict()["ratio_means"]
        expected = row.baseline_value / row.value
        if row.ratio_means == "times as long":
            expected = 1.0 / expected
        assert row.ratio == pytest.approx(expected)

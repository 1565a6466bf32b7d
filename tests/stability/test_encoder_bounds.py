"""Errors of a camera's joints among the bounds of stability."""

import math

import numpy as np
import pytest

from cdpr_drake.analyses.workspaces.stability_defaults import load_bounds
from cdpr_drake.analyses.workspaces.stability_question import varied
from cdpr_drake.servoing.turned_view import encoder_turn
from cdpr_drake.stability.perturbation_bounds import BASELINE, RADII, PerturbationBounds

TURN = RADII.index("d_theta_pc")


def test_joints_add_to_the_camera_and_to_nothing_else():
    joints = BASELINE.varied(d_theta_joints=0.02)
    change = joints.radii() - BASELINE.radii()
    assert change[TURN] == pytest.approx(0.02)
    assert np.count_nonzero(change) == 1
    assert joints.scaled(0.5).d_theta_joints == 0.01
    assert PerturbationBounds(d_theta_pc=3.0, d_theta_joints=1.0).radii()[TURN] == math.pi


def test_without_joints_nothing_is_said_of_them():
    assert "d_theta_joints" not in BASELINE.as_dict()
    assert BASELINE.varied(d_theta_joints=0.1).as_dict()["d_theta_joints"] == 0.1


def test_a_file_of_bounds_has_encoders(tmp_path):
    path = tmp_path / "bounds.yaml"
    path.write_text("d_theta_pc_deg: 1.0\nencoders_deg: [0.3, 0.4]\n")
    bounds = load_bounds(path)
    assert bounds.d_theta_joints == encoder_turn(math.radians(0.3), math.radians(0.4))
    assert math.degrees(bounds.d_theta_joints) == pytest.approx(0.5, rel=1e-4)


def test_they_are_varied_in_degrees_as_other_angles():
    assert varied(BASELINE, "d_theta_joints_deg", 2.0).d_theta_joints == math.radians(2.0)

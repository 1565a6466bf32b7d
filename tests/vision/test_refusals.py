"""Cameras, lenses and boards that make no sense are refused in one line that names them."""

from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.errors import CameraCalibrationError, CdprError, LensDistortionError
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.vision.cable_detection import find_sags
from cdpr_drake.vision.calibration_boards import CalibrationBoard
from cdpr_drake.vision.camera_fit import fit_camera
from cdpr_drake.vision.lens_distortion import LensDistortion
from cdpr_drake.vision.lens_picture import lens_map
from tests.vision.test_camera_fit import SIZE, flat, projected
from tests.vision.test_lenses import SMALL, through

CALIBRATION = CameraCalibrationError


def fit(count=20, poses=None, **options):
    return fit_camera(projected("none", count, poses=poses), SIZE, **options)


def sags(covariance):
    X = pose_from_angles(np.array([0.1, 0.02, 0.3]), np.zeros(3))
    cables, image = load_robot("acrobot_small").cable_set(), np.zeros((120, 160), np.uint8)
    return find_sags(image, cables, X, X, SMALL, pose_covariance=covariance)


REFUSALS = {
    "few images": (lambda: fit(3), CALIBRATION, "found the board in 3; accepted: at least 5"),
    "model": (lambda: fit(model="plumb"), CALIBRATION, "model: found 'plumb'"),
    "share": (lambda: fit(hold_out=0.9), CALIBRATION, "hold_out: found 0.9"),
    "parallel": (lambda: fit(poses=flat(), model="none"), CALIBRATION, "deg of parallel"),
    **{
        f"board {words}": (lambda a=arguments: CalibrationBoard(*a), CALIBRATION, words)
        for arguments, words in (
            (("circles", 9, 7, 0.03), "board: found 'circles'"),
            (("charuco", 2, 7, 0.03), "squares: found 2x7"),
            (("charuco", 9, 7, 0.0), r"size: found 0 \[m\]"),
            (("charuco", 9, 7, 0.03, 0.04), "marker: found 0.04"),
            (("chessboard", 9, 7, 0.03, 0.02), "found markers on a chessboard"),
            (("tags", 4, 3, 0.03, None, "7X7_9"), "markers: found '7X7_9'"),
        )
    },
    **{
        f"lens {words}": (lambda a=arguments: LensDistortion(*a), LensDistortionError, words)
        for arguments, words in (
            (("barrel", (0.1,)), "accepted: brown_conrady, fisheye"),
            (("fisheye", (0.1,) * 5), "up to 4 finite numbers"),
            (("brown_conrady", (np.nan,)), "up to 8 finite numbers"),
        )
    },
    "widest field": (
        lambda: lens_map(replace(through("fisheye", ()), fx=65.5, fy=65.5, cx=79.5, cy=59.5)),
        LensDistortionError, r"at least 0\.25, or a",
    ),
    "folded field": (
        lambda: lens_map(through("brown_conrady", (-0.9,))), LensDistortionError,
        "beyond what it is valid for",
    ),
    "covariance": (lambda: sags(-np.eye(6)), CdprError, "pose_covariance: found shape"),
}  # fmt: skip


@pytest.mark.parametrize(("call", "error", "message"), REFUSALS.values(), ids=REFUSALS)
def test_refusal(call, error, message):
    with pytest.raises(error, match=message) as caught:
        call()
    assert len(str(caught.value).splitlines()) == 1

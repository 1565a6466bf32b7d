"""Lenses, cameras and poses of targets that the tests of this room share."""

import cv2
import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.geometry.poses import rotation_from_vector
from cdpr_drake.vision.lens_distortion import LensDistortion

FLIP = RotationMatrix(np.diag([1.0, -1.0, -1.0]))  # a target that faces the camera, upright

LENSES = {
    "barrel": LensDistortion("brown_conrady", (-0.31, 0.11, 1e-3, -7e-4, -0.02)),
    "pincushion": LensDistortion("brown_conrady", (0.12, 0.02, -5e-4, 1e-3)),
    "rational": LensDistortion("brown_conrady", (1.2, 0.4, 2e-4, -3e-4, 0.02, 1.6, 0.6, 0.05)),
    "fisheye": LensDistortion("fisheye", (-0.02, 0.006, -0.002, 2e-4)),
    "equidistant": LensDistortion("fisheye", ()),
}


def facing(tilt, p_CO):
    """A target's pose that faces the camera but for a turn by a rotation vector [rad]."""
    return RigidTransform(FLIP @ rotation_from_vector(np.array(tilt, float)), np.array(p_CO, float))


def coefficients_of(lens):
    """Coefficients as OpenCV wants them."""
    D = np.zeros(4 if lens.kind == "fisheye" else 8)
    D[: len(lens.coefficients)] = lens.coefficients
    return D


def by_opencv(lens, xy, K):
    """Pixels of OpenCV of points at unit focal length, shape (2, n)."""
    points, zero = np.vstack([xy, np.ones(xy.shape[1])]).T.reshape(-1, 1, 3), np.zeros(3)
    project = cv2.fisheye.projectPoints if lens.kind == "fisheye" else cv2.projectPoints
    return project(points, zero, zero, K, coefficients_of(lens))[0].reshape(-1, 2).T


def directions_by_opencv(lens, uv, K):
    """Points at unit focal length of pixels, shape (2, n), by OpenCV's own iterations."""
    undistort = cv2.fisheye.undistortPoints if lens.kind == "fisheye" else cv2.undistortPoints
    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 200, 1e-12)
    xy = undistort(uv.T.reshape(-1, 1, 2), K, coefficients_of(lens), criteria=criteria)
    return xy.reshape(-1, 2).T

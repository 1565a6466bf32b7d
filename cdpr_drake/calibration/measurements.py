"""What a known robot would measure at poses, with noise: for studies, tests and design of poses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.calibration.parameters import CalibrationModel
from cdpr_drake.calibration.station_kernel import LENGTH, SWIVEL_ANGLE
from cdpr_drake.calibration.stations import Point, Stations
from cdpr_drake.geometry.poses import rotation_from_vector
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import PointTarget


def simulated_lengths(
    model: CalibrationModel,
    poses: Sequence[RigidTransform],
    start: Array,
    sigma: float | Array,
    random: np.random.Generator,
) -> Array:
    """Readings of winches at poses X_WP, shape (k, m) [m].

    Args:
        model: The true robot.
        poses: Where the platform is [m].
        start: Readings where counting began, shape (m,) [m].
        sigma: Standard deviation of a reading, or one for each [m].
        random: Where noise comes from.
    """
    lengths = Point(model, Stations.at(poses)).numbers[:, :, LENGTH]
    offset = model.length_offset + model.common_length_offset
    counted = (start + (lengths - start - offset) / model.length_scale) / model.common_length_scale
    return np.asarray(counted + sigma * random.standard_normal(counted.shape))


def simulated_swivels(
    model: CalibrationModel,
    poses: Sequence[RigidTransform],
    sigma: float,
    random: np.random.Generator,
) -> Array:
    """Swivel angles that pulleys measure, shape (k, m) [rad]; arguments as before."""
    angles = Point(model, Stations.at(poses)).numbers[:, :, SWIVEL_ANGLE] - model.swivel_offset
    return np.asarray(angles + sigma * random.standard_normal(angles.shape))


def simulated_poses(
    poses: Sequence[RigidTransform],
    sigma_turn: float,
    sigma_place: float,
    random: np.random.Generator,
    model: CalibrationModel | None = None,
) -> list[RigidTransform]:
    """Poses that a tracker measures, off by angles [rad] and places [m] along each axis.

    X_KM at poses X_WP, by a model that says what the tracker's frame and marker are; else X_WP.
    """
    if model is not None:
        X_KW = model.X_WK.inverse()
        poses = [X_KW @ X_WP @ model.X_PM for X_WP in poses]
    return [
        RigidTransform(
            rotation_from_vector(sigma_turn * random.standard_normal(3)) @ X.rotation(),
            X.translation() + sigma_place * random.standard_normal(3),
        )
        for X in poses
    ]


def simulated_corners(
    model: CalibrationModel,
    poses: Sequence[RigidTransform],
    targets: dict[int, PointTarget],
    pinhole: Pinhole,
    sigma: float,
    random: np.random.Generator,
) -> Array:
    """Images of corners of tags at poses X_WP, shape (k, tags, 4, 2) [px].

    NaN where a tag is not in the image as a whole, or not turned to the camera.
    """
    uv = np.full((len(poses), len(targets), 4, 2), np.nan)
    for k, X_WP in enumerate(poses):
        X_CW = (X_WP @ model.X_PC).inverse()
        for t, (tag, target) in enumerate(targets.items()):
            marks = target.project(X_CW @ model.tags[tag], pinhole, sigma, random)
            if marks is not None:
                uv[k, t] = marks.reshape(4, 2)
    return uv

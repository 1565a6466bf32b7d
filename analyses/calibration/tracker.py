"""A tracker with a clock of its own, or whose frame or marker's place nobody measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.analyses.calibration.calibration_request import Prepared, unknown_frames
from cdpr_drake.analyses.calibration.log_fit import refuse_late_tracker
from cdpr_drake.analyses.logs.measurements import on_motion
from cdpr_drake.calibration.guesses import guessed_tracker
from cdpr_drake.calibration.stations import Point, Stations
from cdpr_drake.errors import CalibrationError
from cdpr_drake.numerics.time_shift import tracker_shift


def with_tracker(prepared: Prepared, poses: Sequence[RigidTransform]) -> Prepared:
    """With guesses of the tracker's frame and marker, and the poses that it tells by them.

    Args:
        prepared: A log with tracked poses.
        poses: Where winches say that the platform was, X_WP [m].

    Raises:
        CalibrationError: No pose was tracked.
    """
    tracked = prepared.log.poses
    assert tracked is not None
    model = guessed_tracker(prepared.model, poses, tracked, unknown_frames(prepared))
    X_MP = model.X_PM.inverse()
    told = [None if X is None else model.X_WK @ X @ X_MP for X in tracked]
    return replace(prepared, model=model, tracked=told)


def with_turned_tracker(prepared: Prepared, poses: Sequence[RigidTransform]) -> Prepared:
    """As `with_tracker`, for a tracker of positions of a point mass whose frame is turned.

    Raises:
        CalibrationError: Fewer than three positions were told.

    Source: Kabsch, A solution for the best rotation to relate two sets of vectors, 1976.
    """
    points = prepared.points
    assert points is not None
    seen = np.asarray(np.isfinite(points).all(axis=1))
    if np.sum(seen) < 3:
        raise CalibrationError(
            f"{prepared.log.path}: tracked positions: found {np.sum(seen)}; accepted: at least 3, "
            "where nothing is known of how the tracker's frame is turned"
        )
    there = np.array([X.translation() for X in poses])[seen]
    here = points[seen]
    U, _, Vt = np.linalg.svd((there - there.mean(axis=0)).T @ (here - here.mean(axis=0)))
    R = U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt
    place = there.mean(axis=0) - R @ here.mean(axis=0)
    X_WK = RigidTransform(RotationMatrix.ProjectToRotationMatrix(R), place)
    told = [
        on_motion(prepared.task.robot, RigidTransform(X.rotation(), X_WK @ p)) if known else None
        for X, p, known in zip(poses, points, seen, strict=True)
    ]
    return replace(prepared, model=replace(prepared.model, X_WK=X_WK), tracked=told)


def check_clock(prepared: Prepared) -> None:
    """Refuses a tracker that is out of sync with the winches.

    Raises:
        CalibrationError: It is; says by how much.
    """
    log, poses = prepared.log, prepared.tracked
    if poses is None or log.time is None or prepared.lengths is None:
        return
    if "clock" in prepared.unknown:
        return  # it is found with all else
    tracked = np.full(prepared.lengths.shape, np.nan)
    seen = [k for k, X in enumerate(poses) if X is not None]
    at = Point(prepared.model, Stations.at([X for X in poses if X is not None]))
    tracked[seen] = at.numbers[:, :, 0]
    found = tracker_shift(log.time, prepared.lengths, tracked)
    step = float(np.median(np.diff(log.time)))
    refuse_late_tracker(log, "cable lengths", found, step, CalibrationError)

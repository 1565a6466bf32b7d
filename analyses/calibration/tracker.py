"""A tracker with a clock of its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.calibration.log_file import CalibrationLog
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CalibrationError


def shifted_log(log: CalibrationLog, late: float) -> CalibrationLog:
    """A log whose tracker was late by a time [s]: poses in between are interpolated, the ends left.

    Raises:
        CalibrationError: It has no times or no poses.
    """
    if log.time is not None and log.points is not None:
        return replace(log, points=_shifted_points(log.time, log.points, late))
    if log.time is None or log.poses is None:
        raise CalibrationError(
            f"{log.path}: found no {'time' if log.time is None else 'poses'} to shift a tracker by"
        )
    seen = [k for k, X in enumerate(log.poses) if X is not None]
    times, known = log.time[seen], [X for X in log.poses if X is not None]
    moved: list[RigidTransform | None] = []
    for t in log.time + late:
        k = int(np.searchsorted(times, t)) - 1
        if not 0 <= k < len(times) - 1:
            moved.append(None)
            continue
        share = (t - times[k]) / (times[k + 1] - times[k])
        X, Y = known[k], known[k + 1]
        turn = X.rotation().inverse() @ Y.rotation()
        angle_axis = turn.ToAngleAxis()
        angle_axis.set_angle(share * angle_axis.angle())
        R = X.rotation().matrix() @ angle_axis.rotation()
        p = X.translation() + share * (Y.translation() - X.translation())
        moved.append(RigidTransform(type(X.rotation()).ProjectToRotationMatrix(R), p))
    return replace(log, poses=moved)


def _shifted_points(time: Array, points: Array, late: float) -> Array:
    """Positions of a tracker that was late, shape (k, 3) [m]; NaN at the ends."""
    seen = np.isfinite(points).all(axis=1)
    moved = np.full(points.shape, np.nan)
    inside = (time + late >= time[seen][0]) & (time + late <= time[seen][-1])
    for axis in range(3):
        moved[inside, axis] = np.interp(time[inside] + late, time[seen], points[seen, axis])
    return moved

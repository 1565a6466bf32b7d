"""A tracker whose frame, or whose marker's place on the platform, nobody measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from pydrake.math import RigidTransform

from cdpr_drake.analyses.calibration.asked import Prepared, unknown_frames
from cdpr_drake.calibration import guessed_tracker


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

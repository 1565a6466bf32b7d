"""What figures and tables draw of a run: paths, errors, deviations, jumps of the estimate."""

from __future__ import annotations

import numpy as np

from cdpr_drake.analyses.simulation.run_summary import (
    THESIS_WIDTH,
    camera_ends,
    camera_path,
    image_path,
)
from cdpr_drake.analyses.simulation.visual_servo_run import RunResult
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.pose_accuracy import distances_from_line
from cdpr_drake.geometry.poses import pose_rows_distance
from cdpr_drake.vision.target import PointTarget

CORNERS = 4
"""Points of an object whose paths in the image are kept."""


def estimate_jump(traces: dict[str, Array]) -> float:
    """Largest change of the estimate's error vector between two rows of the log [m]."""
    error = traces["estimate_path"] - traces["platform_path"]
    if len(error) < 2:
        return 0.0
    return float(np.max(np.linalg.norm(np.diff(error, axis=0), axis=1)))


def run_traces(result: RunResult) -> dict[str, Array]:
    """Arrays of a run that the figures of case studies draw.

    Returns:
        time (n,) [s]; image_time (k,) [s], image_path (k, 2) and image_line (2, 2) [px of an image
        1600 px wide], image_deviation (k,) the same; image_size (2,) [px]; camera_path (n, 3) and
        camera_line (2, 3) in W [m], camera_deviation (n,) [m]; camera_ends (2, 7), its last
        pose and the desired one as rows; platform_path (n, 3) [m]; estimate_distance (n,) [m],
        estimate_angle (n,) [rad]; error (n, e), NaN where the object is not seen; cable_velocities
        (n, m) [m/s]; tensions (n, m) [N]; of an object with four points, corner_paths (k, 4, 2) and
        corner_goals (4, 2), where they are and should be in the image [px as above].
    """
    log, pinhole = result.log, result.servo.pinhole
    scale = THESIS_WIDTH / pinhole.width
    image_time, path, line = image_path(result)
    track, camera_line = camera_path(result)
    distance, angle = pose_rows_distance(log["X_WP"], log["X_WP_estimated"])
    return {
        "time": log["time"],
        "image_time": image_time,
        "image_path": scale * path,
        "image_line": scale * line,
        "image_deviation": scale * distances_from_line(path, *line),
        "image_size": scale * np.array([pinhole.width, pinhole.height], float),
        "camera_path": track,
        "camera_line": camera_line,
        "camera_deviation": distances_from_line(track, *camera_line),
        "camera_ends": camera_ends(result),
        "platform_path": log["X_WP"][:, 4:],
        "estimate_path": log["X_WP_estimated"][:, 4:],
        "estimate_distance": distance,
        "estimate_angle": angle,
        "error": np.where(log["gain"] > 0.0, log["error"], np.nan),
        "cable_velocities": log["cable_velocities"],
        "tensions": log["tensions"],
        **_corner_traces(result, scale),
    }


def _corner_traces(result: RunResult, scale: float) -> dict[str, Array]:
    """Paths of four points in the image; nothing of objects that have not four."""
    log, target = result.log, result.servo.target
    if target.size != 2 * CORNERS or not isinstance(target, PointTarget):
        return {}
    seen = log[f"{target.mark}_px"][log["found"][:, 0] > 0.0]
    goals = result.servo.pinhole.ideal.project(result.servo.X_CdO @ target.points).T
    return {
        "corner_paths": (scale * seen).reshape(-1, CORNERS, 2).astype(np.float32),
        "corner_goals": scale * goals,
    }

"""What the joints of a servo's camera did in a run: numbers and a figure."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.frame.figures import draw_curve, new_figure
from cdpr_drake.analyses.runs.run import Run, Subject
from cdpr_drake.arrays import Array
from cdpr_drake.palette import nth_look
from cdpr_drake.sections.pan_tilt.section import ENCODERS, FOUND, IMAGE, JOINTS
from cdpr_drake.sections.perception.report import draw_joints


def _in_view(run: Run) -> np.ndarray:
    return np.asarray(run.log[FOUND])[:, 0] > 0.0


def off_center(run: Run) -> Array:
    """Distance of the mean of the target's points from the principal point, shape (n,) [px]; NaN
    while the target is not seen."""
    marks, pinhole = np.asarray(run.log[IMAGE]), run.built.pinhole
    middle = marks.reshape(len(marks), -1, 2).mean(axis=1)
    distance = np.linalg.norm(middle - [pinhole.cx, pinhole.cy], axis=1)
    return np.where(_in_view(run), distance, np.nan)


def pan_tilt_numbers(run: Run) -> dict[str, Any]:
    """Sight of the target, angles, limits and encoders of the joints of a camera."""
    log, settings, distance = run.log, run.scenario.camera.pan_tilt, off_center(run)
    times, joints, in_view = np.asarray(log["time"]), np.asarray(log[JOINTS]), _in_view(run)
    first = int(np.argmax(in_view)) if np.any(in_view) else None
    lower, upper = np.radians(settings.lower_deg), np.radians(settings.upper_deg)
    # Readings are whole counts: a count beside a limit is on it.
    near = 2.0 * np.pi / settings.counts_per_turn
    limited = np.any((joints <= lower + near) | (joints >= upper - near), axis=1)
    errors = np.asarray(log[ENCODERS]) - joints
    gaps = np.diff(times) * ~in_view[:-1]
    return {
        "first_seen_s": None if first is None else float(times[first]),
        "unseen_after_s": None if first is None else float(np.sum(gaps[first:])),
        "off_center_px": {
            "median": None if first is None else float(np.nanmedian(distance)),
            "end": float(distance[-1]) if in_view[-1] else None,
        },
        "largest_angles_deg": np.degrees(np.max(np.abs(joints), axis=0)).tolist(),
        "at_limits_s": float(np.sum(np.diff(times) * limited[:-1])),
        "encoder_error_deg": np.degrees(np.sqrt(np.mean(errors**2, axis=0))).tolist(),
    }


def camera_joints_figure(run: Run) -> Figure:
    """Angles of a camera's joints, errors of their encoders, and the target in the image."""
    log, pinhole = run.log, run.built.pinhole
    title = run.title("Joints of the camera, and where the target is in its image")
    figure, axes = new_figure(3, 1, (10.0, 9.0), title)
    draw_joints(axes, log["time"], np.asarray(log[JOINTS]), np.asarray(log[ENCODERS]))
    draw_curve(axes[2], log["time"], off_center(run), nth_look(2), "target's middle")
    rim = 0.5 * min(pinhole.width, pinhole.height)
    axes[2].axhline(rim, color="0.4", linestyle="--", label="nearest rim of the image")
    axes[2].set(xlabel="time [s]", ylabel="off the image's middle [px]")
    for panel in axes:
        panel.set(xlim=axes[0].get_xlim())
        panel.legend(loc="best")
    return figure


SUBJECTS = (Subject("pan_tilt", pan_tilt_numbers, {"camera_joints": camera_joints_figure}),)
"""What a run reports of the section."""

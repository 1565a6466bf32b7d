"""What the joints of a turning camera did in a run: numbers and a figure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.frame.figures import curves, draw_curve, new_figure
from cdpr_drake.arrays import Array
from cdpr_drake.palette import nth_look
from cdpr_drake.systems.cameras.pan_tilt_settings import CameraPanTilt
from cdpr_drake.systems.diagrams.pan_tilt import (
    LOGGED_ENCODERS,
    LOGGED_FOUND,
    LOGGED_IMAGE,
    LOGGED_JOINTS,
)
from cdpr_drake.vision.pinhole import Pinhole

Log = Mapping[str, Array]


def off_center(log: Log, pinhole: Pinhole) -> Array:
    """How far the mean of the target's points is from the principal point, shape (n,) [px]; NaN
    where it is not seen."""
    marks = np.asarray(log[LOGGED_IMAGE])
    middle = marks.reshape(len(marks), -1, 2).mean(axis=1)
    off = np.linalg.norm(middle - [pinhole.cx, pinhole.cy], axis=1)
    return np.where(np.asarray(log[LOGGED_FOUND])[:, 0] > 0.0, off, np.nan)


def pan_tilt_summary(log: Log, settings: CameraPanTilt, pinhole: Pinhole) -> dict[str, Any]:
    """Numbers of a run; keys as the guide on cameras lists them."""
    times, joints = np.asarray(log["time"]), np.asarray(log[LOGGED_JOINTS])
    found = np.asarray(log[LOGGED_FOUND])[:, 0] > 0.0
    off = off_center(log, pinhole)
    seen = np.flatnonzero(found)
    first = int(seen[0]) if len(seen) else None
    gaps = np.diff(times) * ~found[:-1]
    lower, upper = np.radians(settings.lower_deg), np.radians(settings.upper_deg)
    # Readings are whole counts: one count beside a limit is on it.
    near = 2.0 * np.pi / settings.counts_per_turn
    limited = np.any((joints <= lower + near) | (joints >= upper - near), axis=1)
    return {
        "first_seen_s": None if first is None else float(times[first]),
        "unseen_after_s": None if first is None else float(np.sum(gaps[first:])),
        "off_center_px": {
            "median": None if first is None else float(np.nanmedian(off)),
            "end": None if first is None or not found[-1] else float(off[-1]),
        },
        "largest_angles_deg": np.degrees(np.max(np.abs(joints), axis=0)).tolist(),
        "at_limits_s": float(np.sum(np.diff(times) * limited[:-1])),
        "encoder_error_deg": np.degrees(
            np.sqrt(np.mean((np.asarray(log[LOGGED_ENCODERS]) - joints) ** 2, axis=0))
        ).tolist(),
    }


def camera_joints_figure(title: str, log: Log, pinhole: Pinhole) -> Figure:
    """Angles of the joints, what the encoders read beyond them, and where the target is."""
    figure, axes = new_figure(3, 1, (10.0, 9.0), title)
    true, read = np.asarray(log[LOGGED_JOINTS]), np.asarray(log[LOGGED_ENCODERS])
    for each, values in ((axes[0], true), (axes[1], read - true)):
        curves(each, log["time"], values, ("pan", "tilt"), scale=180.0 / np.pi)
    draw_curve(axes[2], log["time"], off_center(log, pinhole), nth_look(2), "target's middle")
    rim = 0.5 * min(pinhole.width, pinhole.height)
    axes[2].axhline(rim, color="0.4", linestyle="--", label="nearest rim of the image")
    labels = ("angle [deg]", "encoder - angle [deg]", "off the image's middle [px]")
    for each, label in zip(axes, labels, strict=True):
        each.set(xlabel="time [s]", ylabel=label, xlim=axes[0].get_xlim())
        each.legend(loc="best")
    return figure

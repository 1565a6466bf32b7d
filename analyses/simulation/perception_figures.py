"""Figures of what looks at the world and at motion: scans, depth, inertial readings, odometry."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.frame.figures import (
    curves,
    draw_curve,
    line_style,
    new_figure,
    plane,
    spread,
)
from cdpr_drake.analyses.frame.thinning import path_rows
from cdpr_drake.analyses.reporting.log_on_disk import Log
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_row, pose_rows_distance
from cdpr_drake.palette import DISTANCE, ESTIMATED, TARGET, nth_look
from cdpr_drake.systems.sensors.sensor_settings import SensorSuite
from cdpr_drake.trajectories.pose_trajectory import MovingPose

MOST_ROWS = 600
"""Rows of a log that a picture of scans or of depth over time shows."""

INSTANT = 1e-3
"""Width of a picture of one row [s]."""

ROOM = 0.2
"""Round panels, so that a scale of colours is not read with the panel beside it [inch]."""


def looking_figures(
    title: Callable[[str], str],
    suite: SensorSuite,
    log: Log,
    motion: MovingPose,
    depth_image: Array | None,
) -> dict[str, Callable[[], Figure]]:
    """What draws the figures of the sensors that look round, by the names of their files.

    Args:
        title: Makes a title of words on what is shown.
        suite: The sensors.
        log: What the run logged.
        motion: How the target moves.
        depth_image: The last image of the depth camera, shape (h, w) [m]; None: there is none.
    """
    drawn: dict[str, Callable[[], Figure]] = {}
    for sensor in suite.range_sensors:
        model, name = sensor.model(), f"scan_{sensor.name}"
        angles = np.linspace(model.first_angle_deg, model.last_angle_deg, model.beams)
        words = title(f"What range sensor {sensor.name} reads")
        drawn[name] = partial(scan_figure, words, log, name, angles)
    if suite.imu is not None:
        drawn["imu"] = partial(imu_figure, title("What the inertial sensor reads"), log)
    if suite.depth is not None:
        drawn["depth"] = partial(depth_figure, title("Depth camera"), log, depth_image)
    if suite.pan_tilt is not None:
        drawn["pan_tilt"] = partial(pan_tilt_figure, title("Joints of the pan-tilt head"), log)
    if suite.odometry is not None:
        words = title("Odometry of the mobile robot")
        drawn["odometry"] = partial(odometry_figure, words, log, motion, suite.odometry.rate)
    return drawn


def _shown(log: Log) -> Array:
    """Rows of the log that a picture over time shows."""
    count = len(log["time"])
    return np.unique(np.linspace(0, count - 1, min(count, MOST_ROWS)).round().astype(int))


def _over_time(axes: Any, times: Array, across: Array, values: Array) -> None:
    """Distances by colour: time to the right, `across` upwards."""
    end = max(float(times[-1]), float(times[0]) + INSTANT)
    extent = (float(times[0]), end, float(across[0]), float(across[-1]))
    distances = np.where(values > 0.0, values, np.nan).T
    plane(axes, distances, "distance [m]", origin="lower", aspect="auto", extent=extent)
    axes.set(xlabel="time [s]")


def scan_figure(title: str, log: Log, name: str, angles: Array) -> Figure:
    """Ranges over time and angle, and the last scan seen from above; of one beam, a curve.

    Empty where nothing is in range.
    """
    rows = _shown(log)
    times, scans = log["time"][rows], log[name][rows]
    if len(angles) == 1:
        figure, axes = new_figure(1, 1, (10.0, 4.5), title)
        read = log[name][:, 0]
        draw_curve(axes, log["time"], np.where(np.isfinite(read), read, np.nan), DISTANCE)
        axes.set(xlabel="time [s]", ylabel="range [m]")
        return figure
    figure, axes = new_figure(1, 2, (13.0, 5.6), title)
    spread(figure, ROOM)
    _over_time(axes[0], times, angles, scans)
    axes[0].set(ylabel="angle from the front [deg]")
    there = np.isfinite(scans[-1])
    turn = np.radians(angles[there])
    axes[1].plot(
        scans[-1][there] * np.cos(turn), scans[-1][there] * np.sin(turn), ".",
        color=DISTANCE.color, markersize=3, label=f"at {times[-1]:.3g} s",
    )  # fmt: skip
    axes[1].plot(0.0, 0.0, TARGET.marker, color=TARGET.color, label="sensor")
    axes[1].set(xlabel="x of S, ahead [m]", ylabel="y of S, to the left [m]", aspect="equal")
    axes[1].legend(loc="best")
    return figure


def imu_figure(title: str, log: Log) -> Figure:
    """Specific force, angular velocity, and the biases that are in them."""
    figure, axes = new_figure(2, 2, (13.0, 7.5), title)
    panels = (
        (axes[0, 0], log["specific_force"], 1.0, "specific force [m/s$^2$]"),
        (axes[1, 0], log["angular_velocity"], 180.0 / np.pi, "angular velocity [deg/s]"),
        (axes[0, 1], log["imu_biases"][:, :3], 1.0, "bias, accelerometers [m/s$^2$]"),
        (axes[1, 1], log["imu_biases"][:, 3:], 180.0 / np.pi, "bias, gyroscopes [deg/s]"),
    )
    for each, values, scale, label in panels:
        curves(each, log["time"], values, "xyz", scale=scale)
        each.set(xlabel="time [s]", ylabel=label)
        each.legend(loc="best", ncols=3)
    return figure


def depth_figure(title: str, log: Log, image: Array | None) -> Figure:
    """The row in the middle of the images over time, and the last image where there is one."""
    rows = _shown(log)
    depth = log["depth_row"][rows]
    figure, panels = new_figure(1, 1 + (image is not None), (13.0, 5.2), title)
    spread(figure, ROOM)
    first = np.atleast_1d(panels)[0]
    _over_time(first, log["time"][rows], np.array([0.0, depth.shape[1]]), depth)
    first.set(ylabel="u in the middle row [px]")
    if image is not None:
        plane(panels[1], np.where(image > 0.0, image, np.nan), "depth [m]")
        panels[1].set(xlabel="u [px]", ylabel="v [px]")
        panels[1].set_title("last image", fontsize=11)
    return figure


def pan_tilt_figure(title: str, log: Log) -> Figure:
    """Angles of the joints, and what their encoders say beyond them."""
    figure, axes = new_figure(2, 1, (10.0, 7.0), title)
    true, read = log["pan_tilt_angles"], log["pan_tilt_encoders"]
    panels = (true, "angle [deg]"), (read - true, "encoder - angle [deg]")
    for each, (values, label) in zip(axes, panels, strict=True):
        curves(each, log["time"], values, ("pan", "tilt"), scale=180.0 / np.pi)
        each.set(xlabel="time [s]", ylabel=label)
        each.legend(loc="best")
    return figure


def odometry_figure(title: str, log: Log, motion: MovingPose, rate: float) -> Figure:
    """The mobile robot's path as it is and as its wheels tell it, and how far they are apart.

    A row of the log has the last sample before it; it is compared to the truth of that sample.
    """
    times, told = log["time"], log["X_WO_odometry"]
    true = true_poses(motion, np.maximum(np.ceil(times * rate - 1e-6) - 1.0, 0.0) / rate)
    distance, angle = pose_rows_distance(true, told)
    figure, axes = new_figure(1, 2, (13.0, 5.6), title)
    rows = path_rows(told[:, 4:])
    for values, look, label in ((true, TARGET, "true"), (told, ESTIMATED, "by odometry")):
        axes[0].plot(*values[rows, 4:6].T, label=label, **line_style(look))
    axes[0].set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
    axes[0].legend(loc="best")
    draw_curve(axes[1], times, distance, nth_look(0), "position [mm]", scale=1e3, phase=0.3)
    draw_curve(axes[1], times, angle, nth_look(1), "heading [deg]", scale=180.0 / np.pi, phase=0.8)
    axes[1].set(xlabel="time [s]", ylabel="error of the odometry", ylim=(0.0, None))
    axes[1].legend(loc="best")
    return figure


def true_poses(motion: MovingPose, times: Sequence[float] | Array) -> Array:
    """Poses of the target over time as rows of the log, shape (n, 7) [-, m]."""
    return np.array([pose_row(motion.at(float(time))) for time in times])

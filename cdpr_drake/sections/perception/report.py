"""Figures of the sensors that look at the world or at motion: scans, images, joints, odometry."""

from __future__ import annotations

from collections.abc import Callable
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
from cdpr_drake.analyses.runs.run import Run, Subject
from cdpr_drake.analyses.runs.sensing import DEGREES, has_sensor, reading_times
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_row, pose_rows_distance
from cdpr_drake.palette import DISTANCE, ESTIMATED, TARGET, nth_look

MOST_ROWS = 600
"""Rows of a log in a picture of scans or of depth over time."""

INSTANT = 1e-3
"""Width of a picture of one row [s]."""

ROOM = 0.2
"""Room around panels, so that a scale of colours is not read with the next panel [inch]."""


def draw_distances(panel: Any, log: Any, name: str, across: Array) -> None:
    """Distances by colour: time to the right, `across` upwards."""
    count = len(log["time"])
    rows = np.unique(np.linspace(0, count - 1, min(count, MOST_ROWS)).round().astype(int))
    times, values = log["time"][rows], log[name][rows]
    end = max(float(times[-1]), float(times[0]) + INSTANT)
    extent = (float(times[0]), end, float(across[0]), float(across[-1]))
    distances = np.where(values > 0.0, values, np.nan).T
    plane(panel, distances, "distance [m]", origin="lower", aspect="auto", extent=extent)
    panel.set(xlabel="time [s]")


def range_figures(run: Run) -> dict[str, Callable[[], Figure]]:
    """A figure for each range sensor."""
    sensors = run.scenario.sensors.range_sensors
    return {f"scan_{sensor.name}": partial(scan_figure, run, sensor) for sensor in sensors}


def scan_figure(run: Run, sensor: Any) -> Figure:
    """Ranges over time and angle, and the last scan from above; of a single beam, a curve."""
    model, name, times = sensor.model(), f"scan_{sensor.name}", run.log["time"]
    angles = np.linspace(model.first_angle_deg, model.last_angle_deg, model.beams)
    title = run.title(f"What range sensor {sensor.name} reads")
    if len(angles) == 1:
        figure, panel = new_figure(1, 1, (10.0, 4.5), title)
        ranges = run.log[name][:, 0]
        draw_curve(panel, times, np.where(np.isfinite(ranges), ranges, np.nan), DISTANCE)
        panel.set(xlabel="time [s]", ylabel="range [m]")
        return figure
    figure, axes = new_figure(1, 2, (13.0, 5.6), title)
    spread(figure, ROOM)
    draw_distances(axes[0], run.log, name, angles)
    axes[0].set(ylabel="angle from the front [deg]")
    scan = run.log[name][-1]
    hits = np.isfinite(scan)
    turns, label = np.radians(angles[hits]), f"at {times[-1]:.3g} s"
    axes[1].plot(
        scan[hits] * np.cos(turns), scan[hits] * np.sin(turns), ".", color=DISTANCE.color,
        markersize=3, label=label,
    )  # fmt: skip
    axes[1].plot(0.0, 0.0, TARGET.marker, color=TARGET.color, label="sensor")
    axes[1].set(xlabel="x of S, ahead [m]", ylabel="y of S, to the left [m]", aspect="equal")
    axes[1].legend(loc="best")
    return figure


def depth_figure(run: Any) -> Figure:
    """The middle row of the images over time, and the last image if there is one."""
    image, width = run.at_end.get("depth_image"), run.log["depth_row"].shape[1]
    figure, axes = new_figure(1, 1 + (image is not None), (13.0, 5.2), run.title("Depth camera"))
    spread(figure, ROOM)
    first = np.atleast_1d(axes)[0]
    draw_distances(first, run.log, "depth_row", np.array([0.0, width]))
    first.set(ylabel="u in the middle row [px]")
    if image is None:
        first.set_title("the log does not have the last image", fontsize=11)
    else:
        plane(axes[1], np.where(image > 0.0, image, np.nan), "depth [m]")
        axes[1].set(xlabel="u [px]", ylabel="v [px]")
        axes[1].set_title("last image", fontsize=11)
    return figure


def draw_joints(axes: Any, times: Array, angles: Array, encoders: Array) -> None:
    """Angles of pan and tilt, and the errors of their encoders."""
    for panel, values, label in (
        (axes[0], angles, "angle [deg]"), (axes[1], encoders - angles, "encoder - angle [deg]")
    ):  # fmt: skip
        curves(panel, times, values, ("pan", "tilt"), scale=DEGREES)
        panel.set(xlabel="time [s]", ylabel=label)


def head_figure(run: Run) -> Figure:
    """Angles of the joints of the pan-tilt head, and the errors of their encoders."""
    log = run.log
    figure, axes = new_figure(2, 1, (10.0, 7.0), run.title("Joints of the pan-tilt head"))
    draw_joints(axes, log["time"], log["pan_tilt_angles"], log["pan_tilt_encoders"])
    for panel in axes:
        panel.legend(loc="best")
    return figure


def odometry_figure(run: Run) -> Figure:
    """True path of the mobile robot and its path by odometry, and their distance.

    A row of the log has the last sample before it, which is compared to the truth at its time.
    """
    times, poses = run.log["time"], run.log["X_WO_odometry"]
    instants = reading_times(times, run.scenario.sensors.odometry.rate)
    true = np.array([pose_row(run.built.motion.at(float(time))) for time in instants])
    distance, angle = pose_rows_distance(true, poses)
    figure, axes = new_figure(1, 2, (13.0, 5.6), run.title("Odometry of the mobile robot"))
    rows = path_rows(poses[:, 4:])
    for values, look, label in ((true, TARGET, "true"), (poses, ESTIMATED, "by odometry")):
        axes[0].plot(*values[rows, 4:6].T, label=label, **line_style(look))
    axes[0].set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
    axes[0].legend(loc="best")
    draw_curve(axes[1], times, distance, nth_look(0), "position [mm]", scale=1e3, phase=0.3)
    draw_curve(axes[1], times, angle, nth_look(1), "heading [deg]", scale=DEGREES, phase=0.8)
    axes[1].set(xlabel="time [s]", ylabel="error of the odometry", ylim=(0.0, None))
    axes[1].legend(loc="best")
    return figure


SUBJECTS = (
    Subject("", figures=range_figures, applies=has_sensor("range_sensors")),
    Subject("", figures={"depth": depth_figure}, applies=has_sensor("depth")),
    Subject("", figures={"pan_tilt": head_figure}, applies=has_sensor("pan_tilt")),
    Subject("", figures={"odometry": odometry_figure}, applies=has_sensor("odometry")),
)
"""What a run reports of all of them."""

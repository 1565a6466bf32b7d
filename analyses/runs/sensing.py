"""Sensors of a visual servo: readings, scans, images, inertial sensor, joints, odometry."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.frame.figures import (
    LEGEND_BESIDE,
    curves,
    draw_curve,
    line_style,
    new_figure,
    panels,
    plane,
    spread,
)
from cdpr_drake.analyses.frame.thinning import path_rows
from cdpr_drake.analyses.runs.run import Run, Subject
from cdpr_drake.analyses.visualization.cable_figures import draw_cables
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_row, pose_rows_distance
from cdpr_drake.palette import DISTANCE, ESTIMATED, TARGET, nth_look
from cdpr_drake.systems.diagrams.pan_tilt import (
    LOGGED_ENCODERS,
    LOGGED_FOUND,
    LOGGED_IMAGE,
    LOGGED_JOINTS,
)
from cdpr_drake.systems.sensors.sensor_kinds import SENSORS

MOST_ROWS = 600
"""Rows of a log in a picture of scans or of depth over time."""

INSTANT = 1e-3
"""Width of a picture of one row [s]."""

ROOM = 0.2
"""Room around panels, so that a scale of colours is not read with the next panel [inch]."""

PERIOD_TOLERANCE = 1e-6
"""Share of a period by which a row may miss the instant of a reading."""

DEGREES = 180.0 / np.pi

READINGS = {
    "tension": (1.0, "tension, reading - true [N]"),
    "encoder": (1e6, "length, reading - true [um]"),
    "tracker": (1e3, "tracker, from truth [mm]"),
    "metrology": (1e3, "metrology, from truth [mm]"),
}
"""By sensor: factor to the unit of the axis, label."""


def reading_times(times: Array, rate: float | None) -> Array:
    """Times of the last readings before the rows [s]; without a rate readings are continuous."""
    if rate is None:
        return times
    return np.maximum(np.ceil(times * rate - PERIOD_TOLERANCE) - 1.0, 0.0) / rate


def reading_figure(run: Run) -> Figure:
    """Readings of the logged sensors minus the truth, which is interpolated between rows."""
    log, settings, times = run.log, run.scenario.sensors, run.log["time"]
    title, count = run.title("What the sensors read beyond the truth"), len(settings.log)
    figure, axes = panels(count, 1, (10.0, 3.0 * count + 0.5), title)
    for panel, sensor in zip(axes, settings.log, strict=True):
        (scale, label), kind = READINGS[sensor], SENSORS[sensor]
        true, values, is_pose = log[kind.truth], log[kind.reading], kind.truth == "X_WP"
        if is_pose:
            true, values = true[:, 4:], values[:, 4:]
        instants = reading_times(times, settings.rate(sensor))
        errors = values - np.column_stack([np.interp(instants, times, row) for row in true.T])
        if is_pose:
            draw_curve(panel, times, np.linalg.norm(errors, axis=1), DISTANCE, scale=scale)
            panel.set(ylim=(0.0, None))
        else:
            draw_cables(panel, run.robot, times, errors, scale)
            panel.legend(**LEGEND_BESIDE)
        panel.set(xlabel="time [s]", ylabel=label)
    return figure


def _draw_distances(panel: Any, log: Any, name: str, across: Array) -> None:
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
    _draw_distances(axes[0], run.log, name, angles)
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


def imu_figure(run: Run) -> Figure:
    """Specific force, angular velocity, and the biases in them."""
    log = run.log
    figure, axes = new_figure(2, 2, (13.0, 7.5), run.title("What the inertial sensor reads"))
    for panel, values, scale, label in (
        (axes[0, 0], log["specific_force"], 1.0, "specific force [m/s$^2$]"),
        (axes[1, 0], log["angular_velocity"], DEGREES, "angular velocity [deg/s]"),
        (axes[0, 1], log["imu_biases"][:, :3], 1.0, "bias, accelerometers [m/s$^2$]"),
        (axes[1, 1], log["imu_biases"][:, 3:], DEGREES, "bias, gyroscopes [deg/s]"),
    ):
        curves(panel, log["time"], values, "xyz", scale=scale)
        panel.set(xlabel="time [s]", ylabel=label)
        panel.legend(loc="best", ncols=3)
    return figure


def depth_figure(run: Any) -> Figure:
    """The middle row of the images over time, and the last image if there is one."""
    image, width = run.depth_image, run.log["depth_row"].shape[1]
    figure, axes = new_figure(1, 1 + (image is not None), (13.0, 5.2), run.title("Depth camera"))
    spread(figure, ROOM)
    first = np.atleast_1d(axes)[0]
    _draw_distances(first, run.log, "depth_row", np.array([0.0, width]))
    first.set(ylabel="u in the middle row [px]")
    if image is None:
        first.set_title("the log does not have the last image", fontsize=11)
    else:
        plane(axes[1], np.where(image > 0.0, image, np.nan), "depth [m]")
        axes[1].set(xlabel="u [px]", ylabel="v [px]")
        axes[1].set_title("last image", fontsize=11)
    return figure


def _draw_joints(axes: Any, times: Array, angles: Array, encoders: Array) -> None:
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
    _draw_joints(axes, log["time"], log["pan_tilt_angles"], log["pan_tilt_encoders"])
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


def _in_view(run: Run) -> np.ndarray:
    return np.asarray(run.log[LOGGED_FOUND])[:, 0] > 0.0


def off_center(run: Run) -> Array:
    """Distance of the mean of the target's points from the principal point, shape (n,) [px]; NaN
    while the target is not seen."""
    marks, pinhole = np.asarray(run.log[LOGGED_IMAGE]), run.built.pinhole
    middle = marks.reshape(len(marks), -1, 2).mean(axis=1)
    distance = np.linalg.norm(middle - [pinhole.cx, pinhole.cy], axis=1)
    return np.where(_in_view(run), distance, np.nan)


def pan_tilt_numbers(run: Run) -> dict[str, Any]:
    """Sight of the target, angles, limits and encoders of the joints of a camera."""
    log, settings, distance = run.log, run.scenario.camera.pan_tilt, off_center(run)
    times, joints, in_view = np.asarray(log["time"]), np.asarray(log[LOGGED_JOINTS]), _in_view(run)
    first = int(np.argmax(in_view)) if np.any(in_view) else None
    lower, upper = np.radians(settings.lower_deg), np.radians(settings.upper_deg)
    # Readings are whole counts: a count beside a limit is on it.
    near = 2.0 * np.pi / settings.counts_per_turn
    limited = np.any((joints <= lower + near) | (joints >= upper - near), axis=1)
    errors = np.asarray(log[LOGGED_ENCODERS]) - joints
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
    _draw_joints(
        axes, log["time"], np.asarray(log[LOGGED_JOINTS]), np.asarray(log[LOGGED_ENCODERS])
    )
    draw_curve(axes[2], log["time"], off_center(run), nth_look(2), "target's middle")
    rim = 0.5 * min(pinhole.width, pinhole.height)
    axes[2].axhline(rim, color="0.4", linestyle="--", label="nearest rim of the image")
    axes[2].set(xlabel="time [s]", ylabel="off the image's middle [px]")
    for panel in axes:
        panel.set(xlim=axes[0].get_xlim())
        panel.legend(loc="best")
    return figure


def _has(name: str) -> Callable[[Run], bool]:
    """True for runs with a sensor of this key of the section `sensors`."""
    return lambda run: getattr(run.scenario.sensors, name) not in (None, [], ())


PAN_TILT = Subject(
    "pan_tilt",
    pan_tilt_numbers,
    {"camera_joints": camera_joints_figure},
    applies=lambda run: run.scenario.camera.pan_tilt is not None,
)
SENSING = (
    Subject("", figures={"readings": reading_figure}, applies=_has("log")),
    Subject("", figures=range_figures, applies=_has("range_sensors")),
    Subject("", figures={"imu": imu_figure}, applies=_has("imu")),
    Subject("", figures={"depth": depth_figure}, applies=_has("depth")),
    Subject("", figures={"pan_tilt": head_figure}, applies=_has("pan_tilt")),
    Subject("", figures={"odometry": odometry_figure}, applies=_has("odometry")),
)

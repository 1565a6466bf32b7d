"""The figures of a run, as the servoing thesis draws them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.pictures import (
    Path3D,
    cable_figure,
    figure_writer,
    new_figure,
    path_figure,
)
from cdpr_drake.analyses.reporting import Pictures
from cdpr_drake.analyses.runs.hardware_figures import motor_figure, reading_figure
from cdpr_drake.analyses.runs.summary import camera_path, image_path
from cdpr_drake.analyses.runs.visual_servo_run import RunResult
from cdpr_drake.spatial import distances_from_line, pose_from_row, pose_rows_distance


def run_figures(result: RunResult) -> Pictures:
    """What draws the figures of a run, by the names of their files."""
    title, robot, log = _title(result), result.servo.robot, result.log
    drawn: dict[str, Callable[[], Figure]] = {
        "image_path": lambda: image_path_figure(result),
        "error": lambda: error_figure(result),
        "cable_velocities": lambda: cable_curves_figure(result, "cable_velocities"),
        "cable_lengths": lambda: cable_curves_figure(result, "lengths"),
        "tensions": lambda: cable_curves_figure(result, "tensions"),
        "platform_path": lambda: platform_path_figure(result),
    }
    if "applied_torques" in log:
        drawn["motor_torques"] = lambda: motor_figure(title, robot, log)
    sensors = result.servo.scenario.sensors
    if sensors.log:
        drawn["readings"] = lambda: reading_figure(title, robot, log, sensors)
    return {f"{name}.png": figure_writer(draw) for name, draw in drawn.items()}


def _title(result: RunResult) -> str:
    scenario = result.servo.scenario
    return f"{scenario.name}, {scenario.camera.kind} camera, seed {scenario.seed}"


def image_path_figure(result: RunResult) -> Figure:
    """Path of the target's middle in the image, and how far it is off its line or its goal."""
    pinhole = result.servo.pinhole
    times, path, line = image_path(result)
    figure, (image, deviation) = new_figure(1, 2, (12.0, 5.0), _title(result))
    moving = result.servo.motion.is_moving()
    if not moving:
        image.plot(*line.T, "--", color="0.4", label="straight line")
    image.plot(*path.T, color="C0", label="target's centre, measured")
    image.plot(*line[0], "o", color="C2", label="start")
    image.plot(*line[1], "*", color="C3", markersize=14, label="desired")
    image.set(
        xlim=(0, pinhole.width),
        ylim=(pinhole.height, 0),
        xlabel="u [px]",
        ylabel="v [px]",
        aspect=pinhole.fx / pinhole.fy,
    )
    image.legend(loc="best")
    what = "desired point" if moving else "straight line"
    off = np.linalg.norm(path - line[1], axis=1) if moving else distances_from_line(path, *line)
    deviation.plot(times, off, color="C0")
    deviation.set(xlabel="time [s]", ylabel=f"distance from the {what} [px]", ylim=(0, None))
    return figure


_UNITS = {
    "m": ("position error [mm]", 1e3),
    "rad": ("rotation error [deg]", 180.0 / np.pi),
    "": ("error in the image [-]", 1.0),
}
"""Label and factor of the axis of features by their unit."""


def error_figure(result: RunResult) -> Figure:
    """Errors of the features and of the pose estimate over time."""
    log, features = result.log, result.servo.servo.controller.tasks[-1].features
    # No gain, no error: the target was not seen.
    time, error = log["time"], np.where(log["gain"] > 0.0, log["error"], np.nan)
    units = features.units()
    shown = [unit for unit in _UNITS if unit in units]
    columns = max(2, len(shown))
    figure, grid = new_figure(2, columns, (6.0 * columns, 7.5), _title(result))
    for axes, unit in zip(grid[0], shown, strict=False):
        label, factor = _UNITS[unit]
        mine = [k for k in range(len(units)) if units[k] == unit]
        for k in mine:
            name = features.names[k].removesuffix(f"_{unit}")
            axes.plot(time, factor * error[:, k], label=name)
        axes.set(ylabel=label)
        axes.legend(loc="best", ncols=1 + len(mine) // 6)
    if len(shown) == 1:
        grid[0, 1].plot(time, np.linalg.norm(error, axis=1), color="C5", label="norm")
        grid[0, 1].set(ylabel=_UNITS[shown[0]][0], yscale="log")
        grid[0, 1].legend(loc="best")
    distance, angle = pose_rows_distance(log["X_WP"], log["X_WP_estimated"])
    for axes, values, label in (
        (grid[1, 0], 1e3 * distance, "pose estimate, error [mm]"),
        (grid[1, 1], np.degrees(angle), "pose estimate, error [deg]"),
    ):
        axes.plot(time, values, color="C4", label="distance" if "mm" in label else "angle")
        axes.set(ylabel=label)
        axes.legend(loc="best")
    for axes in grid[1, 2:]:
        axes.set_axis_off()
    for axes in grid.flat:
        axes.set(xlabel="time [s]")
    return figure


CABLE_CURVES = {
    "cable_velocities": ("cable velocity [mm/s]", 1e3),
    "lengths": ("cable length [m]", 1.0),
    "tensions": ("tension [N]", 1.0),
}
"""Label and factor of the axis by quantity of the log."""


def cable_curves_figure(result: RunResult, quantity: str) -> Figure:
    """One of `CABLE_CURVES` over time; velocities are those commanded."""
    label, factor = CABLE_CURVES[quantity]
    return cable_figure(_title(result), result.servo.robot, result.log, quantity, label, factor)


def platform_path_figure(result: RunResult) -> Figure:
    """Paths of platform and camera: with the whole robot, and close up."""
    servo, log = result.servo, result.log
    X_WPs = [pose_from_row(row) for row in log["X_WP"]]
    target = [
        (servo.mounting.X_WC(X_WP) @ servo.X_CO(X_WP, time)).translation()
        for X_WP, time in zip(X_WPs, log["time"], strict=True)
    ]
    camera = np.array([servo.mounting.X_WC(X_WP).translation() for X_WP in X_WPs])
    paths = [
        Path3D(log["X_WP"][:, 4:], "platform", "C0", "-"),
        Path3D(log["X_WP_estimated"][:, 4:], "platform, estimated", "C1", ":"),
    ]
    if servo.mounting.is_eye_to_hand():
        paths += [
            Path3D(np.array(target), "target", "C3", "-"),
            Path3D(camera[:1], "camera", "C4", "s"),
        ]
    elif servo.motion.is_moving():
        paths += [
            Path3D(camera, "camera", "C4", "-"),
            Path3D(np.array(target), "target", "C3", "-"),
        ]
    else:
        paths += [
            Path3D(camera, "camera", "C4", "-"),
            Path3D(camera_path(result)[1], "camera, straight line", "0.4", "--"),
            Path3D(np.array(target[:1]), "target", "C3", "s"),
        ]
    cables = servo.scenario.cables.cable_set(servo.robot)
    return path_figure(_title(result), servo.robot, cables, log, paths)

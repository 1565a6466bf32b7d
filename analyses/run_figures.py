"""The figures of a run, as the servoing thesis draws them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from cdpr_drake.analyses.figure_style import bare_figure, new_figure, save_figure, shade_slack
from cdpr_drake.analyses.run import RunResult, pose_rows_distance
from cdpr_drake.analyses.run_summary import camera_path, image_path
from cdpr_drake.arrays import Array
from cdpr_drake.straight_line import distances_from_line
from cdpr_drake.systems import pose_from_row


def write_figures(folder: Path, result: RunResult) -> list[Path]:
    """Draws all figures of a run into a folder; returns their files."""
    drawings = {
        "image_path": image_path_figure,
        "error": error_figure,
        "cable_velocities": cable_velocity_figure,
        "cable_lengths": cable_length_figure,
        "tensions": tension_figure,
        "platform_path": platform_path_figure,
    }
    return [save_figure(draw(result), folder / f"{name}.png") for name, draw in drawings.items()]


def _title(result: RunResult) -> str:
    scenario = result.servo.scenario
    return f"{scenario.name}, {scenario.camera.kind} camera, seed {scenario.seed}"


def image_path_figure(result: RunResult) -> Figure:
    """Path of the tag's middle in the image, with the straight line, and its deviation."""
    pinhole = result.servo.pinhole
    times, path, line = image_path(result)
    figure, (image, deviation) = new_figure(1, 2, (12.0, 5.0), _title(result))
    image.plot(*line.T, "--", color="0.4", label="straight line")
    image.plot(*path.T, color="C0", label="tag centre, measured")
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
    deviation.plot(times, distances_from_line(path, *line), color="C0")
    deviation.set(xlabel="time [s]", ylabel="distance from the straight line [px]", ylim=(0, None))
    return figure


def error_figure(result: RunResult) -> Figure:
    """Feature error and pose estimation error over time."""
    log = result.log
    # No gain, no error: the target was not seen.
    time, error = log["time"], np.where(log["gain"] > 0.0, log["error"], np.nan)
    figure, axes = new_figure(2, 2, (12.0, 7.5), _title(result))
    for k, axis in enumerate("xyz"):
        axes[0, 0].plot(time, 1e3 * error[:, 3 + k], label=f"${axis}$")
        axes[0, 1].plot(time, np.degrees(error[:, k]), label=rf"$\theta u_{axis}$")
    axes[0, 0].set(ylabel="position error of the tag [mm]")
    axes[0, 1].set(ylabel="rotation error [deg]")
    distance, angle = pose_rows_distance(log["X_WP"], log["X_WP_estimated"])
    axes[1, 0].plot(time, 1e3 * distance, color="C4", label="distance")
    axes[1, 0].set(ylabel="pose estimate, error [mm]")
    axes[1, 1].plot(time, np.degrees(angle), color="C4", label="angle")
    axes[1, 1].set(ylabel="pose estimate, error [deg]")
    for axes_i in axes.flat:
        axes_i.set(xlabel="time [s]")
        axes_i.legend(loc="best")
    return figure


def _per_cable(result: RunResult, quantity: str, label: str, scale: float = 1.0) -> Figure:
    """One curve a cable, with the times shaded in which some cable is slack."""
    figure, axes = new_figure(1, 1, (10.0, 5.0), _title(result))
    _cable_curves(axes, result, quantity, scale)
    axes.set(xlabel="time [s]", ylabel=label)
    axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
    return figure


def _cable_curves(axes: Axes, result: RunResult, quantity: str, scale: float) -> None:
    log = result.log
    for k, cable in enumerate(result.servo.robot.cables):
        axes.plot(log["time"], scale * log[quantity][:, k], color=f"C{k % 10}", label=cable.name)
    shade_slack(axes, log["time"], log["slack"])


def cable_velocity_figure(result: RunResult) -> Figure:
    """Commanded cable velocities over time."""
    return _per_cable(result, "cable_velocities", "cable velocity [mm/s]", 1e3)


def cable_length_figure(result: RunResult) -> Figure:
    """Cable lengths over time."""
    return _per_cable(result, "lengths", "cable length [m]")


def tension_figure(result: RunResult) -> Figure:
    """Tensions over time."""
    return _per_cable(result, "tensions", "tension [N]")


def platform_path_figure(result: RunResult) -> Figure:
    """Paths of platform and camera: with the whole robot, and close up."""
    figure = bare_figure((13.0, 6.5), _title(result))
    whole = figure.add_subplot(1, 2, 1, projection="3d")
    close = figure.add_subplot(1, 2, 2, projection="3d")
    for axes in (whole, close):
        _draw_paths(axes, result)
    robot = result.servo.robot
    _draw_cables(whole, result)
    _set_box(whole, robot.frame.lower, robot.frame.upper)
    tag = result.servo.X_WO.translation()
    track, line = camera_path(result)
    points = np.vstack([result.log["X_WP"][:, 4:], track, line, tag])
    low, high = points.min(axis=0), points.max(axis=0)
    half = 0.55 * float(np.max(high - low))
    _set_box(close, (low + high) / 2.0 - half, (low + high) / 2.0 + half)
    figure.legend(*close.get_legend_handles_labels(), loc="outside lower center", ncols=5)
    return figure


def _draw_paths(axes: Any, result: RunResult) -> None:
    servo = result.servo
    track, line = camera_path(result)
    axes.plot(*result.log["X_WP"][:, 4:].T, color="C0", linewidth=2.0, label="platform")
    estimated = result.log["X_WP_estimated"][:, 4:]
    axes.plot(*estimated.T, ":", color="C1", linewidth=2.0, label="platform, estimated")
    axes.plot(*track.T, color="C4", label="camera")
    axes.plot(*line.T, "--", color="0.4", label="camera, straight line")
    axes.plot(*servo.X_WO.translation()[:, None], "s", color="C3", label="tag")


def _draw_cables(axes: Any, result: RunResult) -> None:
    """Cables at the end of the run, red where slack."""
    robot = result.servo.robot
    X_WP = pose_from_row(result.log["X_WP"][-1])
    A, B = robot.exit_points(), robot.anchor_points()
    p_WB = X_WP.rotation().matrix() @ B + X_WP.translation()[:, None]
    for k in range(A.shape[1]):
        color = "C3" if result.log["slack"][-1, k] else "0.35"
        axes.plot(*np.column_stack([A[:, k], p_WB[:, k]]), color=color, linewidth=0.9)


def _set_box(axes: Any, lower: Array, upper: Array) -> None:
    axes.set(
        xlim=(lower[0], upper[0]),
        ylim=(lower[1], upper[1]),
        zlim=(lower[2], upper[2]),
        xlabel="x [m]",
        ylabel="y [m]",
        zlabel="z [m]",
    )
    axes.set_box_aspect(upper - lower, zoom=0.92)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_major_locator(MaxNLocator(4))

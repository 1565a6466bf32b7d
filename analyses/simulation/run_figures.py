"""The figures of a run, as the servoing thesis draws them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.frame.figures import (
    curves,
    draw_curve,
    figure_writers,
    line_style,
    mark_instants,
    new_figure,
    shade,
)
from cdpr_drake.analyses.frame.thinning import by_pieces, path_rows
from cdpr_drake.analyses.frame.words import DEFAULT_FORMATS
from cdpr_drake.analyses.reporting.deferred_figures import Pictures
from cdpr_drake.analyses.simulation.adaptation_report import adaptation_figure
from cdpr_drake.analyses.simulation.behaviour_loops import loop_figure, shows_loops
from cdpr_drake.analyses.simulation.hardware_figures import (
    motor_figure,
    reading_figure,
    tension_loop_figure,
)
from cdpr_drake.analyses.simulation.pan_tilt_report import camera_joints_figure
from cdpr_drake.analyses.simulation.perception_figures import looking_figures
from cdpr_drake.analyses.simulation.run_stability import stability_of_run
from cdpr_drake.analyses.simulation.run_summary import camera_line, image_path
from cdpr_drake.analyses.simulation.stability_files import stability_figure
from cdpr_drake.analyses.simulation.visual_servo_run import RunResult
from cdpr_drake.analyses.simulation.worlds import world_figure, world_words
from cdpr_drake.analyses.simulation.wrench_report import wrench_figure
from cdpr_drake.analyses.visualization.cable_figures import cable_figure
from cdpr_drake.analyses.visualization.path_figures import Path3D, path_figure
from cdpr_drake.geometry.pose_accuracy import distances_from_line
from cdpr_drake.geometry.poses import pose_from_row, pose_rows_distance
from cdpr_drake.palette import (
    ANGLE,
    CAMERA,
    DESIRED,
    DISTANCE,
    ESTIMATED,
    IDEAL,
    PLATFORM,
    TARGET,
)
from cdpr_drake.systems.diagrams.pan_tilt import LOGGED_JOINTS
from cdpr_drake.systems.diagrams.torque_control import tension_limits
from cdpr_drake.systems.estimators.geometry_learner import LEARNT
from cdpr_drake.systems.estimators.wrench_estimator import WRENCH_ESTIMATED


def run_figures(result: RunResult, formats: Sequence[str] = DEFAULT_FORMATS) -> Pictures:
    """What draws the figures of a run, by the names of their files."""
    robot, log = result.servo.robot, result.log
    drawn: dict[str, Callable[[], Figure]] = {
        "image_path": lambda: image_path_figure(result),
        "error": lambda: error_figure(result),
        "cable_velocities": lambda: cable_curves_figure(result, "cable_velocities"),
        "cable_lengths": lambda: cable_curves_figure(result, "lengths"),
        "tensions": lambda: cable_curves_figure(result, "tensions"),
        "platform_path": lambda: platform_path_figure(result),
    }

    def add(name: str, words: str, figure: Callable[..., Figure], *arguments: Any) -> None:
        drawn[name] = partial(figure, _title(result, words), *arguments)

    scenario = result.servo.scenario
    if "applied_torques" in log:
        words = "Torques of the motors and of their friction"
        add("motor_torques", words, motor_figure, robot, log)
    if "wanted_tensions" in log:
        words = "Tensions that a servo by torque wants, and what there is beyond them"
        limits = tension_limits(scenario, robot)
        add("tension_loop", words, tension_loop_figure, robot, log, limits)
    if shows_loops(robot):
        words = "What cables and contacts of the platform went through"
        add("behaviour", words, loop_figure, robot, log)
    sensors = scenario.sensors
    if sensors.log:
        words = "What the sensors read beyond the truth"
        add("readings", words, reading_figure, robot, log, sensors)
    if sensors.looks_round():
        drawn |= looking_figures(
            partial(_title, result), sensors, log, result.servo.motion, result.depth_image
        )
    if WRENCH_ESTIMATED in log:
        words = "What pushes the platform beside its cables, true and estimated"
        add("wrench", words, wrench_figure, log)
    if LEARNT in log:
        words = "Exit and anchor points learnt on the way, and the truth"
        add("adaptation", words, adaptation_figure, log, robot)
    if LOGGED_JOINTS in log:
        words = "Joints of the camera, and where the target is in its image"
        add("camera_joints", words, camera_joints_figure, log, result.servo.pinhole)
    if scenario.world is not None:
        add("world", world_words(scenario.world), world_figure, scenario.world, log)
    along = stability_of_run(result)
    if along is not None:
        words = "Cables that pull, and stability of the servo"
        add("stability", words, stability_figure, along)
    return dict(figure_writers(drawn, formats))


def _title(result: RunResult, words: str) -> str:
    """What the figure shows, and below what the run was."""
    scenario = result.servo.scenario
    geometry = scenario.cables.geometry_words(result.servo.robot)
    run = f"{scenario.name}, {geometry}, {scenario.camera.kind} camera, seed {scenario.seed}"
    return f"{words}\n{scenario.title}\n({run})"


def image_path_figure(result: RunResult) -> Figure:
    """Path of the target's middle in the image, and how far it is off its line or its goal.

    Where the target was never found, only the image with the desired point.
    """
    pinhole = result.servo.pinhole
    times, path, line = image_path(result)
    seen, moving = len(path) > 0, result.servo.motion.is_moving()
    words = "Path of the target's centre in the image"
    if not seen:
        words = "Image of the camera: the target was never found"
    figure, panels = new_figure(1, 1 + seen, (12.0 if seen else 7.0, 5.6), _title(result, words))
    image = panels[0] if seen else panels
    if seen:
        if not moving:
            image.plot(*line.T, **line_style(IDEAL), label="straight line")
        shown = path[path_rows(path)]
        image.plot(*shown.T, **line_style(TARGET), label="target's centre, measured")
        image.plot(*path[0], "o", color=TARGET.color, label="start")
    image.plot(*line[1], DESIRED.marker, color=DESIRED.color, markersize=14, label="desired")
    image.set(
        xlim=(0, pinhole.width), ylim=(pinhole.height, 0), xlabel="u [px]", ylabel="v [px]",
        aspect=pinhole.fx / pinhole.fy,
    )  # fmt: skip
    image.set_title(f"image of {pinhole.width} x {pinhole.height} px", fontsize=11)
    image.legend(loc="best")
    if seen:
        what = "desired point" if moving else "straight line"
        off = np.linalg.norm(path - line[1], axis=1) if moving else distances_from_line(path, *line)
        draw_curve(panels[1], times, off, DISTANCE)
        panels[1].set(xlabel="time [s]", ylabel=f"distance from the {what} [px]", ylim=(0, None))
    return figure


_UNITS = {
    "m": ("position error [mm]", 1e3),
    "rad": ("rotation error [deg]", 180.0 / np.pi),
    "": ("error in the image [-]", 1.0),
}
"""Label and factor of the axis of features by their unit."""


def error_figure(result: RunResult) -> Figure:
    """Errors of the features and of the pose estimate over time; no panel without a curve."""
    log, features = result.log, result.servo.controller.tasks[-1].features
    time, gain = log["time"], log["gain"][:, 0]
    camera = result.servo.scenario.camera
    unseen = (gain <= 0.0) & (time > camera.latency_frames / camera.rate)
    units = features.units()
    shown = [unit for unit in _UNITS if unit in units]
    # No gain, no error: the target was not seen, or nobody looked.
    looked = bool(np.any(gain > 0.0))
    above = (len(shown) + (len(shown) == 1)) if looked else 0
    columns = max(2, above)
    words = "Errors of the features, and of the estimated pose of the platform"
    if not looked:
        words = "Errors of the estimated pose of the platform; no feature was controlled"
    figure, grid = new_figure(
        1 + looked, columns, (6.0 * columns, 8.0 if looked else 4.8), _title(result, words)
    )
    grid = np.reshape(grid, (1 + looked, columns))
    for axes, unit in zip(grid[0], shown if looked else (), strict=False):
        label, factor = _UNITS[unit]
        mine = [k for k in range(len(units)) if units[k] == unit]
        errors = np.where(gain[:, np.newaxis] > 0.0, log["error"][:, mine], np.nan)
        names = [features.names[k].removesuffix(f"_{unit}") for k in mine]
        curves(axes, time, errors, names, numbers=mine, scale=factor)
        shade(axes, time, unseen, "target not seen")
        axes.set(ylabel=label)
        axes.legend(loc="best", ncols=1 + len(mine) // 6)
    if looked and len(shown) == 1:
        label, factor = _UNITS[shown[0]]
        norm = by_pieces(
            lambda g, e: np.where(g > 0.0, np.linalg.norm(e, axis=1), np.nan), gain, log["error"]
        )
        draw_curve(grid[0, 1], time, norm, DISTANCE, scale=factor)
        grid[0, 1].set(ylabel=f"norm of the {label}", yscale="log")
    distance, angle = by_pieces(pose_rows_distance, log["X_WP"], log["X_WP_estimated"])
    last = grid[-1]
    for axes, values, look, label in (
        (last[0], 1e3 * distance, DISTANCE, "estimate, position error [mm]"),
        (last[1], np.degrees(angle), ANGLE, "estimate, rotation error [deg]"),
    ):
        draw_curve(axes, time, values, look)
        axes.set(ylabel=label)
    for axes in last[2:]:
        axes.remove()
    for axes in figure.axes:
        axes.set(xlabel="time [s]")
        mark_instants(axes, _instants(result))
    return figure


def _instants(result: RunResult) -> list[tuple[float, str]]:
    """When something failed [s], and what."""
    failures = result.servo.scenario.failures
    events = [] if failures is None else failures.events
    return [(event.begins, event.words(result.servo.robot)) for event in events]


CABLE_CURVES = {
    "cable_velocities": ("Commanded velocities of the cables", "cable velocity [mm/s]", 1e3),
    "lengths": ("Lengths of the cables", "cable length [m]", 1.0),
    "tensions": ("Tensions of the cables", "tension [N]", 1.0),
}
"""Title, label and factor of the axis by quantity of the log."""


def cable_curves_figure(result: RunResult, quantity: str) -> Figure:
    """One of `CABLE_CURVES` over time; velocities are those commanded, tensions have bounds."""
    words, label, factor = CABLE_CURVES[quantity]
    robot = result.servo.robot
    figure = cable_figure(
        _title(result, words), robot, result.log, quantity, label,
        scale=factor, bounds=robot.tension_limits() if quantity == "tensions" else None,
    )  # fmt: skip
    mark_instants(figure.axes[0], _instants(result))
    return figure


def platform_path_figure(result: RunResult) -> Figure:
    """Paths of platform and camera: with the whole robot, and close up."""
    servo, log = result.servo, result.log
    rows, estimated = (path_rows(log[name][:, 4:]) for name in ("X_WP", "X_WP_estimated"))
    X_WPs = [pose_from_row(row) for row in log["X_WP"][rows]]
    X_WCs = [servo.mounting.X_WC(X_WP) for X_WP in X_WPs]
    points = np.array([X.translation() for X in X_WCs])
    goals = np.array(
        [
            (X_WC @ servo.X_CO(X_WP, time)).translation()
            for X_WC, X_WP, time in zip(X_WCs, X_WPs, log["time"][rows], strict=True)
        ]
    )
    camera, target = Path3D(points, "camera, Co", CAMERA), Path3D(goals, "target, Oo", TARGET)
    paths = [
        Path3D(np.array([X.translation() for X in X_WPs]), "platform, Po", PLATFORM),
        Path3D(
            np.asarray(log["X_WP_estimated"][estimated][:, 4:]), "platform, Po, estimated",
            ESTIMATED,
        ),
    ]  # fmt: skip
    if servo.mounting.is_eye_to_hand():
        paths += [target, replace(camera, points=points[:1])]
    elif servo.motion.is_moving():
        paths += [camera, target]
    else:
        line = Path3D(camera_line(result), "camera, straight line", IDEAL)
        paths += [camera, line, replace(target, points=goals[:1])]
    cables = servo.scenario.cables.cable_set(servo.robot)
    words = "Paths of platform P, camera C and target O in the world frame W"
    return path_figure(_title(result, words), servo.robot, cables, log, paths)

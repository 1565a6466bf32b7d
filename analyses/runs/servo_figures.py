"""Figures of every run of a visual servo, as the servoing thesis draws them, and its film."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from matplotlib.figure import Figure
from pydrake.systems.framework import DiagramBuilder

from cdpr_drake.analyses.frame.figures import (
    curves,
    draw_curve,
    line_style,
    mark_instants,
    new_figure,
    shade,
)
from cdpr_drake.analyses.frame.thinning import by_pieces, path_rows
from cdpr_drake.analyses.visualization.cable_figures import cable_figure
from cdpr_drake.analyses.visualization.path_figures import Path3D, path_figure
from cdpr_drake.analyses.visualization.replay import frame_indices
from cdpr_drake.analyses.visualization.replay_page import CameraView
from cdpr_drake.arrays import Array
from cdpr_drake.errors import OutputFolderError
from cdpr_drake.geometry.pose_accuracy import distances_from_line
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.models.rendered_camera import add_renderer
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
from cdpr_drake.servoing.circle_features import ELLIPSE_SIZE
from cdpr_drake.systems.diagrams.camera import add_pictured_robot, add_sensor
from cdpr_drake.vision.mark_reading import found_marks

FILM = "camera.mp4"
"""File of the film in a results folder."""

CABLE_CURVES = {
    "cable_velocities": (
        "cable_velocities", "Commanded velocities of the cables", "cable velocity [mm/s]", 1e3,
    ),
    "lengths": ("cable_lengths", "Lengths of the cables", "cable length [m]", 1.0),
    "tensions": ("tensions", "Tensions of the cables", "tension [N]", 1.0),
}  # fmt: skip
"""Name of the figure, title, label and factor of the axis by quantity of the log."""

UNITS = {
    "m": ("position error [mm]", 1e3),
    "rad": ("rotation error [deg]", 180.0 / np.pi),
    "": ("error in the image [-]", 1.0),
}
"""Label and factor of the axis of features by their unit."""

MARK_COLOR, LINE_COLOR, PATH_COLOR, TEXT_COLOR = (
    (40, 40, 230), (60, 160, 60), (220, 120, 30), (20, 20, 20),
)  # fmt: skip
"""Colours in a film, blue first."""


def image_path_figure(run: Any) -> Figure:
    """Path of the target's middle in the image, and its distance from its line or its goal.

    If the target was never found, the image with the desired point.
    """
    pinhole, (times, path, line) = run.built.pinhole, run.image_path
    visible, moving = len(path) > 0, run.built.motion.is_moving()
    words = "Path of the target's centre in the image"
    if not visible:
        words = "Image of the camera: the target was never found"
    width = 12.0 if visible else 7.0
    figure, panels = new_figure(1, 1 + visible, (width, 5.6), run.title(words))
    image = panels[0] if visible else panels
    if visible:
        if not moving:
            image.plot(*line.T, **line_style(IDEAL), label="straight line")
        shown = path[path_rows(path)]
        image.plot(*shown.T, **line_style(TARGET), label="target's centre, measured")
        image.plot(*path[0], "o", color=TARGET.color, label="start")
        goal = "desired point" if moving else "straight line"
        off = np.linalg.norm(path - line[1], axis=1) if moving else distances_from_line(path, *line)
        draw_curve(panels[1], times, off, DISTANCE)
        panels[1].set(xlabel="time [s]", ylabel=f"distance from the {goal} [px]", ylim=(0, None))
    image.plot(*line[1], DESIRED.marker, color=DESIRED.color, markersize=14, label="desired")
    image.set(
        xlim=(0, pinhole.width), ylim=(pinhole.height, 0), xlabel="u [px]", ylabel="v [px]",
        aspect=pinhole.fx / pinhole.fy,
    )  # fmt: skip
    image.set_title(f"image of {pinhole.width} x {pinhole.height} px", fontsize=11)
    image.legend(loc="best")
    return figure


def error_figure(run: Any) -> Figure:
    """Errors of the features and of the pose estimate over time; no panel without a curve."""
    log, features, camera = run.log, run.built.controller.tasks[-1].features, run.scenario.camera
    time, gain = log["time"], log["gain"][:, 0]
    unseen = (gain <= 0.0) & (time > camera.latency_frames / camera.rate)
    units = features.units()
    shown = [unit for unit in UNITS if unit in units]
    # Without a gain there is no error: the target was not seen, or no feature is controlled.
    controlled = bool(np.any(gain > 0.0))
    columns, height = max(2, len(shown) + (len(shown) == 1)), 8.0
    words = "Errors of the features, and of the estimated pose of the platform"
    if not controlled:
        columns, height, shown = 2, 4.8, []
        words = "Errors of the estimated pose of the platform; no feature was controlled"
    title = run.title(words)
    figure, grid = new_figure(1 + controlled, columns, (6.0 * columns, height), title)
    grid = np.reshape(grid, (1 + controlled, columns))
    for panel, unit in zip(grid[0], shown, strict=False):
        label, factor = UNITS[unit]
        numbers = [k for k in range(len(units)) if units[k] == unit]
        errors = np.where(gain[:, np.newaxis] > 0.0, log["error"][:, numbers], np.nan)
        names = [features.names[k].removesuffix(f"_{unit}") for k in numbers]
        curves(panel, time, errors, names, numbers=numbers, scale=factor)
        shade(panel, time, unseen, "target not seen")
        panel.set(ylabel=label)
        panel.legend(loc="best", ncols=1 + len(numbers) // 6)
    if len(shown) == 1:
        label, factor = UNITS[shown[0]]
        norm = by_pieces(
            lambda g, e: np.where(g > 0.0, np.linalg.norm(e, axis=1), np.nan), gain, log["error"]
        )
        draw_curve(grid[0, 1], time, norm, DISTANCE, scale=factor)
        grid[0, 1].set(ylabel=f"norm of the {label}", yscale="log")
    distance, angle = run.distances("X_WP_estimated")
    for panel, values, look, label in (
        (grid[-1, 0], 1e3 * distance, DISTANCE, "estimate, position error [mm]"),
        (grid[-1, 1], np.degrees(angle), ANGLE, "estimate, rotation error [deg]"),
    ):
        draw_curve(panel, time, values, look)
        panel.set(ylabel=label)
    for panel in grid[-1, 2:]:
        panel.remove()
    for panel in figure.axes:
        panel.set(xlabel="time [s]")
        mark_instants(panel, _failures(run))
    return figure


def _failures(run: Any) -> list[tuple[float, str]]:
    """Times of failures [s], and words on them."""
    failures = run.scenario.failures
    events = [] if failures is None else failures.events
    return [(event.begins, event.words(run.robot)) for event in events]


def cable_curves_figure(run: Any, quantity: str) -> Figure:
    """One of `CABLE_CURVES` over time; velocities are commanded, tensions have bounds."""
    _, words, label, factor = CABLE_CURVES[quantity]
    bounds = run.robot.tension_limits() if quantity == "tensions" else None
    figure = cable_figure(
        run.title(words), run.robot, run.log, quantity, label, scale=factor, bounds=bounds
    )
    mark_instants(figure.axes[0], _failures(run))
    return figure


def platform_path_figure(run: Any) -> Figure:
    """Paths of platform and camera: with the whole robot, and close up."""
    built, log = run.built, run.log
    rows, estimated = (path_rows(log[name][:, 4:]) for name in ("X_WP", "X_WP_estimated"))
    X_WPs = [pose_from_row(row) for row in log["X_WP"][rows]]
    X_WCs = [built.mounting.X_WC(X_WP) for X_WP in X_WPs]
    targets = [
        X_WC @ built.X_CO(X_WP, time)
        for X_WC, X_WP, time in zip(X_WCs, X_WPs, log["time"][rows], strict=True)
    ]
    platform, camera, target = (
        Path3D(np.array([X.translation() for X in poses]), label, look)
        for poses, label, look in (
            (X_WPs, "platform, Po", PLATFORM), (X_WCs, "camera, Co", CAMERA),
            (targets, "target, Oo", TARGET),
        )
    )  # fmt: skip
    points = np.asarray(log["X_WP_estimated"][estimated][:, 4:])
    paths = [platform, Path3D(points, "platform, Po, estimated", ESTIMATED)]
    if built.mounting.is_eye_to_hand():
        paths += [target, replace(camera, points=camera.points[:1])]
    elif built.motion.is_moving():
        paths += [camera, target]
    else:
        line = Path3D(run.camera_line, "camera, straight line", IDEAL)
        paths += [camera, line, replace(target, points=target.points[:1])]
    title = run.title("Paths of platform P, camera C and target O in the world frame W")
    return path_figure(title, run.robot, run.scenario.cables.cable_set(run.robot), log, paths)


def camera_view(run: Any, film: Path | None) -> CameraView:
    """What the camera saw, for the replay; with the images of a film of `write_film`."""
    target, pinhole = run.built.target, run.built.pinhole
    no_noise = np.random.default_rng(0)
    desired = [
        (task.time, target.project(task.desired.transform(), pinhole, 0.0, no_noise))
        for task in run.scenario.tasks()
    ]
    return CameraView(
        pinhole=pinhole, kind=run.scenario.camera.kind, mark=target.mark, desired=desired,
        film=film, film_times=run.log["time"][_film_rows(run)],
    )  # fmt: skip


def _film_rate(run: Any) -> float:
    return float(min(run.scenario.camera.rate, run.scenario.log_rate))


def _film_rows(run: Any) -> list[int]:
    """Rows of the log in a film: not more per second than the camera took images."""
    times = run.log["time"]
    return frame_indices(times, _film_rate(run), len(times))


def write_film(run: Any, path: Path) -> None:
    """Renders the camera's images again along a run, with the target's path, into an MP4 file.

    Raises:
        RenderingError: EGL is missing.
        OutputFolderError: OpenCV cannot write the film.
    """
    built, log, pinhole, target = run.built, run.log, run.built.pinhole, run.built.target
    builder = DiagramBuilder()
    block = add_pictured_robot(builder, run.robot, run.scenario)
    add_renderer(block.scene_graph)
    sensor = add_sensor(builder, block, built.mounting, pinhole)
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    size, code = (pinhole.width, pinhole.height), cv2.VideoWriter.fourcc(*"mp4v")
    film = cv2.VideoWriter(str(path), code, _film_rate(run), size)
    if not film.isOpened():
        raise OutputFolderError(f"{path}: OpenCV cannot write this film")
    image_times, track, line = run.image_path
    # Paths and marks are as read: in the image they are where the lens puts them.
    track, line = (pinhole.found_at(points.T).T for points in (track, line))
    # A log on disk is read at each look.
    times, poses, in_view, marks = (
        log[name] for name in ("time", "X_WP", "found", f"{target.mark}_px")
    )
    for row in _film_rows(run):
        now = float(times[row])
        context.SetTime(now)
        plant_context = block.plant.GetMyMutableContextFromRoot(context)
        block.in_plant.set_pose(plant_context, pose_from_row(poses[row]))
        rgb = sensor.GetOutputPort("color_image").Eval(sensor.GetMyContextFromRoot(context)).data
        picture = cv2.cvtColor(rgb[:, :, :3], cv2.COLOR_RGB2BGR)
        _draw_track(picture, track[image_times <= now], line)
        if in_view[row, 0] > 0.0:
            shown = marks[row]
            if not pinhole.is_ideal:
                shown = found_marks(shown, target.mark, target.size, pinhole)
            _draw_marks(picture, target.mark, shown)
        words = f"{now:6.2f} s"
        cv2.putText(picture, words, (10, 28), cv2.FONT_HERSHEY_SIMPLEX, 0.8, TEXT_COLOR, 2)
        film.write(picture)
    film.release()


def _draw_track(picture: np.ndarray, track: Array, line: Array) -> None:
    start, end = (tuple(round(value) for value in point) for point in line)
    cv2.line(picture, start, end, LINE_COLOR, 1, cv2.LINE_AA)
    if len(track) > 1:
        points = np.round(track).astype(np.int32)
        cv2.polylines(picture, [points], False, PATH_COLOR, 2, cv2.LINE_AA)


def _draw_marks(picture: np.ndarray, mark: str, marks: Array) -> None:
    if mark == "corners":
        for four in marks.reshape(-1, 4, 2):
            cv2.polylines(picture, [np.round(four).astype(np.int32)], True, MARK_COLOR, 2)
        return
    for u, v, n20, n11, n02 in marks.reshape(-1, ELLIPSE_SIZE):
        values, vectors = np.linalg.eigh(np.array([[n20, n11], [n11, n02]]))
        axes = tuple(round(2.0 * np.sqrt(value)) for value in np.maximum(values, 0.0))
        angle = float(np.degrees(np.arctan2(vectors[1, 0], vectors[0, 0])))
        cv2.ellipse(picture, (round(u), round(v)), axes, angle, 0.0, 360.0, MARK_COLOR, 2)

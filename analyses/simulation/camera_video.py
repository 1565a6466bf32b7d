"""What the camera of a run saw: as a film, and for its replay."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from pydrake.systems.framework import DiagramBuilder

from cdpr_drake.analyses.simulation.run_summary import image_path
from cdpr_drake.analyses.simulation.visual_servo_run import RunResult
from cdpr_drake.analyses.visualization.replay import frame_indices
from cdpr_drake.analyses.visualization.replay_page import CameraView
from cdpr_drake.arrays import Array
from cdpr_drake.errors import OutputFolderError
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.models.rendered_camera import add_renderer
from cdpr_drake.servoing.circle_features import ELLIPSE_SIZE
from cdpr_drake.systems.diagrams.camera import add_sensor, pictured_robot
from cdpr_drake.vision.mark_reading import found_marks

_CORNER_COLOR = (40, 40, 230)
_LINE_COLOR = (60, 160, 60)
_PATH_COLOR = (220, 120, 30)


def camera_view(result: RunResult, film: Path | None = None) -> CameraView:
    """What the camera saw, for the replay of a run; with the images of a film of `write_video`."""
    servo, times = result.servo, result.log["time"]
    target, pinhole = servo.target, servo.pinhole
    exactly = np.random.default_rng(0)  # unused, as there is no noise
    desired = [
        (task.time, target.project(task.desired.transform(), pinhole, 0.0, exactly))
        for task in servo.scenario.tasks()
    ]
    return CameraView(
        pinhole=pinhole,
        kind=servo.scenario.camera.kind,
        mark=target.mark,
        desired=desired,
        film=film,
        film_times=times[film_rows(result)],
    )


def film_rows(result: RunResult) -> list[int]:
    """Rows of the log that a film shows: no more a second than the camera took images."""
    times = result.log["time"]
    return frame_indices(times, film_rate(result), len(times))


def film_rate(result: RunResult) -> float:
    """Images per second of a film [Hz]."""
    scenario = result.servo.scenario
    return min(scenario.camera.rate, scenario.log_rate)


def write_video(path: Path, result: RunResult) -> None:
    """Renders the camera's images again along a run, with the tag's path, into an MP4 file.

    Raises:
        RenderingError: EGL is missing.
        OutputFolderError: OpenCV cannot write the film.
    """
    log, servo = result.log, result.servo
    scenario, pinhole = servo.scenario, servo.pinhole

    builder = DiagramBuilder()
    block = builder.AddNamedSystem("robot", pictured_robot(servo.robot, scenario))
    add_renderer(block.scene_graph)
    sensor = add_sensor(builder, block, servo.mounting, pinhole)
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    rate = film_rate(result)
    film = cv2.VideoWriter(
        str(path), cv2.VideoWriter.fourcc(*"mp4v"), rate, (pinhole.width, pinhole.height)
    )
    if not film.isOpened():
        raise OutputFolderError(f"{path}: OpenCV cannot write this film")
    times, track, line = image_path(result)
    # Paths and marks are read: in the image they are where the lens puts them.
    track, line = (pinhole.found_at(path.T).T for path in (track, line))
    # A log on disk is read where it is looked at.
    log_times, poses, found = log["time"], log["X_WP"], log["found"]
    marks = log[f"{servo.target.mark}_px"]
    for index in film_rows(result):
        now = float(log_times[index])
        context.SetTime(now)
        plant_context = block.plant.GetMyMutableContextFromRoot(context)
        block.in_plant.set_pose(plant_context, pose_from_row(poses[index]))
        rgb = sensor.GetOutputPort("color_image").Eval(sensor.GetMyContextFromRoot(context)).data
        picture = cv2.cvtColor(rgb[:, :, :3], cv2.COLOR_RGB2BGR)
        _draw_track(picture, track[times <= now], line)
        if found[index, 0] > 0.0:
            own = marks[index]
            if not pinhole.is_ideal:
                own = found_marks(own, servo.target.mark, servo.target.size, pinhole)
            _draw_marks(picture, servo.target.mark, own)
        cv2.putText(
            picture, f"{now:6.2f} s", (10, 28), cv2.FONT_HERSHEY_SIMPLEX, 0.8, (20, 20, 20), 2
        )
        film.write(picture)
    film.release()


def _draw_marks(picture: np.ndarray, mark: str, marks: Array) -> None:
    if mark == "corners":
        for four in marks.reshape(-1, 4, 2):
            cv2.polylines(picture, [np.round(four).astype(np.int32)], True, _CORNER_COLOR, 2)
        return
    for u, v, n20, n11, n02 in marks.reshape(-1, ELLIPSE_SIZE):
        values, vectors = np.linalg.eigh(np.array([[n20, n11], [n11, n02]]))
        axes = tuple(round(2.0 * np.sqrt(value)) for value in np.maximum(values, 0.0))
        angle = float(np.degrees(np.arctan2(vectors[1, 0], vectors[0, 0])))
        cv2.ellipse(picture, (round(u), round(v)), axes, angle, 0.0, 360.0, _CORNER_COLOR, 2)


def _draw_track(picture: np.ndarray, track: np.ndarray, line: np.ndarray) -> None:
    start, end = (tuple(round(value) for value in point) for point in line)
    cv2.line(picture, start, end, _LINE_COLOR, 1, cv2.LINE_AA)
    if len(track) > 1:
        cv2.polylines(
            picture, [np.round(track).astype(np.int32)], False, _PATH_COLOR, 2, cv2.LINE_AA
        )

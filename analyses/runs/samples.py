"""Samples and images of a run at an instant, as the studio shows them."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from pydrake.systems.framework import Context, Diagram

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_error, pose_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.palette import DESIRED, ESTIMATED, rgb
from cdpr_drake.servoing.circle_features import ELLIPSE_SIZE
from cdpr_drake.systems.cameras.region_camera import RegionCamera
from cdpr_drake.systems.diagrams.servo_models import ServoModel, servo_model
from cdpr_drake.systems.diagrams.torque_control import tension_limits
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.run_settings import ScenarioHeader
from cdpr_drake.systems.scenarios.tension_control_scenario import TensionScenario
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario

LARGEST_WIDTH, QUALITY, PAPER = 640, 80, 246
"""Width of images at most [px], their quality as JPEG, and grey of an image of marks alone."""


class Samples:
    """Reads samples and images of a run from the exported ports of its diagram, by their names."""

    def __init__(self, scenario: Any) -> None:
        """For a scenario of any kind that moves a robot."""
        self._scenario, self._robot = scenario, load_robot(scenario.robot)
        self._model: ServoModel | None = None
        if isinstance(scenario, Scenario):
            self._model = servo_model(scenario, self._robot)
            self._picture = MarksPicture(self._model)

    def header(self) -> dict[str, Any]:
        """Data of the message `begin`, but for `takes`."""
        scenario, robot = self._scenario, self._robot
        return {
            "scenario": scenario.name, "title": scenario.title, "robot": robot.name,
            "cables": [cable.name for cable in robot.cables],
            "limits": list(shown_limits(scenario, robot)),
            "duration": scenario.duration, "period": 1.0 / scenario.log_rate,
        }  # fmt: skip

    def sample(self, diagram: Diagram, context: Context) -> dict[str, Any]:
        """Data of the message `sample`."""

        def read(name: str) -> Any:
            return diagram.GetOutputPort(name).Eval(context)

        X_WP, unstrained, outcome = read("X_WP"), None, Outcome.RUNNING
        if diagram.HasOutputPort("unstrained_lengths"):
            unstrained = read("unstrained_lengths").tolist()
        if diagram.HasOutputPort("outcome"):
            outcome = Outcome(int(read("outcome")[0]))
        if self._model is not None:
            distance, angle = self._model.seen_error(X_WP, context.get_time())
        else:
            distance, angle = pose_error(X_WP, read("X_WP_desired"))
        return {
            "t": context.get_time(),
            "position_error": float(distance), "rotation_error": float(angle),
            "tensions": read("tensions").tolist(), "lengths": read("lengths").tolist(),
            "unstrained": unstrained, "pose": pose_row(X_WP).tolist(),
            "outcome": outcome.name.lower(),
        }  # fmt: skip

    def image(self, diagram: Diagram, context: Context) -> bytes:
        """The camera's image as JPEG, with marks as measured and as desired; empty without one."""
        if self._model is None:
            return b""
        marks = None
        if diagram.GetOutputPort("found").Eval(context)[0] != 0.0:
            marks = diagram.GetOutputPort(self._model.target.mark).Eval(context)
        camera, image = diagram.GetSubsystemByName("camera"), None
        own = camera.GetMyContextFromRoot(context)
        if isinstance(camera, RegionCamera):
            image = camera.picture(own)
        elif camera.HasOutputPort("color_image"):
            image = camera.GetOutputPort("color_image").Eval(own).data
        return self._picture.jpeg(marks, image)


def shown_limits(scenario: ScenarioHeader, robot: Robot) -> tuple[float, float]:
    """Smallest and largest tension [N] that a run is judged by."""
    if isinstance(scenario, TensionScenario):
        return robot.tension_limits(scenario.limits())
    if isinstance(scenario, Scenario) and scenario.winches.mode == "torque":
        return tension_limits(scenario, robot)
    return robot.tension_limits()


class MarksPicture:
    """Draws images of the camera of a visual servo, with marks on them."""

    def __init__(self, model: ServoModel) -> None:
        """For the camera and the target of a visual servo."""
        target, pinhole = model.target, model.pinhole
        self._mark, self._scale = target.mark, min(1.0, LARGEST_WIDTH / pinhole.width)
        self._size = (round(pinhole.width * self._scale), round(pinhole.height * self._scale))
        no_noise = np.random.default_rng(0)
        self._desired = target.project(model.X_CdO, pinhole, 0.0, no_noise)

    def jpeg(self, marks: Array | None, image: np.ndarray | None) -> bytes:
        """An image as JPEG.

        Args:
            marks: Marks as measured, shape (size,) [px]; None: none.
            image: What the camera sees, shape (height, width, 3 or 4), red first; None: paper.
        """
        if image is None:
            picture = np.full((self._size[1], self._size[0], 3), PAPER, np.uint8)
        else:
            whole = cv2.cvtColor(np.ascontiguousarray(image[:, :, :3]), cv2.COLOR_RGB2BGR)
            picture = cv2.resize(whole, self._size, interpolation=cv2.INTER_AREA)
        for shown, look, width in ((marks, ESTIMATED, 3), (self._desired, DESIRED, 1)):
            if shown is not None:
                color = tuple(round(255.0 * value) for value in reversed(rgb(look.color)))
                draw = self._draw_points if self._mark == "corners" else self._draw_ellipses
                draw(picture, shown, color, width)
        _, coded = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
        return coded.tobytes()

    def _draw_points(self, picture: np.ndarray, marks: Array, color: Any, width: int) -> None:
        """Points, and the outlines of tags if there are four points each."""
        points = self._scale * marks.reshape(-1, 2)
        for four in points.reshape(-1, 4, 2) if len(points) % 4 == 0 else ():
            if np.all(np.isfinite(four)):
                corners = np.round(four).astype(np.int32)
                cv2.polylines(picture, [corners], True, color, width, cv2.LINE_AA)
        for u, v in points[np.all(np.isfinite(points), axis=1)]:
            cv2.circle(picture, (round(float(u)), round(float(v))), 3, color, -1, cv2.LINE_AA)

    def _draw_ellipses(self, picture: np.ndarray, marks: Array, color: Any, width: int) -> None:
        for ellipse in marks.reshape(-1, ELLIPSE_SIZE):
            if not np.all(np.isfinite(ellipse)):
                continue
            u, v, n20, n11, n02 = ellipse
            values, vectors = np.linalg.eigh(np.array([[n20, n11], [n11, n02]]))
            axes = [2.0 * self._scale * float(np.sqrt(value)) for value in np.maximum(values, 0.0)]
            angle = float(np.degrees(np.arctan2(vectors[1, 0], vectors[0, 0])))
            center = (round(self._scale * float(u)), round(self._scale * float(v)))
            size = (round(axes[0]), round(axes[1]))
            cv2.ellipse(picture, center, size, angle, 0.0, 360.0, color, width, cv2.LINE_AA)
            cv2.circle(picture, center, 2, color, -1, cv2.LINE_AA)

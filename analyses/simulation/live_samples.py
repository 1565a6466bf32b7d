"""What a moment of a run shows: from the exported ports of its diagram, by their names."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, Diagram

from cdpr_drake.analyses.simulation.live_messages import Message
from cdpr_drake.analyses.simulation.mark_images import MarksPicture
from cdpr_drake.geometry.poses import pose_error, pose_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.cameras.region_camera import RegionCamera
from cdpr_drake.systems.diagrams.servo_models import ServoModel, servo_model
from cdpr_drake.systems.diagrams.torque_control import tension_limits
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.run_settings import ScenarioHeader
from cdpr_drake.systems.scenarios.tension_control_scenario import TensionScenario
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario

Errors = Callable[[Diagram, Context, RigidTransform], tuple[float, float]]
"""Distance [m] and angle [rad] of a platform at X_WP from what is wanted at the context's time."""


class Moments:
    """Reads samples and images of one run out of its diagram."""

    def __init__(self, scenario: Any) -> None:
        """For a scenario of any kind."""
        self._scenario, self._robot = scenario, load_robot(scenario.robot)
        self._model: ServoModel | None = None
        self._picture: MarksPicture | None = None
        if isinstance(scenario, Scenario):
            self._model = servo_model(scenario, self._robot)
            self._picture = MarksPicture(self._model)

    def begin(self) -> Message:
        """What is said before the run starts, see `live_messages`."""
        scenario, robot = self._scenario, self._robot
        return Message(
            "begin",
            {
                "scenario": scenario.name,
                "title": scenario.title,
                "robot": robot.name,
                "cables": [cable.name for cable in robot.cables],
                "limits": list(shown_limits(scenario, robot)),
                "duration": scenario.duration,
                "period": 1.0 / scenario.log_rate,
            },
        )

    def sample(self, diagram: Diagram, context: Context) -> Message:
        """Where the run stands."""

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
        return Message(
            "sample",
            {
                "t": context.get_time(),
                "position_error": float(distance),
                "rotation_error": float(angle),
                "tensions": read("tensions").tolist(),
                "lengths": read("lengths").tolist(),
                "unstrained": unstrained,
                "pose": pose_row(X_WP).tolist(),
                "outcome": outcome.name.lower(),
            },
        )

    def image(self, diagram: Diagram, context: Context) -> Message | None:
        """What the camera sees, with marks that it found and where they shall be; None: no
        camera."""
        if self._model is None or self._picture is None:
            return None
        found = diagram.GetOutputPort("found").Eval(context)[0] != 0.0
        marks = diagram.GetOutputPort(self._model.target.mark).Eval(context) if found else None
        jpeg = self._picture.jpeg(marks, _camera_image(diagram, context))
        return Message("image", {"t": context.get_time()}, jpeg)


def shown_limits(scenario: ScenarioHeader, robot: Robot) -> tuple[float, float]:
    """Smallest and largest tension [N] that a run is judged by."""
    if isinstance(scenario, TensionScenario):
        return robot.tension_limits(scenario.limits())
    if isinstance(scenario, Scenario) and scenario.winches.mode == "torque":
        return tension_limits(scenario, robot)
    return robot.tension_limits()


def _camera_image(diagram: Diagram, context: Context) -> np.ndarray | None:
    """What the camera of a visual servo sees now, shape (height, width, 4); None: nothing is
    rendered."""
    camera = diagram.GetSubsystemByName("camera")
    own = camera.GetMyContextFromRoot(context)
    if isinstance(camera, RegionCamera):
        return camera.picture(own)
    if not camera.HasOutputPort("color_image"):
        return None
    image: np.ndarray = camera.GetOutputPort("color_image").Eval(own).data
    return image

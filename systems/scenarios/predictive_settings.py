"""Scenario section `predictive`: tensions by a program over the time ahead.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass

import numpy as np

from cdpr_drake.errors import ScenarioError
from cdpr_drake.models import Robot, load_camera
from cdpr_drake.planning import View
from cdpr_drake.schema import array, text, whole


@dataclass(kw_only=True)
class PredictiveSettings:
    """Predictive control in the place of computed torque, at the rate of `controller`.

    Its program takes a millisecond or more: rates of 50 to 200 Hz are usual.
    """

    steps: int = whole("Steps of control that it looks ahead.", 10, at_least=2, at_most=100)
    mount: str | None = text(
        "Mounting on the platform of the camera that keeps `points` in view; null: none.", None
    )
    points: np.ndarray | None = array("Points in W that stay in view.", "m", (None, 3), None)

    def view(self, robot: Robot) -> View | None:
        """What is kept in view.

        Raises:
            ScenarioError: The robot has no such camera on its platform, or one of mount and points
                is missing.
        """
        if (self.mount is None) != (self.points is None):
            missing = "mount" if self.mount is None else "points"
            raise ScenarioError(f"predictive.{missing}: found null; accepted: both, or neither")
        if self.mount is None or self.points is None:
            return None
        known = [mount for mount in robot.cameras if mount.parent == "platform"]
        found = [mount for mount in known if mount.name == self.mount]
        if not found:
            names = ", ".join(mount.name for mount in known) or "none on its platform"
            raise ScenarioError(
                f"predictive.mount: found {self.mount!r}; accepted for {robot.name}: {names}"
            )
        camera = load_camera(found[0].model)
        angles = camera.view_angle_horizontal_deg, camera.view_angle_vertical_deg
        slopes = np.tan(np.radians(angles) / 2.0)
        return View(found[0].pose.transform(), (float(slopes[0]), float(slopes[1])), self.points.T)

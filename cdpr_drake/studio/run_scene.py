"""The scene of runs: the robot of a run in the Meshcat of a workbench."""

from __future__ import annotations

from asyncio import Future
from collections.abc import Mapping
from time import monotonic
from typing import Any

import numpy as np

from cdpr_drake.analyses.visualization.replay import RobotPicture
from cdpr_drake.cables.models import ELASTIC
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.palette import nth_look
from cdpr_drake.studio.results import Subject
from cdpr_drake.studio.scene import WORKSPACE, RobotScene, look_at_robot
from cdpr_drake.studio.session import Workbench
from cdpr_drake.systems.robots.settings import CableSettings
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario

PATHS = ("visualizer", "cables", "studio", WORKSPACE)
"""What is taken out of a scene before a run's robot is put there."""


class RunScene:
    """Draws runs into a workbench's scene while the run panel is shown.

    Attributes:
        sample: The sample of a run that is there, or on its way; None: the open robot is there.
    """

    def __init__(self) -> None:
        """Without a run."""
        self.sample: Mapping[str, Any] | None = None
        self._busy, self._drawn = False, 0.0
        # Of the calculator's thread: the robot of a scenario.
        self._scenario: Any = None
        self._picture: RobotPicture

    def draw(
        self, bench: Workbench, scenario: Any, subject: Subject | None,
        sample: Mapping[str, Any], wait: float,
    ) -> None:  # fmt: skip
        """Draws a sample of a run, unless it is there, or one was drawn less than `wait` before [s]
        or is being drawn; to be called again and again."""
        if sample is self.sample or self._busy or monotonic() - self._drawn < wait:
            return
        self.sample, self._busy, dark = sample, True, bool(bench.dark)

        def done(future: Future[None]) -> None:
            self._busy, self._drawn = False, monotonic()
            if future.exception() is None and self.sample is not None:
                bench.draws(subject)

        bench.draw(lambda scene: self._draw(scene, scenario, sample, dark), done)

    def give_back(self, bench: Workbench) -> None:
        """Lets the open robot be shown again."""
        if self.sample is not None:
            self.sample = None
            bench.draw(self._leave)
            bench.draws(None)
            bench.ask()

    def _leave(self, scene: RobotScene) -> None:
        self._scenario = None
        scene.redraw()

    def _draw(
        self, scene: RobotScene, scenario: Any, sample: Mapping[str, Any], dark: bool
    ) -> None:
        if scenario is not self._scenario:
            for path in PATHS:
                scene.meshcat.Delete(path)
            self._scenario, self._picture = scenario, _picture(scene, scenario)
            scene.set_dark(dark)
        unstrained = sample["unstrained"]
        self._picture.draw(
            pose_from_row(np.array(sample["pose"], float)),
            np.array(sample["tensions"], float),  # None becomes NaN
            float(sample["t"]),
            None if unstrained is None else np.array(unstrained, float),
        )


def _picture(scene: RobotScene, scenario: Any) -> RobotPicture:
    """The robot of a scenario and all that is round it."""
    robot = load_robot(scenario.robot)
    servo, cables, world = scenario, None, None
    if not isinstance(scenario, Scenario):
        servo, world = None, scenario.world
        cables = CableSettings(model=ELASTIC, pulleys=scenario.cables.pulleys)
    picture = RobotPicture(
        robot, robot.tension_limits()[1], servo, cables, meshcat=scene.meshcat, world=world,
        colors=[nth_look(k).color for k in range(len(robot.cables))],
    )  # fmt: skip
    look_at_robot(scene.meshcat, robot)
    return picture

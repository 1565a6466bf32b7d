"""Draws a run into Meshcat."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from pydrake.geometry import Meshcat

from cdpr_drake.analyses.pictures import RobotPicture
from cdpr_drake.arrays import Array
from cdpr_drake.models import load_robot
from cdpr_drake.palette import nth_look
from cdpr_drake.spatial import pose_from_row
from cdpr_drake.systems.robots import CableSettings
from cdpr_drake.systems.scenarios import Scenario, TensionScenario

PATHS = ("visualizer", "cables", "studio")
"""What is taken out of a scene before a run's robot is put there."""


class RunScene:
    """The robot of a run in a Meshcat; all of it belongs to the thread that made that.

    Attributes:
        robot: The robot.
    """

    def __init__(self, meshcat: Meshcat, scenario: Scenario | TensionScenario) -> None:
        """Puts the robot of a scenario and all that is round it into a scene."""
        for path in PATHS:
            meshcat.Delete(path)
        robot = self.robot = load_robot(scenario.robot)
        servo, cables, world = None, None, None
        if isinstance(scenario, Scenario):
            servo = scenario
        else:
            cables, world = CableSettings(pulleys=scenario.cables.pulleys), scenario.world
        self._picture = RobotPicture(
            robot, robot.tension_limits()[1], servo, cables, meshcat=meshcat, world=world,
            colors=[nth_look(k).color for k in range(len(robot.cables))],
        )  # fmt: skip

    def draw(self, sample: Mapping[str, Any]) -> None:
        """Draws a sample of the run."""
        unstrained = sample["unstrained"]
        self._picture.draw(
            pose_from_row(np.array(sample["pose"], float)),
            _numbers(sample["tensions"]),
            float(sample["t"]),
            None if unstrained is None else _numbers(unstrained),
        )


def _numbers(values: list[float | None]) -> Array:
    return np.array([np.nan if value is None else value for value in values], float)

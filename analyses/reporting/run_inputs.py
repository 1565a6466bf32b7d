"""What a run was made of, beside its results: somebody else can repeat it from the folder."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydrake.common.yaml import yaml_dump_typed

from cdpr_drake.analyses.reporting.log_files import write_scenario
from cdpr_drake.models import Robot, portable_robot

ROBOT_FILE = "robot.yaml"
"""The robot of a run, in its folder."""


def write_run_inputs(folder: Path, scenario: Any, robot: Robot) -> None:
    """Writes robot and scenario as they were run, overrides included, into an existing folder.

    The mesh of a platform is copied beside them.

    The scenario names the robot's file beside it, so an installed robot of the same name does not
    count when the folder is run again.

    Args:
        folder: Where to.
        scenario: A dataclass with the field `robot`.
        robot: The robot that was simulated.
    """
    portable, files = portable_robot(robot)
    for file in files:
        shutil.copy(file, folder / file.name)
    (folder / ROBOT_FILE).write_text(yaml_dump_typed(portable), encoding="utf-8")
    write_scenario(folder / "scenario.yaml", replace(scenario, robot=ROBOT_FILE))

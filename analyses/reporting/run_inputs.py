"""What a run was made of, beside its results: somebody else can repeat it from the folder."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from pydrake.common.yaml import yaml_dump_typed

from cdpr_drake.analyses.reporting.log_files import write_scenario
from cdpr_drake.models import load_robot

ROBOT_FILE = "robot.yaml"
"""The robot of a run, in its folder."""

BELIEVED_FILE = "believed_robot.yaml"
"""The robot that its controller believes in, if it is another one."""


def write_run_inputs(folder: Path, scenario: Any, robot: object) -> None:
    """Writes robot and scenario as they were run, overrides included, into an existing folder.

    The scenario names the robot's file beside it, so an installed robot of the same name does not
    count when the folder is run again; so it does for a robot that its controller believes in.

    Args:
        folder: Where to.
        scenario: A dataclass with the field `robot`.
        robot: The robot that was simulated.
    """
    (folder / ROBOT_FILE).write_text(yaml_dump_typed(robot), encoding="utf-8")
    written = replace(scenario, robot=ROBOT_FILE)
    perturbations = getattr(scenario, "perturbations", None)
    if perturbations is not None and perturbations.believed_robot is not None:
        believed = yaml_dump_typed(load_robot(perturbations.believed_robot))
        (folder / BELIEVED_FILE).write_text(believed, encoding="utf-8")
        written.perturbations = replace(perturbations, believed_robot=BELIEVED_FILE)
    write_scenario(folder / "scenario.yaml", written)

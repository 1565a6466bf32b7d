"""What a run was made of, beside its results: somebody else can repeat it from the folder."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydrake.common.yaml import yaml_dump_typed

from cdpr_drake.analyses.reporting.log_files import write_scenario, write_whole
from cdpr_drake.analyses.reporting.written_files import whole_file
from cdpr_drake.models import Robot, load_robot, portable_robot

ROBOT_FILE = "robot.yaml"
"""The robot of a run, in its folder."""

MOTION_FILE = "motion.csv"
"""The motion that it tracked, if that came from a file."""

BELIEVED_FILE = "believed_robot.yaml"
"""The robot that its controller believes in, if it is another one."""


def write_run_inputs(folder: Path, scenario: Any, robot: Robot) -> None:
    """Writes robot and scenario as they were run, overrides included, into an existing folder.

    The mesh of a platform is copied beside them.

    The scenario names the robot's file beside it, so an installed robot of the same name does not
    count when the folder is run again; so it does for a robot that its controller believes in, and
    for the file of a motion.

    Args:
        folder: Where to.
        scenario: A dataclass with the field `robot`.
        robot: The robot that was simulated.
    """
    written = replace(scenario, robot=_write(folder / ROBOT_FILE, robot))
    perturbations = getattr(scenario, "perturbations", None)
    if perturbations is not None and getattr(perturbations, "believed_robot", None) is not None:
        believed = _write(folder / BELIEVED_FILE, load_robot(perturbations.believed_robot))
        written.perturbations = replace(perturbations, believed_robot=believed)
    trajectory = getattr(scenario, "trajectory", None)
    if trajectory is not None and getattr(trajectory, "file", None) is not None:
        _copy(Path(trajectory.file), folder / MOTION_FILE)
        written.trajectory = replace(trajectory, file=MOTION_FILE)
    write_scenario(folder / "scenario.yaml", written)


def _write(path: Path, robot: Robot) -> str:
    """Writes a robot with the files that it names beside it; gives its own file's name."""
    portable, files = portable_robot(robot)
    for file in files:
        _copy(file, path.parent / file.name)
    write_whole(path, yaml_dump_typed(portable))
    return path.name


def _copy(file: Path, path: Path) -> None:
    """Copies a file, whole or not at all."""
    with whole_file(path) as part:
        shutil.copy(file, part)

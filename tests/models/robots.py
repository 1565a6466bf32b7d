"""Robots that differ from those of the package in their hardware, from changed robot files."""

from __future__ import annotations

from pathlib import Path

import yaml

from cdpr_drake.models.robot_loader import parse_robot, robot_text
from cdpr_drake.models.robot_schema import Robot


def content_of(name: str = "acrobot_small") -> dict:
    """The robot file of a robot, as YAML gives it."""
    return yaml.safe_load(robot_text(name))


def robot_of(content: dict) -> Robot:
    """The robot of a robot file."""
    return parse_robot(yaml.safe_dump(content, sort_keys=False), Path("robot.yaml"))

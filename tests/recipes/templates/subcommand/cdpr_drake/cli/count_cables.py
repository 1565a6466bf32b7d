"""`cdpr count-cables`: how many cables a robot has."""

from __future__ import annotations

from typing import Annotated

import typer

from cdpr_drake.cli.options import AsJson
from cdpr_drake.cli.terminal import print_json
from cdpr_drake.models.robot_loader import load_robot


def count_cables(
    robot: Annotated[str, typer.Argument(help="Name or path.")], as_json: AsJson = False
) -> int:
    """Counts the cables of a robot."""
    count = len(load_robot(robot).cables)
    print_json({"cables": count}) if as_json else print(f"{count} cables")
    return 0

"""The tasks by name, and how one is made of options."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from cdpr_drake.analyses.learning.handling_task import HandlingTask
from cdpr_drake.analyses.learning.reach_task import ReachTask
from cdpr_drake.analyses.learning.robot_task import RobotTask
from cdpr_drake.analyses.learning.track_task import TrackTask
from cdpr_drake.analyses.learning.visual_servo_task import VisualServoTask
from cdpr_drake.errors import CdprError, accepted_names

TASKS: dict[str, type[RobotTask]] = {
    "Reach": ReachTask,
    "Track": TrackTask,
    "VisualServo": VisualServoTask,
    "PickAndPlace": HandlingTask,
}
"""Names, as in `cdpr/Reach-v0`, and what they are."""


def make_task(name: str, count: int = 1, **options: Any) -> RobotTask:
    """A task of `TASKS` for so many robots.

    Args:
        name: Its name.
        count: Number of robots.
        options: Fields of its `Options`.

    Raises:
        CdprError: There is no such task or option, or one is not accepted.
    """
    if name not in TASKS:
        raise CdprError(f"task: found {name!r}; {accepted_names(name, TASKS)}")
    kind = TASKS[name]
    known = [field.name for field in fields(kind.Options)]
    for option in options:
        if option not in known:
            raise CdprError(f"{name}: found option {option!r}; {accepted_names(option, known)}")
    if count < 1:
        raise CdprError(f"count: found {count}; accepted: 1 or more")
    return kind(count, kind.Options(**options))

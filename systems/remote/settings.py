"""Scenario section `remote`: a process outside closes the loop."""

from collections.abc import Collection
from pathlib import Path
from typing import Annotated, Any

from cdpr_drake.errors import ScenarioError, accepted_names
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.declarations import In, OneOf, settings
from cdpr_drake.systems.remote.remote_driver import SyncMode
from cdpr_drake.systems.remote.remote_place import SERVO_PLACES, TENSION_PLACES, TWIST

PLACES = (*TENSION_PLACES, *SERVO_PLACES)


@settings
class RemoteSettings:
    """Where a process outside stands, and how the run waits for it; see cdpr serve."""

    place: Annotated[
        str,
        OneOf(PLACES),
        "Which block it replaces: distributor, controller or trajectory of dynamic "
        "control, or servo (cable velocities) or twist (of the platform) of a visual "
        "servo.",
    ]
    pace: Annotated[
        str,
        OneOf(tuple(pace.value for pace in SyncMode)),
        "Whether the run waits for each command, or goes on in real time with the last one.",
    ] = SyncMode.LOCK_STEP.value
    timeout: Annotated[
        float, In("s", gt=0.0, le=86400.0), "Silence of the process after which the run ends."
    ] = 10.0


def check_place(settings: RemoteSettings | None, accepted: Collection[str], path: Path) -> None:
    """Refuses a place that a scenario does not have.

    Args:
        settings: The section; None: nobody stands anywhere.
        accepted: Places that there are.
        path: The scenario's file, for the message.

    Raises:
        ScenarioError: It is none of them.
    """
    if settings is not None and settings.place not in accepted:
        known = accepted_names(settings.place, accepted)
        raise ScenarioError(f"{path}: remote.place: found {settings.place}; {known}")


def check_servo_place(scenario: Any, robot: Robot, path: Path) -> None:
    """Refuses a place that a visual servo does not have, or what contradicts it.

    Raises:
        ScenarioError: See above.
    """
    check_place(scenario.remote, SERVO_PLACES, path)
    if scenario.remote is None:
        return
    for key in ("open_loop", "pose_plan"):
        if getattr(scenario, key) is not None:
            raise ScenarioError(f"{path}: {key}: found a section with remote; accepted: null")
    if scenario.winches.mode == "torque" and scenario.remote.place != TWIST:
        raise ScenarioError(
            f"{path}: remote.place: found {scenario.remote.place} with winches.mode torque; "
            f"accepted: {TWIST}"
        )

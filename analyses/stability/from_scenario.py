"""The task of a scenario as a question of stability has it: camera, object, desired view."""

from __future__ import annotations

from cdpr_drake.analyses.stability.question import CameraTask
from cdpr_drake.errors import StabilityError
from cdpr_drake.models import load_robot
from cdpr_drake.stability import FixedObject
from cdpr_drake.systems.diagrams import load_scenario


def scenario_task(robot: str, scenario: str) -> CameraTask:
    """What a scenario's camera sees and shall see.

    Args:
        robot: Name or path of the robot, in the place of the scenario's.
        scenario: Name or path of a visual servo's scenario.

    Returns:
        The object where the scenario has it, the view that it wants, the robot's camera mounting
        that it uses, and the interaction matrix that its servo really uses: that of the object's
        position, not of the error.

    Raises:
        StabilityError: The object moves, or the camera is not on the platform: the criterion is
            about neither.
        ScenarioError: There is no such scenario, or the robot does not fit into it.
    """
    loaded = load_scenario(scenario, [f"robot={robot}"])
    where = f"--scenario {scenario}"
    if loaded.target.carrier != "world":
        raise StabilityError(
            f"{where}: found target.carrier {loaded.target.carrier}; accepted: world, with the "
            "camera on the platform"
        )
    if loaded.target.motion is not None:
        raise StabilityError(f"{where}: found target.motion; accepted: an object that rests")
    return CameraTask(
        FixedObject(loaded.target.pose.transform(), loaded.desired.transform()),
        load_robot(robot).camera_mount(loaded.camera.mount).pose.transform(),
        "object",
    )

"""A robot that looks for a box, takes it, and sets it down where a tag says.

`HandlingTask` is the phases as a function; `HandlingMachine` puts them into a diagram, between
cameras that look when they are asked to, dead reckoning, a visual servo and a `Gripper`. The box is
a free body of the plant, which contact holds on the table and the gripper's compliance on the
platform. Frames: W the world, P the platform, B the box, G the goal (B once it is set down), O and
T the tags of box and goal, C a camera.

Source: servoing thesis 5.4, which names occlusion in pick and place and several cameras against it.
"""

from cdpr_drake.systems.handling.beliefs import camera_poses
from cdpr_drake.systems.handling.cameras import pinholes
from cdpr_drake.systems.handling.gripper import HOLDING, MISSED, OPEN, TORN, GripLaw, Gripper
from cdpr_drake.systems.handling.handling_machine import HandlingMachine
from cdpr_drake.systems.handling.handling_task import (
    FAILURE_WORDS,
    Failure,
    HandlingGeometry,
    HandlingRules,
    HandlingState,
    HandlingTask,
    Phase,
    Reading,
)
from cdpr_drake.systems.handling.pick_and_place import (
    PickAndPlace,
    build_pick_and_place,
    handling_task,
)
from cdpr_drake.systems.handling.tag_cameras import box_hides
from cdpr_drake.systems.handling.tag_cover import COVER_COLOR, TagCover, cover_plate
from cdpr_drake.systems.handling.workpiece import GRIPPER_COLOR, placed_tags, stem

__all__ = [
    "COVER_COLOR", "FAILURE_WORDS", "GRIPPER_COLOR", "HOLDING", "MISSED", "OPEN", "TORN",
    "Failure", "GripLaw", "Gripper", "HandlingGeometry", "HandlingMachine", "HandlingRules",
    "HandlingState", "HandlingTask", "Phase", "PickAndPlace", "Reading", "TagCover", "box_hides",
    "build_pick_and_place", "camera_poses", "cover_plate", "handling_task", "pinholes",
    "placed_tags", "stem",
]  # fmt: skip

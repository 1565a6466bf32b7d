"""The law of visual servoing: from features to the twist of the platform and cable velocities.

v_C = L^+ (-lambda e + ds*/dt), turned into the platform's twist and from there into cable
velocities by the believed robot. Gains fall with the error, targets may move, features may follow
a plan. `ServoLaw.partition` takes the optical axis first, `ServoLaw.switching` chooses between pose
and image.

Source: servoing thesis 1.4 and 4.2, (4.2) for (1.60) and (1.61), whose sign is wrong.
"""

from cdpr_drake.servoing.believed_robot import BelievedRobot
from cdpr_drake.servoing.camera_mounting import CameraMounting
from cdpr_drake.servoing.controller import Command, ServoController
from cdpr_drake.servoing.feature_plan import PROFILES, FeaturePlan
from cdpr_drake.servoing.gain import AdaptiveGain, saturation_share
from cdpr_drake.servoing.law_numbers import GOALS, MODES
from cdpr_drake.servoing.servo_law import (
    FRAMES,
    AxisPartition,
    EdgeField,
    ModeSwitching,
    ServoLaw,
    YawTask,
)
from cdpr_drake.servoing.step_kernel import (
    look_and_step,
    look_and_step_at,
    servo_step,
    step_addresses,
    task_at,
)
from cdpr_drake.servoing.target_motion import KINDS, MotionFilter
from cdpr_drake.servoing.task import INTERACTIONS, ServoTask, make_task

__all__ = [
    "FRAMES", "GOALS", "INTERACTIONS", "KINDS", "MODES", "PROFILES", "AdaptiveGain",
    "AxisPartition", "BelievedRobot", "CameraMounting", "Command", "EdgeField", "FeaturePlan",
    "ModeSwitching", "MotionFilter", "ServoController", "ServoLaw", "ServoTask", "YawTask",
    "look_and_step", "look_and_step_at", "make_task", "saturation_share", "servo_step",
    "step_addresses", "task_at",
]  # fmt: skip

"""Cable robots as Drake blocks: cables, winches, platform pose, or all of them as one.

`add_cable_robot` puts cables and winches on a platform that is in somebody's plant; `CableRobot`
is a whole robot as one Diagram, made by it. Settings stand in `settings`; robots come from
`cdpr_drake.models`. Cable order is that of the robot's file, lengths are positive when paid out.

Source: servoing thesis 2.2 and 2.3; each block names its own.
"""

from cdpr_drake.systems.robots.assembly import (
    CableRobotPorts,
    RobotBlock,
    SceneAdder,
    add_cable_robot,
    apply_force,
    held_start,
)
from cdpr_drake.systems.robots.cable_forces import CableForces, CableForces_, simulated_cables
from cdpr_drake.systems.robots.cable_robot import (
    SEMI_IMPLICIT,
    SEMI_IMPLICIT_STEP,
    STEP_SHARE,
    CableRobot,
    automatic_step,
    holding_tensions,
)
from cdpr_drake.systems.robots.compiled_cable_robot import (
    CompiledCableRobot,
    motion_by_tensions,
    winch_drive,
)
from cdpr_drake.systems.robots.compiled_motion import MEMORY, CompiledMotion
from cdpr_drake.systems.robots.compiled_step import (
    PackedRule,
    StepRule,
    motion_problem,
    resting_state,
)
from cdpr_drake.systems.robots.motor_winch import MotorWinch
from cdpr_drake.systems.robots.platform_pose import PlatformPose, PlatformPose_
from cdpr_drake.systems.robots.settings import (
    AUTOMATIC,
    COMPILED,
    ENGINES,
    PLANT,
    CableRobotSettings,
    CableSettings,
    DampingSettings,
    WinchSettings,
)
from cdpr_drake.systems.robots.tension_driven_cables import TensionDrivenCables
from cdpr_drake.systems.robots.ups_robot import UpsRobot
from cdpr_drake.systems.robots.velocity_winch import VelocityWinch
from cdpr_drake.systems.robots.winches import make_winches

__all__ = [
    "AUTOMATIC", "COMPILED", "ENGINES", "MEMORY", "PLANT", "SEMI_IMPLICIT", "SEMI_IMPLICIT_STEP",
    "STEP_SHARE", "CableForces", "CableForces_", "CableRobot", "CableRobotPorts",
    "CableRobotSettings", "CableSettings", "CompiledCableRobot", "CompiledMotion",
    "DampingSettings", "MotorWinch", "PackedRule", "PlatformPose", "PlatformPose_", "RobotBlock",
    "SceneAdder", "StepRule", "TensionDrivenCables", "UpsRobot", "VelocityWinch", "WinchSettings",
    "add_cable_robot", "apply_force", "automatic_step", "held_start", "holding_tensions",
    "make_winches", "motion_by_tensions", "motion_problem", "resting_state", "simulated_cables",
    "winch_drive",
]  # fmt: skip

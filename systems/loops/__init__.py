"""A visual servo as one loop, without a Drake Diagram: for many runs of it.

`ServoLoop` calls what the blocks of a diagram call, the kernels of the robot and the methods of
camera, servo, estimators, sensors, monitor and tension corrector that know no context, at the times
and in the order of Drake's Simulator. `why_diagram` says which scenarios it cannot do, `with_loop`
chooses. `MotorTracking` tracks a trajectory by motors, and
`RemoteTensionLoop` steps dynamic control that a process outside closes.
"""

from cdpr_drake.systems.loops.loop_choice import (
    check_loop,
    is_looped,
    looped,
    why_diagram,
    with_loop,
)
from cdpr_drake.systems.loops.loop_log import LoopLog
from cdpr_drake.systems.loops.motor_tracking import MotorTracking, TrackingSettings
from cdpr_drake.systems.loops.remote_tension_loop import RemoteTensionLoop, can_be_stepped
from cdpr_drake.systems.loops.robot_motion import RobotMotion
from cdpr_drake.systems.loops.servo_loop import ServoLoop

__all__ = [
    "LoopLog", "MotorTracking", "RemoteTensionLoop", "RobotMotion", "ServoLoop",
    "TrackingSettings", "can_be_stepped", "check_loop",
    "is_looped", "looped", "why_diagram", "with_loop",
]  # fmt: skip

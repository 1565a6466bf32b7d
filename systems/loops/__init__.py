"""A visual servo as one loop, without a Drake Diagram: for many runs of it.

`ServoLoop` calls what the blocks of a diagram call, the kernels of the robot and the methods of
camera, servo, estimators, sensors, monitor and tension corrector that know no context, at the times
and in the order of Drake's Simulator. `why_diagram` says which scenarios it cannot do, `with_loop`
chooses. `RemoteTensionLoop` steps dynamic control that a process outside closes.
"""

from cdpr_drake.systems.loops.loop_choice import (
    check_loop,
    is_looped,
    looped,
    why_diagram,
    with_loop,
)
from cdpr_drake.systems.loops.loop_log import LoopLog
from cdpr_drake.systems.loops.remote_tension_loop import RemoteTensionLoop, can_be_stepped
from cdpr_drake.systems.loops.robot_motion import RobotMotion
from cdpr_drake.systems.loops.servo_loop import ServoLoop

__all__ = [
    "LoopLog", "RemoteTensionLoop", "RobotMotion", "ServoLoop", "can_be_stepped", "check_loop",
    "is_looped", "looped", "why_diagram", "with_loop",
]  # fmt: skip

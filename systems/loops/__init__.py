"""A visual servo as one loop, without a Drake Diagram: for many runs of it.

`ServoLoop` calls what the blocks of a diagram call, the kernels of the robot and the methods of
camera, servo, estimators, sensors and monitor that know no context, at the times and in the order
of Drake's Simulator. `why_diagram` says which scenarios it cannot do.
"""

from cdpr_drake.systems.loops.loop_log import LoopLog
from cdpr_drake.systems.loops.robot_motion import RobotMotion
from cdpr_drake.systems.loops.servo_loop import ServoLoop

__all__ = ["LoopLog", "RobotMotion", "ServoLoop"]

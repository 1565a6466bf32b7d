"""Control of the platform by wrenches, tensions and torques.

Computed torque in task space: w = M (a_d + Kd e_v + Kp e) + C v - f_g as a spatial force on the
platform about Po in W. Visual servoing by torque: the servo's wanted twist gives a wanted
acceleration, that a wrench, that tensions, and these motor torques by a loop around measured
tensions; `TorqueServoLaw` is all of it. `goal_pose` is where a camera sees that the platform shall
be, `GoalPlan` how it gets there.

Source: Gazebo thesis 6.1, (2.24) for (2.17), whose sign is wrong; servoing thesis 5.2.3, 5.2.4,
(5.7) with the sign and the bars that are missing in print, (5.9) as X_C*O is meant.
"""

from cdpr_drake.control.planned_goal import GoalPlan, goal_offset, goal_pose
from cdpr_drake.control.servo_wrench_kernel import twist_from_winches, wanted_acceleration
from cdpr_drake.control.task_space import (
    PlatformDynamics,
    TaskGains,
    TrackingStep,
    computed_torque,
    floating_wrench,
    planar_wrench,
    tracking_wrench,
    tracking_wrench_at,
)
from cdpr_drake.control.tension_controller_kernel import friction_torque, winch_torque
from cdpr_drake.control.torque_law import (
    FALLBACK,
    ServoWrench,
    TensionController,
    TorqueCommand,
    TorqueServoLaw,
)
from cdpr_drake.control.torque_step_kernel import torque_step

__all__ = [
    "FALLBACK", "GoalPlan", "PlatformDynamics", "ServoWrench", "TaskGains", "TensionController",
    "TorqueCommand", "TorqueServoLaw", "TrackingStep", "computed_torque", "floating_wrench",
    "friction_torque", "goal_offset", "goal_pose", "planar_wrench", "torque_step",
    "tracking_wrench", "tracking_wrench_at", "twist_from_winches", "wanted_acceleration",
    "winch_torque",
]  # fmt: skip

"""Control of the platform by wrenches: computed torque in task space.

w = M (a_d + Kd e_v + Kp e) + C v - f_g as a spatial force on the platform about Po in W.

Source: Gazebo thesis 6.1, (2.24) for (2.17), whose sign is wrong.
"""

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

__all__ = [
    "PlatformDynamics", "TaskGains", "TrackingStep", "computed_torque", "floating_wrench",
    "planar_wrench", "tracking_wrench", "tracking_wrench_at",
]  # fmt: skip

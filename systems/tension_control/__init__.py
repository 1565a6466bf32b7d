"""Dynamic control by cable tensions as Drake blocks: trajectory, computed torque, distribution.

Source: Gazebo thesis 6.1 and 6.2.
"""

from cdpr_drake.systems.tension_control.computed_torque import ComputedTorque, platform_dynamics
from cdpr_drake.systems.tension_control.pose_tracking import PoseTracking
from cdpr_drake.systems.tension_control.pose_trajectory_source import PoseTrajectorySource
from cdpr_drake.systems.tension_control.tension_distributor import TensionDistributor

__all__ = [
    "ComputedTorque", "PoseTracking", "PoseTrajectorySource", "TensionDistributor",
    "platform_dynamics",
]  # fmt: skip

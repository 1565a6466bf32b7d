"""Forward kinematics: the pose that fits cable lengths, near a guess.

An answer is a pose that reproduces the lengths, or an error; never the nearest pose alone.

Source: servoing thesis 2.3; Pott, 2018.
"""

from cdpr_drake.kinematics.forward_kinematics import ForwardKinematics, tautest_cables
from cdpr_drake.kinematics.pose_fit_kernel import WORK_SHAPE, fit_pose

__all__ = ["WORK_SHAPE", "ForwardKinematics", "fit_pose", "tautest_cables"]

from .pose_trajectory import PoseTrajectory as PoseTrajectory

"""Robots and poses that tests of workspaces share."""

import numpy as np

from cdpr_drake.analyses.workspaces.static_feasible import static_case
from cdpr_drake.geometry.poses import rotation_from_angles
from cdpr_drake.models.robot_loader import load_robot


def robot_case(name, limits=None, **more):
    robot = load_robot(name)
    return robot, static_case(robot, limits, **more)


def random_poses(robot, count, seed=0, turn=0.3):
    """Positions in the frame and turns, in the plane where the robot has one."""
    random = np.random.default_rng(seed)
    positions = random.uniform(robot.frame.lower, robot.frame.upper, (count, 3))
    angles = random.uniform(-turn, turn, (count, 3))
    if robot.is_planar():
        positions[:, 2] = robot.plane_height
        angles[:, :2] = 0.0
    return positions, np.array([rotation_from_angles(a).matrix() for a in angles])

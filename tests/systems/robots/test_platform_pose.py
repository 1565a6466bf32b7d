"""The platform's pose as a port."""

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant

from cdpr_drake.geometry.poses import pose_error, pose_from_angles
from cdpr_drake.models.robot_in_plant import add_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.robots.platform_pose import PlatformPose

ROUND_OFF = 1e-12
"""Of a pose with entries of order one."""


@pytest.mark.parametrize(("name", "size"), [("acrobot_small", 13), ("planar", 6)])
def test_ports_are_these(name, size):
    plant = MultibodyPlant(0.0)
    in_plant = add_robot(plant, load_robot(name))
    plant.Finalize()
    system = PlatformPose(in_plant)
    assert system.num_input_ports() == system.num_output_ports() == 1
    assert system.GetInputPort("platform_state").size() == size
    assert isinstance(system.GetOutputPort("X_WP").Allocate().get_value(), RigidTransform)


@pytest.mark.parametrize(
    ("name", "X_WP"),
    [
        (
            "acrobot_small",
            pose_from_angles(np.array([0.1, -0.2, 0.4]), np.array([0.3, -0.5, 2.0])),
        ),
        ("planar", pose_from_angles(np.array([0.1, -0.2, 0.3]), np.array([0.0, 0.0, -2.5]))),
    ],
)
def test_pose_is_that_of_the_plant(name, X_WP):
    block = CableRobot(load_robot(name))
    context = block.CreateDefaultContext()
    block.in_plant.set_pose(block.plant.GetMyMutableContextFromRoot(context), X_WP)
    assert max(pose_error(X_WP, block.GetOutputPort("X_WP").Eval(context))) < ROUND_OFF
    platform = block.GetOutputPort("body_poses").Eval(context)[int(block.in_plant.body_index)]
    assert max(pose_error(X_WP, platform)) < ROUND_OFF

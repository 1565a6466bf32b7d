"""The robot in one block: ports, default context, holding tensions, steps."""

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator

from cdpr_drake.cable_geometry import cable_lengths
from cdpr_drake.errors import InfeasibleTensionError
from cdpr_drake.models import load_robot, robot_names
from cdpr_drake.systems import CableRobot, automatic_step, holding_tensions


def port_names(system):
    inputs = [system.get_input_port(i).get_name() for i in range(system.num_input_ports())]
    outputs = [system.get_output_port(i).get_name() for i in range(system.num_output_ports())]
    return inputs, outputs


def test_ports_are_public():
    inputs, outputs = port_names(CableRobot(load_robot("acrobot_small")))
    assert inputs == ["cable_velocities"]
    assert sorted(outputs) == [
        "X_WP", "body_poses", "lengths", "platform_state", "query_object", "slack", "tensions",
        "unstrained_length_rates", "unstrained_lengths",
    ]  # fmt: skip


@pytest.mark.parametrize("name", robot_names())
def test_default_context_is_the_home_pose_and_simulates(name):
    robot = load_robot(name)
    block = CableRobot(robot)
    context = block.CreateDefaultContext()
    block.GetInputPort("cable_velocities").FixValue(context, np.zeros(len(robot.cables)))
    X_WP = block.GetOutputPort("X_WP").Eval(context)
    assert X_WP.IsNearlyEqualTo(robot.home.transform(), 1e-12)
    l0 = block.GetOutputPort("unstrained_lengths").Eval(context)
    home = cable_lengths(X_WP, robot.exit_points(), robot.anchor_points())
    np.testing.assert_allclose(l0, home, rtol=1e-12)
    Simulator(block, context).AdvanceTo(0.01)


def test_pose_that_cannot_be_held_is_named():
    robot = load_robot("acrobot_small")
    with pytest.raises(InfeasibleTensionError, match=r"acrobot_small cannot hold .* 0\.55"):
        holding_tensions(robot, RigidTransform([0.55, 0.55, 0.3]))


def test_step_gets_shorter_as_the_platform_climbs():
    robot = load_robot("acrobot_small")
    steps = [automatic_step(robot, RigidTransform([0, 0, z]), "runge_kutta3") for z in (0.1, 0.8)]
    assert 0.0 < steps[1] < steps[0]

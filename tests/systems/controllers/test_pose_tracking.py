"""Tracking asks for the wrench of the law at the pose and the time that it reads."""

import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from cdpr_drake.control.task_space import TaskGains, computed_torque
from cdpr_drake.geometry.poses import pose_error, pose_from_angles
from cdpr_drake.models.robot_in_plant import add_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.controllers.computed_torque import PoseTracking, platform_dynamics
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory

GAINS = TaskGains((120.0, 80.0), (20.0, 15.0))

ROUNDING = 1e-12
"""Of the wrench, relative: the same kernels, compiled together or apart."""

V_WP = np.array([0.0, 0.0, 0.1, 0.3, -0.2, 0.0])
"""Velocity of the platform, which a planar one can have, too [rad/s, m/s]."""

TIMES = (0.0, 0.7, 1.6, 5.0)
"""Before, in two stretches of and after the trajectory [s]."""


class Tracking:
    """The block in a diagram, beside a platform whose state is given."""

    def __init__(self, name, dynamics=None):
        self.robot = load_robot(name)
        plant = MultibodyPlant(0.0)
        in_plant = add_robot(plant, self.robot)
        plant.Finalize()
        self.home = self.robot.home.transform()
        planar = self.robot.is_planar()
        away = self.home @ pose_from_angles(
            np.array([0.1, -0.05, 0.0 if planar else 0.1]),
            np.array([0.0, 0.0, 0.3] if planar else [0.1, -0.2, 0.3]),
        )
        self.trajectory = PoseTrajectory((self.home, away, self.home), (1.0, 2.0), 0.2)
        builder = DiagramBuilder()
        here = away @ pose_from_angles(np.array([0.02, 0.03, 0.0]), np.array([0.0, 0.0, 0.1]))
        context = plant.CreateDefaultContext()
        in_plant.set_pose(context, here)
        self.here = here
        state = plant.get_state_output_port(in_plant.model_instance).Eval(context).copy()
        state[-3 if planar else -6 :] = V_WP[[3, 4, 2]] if planar else V_WP
        given = builder.AddSystem(ConstantVectorSource(state)).get_output_port()
        self.dynamics = dynamics or platform_dynamics(self.robot)
        self.tracking = builder.AddSystem(PoseTracking(in_plant, self.trajectory, GAINS, dynamics))
        builder.Connect(given, self.tracking.GetInputPort("platform_state"))
        for name in ("desired_wrench", "X_WP", "X_WP_desired"):
            builder.ExportOutput(self.tracking.GetOutputPort(name), name)
        self.diagram = builder.Build()
        self.context = self.diagram.CreateDefaultContext()

    def at(self, time, name):
        self.context.SetTime(time)
        return self.diagram.GetOutputPort(name).Eval(self.context)

    def expected(self, time):
        wanted = self.trajectory
        return computed_torque(
            self.here, V_WP, wanted.pose(time), wanted.velocity(time), wanted.acceleration(time),
            dynamics=self.dynamics, gains=GAINS,
        )  # fmt: skip


def test_ports_are_these():
    tracking = Tracking("caroca").tracking
    inputs = [tracking.get_input_port(i).get_name() for i in range(tracking.num_input_ports())]
    outputs = [tracking.get_output_port(i).get_name() for i in range(tracking.num_output_ports())]
    assert inputs == ["platform_state"]
    assert outputs == ["desired_wrench", "X_WP", "X_WP_desired"]


@pytest.mark.parametrize("name", ["caroca", "planar"])
def test_wrench_is_that_of_the_law(name):
    tracking, wrenches = Tracking(name), []
    for time in TIMES:
        wrench = tracking.at(time, "desired_wrench")
        size = np.max(np.abs(wrench))
        assert size > 0.0
        np.testing.assert_allclose(wrench, tracking.expected(time), atol=ROUNDING * size)
        wrenches.append(wrench)
    assert np.ptp(wrenches, axis=0).max() > 1.0  # a wrench of an earlier time did not stay


def test_a_believed_model_counts():
    robot = load_robot("caroca")
    robot.platform.mass *= 0.5
    tracking = Tracking("caroca", platform_dynamics(robot))
    wrench = tracking.at(0.7, "desired_wrench")
    size = np.max(np.abs(wrench))
    np.testing.assert_allclose(wrench, tracking.expected(0.7), atol=ROUNDING * size)
    assert np.max(np.abs(wrench - Tracking("caroca").at(0.7, "desired_wrench"))) > 100.0


@pytest.mark.parametrize("name", ["caroca", "planar"])
@pytest.mark.parametrize("time", TIMES)
def test_poses(name, time):
    tracking = Tracking(name)
    assert (
        max(pose_error(tracking.here, tracking.at(time, "X_WP"))) < 1e-7
    )  # angle: sqrt of round-off
    assert tracking.at(time, "X_WP_desired").IsExactlyEqualTo(tracking.trajectory.pose(time))

"""`PoseTracking` in a loop: error dynamics as designed, tracking."""

import numpy as np
import pytest
import scipy.integrate
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import MatrixGain

from cdpr_drake.control.task_space import TaskGains
from cdpr_drake.geometry.poses import (
    pose_error,
    pose_from_angles,
    rotation_from_vector,
    rotation_vector,
)
from cdpr_drake.models.robot_in_plant import add_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import PlatformDamping
from cdpr_drake.systems.controllers.computed_torque import PoseTracking, platform_dynamics
from cdpr_drake.systems.robots.assembly import apply_force
from cdpr_drake.systems.robots.settings import DampingSettings
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory

INTEGRATION = 1e-7
"""Runge-Kutta 3 with 1 ms on motions with rates of 10/s: (1e-2)^3 times the motion's 0.1, over
the length of the transient, and what the reference integration is allowed."""

MODEL_GAINS = TaskGains(100.0, 20.0)
"""Critically damped at 10 rad/s."""


class Loop:
    """A robot whose damped platform gets the desired wrench itself, without cables."""

    def __init__(self, name, trajectory):
        self.robot = load_robot(name)
        self.robot.damping = PlatformDamping(translation=225.0, rotation=4.2)
        builder = DiagramBuilder()
        self.plant = builder.AddSystem(MultibodyPlant(0.0))
        self.in_plant = add_robot(self.plant, self.robot)
        self.plant.Finalize()
        control = builder.AddSystem(PoseTracking(self.in_plant, trajectory, MODEL_GAINS))
        rows = [3, 4, 2] if self.robot.is_planar() else range(6)
        pick = builder.AddSystem(MatrixGain(np.eye(6)[list(rows)]))
        state = self.plant.get_state_output_port(self.in_plant.model_instance)
        builder.Connect(state, control.GetInputPort("platform_state"))
        builder.Connect(control.GetOutputPort("desired_wrench"), pick.get_input_port())
        brake = builder.AddSystem(DampingSettings().block(self.in_plant))
        builder.Connect(state, brake.get_input_port())
        apply_force(builder, self.plant, pick.get_output_port(), name="wrench")
        apply_force(builder, self.plant, brake.get_output_port(), name="brake")
        self.simulator = Simulator(builder.Build())
        ResetIntegratorFromFlags(self.simulator, "runge_kutta3", 1e-3)
        self.simulator.get_mutable_integrator().set_fixed_step_mode(True)
        root = self.simulator.get_mutable_context()
        self.plant_context = self.plant.GetMyMutableContextFromRoot(root)
        self.control_context = control.GetMyContextFromRoot(root)

    def put(self, X_WP):
        self.in_plant.set_pose(self.plant_context, X_WP)

    def pose(self, time):
        self.simulator.AdvanceTo(time)
        return self.in_plant.pose(self.plant_context)


def resting(X_WP):
    return PoseTrajectory((X_WP, X_WP), (1.0,))


def test_position_error_dies_out_as_the_gains_say():
    """e(t) = e(0) (1 + 10 t) exp(-10 t), although the centre of mass lies off Po."""
    X_WD = RigidTransform([0.0, 0.0, 1.0])
    loop = Loop("caroca", resting(X_WD))
    offset = np.array([0.1, -0.2, 0.15])
    loop.put(RigidTransform(X_WD.translation() + offset))
    for time in (0.05, 0.1, 0.3, 0.6):
        left = loop.pose(time).translation() - X_WD.translation()
        expected = offset * (1.0 + 10.0 * time) * np.exp(-10.0 * time)
        np.testing.assert_allclose(left, expected, atol=INTEGRATION)


def test_attitude_error_about_one_axis_dies_out_as_the_gains_say():
    """theta'' = -Kp 2 sin(theta / 2) - Kd theta', from far away, Po staying where it is."""
    X_WD = RigidTransform([0.0, 0.0, 1.0])
    axis = np.array([2.0, -1.0, 2.0]) / 3.0
    loop = Loop("caroca", resting(X_WD))
    loop.put(RigidTransform(rotation_from_vector(2.5 * axis), X_WD.translation()))
    times = (0.05, 0.1, 0.3, 0.6)
    expected = scipy.integrate.solve_ivp(
        lambda _, y: [y[1], -200.0 * np.sin(y[0] / 2.0) - 20.0 * y[1]],
        (0.0, 0.6),
        [2.5, 0.0],
        t_eval=times,
        rtol=1e-10,
        atol=1e-12,
    ).y[0]
    for time, theta in zip(times, expected, strict=True):
        X_WP = loop.pose(time)
        np.testing.assert_allclose(
            rotation_vector(X_WP.rotation()), theta * axis, atol=10.0 * INTEGRATION
        )
        np.testing.assert_allclose(X_WP.translation(), X_WD.translation(), atol=INTEGRATION)


@pytest.mark.parametrize("name", ["caroca", "planar"])
def test_platform_follows_a_trajectory(name):
    robot = load_robot(name)
    X_WS = robot.home.transform()
    angles = np.array([0.0, 0.0, 0.2]) if robot.is_planar() else np.array([0.1, -0.1, 0.2])
    way = np.array([0.05, -0.04, 0.0 if robot.is_planar() else 0.06])
    X_WE = X_WS @ pose_from_angles(way, angles)
    trajectory = PoseTrajectory((X_WS, X_WE), (2.0,), start_time=0.1)
    loop = Loop(name, trajectory)
    loop.put(X_WS)
    for time in np.linspace(0.0, 2.4, 49)[1:]:
        distance, angle = pose_error(trajectory.pose(time), loop.pose(time))
        assert distance < INTEGRATION
        assert angle < INTEGRATION


def test_a_believed_model_of_half_the_mass_asks_for_half_the_force():
    robot = load_robot("caroca")
    plant = MultibodyPlant(0.0)
    in_plant = add_robot(plant, robot)
    plant.Finalize()
    X_WP = RigidTransform([0.0, 0.0, 1.0])
    lighter = load_robot("caroca")
    lighter.platform.mass /= 2.0
    control = PoseTracking(in_plant, resting(X_WP), MODEL_GAINS, platform_dynamics(lighter))
    context = control.CreateDefaultContext()
    state = np.concatenate([[1.0, 0.0, 0.0, 0.0], X_WP.translation(), np.zeros(6)])
    control.GetInputPort("platform_state").FixValue(context, state)
    found = control.GetOutputPort("desired_wrench").Eval(context)
    np.testing.assert_allclose(found, [0.0, 0.0, 0.0, 0.0, 0.0, 75.0 * 9.81], atol=1e-9)

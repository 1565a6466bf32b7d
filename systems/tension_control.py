"""Wires the dynamic control of a robot by cable tensions into one Diagram."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context, Diagram, DiagramBuilder

from cdpr_drake.arrays import Array
from cdpr_drake.computed_torque import TaskGains
from cdpr_drake.models import Robot, RobotInPlant, add_robot, pose_from_state
from cdpr_drake.pose_trajectory import PoseTrajectory
from cdpr_drake.poses import pose_error
from cdpr_drake.systems.computed_torque import ComputedTorque
from cdpr_drake.systems.log_row import RunLog, add_log, pose_row
from cdpr_drake.systems.platform_pose import PlatformPose
from cdpr_drake.systems.pose_trajectory_source import PoseTrajectorySource
from cdpr_drake.systems.tension_distributor import TensionDistributor
from cdpr_drake.systems.tension_driven_cables import TensionDrivenCables


@dataclass(frozen=True)
class TensionControl:
    """A robot that follows a trajectory by commanded tensions.

    Attributes:
        robot: The robot.
        trajectory: The desired motion.
        diagram: The diagram; subsystems plant, trajectory, controller, distributor, cables,
            platform_pose; exported outputs X_WP, X_WP_desired, desired_wrench, tensions, feasible,
            failures, lengths, slack.
        in_plant: The platform in the plant.
        log: What the run stores; None unless asked for.
    """

    robot: Robot
    trajectory: PoseTrajectory
    diagram: Diagram
    in_plant: RobotInPlant
    log: RunLog | None = None

    def make_context(self) -> Context:
        """A root context with the platform at rest where the trajectory begins."""
        context = self.diagram.CreateDefaultContext()
        plant_context = self.in_plant.plant.GetMyMutableContextFromRoot(context)
        self.in_plant.set_pose(plant_context, self.trajectory.pose(0.0))
        return context

    def read_log(self, context: Context) -> dict[str, Array]:
        """What was logged, from a root context.

        Times "time", shape (n,) [s]; true and desired poses "X_WP", "X_WP_desired" as `pose_row`,
        shape (n, 7); and the exported vectors by name, shape (n, size). There must be a log.
        """
        assert self.log is not None
        log = self.log.read(context)
        states = log.pop("platform_state")
        poses = [pose_row(pose_from_state(self.robot, state)) for state in states]
        desired = [pose_row(self.trajectory.pose(t)) for t in log["time"]]
        time = log.pop("time")
        return {"time": time, "X_WP": np.array(poses), "X_WP_desired": np.array(desired), **log}

    def position_error(self, context: Context) -> float:
        """Distance of the platform from where it should be now, from a root context [m]."""
        return self.errors(context)[0]

    def errors(self, context: Context) -> tuple[float, float]:
        """Distance [m] and angle [rad] of the platform from where it should be, root context."""
        plant_context = self.in_plant.plant.GetMyContextFromRoot(context)
        return pose_error(
            self.in_plant.pose(plant_context), self.trajectory.pose(context.get_time())
        )


def build_tension_control(
    robot: Robot,
    trajectory: PoseTrajectory,
    gains: TaskGains,
    method: str = "quadratic_program",
    limits: tuple[float, float] | None = None,
    rate: float = 1000.0,
    reference: Array | None = None,
    log_rate: float | None = None,
) -> TensionControl:
    """Builds plant, trajectory, computed torque, tension distribution and ideal cables.

    The controller has no rate: the distributor samples its wrench, so that wrench and tensions
    belong to the same time.

    Args:
        robot: The robot.
        trajectory: The desired motion of the platform.
        gains: Kp and Kd.
        method: A name of `tension_methods.METHODS`.
        limits: Smallest and largest tension [N]; None: the robot's.
        rate: Control steps per second [Hz].
        reference: Wanted tensions, shape (m,) [N], for `reference_program`.
        log_rate: Rows of the log per second [Hz]; None: no log.

    Raises:
        TensionProblemError: The method or the limits do not fit the robot.

    Source: Gazebo thesis 6.1, figure 6.1.
    """
    builder = DiagramBuilder()
    plant = builder.AddNamedSystem("plant", MultibodyPlant(0.0))
    in_plant = add_robot(plant, robot)
    plant.Finalize()
    source = builder.AddNamedSystem("trajectory", PoseTrajectorySource(trajectory))
    controller = builder.AddNamedSystem("controller", ComputedTorque(in_plant, gains, rate=None))
    distributor = builder.AddNamedSystem(
        "distributor", TensionDistributor(in_plant, method, limits, rate, reference)
    )
    cables = builder.AddNamedSystem("cables", TensionDrivenCables(in_plant))
    pose = builder.AddNamedSystem("platform_pose", PlatformPose(in_plant))
    state = plant.get_state_output_port(in_plant.model_instance)
    for system in (controller, distributor, cables, pose):
        builder.Connect(state, system.GetInputPort("platform_state"))
    for before, out, after, into in (
        (source, "motion", controller, "desired_motion"),
        (controller, "desired_wrench", distributor, "desired_wrench"),
        (distributor, "tensions", cables, "tensions"),
    ):
        builder.Connect(before.GetOutputPort(out), after.GetInputPort(into))
    builder.Connect(
        cables.GetOutputPort("generalized_force"), plant.get_applied_generalized_force_input_port()
    )
    ports = {"X_WP_desired": source.GetOutputPort("X_WP")}
    for system, names in (
        (pose, ("X_WP",)),
        (controller, ("desired_wrench",)),
        (distributor, ("tensions", "feasible", "failures")),
        (cables, ("lengths", "slack")),
    ):
        ports |= {name: system.GetOutputPort(name) for name in names}
    for name, port in ports.items():
        builder.ExportOutput(port, name)
    log = None
    if log_rate is not None:
        # The state in the place of the poses, which `read_log` makes from it: conversions cost.
        logged = {"platform_state": state, **ports}
        for name in ("X_WP", "X_WP_desired"):
            del logged[name]
        log = add_log(builder, logged, log_rate)
    diagram = builder.Build()
    diagram.set_name(f"{robot.name}_tension_control")
    return TensionControl(robot, trajectory, diagram, in_plant, log)

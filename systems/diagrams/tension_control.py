"""Wires the dynamic control of a robot by cable tensions into one Diagram."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context, Diagram, DiagramBuilder

from cdpr_drake.arrays import Array
from cdpr_drake.cables.commanded_tension_kernel import cable_motions
from cdpr_drake.control.computed_torque import TaskGains
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.models.robot_in_plant import RobotInPlant, add_robot, pose_from_state
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.spatial.poses import pose_error
from cdpr_drake.systems.monitoring.log_row import RunLog, add_log, pose_row
from cdpr_drake.systems.robots.tension_driven_cables import TensionDrivenCables
from cdpr_drake.systems.tension_control.pose_tracking import PoseTracking
from cdpr_drake.systems.tension_control.tension_distributor import TensionDistributor
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory


@dataclass(frozen=True)
class TensionControl:
    """A robot that follows a trajectory by commanded tensions.

    Attributes:
        robot: The robot.
        trajectory: The desired motion.
        diagram: The diagram; subsystems plant, controller, distributor, cables; exported outputs
            X_WP, X_WP_desired, desired_wrench, tensions, feasible, failures, lengths, slack.
        in_plant: The platform in the plant.
        cables: The cables as they are simulated.
        log: What the run stores; None unless asked for.
    """

    robot: Robot
    trajectory: PoseTrajectory
    diagram: Diagram
    in_plant: RobotInPlant
    cables: CableSet
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
        time, states = log.pop("time"), log.pop("platform_state")
        poses = [pose_row(pose_from_state(self.robot, state)) for state in states]
        desired = [pose_row(self.trajectory.pose(t)) for t in time]
        return {
            "time": time,
            "X_WP": np.array(poses),
            "X_WP_desired": np.array(desired),
            **log,
            "lengths": self._lengths(states),
            "slack": (log["tensions"] <= 0.0).astype(float),
        }

    def _lengths(self, states: Array) -> Array:
        """Cable lengths at states of the platform, shape (n, m) [m]."""
        cables = self.cables.packed()
        motions = np.empty((len(states), 2, len(cables)))
        for state, out in zip(states, motions, strict=True):
            cable_motions(state, cables, float(self.robot.plane_height or 0.0), out)
        return motions[:, 0]

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
    distributor: type[TensionDistributor] = TensionDistributor,
    push: bool = False,
    cables: CableSet | None = None,
    believed_cables: CableSet | None = None,
) -> TensionControl:
    """Builds plant, tracking control, tension distribution and ideal cables.

    The controller has no rate: the distributor samples its wrench, so that wrench and tensions
    belong to the same time.

    Args:
        robot: The robot.
        trajectory: The desired motion of the platform.
        gains: Kp and Kd.
        method: A name of `tensions.METHODS`.
        limits: Smallest and largest tension [N]; None: the robot's.
        rate: Control steps per second [Hz].
        reference: Wanted tensions, shape (m,) [N], for `reference_program`.
        log_rate: Rows of the log per second [Hz]; None: no log.
        distributor: The block that distributes.
        push: Whether a negative tension pushes; otherwise it acts as zero, as in a real cable.
        cables: The cables as they really are; None: the robot's, from fixed exit points.
        believed_cables: What the distributor believes of them; None: as they are.

    Raises:
        TensionProblemError: The method or the limits do not fit the robot.

    Source: Gazebo thesis 6.1, figure 6.1.
    """
    real = robot.cable_set().without_pulleys() if cables is None else cables
    believed = real if believed_cables is None else believed_cables
    builder = DiagramBuilder()
    plant = builder.AddNamedSystem("plant", MultibodyPlant(0.0))
    in_plant = add_robot(plant, robot)
    plant.Finalize()
    control = builder.AddNamedSystem("controller", PoseTracking(in_plant, trajectory, gains))
    distribution = builder.AddNamedSystem(
        "distributor", distributor(in_plant, method, limits, rate, reference, believed)
    )
    driven = builder.AddNamedSystem("cables", TensionDrivenCables(in_plant, push, real))
    state = plant.get_state_output_port(in_plant.model_instance)
    for system in (control, distribution, driven):
        builder.Connect(state, system.GetInputPort("platform_state"))
    for before, after, name in (
        (control, distribution, "desired_wrench"),
        (distribution, driven, "tensions"),
    ):
        builder.Connect(before.GetOutputPort(name), after.GetInputPort(name))
    builder.Connect(
        driven.GetOutputPort("generalized_force"), plant.get_applied_generalized_force_input_port()
    )
    for system, names in (
        (control, ("X_WP", "X_WP_desired", "desired_wrench")),
        (distribution, ("tensions", "feasible", "failures")),
        (driven, ("lengths", "slack")),
    ):
        for name in names:
            builder.ExportOutput(system.GetOutputPort(name), name)
    log = None
    if log_rate is not None:
        # `read_log` makes the rest from these; what is logged costs in the loop.
        logged = {
            "platform_state": state,
            "desired_wrench": control.GetOutputPort("desired_wrench"),
            "tensions": distribution.GetOutputPort("tensions"),
            "feasible": distribution.GetOutputPort("feasible"),
            "failures": distribution.GetOutputPort("failures"),
        }
        log = add_log(builder, logged, log_rate)
    diagram = builder.Build()
    diagram.set_name(f"{robot.name}_tension_control")
    return TensionControl(robot, trajectory, diagram, in_plant, real, log)

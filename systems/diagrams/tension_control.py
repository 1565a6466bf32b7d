"""Wires the dynamic control of a robot by cable tensions into one Diagram."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, LeafSystem, OutputPort
from pydrake.systems.primitives import Demultiplexer

from cdpr_drake.arrays import Array
from cdpr_drake.cables.commanded_tension_kernel import cable_motions
from cdpr_drake.control.force_balance import WRENCH
from cdpr_drake.control.task_space import PlatformDynamics, TaskGains
from cdpr_drake.errors import ScenarioError
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import pose_error, pose_from_row, pose_row
from cdpr_drake.models.robot_in_plant import RobotInPlant, add_robot, pose_on_joint
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.controllers.computed_torque import PoseTracking, platform_dynamics
from cdpr_drake.systems.controllers.tension_distributor import TensionDistributor
from cdpr_drake.systems.monitoring.log_row import RunLog, add_log
from cdpr_drake.systems.robots.assembly import add_hysteresis, apply_force
from cdpr_drake.systems.robots.compiled_cable_robot import motion_by_tensions
from cdpr_drake.systems.robots.compiled_motion import HELD, MEMORY, CompiledMotion
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.platform_wrench import APPLIED_WRENCH, PlatformWrench
from cdpr_drake.systems.robots.settings import DampingSettings
from cdpr_drake.systems.robots.tension_driven_cables import TensionDrivenCables
from cdpr_drake.systems.sections import Platform, Section, add_pushes
from cdpr_drake.systems.worlds.adding import (
    CLEARANCES,
    CONTACTS,
    WorldInScene,
    WorldMeters,
    add_world_meters,
)
from cdpr_drake.systems.worlds.settings import WorldSettings
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
        blocks: The blocks.
        log: What the run stores; None unless asked for.
        motion: What moves the robot in compiled steps, subsystems motion and motion_parts in the
            place of plant and cables; None where the plant moves.
        world: What is round the robot; None: nothing.
        meters: What measures the robot in it; None without a world.
    """

    robot: Robot
    trajectory: PoseTrajectory
    diagram: Diagram
    in_plant: RobotInPlant
    cables: CableSet
    blocks: TensionControlBlocks
    log: RunLog | None = None
    motion: CompiledMotion | None = None
    world: WorldInScene | None = None
    meters: WorldMeters | None = None

    def make_context(self) -> Context:
        """A root context with the platform at rest where the trajectory begins."""
        context = self.diagram.CreateDefaultContext()
        self.set_pose(context, self.trajectory.pose(0.0))
        if self.world is not None:
            self.world.start(context, self.in_plant)
        return context

    def set_pose(self, context: Context, X_WP: RigidTransform) -> None:
        """Puts the platform at rest at a pose [m], in a root context."""
        if self.motion is None:
            plant_context = self.in_plant.plant.GetMyMutableContextFromRoot(context)
            self.in_plant.set_pose(plant_context, X_WP)
            return
        none = np.zeros(self.cables.count)
        self.motion.hold(self.motion.GetMyMutableContextFromRoot(context), X_WP, none, none)

    def pose(self, context: Context) -> RigidTransform:
        """X_WP of the platform [m], from a root context."""
        return self.diagram.GetOutputPort("X_WP").Eval(context)

    @property
    def outside(self) -> Any:
        """The place of a process outside, as a block offers it; None: there is none."""
        blocks = self.blocks.controller, self.blocks.distributor
        places = (getattr(block, "outside", None) for block in blocks)
        return next((place for place in places if place is not None), None)

    def read_log(self, context: Context) -> dict[str, Array]:
        """What was logged, from a root context.

        Times "time", shape (n,) [s]; true and desired poses "X_WP", "X_WP_desired" as `pose_row`,
        shape (n, 7); and the exported vectors by name, shape (n, size). There must be a log.
        """
        assert self.log is not None
        return self.whole_log(self.log.read(context))

    def whole_log(self, rows: dict[str, Array]) -> dict[str, Array]:
        """`read_log` from what was stored: "time", "platform_state" and the exported vectors."""
        log = dict(rows)
        time, states = log.pop("time"), log.pop("platform_state")
        motion = log.pop("desired_motion", None)
        joint = self.robot.joint()
        poses = [pose_row(pose_on_joint(joint, state)) for state in states]
        if motion is None:
            desired = [pose_row(self.trajectory.pose(t)) for t in time]
        else:
            desired = [pose_row(pose_from_row(row[:7])) for row in motion]
        return {
            "time": time,
            "X_WP": np.array(poses),
            "X_WP_desired": np.array(desired),
            **log,
            "lengths": self._lengths(states),
            "slack": (log["tensions"] <= 0.0).astype(float),
            **self._clearances(time, poses),
        }

    def _clearances(self, times: Array, poses: list[Array]) -> dict[str, Array]:
        """Clearances at times [s] and poses; nothing without a world."""
        if self.meters is None:
            return {}
        ways = [self.meters.clearances.platform, self.meters.clearances.cables]
        pairs = [(pose_from_row(pose), float(t)) for t, pose in zip(times, poses, strict=True)]
        size = len(self.meters.clearances.world.bodies)
        return {
            name: np.array([measure(*pair) for pair in pairs]).reshape(-1, size)
            for name, measure in zip(CLEARANCES, ways, strict=True)
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
        return pose_error(
            self.pose(context), self.diagram.GetOutputPort("X_WP_desired").Eval(context)
        )


@dataclass(frozen=True, kw_only=True)
class TensionControlSettings:
    """What a robot shall do by commanded tensions, and how these are chosen.

    Attributes:
        trajectory: The desired motion of the platform.
        gains: Kp and Kd.
        method: A name of `tensions.METHODS`.
        limits: Smallest and largest tension [N]; None: the robot's.
        rate: Control steps per second [Hz].
        reference: Wanted tensions, shape (m,) [N], for `reference_program`.
        push: Whether a negative tension pushes; otherwise it acts as zero, as in a real cable.
        cables: The cables as they really are; None: the robot's, from fixed exit points.
        believed_cables: What the distributor believes of them; None: as they are.
        dynamics: What the controller believes of the platform; None: as it is.
        balance: What tensions balance, a name of `force_balance.BALANCES`.
        controller: Makes the block that follows the trajectory, from the arguments of
            `PoseTracking`.
        distributor: Makes the block that distributes, from those of `TensionDistributor`. Either
            may have an input port tensions or lengths, vector(m) [N, m], which gets those of the
            cables, and an attribute `outside`, see `Section.outside`.
        rule: How the robot is integrated in compiled steps; None: a plant moves it, by the
            simulator's integrator.
        world: What is round the robot; None: nothing. Contact needs the plant.
        stop_at_contact: Whether the first touch ends the simulation.
        sections: Sections of a scenario: some make controller or distributor, some push the
            platform, which needs the plant.
        seed: Of their random numbers.
        damping: Of the simulated platform; by default the robot file's. It is in the dynamics that
            the controller believes unless `dynamics` says otherwise.
    """

    trajectory: PoseTrajectory
    gains: TaskGains
    method: str = "quadratic_program"
    limits: tuple[float, float] | None = None
    rate: float = 1000.0
    reference: Array | None = None
    push: bool = False
    cables: CableSet | None = None
    believed_cables: CableSet | None = None
    dynamics: PlatformDynamics | None = None
    balance: str = WRENCH
    controller: Callable[..., PoseTracking] = PoseTracking
    distributor: Callable[..., TensionDistributor] = TensionDistributor
    rule: StepRule | None = None
    world: WorldSettings | None = None
    stop_at_contact: bool = False
    sections: Sequence[Section] = ()
    seed: int = 0
    damping: DampingSettings = field(default_factory=DampingSettings)


@dataclass(frozen=True)
class TensionControlBlocks:
    """The blocks of dynamic control in a builder.

    Attributes:
        controller: Follows the motion, `PoseTracking`.
        distributor: Makes tensions of its wrench.
        driven: The cables that have these tensions, `TensionDrivenCables`, or the whole robot in
            compiled steps.
        cables: Those cables.
        state: State of the platform, which controller and distributor read.
        applied_wrench: What pushes the platform beside its cables; None: nothing.
    """

    controller: PoseTracking
    distributor: TensionDistributor
    driven: TensionDrivenCables | CompiledMotion
    cables: CableSet
    state: OutputPort
    applied_wrench: OutputPort | None = None


def add_tension_control(
    builder: DiagramBuilder,
    in_plant: RobotInPlant,
    settings: TensionControlSettings,
    *,
    name: str = "",
) -> TensionControlBlocks:
    """Adds tracking control, tension distribution and ideal cables to a platform in a plant.

    The controller has no rate: the distributor samples its wrench, so that wrench and tensions
    belong to the same time.

    Args:
        builder: The builder that has the plant, which is finalized; with a `rule` in the settings
            the plant is in no diagram, and the robot's motion is added in its place.
        in_plant: The platform in the plant, from `cdpr_drake.models.add_robot`.
        settings: What it shall do.
        name: Put before the names of the blocks, so that several robots can be told apart.

    Raises:
        TensionProblemError: The method or the limits do not fit the robot.

    Source: Gazebo thesis 6.1, figure 6.1.
    """
    prefix = f"{name}_" if name else ""
    real = settings.cables
    if real is None:
        real = in_plant.robot.cable_set().without_pulleys()
    believed = real if settings.believed_cables is None else settings.believed_cables
    robot, balance = in_plant.robot, settings.balance
    dynamics = settings.dynamics or platform_dynamics(
        robot, balance, damping=settings.damping.of(robot)
    )
    settings = replace(settings, believed_cables=believed, dynamics=dynamics)
    for section in settings.sections:
        settings = replace(settings, **section.tension_blocks(settings, robot))
    control = settings.controller(
        in_plant, settings.trajectory, settings.gains, dynamics, balance=balance
    )
    distribution = settings.distributor(
        in_plant, settings.method, settings.limits, settings.rate, settings.reference, believed,
        balance=balance,
    )  # fmt: skip
    driven: TensionDrivenCables | CompiledMotion
    systems: dict[str, LeafSystem] = {"controller": control, "distributor": distribution}
    if settings.rule is None:
        driven = TensionDrivenCables(in_plant, settings.push, real)
        state = in_plant.plant.get_state_output_port(in_plant.model_instance)
        systems["cables"] = driven
    else:
        driven = motion_by_tensions(
            in_plant.robot,
            real,
            push=settings.push,
            rule=settings.rule,
            command_period=HELD,
            damping=settings.damping,
        )
        builder.AddNamedSystem(prefix + "motion", driven)
        state = _split_state(builder, driven, prefix)
    for block, system in systems.items():
        builder.AddNamedSystem(prefix + block, system)
        builder.Connect(state, system.GetInputPort("platform_state"))
    for before, after, port in (
        (control, distribution, "desired_wrench"),
        (distribution, driven, "tensions"),
    ):
        builder.Connect(before.GetOutputPort(port), after.GetInputPort(port))
    for port, source in (("tensions", distribution), ("lengths", driven)):
        for decider in (control, distribution):
            if decider.HasInputPort(port):
                builder.Connect(source.GetOutputPort(port), decider.GetInputPort(port))
    if isinstance(driven, TensionDrivenCables):
        apply_force(builder, in_plant.plant, driven.GetOutputPort("generalized_force"), name=name)
        brake = settings.damping.block(in_plant)
        if brake is not None:
            builder.AddNamedSystem(prefix + "damping", brake)
            builder.Connect(state, brake.get_input_port())
            apply_force(builder, in_plant.plant, brake.get_output_port(), name=prefix + "braked")
        friction = add_hysteresis(builder, in_plant, name=name)
        if friction is not None:
            rubbing = friction.GetOutputPort("generalized_force")
            apply_force(builder, in_plant.plant, rubbing, name=prefix + "rubbing")
    platform = Platform(
        robot=in_plant.robot, X_WP=control.GetOutputPort("X_WP"), state=state,
        seed=settings.seed, prefix=prefix,
    )  # fmt: skip
    wrench = add_pushes(builder, settings.sections, platform)
    if wrench is not None and settings.rule is not None:
        raise ScenarioError(
            "integration.engine: found compiled beside what pushes the platform; accepted: plant"
        )
    if wrench is not None:
        pushed = builder.AddNamedSystem(prefix + "platform_wrench", PlatformWrench(in_plant))
        builder.Connect(wrench, pushed.get_input_port())
        apply_force(builder, in_plant.plant, pushed.get_output_port(), name=prefix + "pushed")
    return TensionControlBlocks(control, distribution, driven, real, state, wrench)


def _split_state(builder: DiagramBuilder, motion: CompiledMotion, prefix: str) -> OutputPort:
    """The platform's state as Drake cuts it out, which costs less than a port in Python."""
    parts = builder.AddNamedSystem(prefix + "motion_parts", Demultiplexer(motion.parts()))
    builder.Connect(motion.GetOutputPort(MEMORY), parts.get_input_port())
    return parts.get_output_port(1)


def build_tension_control(
    robot: Robot | str | Path, settings: TensionControlSettings, *, log_rate: float | None = None
) -> TensionControl:
    """Builds a plant with the robot and `add_tension_control` on it.

    Args:
        robot: The robot.
        settings: What it shall do.
        log_rate: Rows of the log per second [Hz]; None: no log.

    Raises:
        TensionProblemError: The method or the limits do not fit the robot.
    """
    builder, robot = DiagramBuilder(), as_robot(robot, "build_tension_control")
    in_plant, world = _add_plant(builder, robot, settings)
    blocks = add_tension_control(builder, in_plant, settings)
    meters = None
    if world is not None:
        plant = in_plant.plant
        meters = add_world_meters(
            builder, world.world, in_plant, blocks.cables,
            X_WP=blocks.controller.GetOutputPort("X_WP"),
            contact_results=None if world.law is None else plant.get_contact_results_output_port(),
            stop=settings.stop_at_contact,
        )  # fmt: skip
    motion = blocks.driven if isinstance(blocks.driven, CompiledMotion) else None
    for system, names in (
        (blocks.controller, ("X_WP", "X_WP_desired", "desired_wrench")),
        (blocks.distributor, ("tensions", "feasible", "failures")),
        (blocks.driven, ("lengths", "slack")),
    ):
        for name in names:
            builder.ExportOutput(system.GetOutputPort(name), name)
    log = None
    if log_rate is not None:
        # `read_log` makes the rest from these; what is logged costs in the loop.
        logged = {"platform_state": blocks.state}
        for name in blocks.controller.logged():
            logged[name] = blocks.controller.GetOutputPort(name)
        for name in ("tensions", "feasible", "failures"):
            logged[name] = blocks.distributor.GetOutputPort(name)
        if blocks.applied_wrench is not None:
            logged[APPLIED_WRENCH] = blocks.applied_wrench
        if meters is not None and meters.contact is not None:
            logged |= {name: meters.contact.GetOutputPort(name) for name in CONTACTS}
        log = add_log(builder, logged, log_rate)
    diagram = builder.Build()
    diagram.set_name(f"{robot.name}_tension_control")
    return TensionControl(
        robot, settings.trajectory, diagram, in_plant, blocks.cables, blocks, log, motion,
        world, meters,
    )  # fmt: skip


def _add_plant(
    builder: DiagramBuilder, robot: Robot, settings: TensionControlSettings
) -> tuple[RobotInPlant, WorldInScene | None]:
    """The platform in a plant, which only with contact has a scene, and what is round it."""
    world = None if settings.world is None else WorldInScene(settings.world, robot)
    plant, wire = MultibodyPlant(0.0), None
    if settings.rule is None and world is not None and world.law is not None:
        plant, scene_graph = AddMultibodyPlantSceneGraph(builder, plant)
        plant.set_name("plant")
        in_plant = add_robot(plant, robot)
        wire = world.add(builder, in_plant, scene_graph, shown=False)
    else:
        if settings.rule is None:
            builder.AddNamedSystem("plant", plant)
        in_plant = add_robot(plant, robot)
    plant.Finalize()
    if wire is not None:
        wire()
    return in_plant, world

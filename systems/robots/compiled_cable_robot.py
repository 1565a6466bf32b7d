"""A cable robot as one block that is integrated in compiled steps, with its scene."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from pydrake.common import RandomDistribution
from pydrake.geometry import SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context, Diagram, DiagramBuilder
from pydrake.systems.primitives import RandomSource

from cdpr_drake.arrays import Array
from cdpr_drake.cables.models import KELVIN_VOIGT, cable_law
from cdpr_drake.dynamics.robot_arrays import IDEAL, MOTORS, TENSIONS, Drive
from cdpr_drake.errors import CdprError
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.models.robot_in_plant import RobotInPlant
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.robots.assembly import (
    SceneAdder,
    equilibrium_start,
    fill_scene,
    own_context,
)
from cdpr_drake.systems.robots.cable_forces import simulated_cables
from cdpr_drake.systems.robots.cable_robot import default_rule
from cdpr_drake.systems.robots.compiled_motion import MEMORY, CompiledMotion
from cdpr_drake.systems.robots.compiled_step import CompiledBodies, StepRule
from cdpr_drake.systems.robots.failures import BROKEN, FAULTS
from cdpr_drake.systems.robots.platform_wrench import APPLIED_WRENCH
from cdpr_drake.systems.robots.random_pose import RANDOM_NUMBERS, RandomPose
from cdpr_drake.systems.robots.settings import CableRobotSettings, DampingSettings, WinchSettings

ONCE = 1e12
"""Period of what is drawn once [s]: longer than any run."""


class CompiledCableRobot(Diagram):
    """As `CableRobot`, with the same ports, but moved by `CompiledMotion` in place of a plant.

    Its further outputs are step_errors and steps, a further input, which may stay open,
    commanded_length_rates; `CompiledMotion` explains them.

    Commands may be continuous: they are sampled at every step of the rule, and taken as linear in
    between, see `CompiledMotion`. Where all commands are held between events of the diagram, as
    those of sampled controllers are, `command_period=HELD` goes from event to event and is faster.

    Subsystems: motion, scene_graph, bodies. The plant that `plant` names is no part of the
    diagram and never moves: it says which frames and shapes the scene graph has. The platform must
    be all that moves in it.
    """

    def __init__(
        self,
        robot: Robot | str | Path,
        settings: CableRobotSettings | None = None,
        *,
        rule: StepRule | None = None,
        add_to_scene: SceneAdder | None = None,
        floor: bool = True,
        command_period: float | None = None,
        random_pose: RandomPose | None = None,
    ) -> None:
        """Builds the robot; arguments and errors as those of `CableRobot`, and these.

        Args:
            robot: The robot, by name, path, or itself.
            settings: Cables, winches and damping.
            rule: How it is integrated; `default_rule` if None. `integrate_by` changes it.
            add_to_scene: As for `CableRobot`; bodies that move by themselves are refused.
            floor: As for `CableRobot`.
            command_period: Longest time between two samples of the commands [s], see
                `CompiledMotion`; None: the step of `rule`.
            random_pose: As for `CableRobot`.

        Raises:
            CdprError: Something beside the platform moves in the plant.
        """
        super().__init__()
        robot = as_robot(robot, "CompiledCableRobot")
        settings = settings or CableRobotSettings()
        builder = DiagramBuilder()
        scene_graph = builder.AddNamedSystem("scene_graph", SceneGraph())
        plant = MultibodyPlant(0.0)
        plant.set_name("plant")
        source = plant.RegisterAsSourceForSceneGraph(scene_graph)
        in_plant = fill_scene(
            builder, robot, plant, scene_graph, add_to_scene=add_to_scene, floor=floor
        )
        own = plant.num_velocities(in_plant.model_instance)
        if plant.num_velocities() != own or plant.num_bodies() > 2:
            raise CdprError(
                f"compiled robot {robot.name}: found {plant.num_bodies()} bodies with "
                f"{plant.num_velocities()} velocities in its scene; accepted: the platform alone "
                f"with its {own}; other bodies need the engine plant"
            )
        model, failures = settings.cables.model_of(robot), settings.failure_block(robot)
        cables = simulated_cables(settings.cables.cable_set(robot), model)
        motion = CompiledMotion(
            robot, cables, model, winch_drive(robot, settings.winches),
            damping=settings.damping.of(robot),
            rule=default_rule(robot, settings) if rule is None else rule,
            frame=plant.GetBodyFrameIdOrThrow(in_plant.body_index),
            command_period=command_period,
            may_fail=failures is not None,
            random_pose=random_pose,
        )  # fmt: skip
        builder.AddNamedSystem("motion", motion)
        builder.Connect(
            motion.GetOutputPort("geometry_pose"), scene_graph.get_source_pose_port(source)
        )
        bodies = builder.AddNamedSystem(
            "bodies",
            CompiledBodies(motion.arrays(), cable_law(model, cables), robot.joint()),
        )
        for index in range(motion.num_input_ports()):
            port = motion.get_input_port(index)
            if port.get_name() == RANDOM_NUMBERS:
                numbers = RandomSource(RandomDistribution.kUniform, port.size(), ONCE)
                builder.AddNamedSystem("random_numbers", numbers)
                builder.Connect(numbers.get_output_port(), port)
                drawn = numbers.get_output_port().Eval(numbers.CreateDefaultContext())
                motion.default_numbers = np.array(drawn)
            elif port.get_name() not in FAULTS:
                builder.ExportInput(port, port.get_name())
        for index in range(bodies.num_input_ports()):
            port = bodies.get_input_port(index)
            if port.get_name() not in (APPLIED_WRENCH, BROKEN):
                builder.Connect(motion.GetOutputPort(port.get_name()), port)
        if failures is not None:
            builder.AddNamedSystem("failures", failures)
            builder.Connect(failures.GetOutputPort(BROKEN), bodies.GetInputPort(BROKEN))
            for name in filter(motion.HasInputPort, FAULTS):
                flags = failures.GetOutputPort(name)
                builder.Connect(flags, motion.GetInputPort(name))
                builder.ExportInput(failures.GetInputPort(name), name)
                builder.ExportOutput(flags, name)
        builder.ConnectInput(APPLIED_WRENCH, bodies.GetInputPort(APPLIED_WRENCH))
        for index in range(motion.num_output_ports()):
            output = motion.get_output_port(index)
            if output.get_name() not in ("geometry_pose", MEMORY):
                builder.ExportOutput(output, output.get_name())
        for name in ("body_velocities", "body_accelerations"):
            builder.ExportOutput(bodies.GetOutputPort(name), name)
        builder.ExportOutput(scene_graph.get_query_output_port(), "query_object")
        builder.BuildInto(self)
        self.robot: Robot = robot
        self.in_plant: RobotInPlant = in_plant
        self.plant: MultibodyPlant = plant
        self.scene_graph: SceneGraph = scene_graph
        self.motion: CompiledMotion = motion
        self.forces: CompiledMotion = motion
        self.winches: CompiledMotion = motion
        self.not_at_rest: str = motion.not_at_rest

    def integrate_by(self, rule: StepRule) -> None:
        """Changes how the robot is integrated from now on, in all contexts."""
        self.motion.rule = rule

    def set_at_equilibrium(
        self,
        context: Context,
        X_WP: RigidTransform,
        slack_lengths: Array | None = None,
        at_rest: bool = False,
    ) -> Array:
        """Puts the platform at rest at a pose and sets lengths that hold it.

        As `CableRobot.set_at_equilibrium`; the state is that of the context's time.
        """
        context = own_context(self, context)
        cables, model = self.forces.cable_set(), self.forces.model()
        X_WP, holding = equilibrium_start(
            self.robot, cables, model, X_WP, slack=slack_lengths, at_rest=at_rest
        )
        own = self.GetMutableSubsystemContext(self.motion, context)
        self.motion.hold(own, X_WP, holding.unstrained_lengths, holding.drum_tensions)
        return holding.tensions


def winch_drive(robot: Robot, settings: WinchSettings) -> Drive:
    """What drives a robot's cables by a scenario's section `winches`.

    Raises:
        RobotFileError: The winches have motors, of which the robot's file does not say enough.
    """
    if settings.has_motors():
        groups = robot.winch_groups()
        return Drive(kind=MOTORS, law=robot.winch_law(), mode=settings.mode, groups=groups)
    return Drive(
        kind=IDEAL, rated_speed=robot.winch.rated_cable_speed(), groups=robot.winch_groups()
    )


def motion_by_tensions(
    robot: Robot | str | Path,
    cables: CableSet,
    *,
    push: bool = False,
    rule: StepRule | None = None,
    command_period: float | None = None,
    damping: DampingSettings | None = None,
) -> CompiledMotion:
    """A robot on massless, inextensible cables of commanded tensions, as `TensionDrivenCables`.

    Args:
        robot: The robot.
        cables: The cables.
        push: Whether a command below zero pushes.
        rule: How it is integrated; `default_rule` if None.
        command_period: As for `CompiledMotion`.
        damping: Of the platform. Default: the robot file's.
    """
    robot = as_robot(robot, "motion_by_tensions")
    drive, rule = Drive(kind=TENSIONS, push=push), rule or default_rule(robot, by_tensions=True)
    return CompiledMotion(
        robot, cables, KELVIN_VOIGT, drive, damping=(damping or DampingSettings()).of(robot),
        rule=rule, command_period=command_period,
    )  # fmt: skip

"""Puts cables and winches on a platform that is in somebody's plant."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Protocol, runtime_checkable

import numpy as np
from pydrake.geometry import SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, InputPort, OutputPort
from pydrake.systems.primitives import Adder, Demultiplexer, MatrixGain

from cdpr_drake.arrays import Array
from cdpr_drake.cables.cable_behaviour import behaviour_of
from cdpr_drake.cables.states import crept_at_rest
from cdpr_drake.errors import CableModelError, CdprError, accepted_names
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.models.robot_holding import check_bundles, hold_robot, rest_as_long, rest_with_slack
from cdpr_drake.models.robot_in_plant import (
    RobotInPlant,
    add_robot,
    carried_bodies,
    pose_on_joint,
)
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.scene import add_frame, add_ground
from cdpr_drake.statics.static_tensions import StaticTensions
from cdpr_drake.systems.robots.cable_forces import CREPT, PORTS, CableForces, simulated_cables
from cdpr_drake.systems.robots.failures import BROKEN, FAULTS
from cdpr_drake.systems.robots.plant_step import TAUT, check_platform_step
from cdpr_drake.systems.robots.platform_hysteresis import BENT, PlatformHysteresis
from cdpr_drake.systems.robots.platform_pose import PlatformPose
from cdpr_drake.systems.robots.platform_wrench import APPLIED_WRENCH, PlatformWrench
from cdpr_drake.systems.robots.random_pose import Following, RandomPose
from cdpr_drake.systems.robots.settings import CableRobotSettings
from cdpr_drake.systems.robots.winches import make_winches
from cdpr_drake.winches.motor import MODES, resting_motors

SceneAdder = Callable[[DiagramBuilder, RobotInPlant, SceneGraph], Callable[[], None] | None]
"""Adds to the scene of a robot before its plant is finalized; see `CableRobot`."""


class SimulatedCables(Protocol):
    """What a block tells of its cables."""

    def cable_set(self) -> CableSet:
        """The cables as they are simulated."""

    def model(self) -> str:
        """The model of the cables."""


@runtime_checkable
class RobotBlock(Protocol):
    """A cable robot in a diagram: `CableRobot`, `CompiledCableRobot`, or from `add_cable_robot`."""

    @property
    def robot(self) -> Robot:
        """The robot."""

    @property
    def in_plant(self) -> RobotInPlant:
        """Its platform in the plant."""

    @property
    def plant(self) -> MultibodyPlant:
        """The plant."""

    @property
    def scene_graph(self) -> SceneGraph | None:
        """The scene graph, where there is one."""

    @property
    def forces(self) -> SimulatedCables:
        """The cables, `CableForces` or what has them."""

    @property
    def winches(self) -> Any:
        """The winches, `VelocityWinch` or `MotorWinch`."""

    @property
    def not_at_rest(self) -> str:
        """Why the platform is not at rest in default contexts; empty: it is."""

    def set_at_equilibrium(
        self,
        context: Context,
        X_WP: RigidTransform,
        slack_lengths: Array | None = None,
        at_rest: bool = False,
    ) -> Array:
        """Puts the platform at rest at a pose, as `CableRobot` says; tensions, shape (m,) [N]."""

    def HasInputPort(self, port_name: str) -> bool:
        """Whether there is such an input."""

    def HasOutputPort(self, port_name: str) -> bool:
        """Whether there is such an output."""

    def GetInputPort(self, port_name: str) -> InputPort:
        """The input of that name, as `CableRobot` names it."""

    def GetOutputPort(self, port_name: str) -> OutputPort:
        """The output of that name, as `CableRobot` names it."""


def _named(ports: dict[str, Any], name: str, what: str) -> Any:
    if name not in ports:
        raise CdprError(f"{what}: found {name!r}; {accepted_names(name, sorted(ports))}")
    return ports[name]


@dataclass(frozen=True, eq=False)
class NamedPorts:
    """Ports of blocks in a builder, by the names that `CableRobot` has.

    Attributes:
        inputs: Input ports by name.
        outputs: Output ports by name.
    """

    inputs: dict[str, InputPort]
    outputs: dict[str, OutputPort]

    def HasInputPort(self, port_name: str) -> bool:
        """Whether there is such an input."""
        return port_name in self.inputs

    def HasOutputPort(self, port_name: str) -> bool:
        """Whether there is such an output."""
        return port_name in self.outputs

    def GetInputPort(self, port_name: str) -> InputPort:
        """The input of that name.

        Raises:
            CdprError: There is none; names those that there are.
        """
        return _named(self.inputs, port_name, "input port")

    def GetOutputPort(self, port_name: str) -> OutputPort:
        """The output of that name.

        Raises:
            CdprError: There is none; names those that there are.
        """
        return _named(self.outputs, port_name, "output port")


@dataclass(frozen=True, eq=False, kw_only=True)
class CableRobotPorts(NamedPorts):
    """The blocks of a robot in a builder.

    Attributes:
        robot: The robot.
        in_plant: Its platform in the plant.
        plant: The plant.
        scene_graph: The scene graph, where there is one, for cameras.
        forces: The cables, `CableForces`.
        winches: The winches, `VelocityWinch` or `MotorWinch`.
        damping: What brakes the platform beside its cables; None: nothing.
        not_at_rest: Why the platform is not at rest in default contexts; empty: it is.
    """

    robot: Robot
    in_plant: RobotInPlant
    plant: MultibodyPlant
    scene_graph: SceneGraph | None
    forces: CableForces
    winches: Any
    damping: MatrixGain | None = None
    not_at_rest: str = ""

    def set_at_equilibrium(
        self,
        context: Context,
        X_WP: RigidTransform,
        slack_lengths: Array | None = None,
        at_rest: bool = False,
    ) -> Array:
        """As `CableRobot.set_at_equilibrium`, from the root context of the built diagram.

        Raises:
            CableModelError: The plant is discrete, and its time step longer than its cables bear
                there; names the largest one.
        """
        plant_context = self.plant.GetMyMutableContextFromRoot(context)
        winch_context = self.winches.GetMyMutableContextFromRoot(context)
        cables, model = self.forces.cable_set(), self.forces.model()
        X_WP, holding = equilibrium_start(
            self.robot, cables, model, X_WP, slack=slack_lengths, at_rest=at_rest
        )
        cable_context = self.forces.GetMyMutableContextFromRoot(context)
        self.forces.relax(cable_context, X_WP, holding.unstrained_lengths)
        tensions = set_robot_at_equilibrium(self, plant_context, winch_context, X_WP, holding)
        lengths = holding.unstrained_lengths
        check_platform_step(self.in_plant, plant_context, self.forces, lengths, self.damping)
        return tensions


def own_context(block: Diagram, context: Context) -> Context:
    """A block's own context in the root context of the diagram around it, or that which it is."""
    try:
        return block.GetMyMutableContextFromRoot(context)
    except RuntimeError:  # it is no root context
        return context


def fill_scene(
    builder: DiagramBuilder,
    robot: Robot,
    plant: MultibodyPlant,
    scene_graph: SceneGraph,
    *,
    add_to_scene: SceneAdder | None,
    floor: bool,
) -> RobotInPlant:
    """Puts a robot and what stands round it into a plant, which is finalized then.

    Args:
        builder: The builder that has the scene.
        robot: The robot.
        plant: The plant, not finalized.
        scene_graph: Its scene.
        add_to_scene: As for `CableRobot`.
        floor: Whether there is a ground below.
    """
    in_plant = add_robot(plant, robot)
    add_frame(plant, robot)
    if floor:
        add_ground(plant, robot)
    wire = None if add_to_scene is None else add_to_scene(builder, in_plant, scene_graph)
    plant.Finalize()
    if wire is not None:
        wire()
    return in_plant


def add_cable_robot(
    builder: DiagramBuilder,
    in_plant: RobotInPlant,
    settings: CableRobotSettings | None = None,
    *,
    scene_graph: SceneGraph | None = None,
    name: str = "",
    random_pose: RandomPose | None = None,
) -> CableRobotPorts:
    """Adds cables, winches and platform pose to a robot in a finalized plant of the builder.

    The plant may hold further robots and bodies: forces of several robots add up. Other generalized
    forces on the plant are connected before, or by `apply_force`: the plant's input port is taken
    afterwards, and Drake ends the process of who connects a port twice.

    Default contexts, and so `Simulator.reset_context` and `SetRandomContext`, have the platform at
    the plant's default pose of now, which `SetDefaultFreeBodyPose` sets and which is else the
    robot's home, with the lengths that hold it at rest there; where nothing holds it, see
    `CableRobotPorts.not_at_rest`, with cables that are just not taut.

    Args:
        builder: The builder that has the plant.
        in_plant: The platform in the plant, from `cdpr_drake.models.add_robot`.
        settings: Cables, winches and damping; the defaults where None.
        scene_graph: The scene graph, if cameras shall see the robot.
        name: Put before the names of the blocks, so that several robots can be told apart.
        random_pose: Poses of random contexts about the default pose; None: the default pose.

    Returns:
        Handles and ports.

    Raises:
        CableModelError: The cables' model cannot describe the robot's cables, or the plant is
            discrete and its time step longer than the cables bear; names the largest one, which
            `stable_plant_step` finds from stiffness, damping and inertia at the default positions.
        CableGeometryError: At the home pose a cable cannot run over its pulley.
        RobotFileError: Winches with motors are asked for that the robot's file does not describe.
    """
    for value, kind, what in ((builder, DiagramBuilder, "builder"), (in_plant, RobotInPlant,
                              "in_plant")):  # fmt: skip
        if not isinstance(value, kind):
            raise CdprError(
                f"add_cable_robot: {what}: found a {type(value).__name__}; accepted: a "
                f"{kind.__name__}, as in add_cable_robot(builder, add_robot(plant, robot))"
            )
    settings = settings or CableRobotSettings()
    robot, plant, prefix = in_plant.robot, in_plant.plant, f"{name}_" if name else ""
    cables, model = settings.cables.cable_set(robot), settings.cables.model_of(robot)
    failures = settings.failure_block(robot)
    may_fail = failures is not None
    defaults = plant.CreateDefaultContext()
    start = default_start(in_plant, defaults, simulated_cables(cables, model), model)
    forces = builder.AddNamedSystem(
        prefix + "cables", CableForces(in_plant, cables, model, may_fail, start.crept)
    )
    home = cable_paths(robot.home.transform(), cables).lengths
    following = None
    if random_pose is not None:
        following = _following(in_plant, settings, forces.cable_set(), home, start, random_pose)
    winch = builder.AddNamedSystem(
        prefix + "winches",
        make_winches(robot, settings.winches, home, may_fail, start, following),
    )
    pose = builder.AddNamedSystem(prefix + "platform_pose", PlatformPose(in_plant))
    state = plant.get_state_output_port(in_plant.model_instance)
    builder.Connect(state, forces.GetInputPort("platform_state"))
    builder.Connect(state, pose.GetInputPort("platform_state"))
    applied, drums = forces.GetOutputPort("generalized_force"), None
    if settings.winches.has_motors():
        sizes = [plant.num_velocities(), cables.count]
        both = builder.AddNamedSystem(prefix + "force_and_drums", Demultiplexer(sizes))
        builder.Connect(forces.GetOutputPort("force_and_drums"), both.get_input_port())
        applied, drums = both.get_output_port(0), both.get_output_port(1)
    brake = settings.damping.block(in_plant)
    if brake is not None:
        builder.AddNamedSystem(prefix + "damping", brake)
        builder.Connect(state, brake.get_input_port())
        applied = _sum(builder, prefix + "applied_force", applied, brake.get_output_port())
    taut = (1.0 - TAUT) * cable_paths(in_plant.pose(defaults), cables).lengths
    check_platform_step(in_plant, defaults, forces, taut, brake)
    friction = add_hysteresis(builder, in_plant, name=name)
    if friction is not None:
        rubbing = friction.GetOutputPort("generalized_force")
        applied = _sum(builder, prefix + "force_and_friction", applied, rubbing)
    wrench = builder.AddNamedSystem(prefix + "platform_wrench", PlatformWrench(in_plant))
    applied = _sum(builder, prefix + "force_and_wrench", applied, wrench.get_output_port())
    apply_force(builder, plant, applied, name=name)
    inputs = {}
    for port in map(winch.get_input_port, range(winch.num_input_ports())):
        if drums is not None and port.get_name() == "tensions":
            builder.Connect(drums, port)
        elif port.get_name() == "platform_state":
            builder.Connect(state, port)
        else:
            inputs[port.get_name()] = port
    inputs[APPLIED_WRENCH] = wrench.get_input_port()
    outputs = {"platform_state": state, "X_WP": pose.GetOutputPort("X_WP")}
    outputs |= {port: forces.GetOutputPort(port) for port in PORTS}
    if forces.HasOutputPort(CREPT):
        outputs[CREPT] = forces.GetOutputPort(CREPT)
    if friction is not None:
        outputs[BENT] = friction.GetOutputPort(BENT)
    for port_name in ("unstrained_lengths", "unstrained_length_rates"):
        builder.Connect(winch.GetOutputPort(port_name), forces.GetInputPort(port_name))
    for port in map(winch.get_output_port, range(winch.num_output_ports())):
        outputs[port.get_name()] = port
    if failures is not None:
        builder.AddNamedSystem(prefix + "failures", failures)
        inputs[BROKEN] = forces.GetInputPort(BROKEN)
        for port_name in set(FAULTS) & set(inputs):
            outputs[port_name] = failures.GetOutputPort(port_name)
            builder.Connect(outputs[port_name], inputs[port_name])
            inputs[port_name] = failures.GetInputPort(port_name)
    outputs["body_poses"] = plant.get_body_poses_output_port()
    outputs["body_velocities"] = plant.get_body_spatial_velocities_output_port()
    outputs["body_accelerations"] = plant.get_body_spatial_accelerations_output_port()
    if scene_graph is not None:
        outputs["query_object"] = scene_graph.get_query_output_port()
    return CableRobotPorts(
        inputs, outputs, robot=robot, in_plant=in_plant, plant=plant, scene_graph=scene_graph,
        forces=forces, winches=winch, damping=brake, not_at_rest=start.problem,
    )  # fmt: skip


def _following(
    in_plant: RobotInPlant,
    settings: CableRobotSettings,
    cables: CableSet,
    home: Array,
    start: DefaultStart,
    random_pose: RandomPose,
) -> Following:
    """Gives the platform a random pose, and says which state of the winches holds it there."""
    robot, model = in_plant.robot, settings.cables.model_of(in_plant.robot)
    if len(start.crept) or robot.is_underactuated() or start.problem:
        raise CableModelError(
            f"random_pose of {robot.name}: {start.problem or 'its cables creep, or are too few'}; "
            "accepted: a robot that rests at its default pose, on cables that do not creep"
        )
    random_pose.put_on(in_plant, start.X_WP)
    joint = robot.joint()

    def state_at(platform: Array) -> Array:
        X_WP = pose_on_joint(joint, platform)
        _, held = equilibrium_start(robot, cables, model, X_WP, slack=None, at_rest=False)
        if not settings.winches.has_motors():
            return held.unstrained_lengths
        law, mode = robot.winch_law(), MODES[settings.winches.mode]
        return resting_motors(law, mode, home, held.unstrained_lengths, held.drum_tensions)

    plant, instance = in_plant.plant, in_plant.model_instance
    default = plant.GetPositions(plant.CreateDefaultContext(), instance)
    return Following(plant.num_multibody_states(instance), default, state_at)


def add_hysteresis(
    builder: DiagramBuilder, in_plant: RobotInPlant, *, name: str = ""
) -> PlatformHysteresis | None:
    """Adds the friction against turns of a platform that its file gives, which acts on nothing yet.

    Args:
        builder: The builder that has the plant.
        in_plant: The platform in the plant.
        name: Put before the name of the block.

    Returns:
        The block, with the platform's state; None where the file gives none.
    """
    contacts = in_plant.robot.contact_hysteresis()
    if contacts is None:
        return None
    prefix = f"{name}_" if name else ""
    friction = builder.AddNamedSystem(prefix + "hysteresis", PlatformHysteresis(in_plant, contacts))
    state = in_plant.plant.get_state_output_port(in_plant.model_instance)
    builder.Connect(state, friction.get_input_port())
    return friction


def set_robot_at_equilibrium(
    block: RobotBlock,
    plant_context: Context,
    winch_context: Context,
    X_WP: RigidTransform,
    holding: StaticTensions,
) -> Array:
    """Puts a platform at a pose, at rest, with lengths and drum tensions; returns its tensions.

    Raises:
        CableModelError: Bodies with mass hang on the platform, which these tensions do not hold.
    """
    carried = carried_bodies(block.in_plant)
    if carried:
        raise CableModelError(
            f"set_at_equilibrium: found {carried[0]} on the platform of {block.robot.name}, whose "
            "weight would not be held; accepted: a platform that carries nothing; models.hang with "
            "CableRoutes.of_cable_set finds tensions that hold both"
        )
    block.in_plant.set_pose(plant_context, X_WP)
    block.winches.hold(winch_context, holding.unstrained_lengths, holding.drum_tensions)
    return holding.tensions


@dataclass(frozen=True)
class DefaultStart:
    """Platform, winches and cables of default contexts.

    Attributes:
        X_WP: Pose of the platform [m].
        lengths: Unstrained lengths, shape (m,) [m].
        drum_tensions: Tensions at the drums, shape (m,) [N].
        crept: Strains that have crept, shape (m,); empty where cables do not creep.
        problem: Why these do not hold the platform; empty: they do.
    """

    X_WP: RigidTransform
    lengths: Array
    drum_tensions: Array
    crept: Array
    problem: str


def resting_start(robot: Robot, X_WP: RigidTransform, cables: CableSet, model: str) -> DefaultStart:
    """Lengths and tensions that hold a platform at a pose; without any, cables just not taut.

    Args:
        robot: The robot.
        X_WP: The pose [m]; with fewer cables than degrees of freedom it rests near it.
        cables: Its cables as they are simulated.
        model: Their model.

    Raises:
        CableGeometryError: A cable cannot run there.
    """
    lengths, drums, problem = cable_paths(X_WP, cables).lengths, np.zeros(cables.count), ""
    try:
        X_WP, held = equilibrium_start(robot, cables, model, X_WP, slack=None, at_rest=False)
        lengths, drums = held.unstrained_lengths, held.drum_tensions
    except CdprError as refusal:
        problem = str(refusal)
    creeps = behaviour_of(cables).creep_stiffness > 0.0
    crept = crept_at_rest(cables, X_WP, lengths) if creeps else np.zeros(0)
    return DefaultStart(X_WP, lengths, drums, crept, problem)


def default_start(
    in_plant: RobotInPlant, defaults: Context, cables: CableSet, model: str
) -> DefaultStart:
    """`resting_start` of a platform in a default context of its plant.

    With fewer cables than degrees of freedom the default pose becomes that where it rests.
    """
    start = resting_start(in_plant.robot, in_plant.pose(defaults), cables, model)
    if in_plant.robot.is_underactuated() and not start.problem:
        in_plant.set_default_pose(start.X_WP)
    carried = carried_bodies(in_plant)
    if carried and not start.problem:
        return replace(start, problem=f"{carried[0]} hangs on the platform, and is not held")
    return start


def equilibrium_start(
    robot: Robot,
    cables: CableSet,
    model: str,
    X_WP: RigidTransform,
    *,
    slack: Array | None,
    at_rest: bool,
) -> tuple[RigidTransform, StaticTensions]:
    """Where a platform starts, and with which lengths and tensions.

    See `CableRobot.set_at_equilibrium`.

    Args:
        robot: The robot.
        cables: Its cables as they are simulated.
        model: Their model.
        X_WP: Pose that is asked for [m].
        slack: Lengths to be paid out beside what holds that pose, shape (m,) [m]; None: none.
        at_rest: Whether the platform starts where it comes to rest with them.
    """
    check_bundles(robot, cables, X_WP)
    if robot.is_underactuated():
        rest, holding = rest_as_long(robot, X_WP, cables, model, slack if at_rest else None)
        if slack is not None and not at_rest:
            holding = replace(holding, unstrained_lengths=holding.unstrained_lengths + slack)
        return rest, holding
    holding = hold_robot(robot, X_WP, cables, model)
    if slack is None:
        return X_WP, holding
    if at_rest:
        return rest_with_slack(robot, X_WP, holding, slack, cables, model)
    return X_WP, replace(holding, unstrained_lengths=holding.unstrained_lengths + slack)


def _sum(builder: DiagramBuilder, name: str, one: OutputPort, other: OutputPort) -> OutputPort:
    total = builder.AddNamedSystem(name, Adder(2, one.size()))
    builder.Connect(one, total.get_input_port(0))
    builder.Connect(other, total.get_input_port(1))
    return total.get_output_port()


def apply_force(
    builder: DiagramBuilder, plant: MultibodyPlant, force: OutputPort, *, name: str = ""
) -> None:
    """Applies a generalized force, shape (nv,), beside one that is applied already, if there is.

    Args:
        builder: The builder that has the plant.
        plant: The plant.
        force: The force.
        name: Put before the name of the block that adds it to what there was.
    """
    port = plant.get_applied_generalized_force_input_port()
    for (system, index), (source, number) in builder.connection_map().items():
        if system is plant and index == port.get_index():
            before = source.get_output_port(number)
            builder.Disconnect(before, port)
            force = _sum(builder, (f"{name}_" if name else "") + "all_forces", before, force)
    builder.Connect(force, port)

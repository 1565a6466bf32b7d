"""Wires a scenario of picking and placing into one Diagram."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from pydrake.common.value import Value
from pydrake.geometry import SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.tree import RigidBody
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, System
from pydrake.systems.primitives import ConstantValueSource, ConstantVectorSource

from cdpr_drake.models.robot_in_plant import RobotInPlant
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.servoing.controller import ServoController
from cdpr_drake.servoing.servo_law import AdaptiveGain, ServoLaw
from cdpr_drake.servoing.servo_task import BelievedRobot, make_task
from cdpr_drake.servoing.visual_features import CameraPoseFeatures
from cdpr_drake.systems.controllers.feature_servo import FeatureServo
from cdpr_drake.systems.controllers.schemes import ideal_sighting
from cdpr_drake.systems.diagrams.servo_watches import LOGGED_OF_CABLES
from cdpr_drake.systems.estimators.estimator_kinds import ESTIMATORS, EstimatorTask
from cdpr_drake.systems.monitoring.log_row import RunLog, add_log
from cdpr_drake.systems.pick_and_place.cameras import add_cameras, pinholes
from cdpr_drake.systems.pick_and_place.gripper import GripLaw, Gripper
from cdpr_drake.systems.pick_and_place.handling_step import believed_robot, box_step, camera_poses
from cdpr_drake.systems.pick_and_place.pick_and_place_state_machine import (
    PickAndPlaceStateMachine,
    X_CdV,
)
from cdpr_drake.systems.pick_and_place.pick_and_place_task import (
    GAP,
    Phase,
    PickAndPlaceGeometry,
    PickAndPlaceRules,
    PickAndPlaceTask,
)
from cdpr_drake.systems.pick_and_place.tag_occlusion import TagOcclusion
from cdpr_drake.systems.pick_and_place.workpiece import (
    INSTANCE,
    add_goal,
    add_stem,
    add_workpiece,
    tag_pose,
)
from cdpr_drake.systems.robots.assembly import apply_force
from cdpr_drake.systems.robots.cable_robot import STEP_SHARE, CableRobot, automatic_step
from cdpr_drake.systems.robots.platform_wrench import APPLIED_WRENCH
from cdpr_drake.systems.scenarios.pick_and_place_scenario import PickAndPlaceScenario
from cdpr_drake.systems.scenarios.pick_and_place_settings import COVERED_IN, OBJECT_TAG
from cdpr_drake.systems.sections import Platform, add_pushes, sections_of
from cdpr_drake.systems.sensors.sensor_readings import SensorReadings
from cdpr_drake.systems.worlds.adding import WorldInScene
from cdpr_drake.systems.worlds.contact import contact_law, contact_step

FREE_FALL = 9.81
"""For what needs a weight where a robot has no gravity [m/s^2]."""


@dataclass(frozen=True, kw_only=True)
class PickAndPlace:
    """A scenario's diagram and the handles that a run needs.

    Attributes:
        scenario: The scenario.
        diagram: The diagram; subsystems robot, object_camera, goal_camera, their detectors (if
            rendered), machine, servo, estimator, gripper, cover (in robot, if there is one).
        block: The robot.
        box: The box in the robot's plant.
        machine: The phases.
        gripper: The gripper.
        X_WB: Where the box truly is at time 0 [m].
        X_WG: Where the goal truly is [m].
        log: What the run stores.
        max_step: Integration step [s].
    """

    scenario: PickAndPlaceScenario
    diagram: Diagram
    block: CableRobot
    box: RigidBody
    machine: PickAndPlaceStateMachine
    gripper: Gripper
    X_WB: RigidTransform
    X_WG: RigidTransform
    log: RunLog
    max_step: float

    @property
    def robot(self) -> Robot:
        """The robot's data."""
        return self.block.robot

    def make_context(self) -> Context:
        """A root context with the platform at rest at the initial pose and the box where it is.

        Raises:
            InfeasibleTensionError: The initial pose cannot be held.
        """
        context = self.diagram.CreateDefaultContext()
        own = self.block.GetMyMutableContextFromRoot(context)
        self.block.set_at_equilibrium(own, self.scenario.initial_pose.transform())
        plant_context = self.block.plant.GetMyMutableContextFromRoot(context)
        self.block.plant.SetFreeBodyPose(plant_context, self.box, self.X_WB)
        return context

    def platform_pose(self, context: Context) -> RigidTransform:
        """X_WP [m], from a root context."""
        return self.diagram.GetOutputPort("X_WP").Eval(context)

    def box_pose(self, context: Context) -> RigidTransform:
        """X_WB [m], from a root context."""
        return self.diagram.GetOutputPort("X_WB").Eval(context)


def grip_law(scenario: PickAndPlaceScenario) -> GripLaw:
    """The gripper's law; its damping is that of the box alone."""
    own, box = scenario.gripper, scenario.workpiece
    radius = 0.5 * float(np.linalg.norm(box.size))
    inertia = box.mass * radius**2 / 3.0
    share = 2.0 * own.damping_ratio
    return GripLaw(
        p_PT=own.tip,
        p_BF=np.array([0.0, 0.0, 0.5 * float(box.size[2])]),
        reach=own.reach,
        sideways=own.sideways,
        tilt=float(np.radians(own.tilt_deg)),
        stiffness=own.stiffness,
        damping=share * float(np.sqrt(own.stiffness * box.mass)),
        rotational_stiffness=own.rotational_stiffness,
        rotational_damping=share * float(np.sqrt(own.rotational_stiffness * inertia)),
        strength=own.strength,
    )


def make_pick_and_place_task(scenario: PickAndPlaceScenario, robot: Robot) -> PickAndPlaceTask:
    """The task with what the robot believes."""
    box, goal, rules = scenario.workpiece, scenario.goal, scenario.handling
    half = 0.5 * float(box.size[2])
    of_object, of_goal = camera_poses(scenario, robot, believed=True)
    return PickAndPlaceTask(
        PickAndPlaceGeometry(
            X_BO=tag_pose(box.tag, half),
            X_BP=RigidTransform(np.array([0.0, 0.0, half + GAP]) - scenario.gripper.tip),
            X_GT=tag_pose(goal.tag, -half),
            X_PC_object=of_object,
            X_PC_goal=of_goal,
            X_WB=box.pose.transform(),
            X_WG=goal.pose.transform(),
            weight=box.mass * (robot.gravity or FREE_FALL),
        ),
        PickAndPlaceRules(
            hover=rules.hover,
            distance=rules.distance,
            angle=float(np.radians(rules.angle_deg)),
            hold=rules.hold,
            passing_distance=rules.passing_distance,
            fresh=rules.fresh,
            blind=rules.blind,
            pause=rules.pause,
            phase_limit=rules.phase_limit,
            smoothing=rules.smoothing,
            period=1.0 / rules.rate,
        ),
    )


def build_pick_and_place(scenario: PickAndPlaceScenario) -> PickAndPlace:
    """Builds the diagram of a scenario.

    Raises:
        RobotFileError: The robot's file is not accepted.
        RenderingError: The cameras are rendered and EGL is missing.
    """
    robot, builder = load_robot(scenario.robot), DiagramBuilder()
    X_WB, X_WG = scenario.places()
    scene = _Scene(scenario, robot, X_WG)
    block = builder.AddNamedSystem(
        "robot", CableRobot(robot, scenario, add_to_scene=scene.add, floor=False)
    )
    assert scene.box is not None
    assert scene.gripper is not None
    believed = believed_robot(scenario, robot)
    task = make_pick_and_place_task(scenario, robot)
    machine = builder.AddNamedSystem(
        "machine", PickAndPlaceStateMachine(task, believed.X_WP0, believed.X_PC)
    )
    cameras = add_cameras(builder, scenario, block, machine=machine, X_WG=X_WG)
    servo = _add_servo(builder, scenario, robot, believed, machine)
    estimator, readings = _add_estimator(builder, scenario, believed, block, servo)
    for system in (servo, machine):
        builder.Connect(estimator.GetOutputPort("X_WP"), system.GetInputPort("X_WP"))
    for name in ("holding", "load"):
        builder.Connect(block.GetOutputPort(name), machine.GetInputPort(name))
    builder.Connect(machine.GetOutputPort("gripper_closed"), block.GetInputPort("gripper_closed"))
    builder.Connect(servo.GetOutputPort("cable_velocities"), block.GetInputPort("cable_velocities"))
    if scenario.cover is not None:
        builder.Connect(machine.GetOutputPort("phase"), block.GetInputPort("phase"))
    ports = {
        "X_WP": block.GetOutputPort("X_WP"),
        "X_WB": block.GetOutputPort("X_WB"),
        "X_WP_estimated": estimator.GetOutputPort("X_WP"),
        "X_WP_aim": machine.GetOutputPort("X_WP_aim"),
        "phase": machine.GetOutputPort("phase"),
        "found_object": cameras[0].GetOutputPort("found"),
        "found_goal": cameras[1].GetOutputPort("found"),
        "load": block.GetOutputPort("load"),
        "grip": block.GetOutputPort("grip"),
        "platform_velocity": servo.GetOutputPort("platform_velocity"),
        **{name: block.GetOutputPort(name) for name in LOGGED_OF_CABLES},
    }
    platform = Platform(
        robot=robot, X_WP=block.GetOutputPort("X_WP"), state=block.GetOutputPort("platform_state"),
        seed=scenario.seed,
    )  # fmt: skip
    wrench = add_pushes(builder, [section for _, section in sections_of(scenario)], platform)
    if wrench is not None:
        builder.Connect(wrench, block.GetInputPort(APPLIED_WRENCH))
        ports[APPLIED_WRENCH] = wrench
    if scenario.cover is not None:
        ports["hidden"] = block.GetOutputPort("tag_occluded")
    log = add_log(builder, ports, scenario.log_rate)
    for name in ("X_WP", "X_WB", "tensions", "lengths", "unstrained_lengths"):
        builder.ExportOutput(block.GetOutputPort(name), name)
    if scenario.cover is not None:
        builder.ExportOutput(block.GetOutputPort("tag_occluded"), "hidden")
    builder.ExportOutput(machine.GetOutputPort("X_WP_aim"), "X_WP_desired")
    diagram = builder.Build()
    diagram.set_name(scenario.name)
    max_step = min(integration_step(scenario, robot, scene.gripper.law), readings.shortest_period())
    readings.check_step(max_step)
    return PickAndPlace(
        scenario=scenario, diagram=diagram, block=block, box=scene.box, machine=machine,
        gripper=scene.gripper, X_WB=X_WB, X_WG=X_WG, log=log, max_step=max_step,
    )  # fmt: skip


class _Scene:
    """Adds world, box, goal and cover to a robot's scene."""

    def __init__(self, scenario: PickAndPlaceScenario, robot: Robot, X_WG: RigidTransform) -> None:
        assert scenario.world is not None  # the scenario was checked
        self._scenario, self._X_WG = scenario, X_WG
        self._world = WorldInScene(scenario.world, robot)
        self.box: RigidBody | None = None
        self.gripper: Gripper | None = None

    def add(
        self, builder: DiagramBuilder, robot: RobotInPlant, scene_graph: SceneGraph
    ) -> Callable[[], None]:
        """For use as `add_to_scene` of `CableRobot`."""
        scenario, plant = self._scenario, robot.plant
        wire = self._world.add(builder, robot, scene_graph)
        gravity = robot.robot.gravity or FREE_FALL
        box = add_workpiece(robot, scene_graph, scenario.workpiece, gravity)
        self.box = box
        half = 0.5 * float(scenario.workpiece.size[2])
        X_GT = tag_pose(scenario.goal.tag, -half)
        add_goal(plant, self._X_WG, scenario.goal.tag, X_GT)
        add_stem(robot, scenario.gripper.tip)
        cover = None
        if scenario.cover is not None:
            tag = scenario.workpiece.tag if self._covers_box() else scenario.goal.tag
            number = int(Phase[scenario.cover.phase.upper()])
            cover = builder.AddNamedSystem(
                "cover",
                TagOcclusion(
                    scene_graph, tag.size, number, scenario.cover.delay, scenario.cover.duration
                ),
            )
            builder.Connect(
                cover.GetOutputPort("geometry_pose"),
                scene_graph.get_source_pose_port(cover.source_id),
            )
            builder.ExportInput(cover.GetInputPort("phase"), "phase")
            builder.ExportOutput(cover.GetOutputPort("tag_occluded"), "tag_occluded")
            X_WO = scenario.places()[0] @ tag_pose(scenario.workpiece.tag, half)
            X_WT = X_WO if self._covers_box() else self._X_WG @ X_GT
            source = builder.AddNamedSystem("covered_tag", ConstantValueSource(Value(X_WT)))
            builder.Connect(source.get_output_port(), cover.GetInputPort("X_WT"))

        def finish() -> None:
            wire()
            self._add_gripper(builder, robot, box)

        return finish

    def _add_gripper(self, builder: DiagramBuilder, robot: RobotInPlant, box: RigidBody) -> None:
        """The gripper, between platform and box."""
        plant = robot.plant
        law = grip_law(self._scenario)
        gripper = builder.AddNamedSystem("gripper", Gripper(law, plant, (robot.body, box)))
        for name, instance in (
            ("platform_state", robot.model_instance),
            ("box_state", plant.GetModelInstanceByName(INSTANCE)),
        ):
            builder.Connect(plant.get_state_output_port(instance), gripper.GetInputPort(name))
        apply_force(builder, plant, gripper.GetOutputPort("forces"), name="grip")
        builder.ExportInput(gripper.GetInputPort("gripper_closed"), "gripper_closed")
        for name in ("X_WB", "holding", "load", "grip"):
            builder.ExportOutput(gripper.GetOutputPort(name), name)
        self.gripper = gripper

    def _covers_box(self) -> bool:
        cover = self._scenario.cover
        return cover is not None and COVERED_IN[cover.phase] == OBJECT_TAG


def _add_servo(
    builder: DiagramBuilder,
    scenario: PickAndPlaceScenario,
    robot: Robot,
    believed: BelievedRobot,
    machine: PickAndPlaceStateMachine,
) -> FeatureServo:
    """The visual servo, which looks at what the machine shows it."""
    own, target = scenario.handling, scenario.workpiece.tag.target()
    law = ServoLaw(AdaptiveGain(own.lambda_0, own.lambda_infinity, own.lambda_slope), own.sigma)
    task = make_task(CameraPoseFeatures(X_CdV), ideal_sighting(target, X_CdV))
    controller = ServoController(law, [task], believed, 1.0 / own.rate)
    pinhole = pinholes(scenario, robot)[0]
    servo = builder.AddNamedSystem("servo", FeatureServo(controller, target, pinhole, own.rate))
    builder.Connect(machine.GetOutputPort("X_CV"), servo.GetInputPort("X_CO"))
    builder.Connect(machine.GetOutputPort("platform_moving"), servo.GetInputPort("found"))
    unused = builder.AddNamedSystem("no_marks", ConstantVectorSource(np.zeros(target.size)))
    builder.Connect(unused.get_output_port(), servo.GetInputPort(target.mark))
    return servo


def _add_estimator(
    builder: DiagramBuilder,
    scenario: PickAndPlaceScenario,
    believed: BelievedRobot,
    block: CableRobot,
    servo: FeatureServo,
) -> tuple[System, SensorReadings]:
    """What knows the platform's pose without images, and the sensors that it reads."""
    readings = SensorReadings(builder, block, scenario.sensors, seed=scenario.seed)
    task = EstimatorTask(
        robot=believed,
        X_WP0=scenario.initial_pose.transform(),
        target=scenario.workpiece.tag.target(),
        target_rests=False,
        pinhole=pinholes(scenario, block.robot)[0],
        rate=scenario.handling.rate,
    )
    estimator = builder.AddNamedSystem("estimator", ESTIMATORS[scenario.estimator.kind].make(task))
    for index in range(estimator.num_input_ports()):
        port = estimator.get_input_port(index)
        name = port.get_name()
        own = name == "platform_velocity"
        source = servo.GetOutputPort(name) if own else readings.port(name)
        builder.Connect(source, port)
    return estimator, readings


def integration_step(scenario: PickAndPlaceScenario, robot: Robot, law: GripLaw) -> float:
    """The scenario's step, or one that is stable on cables, on the table and in the grip [s]."""
    own, world, gravity = scenario.integration, scenario.world, robot.gravity or FREE_FALL
    if own.max_step is not None:
        return own.max_step
    assert world is not None  # the scenario was checked
    assert world.contact is not None
    up = RigidTransform([0.0, 0.0, -float(scenario.gripper.tip[2])])
    poses = (scenario.initial_pose, scenario.workpiece.pose, scenario.goal.pose)
    ends = [poses[0].transform(), *(up @ pose.transform() for pose in poses[1:])]
    cables = min(automatic_step(robot, X, own.integrator, scenario) for X in ends)
    contact = contact_law(world.contact, robot)
    steps = (
        contact_step(robot, contact, world.friction(), own.integrator),
        box_step(scenario.workpiece, law, gravity, contact.slip_speed, own.integrator),
    )
    # Squares of frequencies add where all of them hold the platform together.
    rates = [1.0 / cables, *(1.0 / (STEP_SHARE * step) for step in steps)]
    return 1.0 / float(np.linalg.norm(rates))

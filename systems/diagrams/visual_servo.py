"""Wires a scenario into one Diagram: robot, visual servo, monitor, logs."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, Diagram, DiagramBuilder

from cdpr_drake.arrays import Array
from cdpr_drake.errors import ScenarioError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.cameras.region_camera import RegionCamera
from cdpr_drake.systems.controllers.torque_settings import TorqueControl
from cdpr_drake.systems.diagrams.camera import scene_adder
from cdpr_drake.systems.diagrams.servo_blocks import VisualServoBlocks, add_visual_servo
from cdpr_drake.systems.diagrams.servo_models import ServoModel
from cdpr_drake.systems.diagrams.servo_watches import (
    LOGGED_OF_CABLES,
    add_servo_log,
    add_servo_watches,
)
from cdpr_drake.systems.monitoring.log_row import RunLog
from cdpr_drake.systems.monitoring.run_monitor import RunMonitor
from cdpr_drake.systems.monitoring.tension_watch import BreakingLoadWatch, TensionRange
from cdpr_drake.systems.robots.cable_robot import STEP_SHARE, CableRobot, automatic_step
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.compiled_motion import HELD
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.failures import LATE
from cdpr_drake.systems.robots.settings import COMPILED
from cdpr_drake.systems.scenarios.files import VISUAL_SERVO
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.systems.sections import sections_of
from cdpr_drake.systems.sensors.sensor_readings import check_rate
from cdpr_drake.systems.worlds.adding import WorldInScene, WorldMeters
from cdpr_drake.systems.worlds.contact import contact_law, contact_step

WATCH_PERIOD = 1e-3
"""Time between looks for broken cables at a robot that the compiled engine moves [s]; a plant's are
looked at once a step, which is about as long."""


@dataclass(frozen=True, kw_only=True)
class VisualServo(VisualServoBlocks):
    """A scenario's diagram and the handles that a run needs.

    Attributes:
        scenario: The scenario.
        diagram: The diagram; subsystems robot, camera, detector (whole rendered images only),
            servo, estimator, monitor, wanted_lengths (winches by position only),
            those of sections; exported outputs of the same names as their ports.
        monitor: The block that ends the run.
        log: What the run stores.
        max_step: Integration step [s].
        watch: Watches for broken cables; None where no breaking load is known.
        tension_range: Watches how far tensions go, where torques are commanded; else None.
        world: What is round the robot; None: nothing.
        meters: What measures the robot in it; None without a world.
    """

    scenario: Scenario
    diagram: Diagram
    monitor: RunMonitor
    log: RunLog
    max_step: float
    watch: BreakingLoadWatch | None = None
    tension_range: TensionRange | None = None
    world: WorldInScene | None = None
    meters: WorldMeters | None = None

    @property
    def cable_robot(self) -> CableRobot | CompiledCableRobot:
        """The robot's block."""
        assert isinstance(self.block, CableRobot | CompiledCableRobot)
        return self.block

    @property
    def outside(self) -> Any:
        """The place of a process outside, as the servo offers it; None: there is none."""
        return getattr(self.servo, "outside", None)

    def true_pose(self, context: Context) -> RigidTransform:
        """X_WP of the platform [m], from the root context."""
        block = self.cable_robot
        return block.GetOutputPort("X_WP").Eval(block.GetMyContextFromRoot(context))

    def step_errors(self, context: Context) -> Array | None:
        """Largest estimated errors of a step, position [m] and rotation [rad], from the root
        context; None from a plant, whose integrator does not say."""
        block = self.cable_robot
        if not block.HasOutputPort("step_errors"):
            return None
        return np.array(
            block.GetOutputPort("step_errors").Eval(block.GetMyContextFromRoot(context))
        )

    def images(self, context: Context) -> tuple[int, int] | None:
        """Images taken and those drawn whole, from the root context; None where no window is."""
        camera = self.measurement
        if not isinstance(camera, RegionCamera):
            return None
        return camera.images(camera.GetMyContextFromRoot(context))

    def make_context(self) -> Context:
        """A root context with the platform at rest at the initial pose, slack paid out if asked.

        Raises:
            InfeasibleTensionError: The initial pose cannot be held.
        """
        context = self.diagram.CreateDefaultContext()
        block = self.cable_robot
        own = block.GetMyMutableContextFromRoot(context)
        wrong = self.scenario.perturbations
        X_WP = self.scenario.initial_pose.transform()
        block.set_at_equilibrium(own, X_WP, wrong.slack, wrong.slack_at_rest)
        self.take_lengths(context, block.GetOutputPort("unstrained_lengths").Eval(own))
        if self.world is not None:
            self.world.start(context, block.in_plant)
        return context


def build_visual_servo(scenario: Scenario) -> VisualServo:
    """Builds the diagram of a scenario.

    Raises:
        RobotFileError: The robot's file is not accepted.
        RenderingError: The camera is rendered and EGL is missing.
        ScenarioError: A sensor reads more often than the simulation steps, or the scenario is not
            one of a visual servo.
    """
    if not isinstance(scenario, Scenario):
        raise ScenarioError(
            f"{scenario.name}: kind: found {scenario.kind}; accepted: {VISUAL_SERVO}; "
            "cdpr_drake.simulate runs all kinds"
        )
    for key, section in sections_of(scenario):
        if section.needs_plant(scenario) and scenario.integration.engine == COMPILED:
            raise ScenarioError(f"integration.engine: found compiled beside {key}; accepted: plant")
    robot = load_robot(scenario.robot)
    builder = DiagramBuilder()
    world = None if scenario.world is None else WorldInScene(scenario.world, robot)
    block = _make_robot(robot, scenario, world)
    builder.AddNamedSystem("robot", block)
    blocks = add_visual_servo(builder, block, scenario)
    watches = add_servo_watches(builder, scenario, blocks, world)
    log = add_servo_log(builder, scenario, blocks, watches.meters)
    for event in () if scenario.failures is None else scenario.failures.of_sensors():
        assert event.sensor is not None
        late = event.delay if event.kind == LATE else None
        blocks.readings.fail(event.sensor, event.begins, event.cable, late)
    rates = {
        f"{key}.rate": rate
        for key, section in sections_of(scenario)
        if (rate := section.sampling_rate()) is not None
    }
    max_step = integration_step(scenario, blocks)
    if scenario.integration.max_step is None:
        periods = [blocks.readings.shortest_period(), *(1.0 / rate for rate in rates.values())]
        max_step = min(max_step, *periods)
    blocks.readings.check_step(max_step)
    for key, rate in rates.items():
        check_rate(key, rate, max_step)
    if isinstance(block, CompiledCableRobot):
        integration = scenario.integration
        block.integrate_by(
            StepRule(
                method=integration.integrator, max_step=max_step, accuracy=integration.accuracy
            )
        )
    for system, names in (
        (block, ("platform_state", "X_WP", *LOGGED_OF_CABLES)),
        (blocks.sight, (blocks.target.mark, "X_CO", "found")),
        (blocks.servo, ("cable_velocities", "platform_velocity", "error", "gain")),
        (watches.monitor, ("outcome",)),
    ):
        for name in names:
            builder.ExportOutput(system.GetOutputPort(name), name)
    builder.ExportOutput(blocks.estimator.GetOutputPort("X_WP"), "X_WP_estimated")
    diagram = builder.Build()
    diagram.set_name(scenario.name)
    return VisualServo(
        **{field.name: getattr(blocks, field.name) for field in fields(blocks)},
        scenario=scenario,
        diagram=diagram,
        monitor=watches.monitor,
        watch=watches.breaking,
        tension_range=watches.tensions,
        world=world,
        meters=watches.meters,
        log=log,
        max_step=max_step,
    )


def _make_robot(
    robot: Robot, scenario: Scenario, world: WorldInScene | None
) -> CableRobot | CompiledCableRobot:
    """The robot's block by the engine that is asked for."""
    add_to_scene = scene_adder(scenario, world)
    floor = world is None or world.world.ground is None
    if scenario.integration.engine != COMPILED:
        return CableRobot(robot, scenario, add_to_scene=add_to_scene, floor=floor)
    watched = robot.knows_breaking_loads() or scenario.stop.contact
    return CompiledCableRobot(
        robot,
        scenario,
        add_to_scene=add_to_scene,
        floor=floor,
        command_period=WATCH_PERIOD if watched else HELD,
    )


def integration_step(scenario: Scenario, model: ServoModel) -> float:
    """The scenario's step, or one that is stable at both ends of the path [s].

    The stiffness changes with the pose: the shorter step counts, and none passes over a step of
    tension management. Readings may ask for shorter ones.
    """
    integration = scenario.integration
    if integration.max_step is not None:
        return integration.max_step
    steps = [_cable_step(scenario, model)]
    world = scenario.world
    if world is not None and world.contact is not None:
        law = contact_law(world.contact, model.robot)
        of_contact = contact_step(model.robot, law, world.friction(), integration.integrator)
        # Squares of frequencies add where cables and ground hold the platform together.
        steps = [1.0 / float(np.hypot(1.0 / steps[0], 1.0 / (STEP_SHARE * of_contact)))]
    if scenario.tension_management is not None and scenario.tension_management.rate is not None:
        steps.append(1.0 / scenario.tension_management.rate)
    if scenario.winches.mode == "torque":
        steps.append(1.0 / (scenario.torque_control or TorqueControl()).rate)
    return min(steps)


def _cable_step(scenario: Scenario, model: ServoModel) -> float:
    """A step [s] that follows the vibrations on the cables at both ends of the path."""
    integration = scenario.integration
    ends = (scenario.initial_pose.transform(), model.desired_platform_pose())
    steps = [automatic_step(model.robot, X, integration.integrator, scenario) for X in ends]
    return min(steps)

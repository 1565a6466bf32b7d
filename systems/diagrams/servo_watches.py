"""What watches a servo in a diagram: what ends its run, measures it, judges it, and logs it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from pydrake.systems.framework import DiagramBuilder

from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.systems.cameras.camera_settings import RENDERED
from cdpr_drake.systems.diagrams.fusion_readings import fusion_ports
from cdpr_drake.systems.diagrams.servo_blocks import VisualServoBlocks, seen_ports
from cdpr_drake.systems.diagrams.servo_models import ServoModel
from cdpr_drake.systems.diagrams.torque_control import tension_limits
from cdpr_drake.systems.monitoring.log_row import RunLog, add_log
from cdpr_drake.systems.monitoring.run_monitor import RunMonitor, StopRules
from cdpr_drake.systems.monitoring.servo_criterion import ServoCriterion
from cdpr_drake.systems.monitoring.tension_watch import BreakingLoadWatch, TensionRange
from cdpr_drake.systems.robots.failures import FAULTS
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.systems.sensors.sensor_kinds import SENSORS
from cdpr_drake.systems.worlds.adding import (
    CONTACT_RESULTS,
    WorldInScene,
    WorldMeters,
    add_world_meters,
)

LOGGED_OF_CABLES = ("tensions", "lengths", "unstrained_lengths", "slack", "surplus_lengths")
"""Outputs of the robot with a number for each cable that are logged, and exported."""


@dataclass(frozen=True)
class ServoWatches:
    """What looks at a servo at every step.

    Attributes:
        monitor: The block that ends the run.
        meters: What measures the robot in its world; None without a world.
        breaking: Watches for broken cables; None where no breaking load is known.
        tensions: Watches how far tensions go, where torques are commanded; else None.
    """

    monitor: RunMonitor
    meters: WorldMeters | None
    breaking: BreakingLoadWatch | None
    tensions: TensionRange | None


def add_servo_watches(
    builder: DiagramBuilder,
    scenario: Scenario,
    blocks: VisualServoBlocks,
    world: WorldInScene | None,
) -> ServoWatches:
    """Adds what looks at a scenario's servo, in somebody's builder."""
    monitor = _add_monitor(builder, scenario, blocks)
    meters = None if world is None else _add_meters(builder, scenario, blocks, world)
    breaking = _add_breaking_watch(builder, scenario, blocks)
    return ServoWatches(monitor, meters, breaking, _add_tension_range(builder, scenario, blocks))


def make_monitor(scenario: Scenario, model: ServoModel) -> RunMonitor:
    """What ends the run."""
    stop, plan, (lower, upper) = scenario.stop, model.plan, model.robot.frame.bounds()
    rules = StopRules(
        stop.position,
        float(np.radians(stop.rotation_deg)),
        stop.hold,
        stop.target_lost,
        lower - [0.0, 0.0, 0.0 if scenario.world is None else scenario.world.room_below()],
        upper,
    )
    return RunMonitor(
        rules,
        model.X_CdO,
        scenario.controller.rate,
        model.free_rotation,
        model.begins,
        np.inf if plan is None else plan.end_time + stop.hold,
    )


def _add_monitor(
    builder: DiagramBuilder, scenario: Scenario, blocks: VisualServoBlocks
) -> RunMonitor:
    """Adds what ends the run."""
    monitor = make_monitor(scenario, blocks)
    builder.AddNamedSystem("monitor", monitor)
    sight = seen_ports(scenario, blocks.sight, blocks.estimator, blocks.target.mark)
    for name in ("X_CO", "found"):
        builder.Connect(sight[name], monitor.GetInputPort(name))
    builder.Connect(blocks.block.GetOutputPort("X_WP"), monitor.GetInputPort("X_WP"))
    return monitor


def _add_meters(
    builder: DiagramBuilder,
    scenario: Scenario,
    blocks: VisualServoBlocks,
    world: WorldInScene,
) -> WorldMeters:
    """Adds what measures the robot in its world."""
    block = blocks.block
    touches = block.HasOutputPort(CONTACT_RESULTS)
    return add_world_meters(
        builder, world.world, block.in_plant, block.forces.cable_set(),
        X_WP=block.GetOutputPort("X_WP"),
        contact_results=block.GetOutputPort(CONTACT_RESULTS) if touches else None,
        stop=scenario.stop.contact,
    )  # fmt: skip


def _add_breaking_watch(
    builder: DiagramBuilder, scenario: Scenario, blocks: VisualServoBlocks
) -> BreakingLoadWatch | None:
    """Adds what watches for broken cables, where a breaking load is known."""
    block = blocks.block
    if not blocks.robot.knows_breaking_loads():
        return None
    loads = block.forces.cable_set().breaking_load
    watch = builder.AddNamedSystem("watch", BreakingLoadWatch(loads, scenario.stop.broken_cable))
    builder.Connect(block.GetOutputPort("tensions"), watch.GetInputPort("tensions"))
    return watch


def _add_tension_range(
    builder: DiagramBuilder, scenario: Scenario, blocks: VisualServoBlocks
) -> TensionRange | None:
    """Adds what watches tensions at every step, where torques are commanded."""
    if blocks.torque is None:
        return None
    lower, _ = tension_limits(scenario, blocks.robot)
    count = len(blocks.robot.cables)
    watch = builder.AddNamedSystem("tension_range", TensionRange(count, lower))
    builder.Connect(blocks.block.GetOutputPort("tensions"), watch.GetInputPort("tensions"))
    return watch


def criterion_of(blocks: VisualServoBlocks, pulleys: bool) -> ServoCriterion:
    """The stability criterion of a servo.

    Args:
        blocks: The servo.
        pulleys: Whether its controller reckons with pulleys.
    """
    return servo_criterion(blocks, blocks.block.forces.cable_set(), pulleys)


def servo_criterion(model: ServoModel, cables: CableSet, pulleys: bool) -> ServoCriterion:
    """The same of a servo without blocks, with its cables as they are simulated."""
    believed = model.believed
    if not pulleys:
        believed = replace(believed, cables=believed.cables.without_pulleys())
    return ServoCriterion(
        cables=cables,
        believed=believed,
        camera=model.mounting.X_BC,
        features=model.controller.tasks[-1].features,
        target=model.target,
        sees=model.X_CO,
        judges_law=model.controller.law.uses_all_features(),
    )


def add_servo_log(
    builder: DiagramBuilder,
    scenario: Scenario,
    blocks: VisualServoBlocks,
    meters: WorldMeters | None,
) -> RunLog:
    """Logs what the summary, the figures and the replay need."""
    block, servo, sight = blocks.block, blocks.servo, blocks.sight
    mark = blocks.target.mark
    ports = {
        "X_WP": block.GetOutputPort("X_WP"),
        "X_WP_estimated": blocks.estimator.GetOutputPort("X_WP"),
        "X_CO_measured": sight.GetOutputPort("X_CO"),
        "found": sight.GetOutputPort("found"),
        f"{mark}_px": sight.GetOutputPort(mark),
    }
    if blocks.target.quality and scenario.camera.kind == RENDERED:
        ports["quality"] = blocks.measurement.GetOutputPort("quality")
    for name in servo.logged():
        ports[name] = servo.GetOutputPort(name)
    for name in LOGGED_OF_CABLES:
        ports[name] = block.GetOutputPort(name)
    if scenario.failures is not None:
        ports |= {name: block.GetOutputPort(name) for name in FAULTS if block.HasOutputPort(name)}
    if blocks.plan is not None:
        ports["X_WP_planned"] = servo.GetOutputPort("X_WP_planned")
    for name, other in zip(scenario.estimator.compare, blocks.compared, strict=True):
        ports[f"X_WP_{name}"] = other.GetOutputPort("X_WP")
    for sensor in scenario.sensors.log:
        reading = SENSORS[sensor].reading
        ports[reading] = blocks.readings.port(reading)
    if blocks.corrector is not None:
        for name in ("tension_corrections", "tension_thresholds"):
            ports[name] = blocks.corrector.GetOutputPort(name)
    if meters is not None:
        ports |= meters.logged()
    if blocks.torque is not None:
        for name in ("wanted_tensions", "motor_torques", "desired_wrench", "relaxed"):
            ports[name] = blocks.torque.GetOutputPort(name)
    for name in ("applied_torques", "friction_torques"):
        if block.HasOutputPort(name):  # motors on the winches
            ports[name] = block.GetOutputPort(name)
    ports |= fusion_ports((blocks.estimator, *blocks.compared))
    ports |= blocks.logged
    return add_log(builder, ports, scenario.log_rate)

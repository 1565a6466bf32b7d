"""Puts what a robot does when something fails into a diagram, and checks section `emergency`."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.framework import DiagramBuilder, OutputPort

from cdpr_drake.arrays import Array
from cdpr_drake.errors import SensorError
from cdpr_drake.estimation.break_detection import silent_reading
from cdpr_drake.estimation.failure_detection import AlarmRule
from cdpr_drake.estimation.failure_watch import EncoderWatch, MotorWatch, repeats_in_a_row
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.sensor_catalogue import TensionSensorModel, load_tension_sensor
from cdpr_drake.schema.declarations import Refusal, Scope, told
from cdpr_drake.statics.nearest_held_pose import Load, nearest_held_pose
from cdpr_drake.systems.controllers.emergency import (
    ACCEPTED,
    BRAKE,
    CONTINUE,
    DESCEND,
    FOUND,
    HOLD,
    HOURS,
    REDISTRIBUTE,
    RETREAT,
    STOP,
    EmergencyReaction,
    EmergencySettings,
    WatchSettings,
    WaysOut,
)
from cdpr_drake.systems.controllers.torque_settings import TorqueControl
from cdpr_drake.systems.diagrams.servo_blocks import VisualServoBlocks
from cdpr_drake.systems.diagrams.torque_control import TORQUE, wanted_limits
from cdpr_drake.systems.monitoring.break_detector import BreakDetector
from cdpr_drake.systems.monitoring.failure_monitor import (
    FOUND as FOUND_OF_WINCHES,
)
from cdpr_drake.systems.monitoring.failure_monitor import (
    OF_CAMERA,
    FailureMonitor,
    WatchRules,
)
from cdpr_drake.systems.robots.failures import BROKEN, JAMMED

if TYPE_CHECKING:
    from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario


def emergency_refusals(scope: Scope) -> Iterator[Refusal]:
    """Reactions that the scenario's winches cannot do."""
    scenario, robot, settings = scope.whole, scope.robot, scope.whole.emergency
    if settings is None:
        return
    mode, reaction = scenario.winches.mode, settings.reaction
    if scenario.failures is None:
        accepted = "null, or with a section failures, which may be {}"
        yield "emergency", "a section without failures", accepted
    if robot.winch_groups().are_shared():
        found = f"a section with {robot.name}, which has several cables on one winch"
        yield "emergency", found, "null"
        return
    if reaction != REDISTRIBUTE and settings.motion == CONTINUE:
        yield "emergency.motion", f"{CONTINUE} with reaction {reaction}", HOLD
    if settings.watch is not None and mode != TORQUE:
        found = f"a section with winches.mode {mode}"
        yield "emergency.watch", found, f"null, or winches.mode {TORQUE}"
    elif settings.watch is not None:
        try:
            watch_rules(scenario, settings, settings.watch, robot)
        except SensorError as problem:
            yield told(problem, "emergency.watch")
    if reaction != STOP and mode != TORQUE:
        found = f"{reaction} with winches.mode {mode}"
        yield "emergency.reaction", found, f"{STOP}, or winches.mode {TORQUE}"
    if reaction in (RETREAT, DESCEND) and not robot.motion_type().is_free:
        found = f"{reaction} with {robot.name}, whose platform does not move freely"
        yield "emergency.reaction", found, f"{STOP}, {REDISTRIBUTE}, {BRAKE}"
    most = wanted_limits(scenario.torque_control or TorqueControl(), robot)[1]
    if reaction == RETREAT and settings.least_tension >= most:
        accepted = f"below {most:g} [N], the largest wanted tension"
        yield "emergency.least_tension", f"{settings.least_tension:g}", accepted


def watch_rules(
    scenario: Scenario, settings: EmergencySettings, watch: WatchSettings, robot: Robot
) -> WatchRules:
    """When something other than a broken cable is an alarm.

    Raises:
        SensorError: A bandwidth does not fit the rate, or the tension sensors have no noise by
            which a frozen one is told.
    """
    law, period = robot.winch_law(), 1.0 / settings.rate
    count = len(robot.cables)
    motor = MotorWatch(
        law.drum.radii(count), law.friction, law.inertia, 2.0 * np.pi * watch.bandwidth, period
    )
    sensor = load_tension_sensor(scenario.sensors.tension)
    rate = scenario.sensors.rate("tension") or settings.rate
    readings = 3600.0 * HOURS * rate * count
    repeats = repeats_in_a_row(
        sensor.repeatability, sensor.resolution, readings=readings, accepted=ACCEPTED
    )
    # A look that comes more often than readings finds each of them several times.
    repeats = int(np.ceil((repeats + SPARE_REPEATS) * max(settings.rate / rate, 1.0)))
    return WatchRules(
        motor=motor,
        torque=AlarmRule(_torque_limit(settings, watch, motor, sensor), watch.in_a_row),
        repeats=repeats,
        encoder=EncoderWatch(period, watch.leak),
        lag=AlarmRule(watch.lag, watch.in_a_row),
        dark=watch.dark,
        late=watch.late,
    )


def _torque_limit(
    settings: EmergencySettings, watch: WatchSettings, motor: MotorWatch, sensor: TensionSensorModel
) -> float:
    """Torque that nothing explains from which on it is an alarm [N m]."""
    if watch.torque is not None:
        return watch.torque
    return motor.limit(
        sensor.accuracy, sensor.repeatability, samples=settings.samples(),
        in_a_row=watch.in_a_row, false_alarms=ACCEPTED,
    )  # fmt: skip


def silent_readings(scenario: Scenario, settings: EmergencySettings, robot: Robot) -> Array:
    """What tension sensors read at most of cables that pull nothing, shape (m,) [N]."""
    count = len(robot.cables)
    if settings.slack_below is not None:
        return np.full(count, settings.slack_below)
    most = 0.0
    if scenario.sensors.rate("tension") is not None:
        sensor = load_tension_sensor(scenario.sensors.tension)
        most = sensor.resolution + silent_reading(
            sensor.accuracy, sensor.repeatability, samples=settings.samples(), cables=count,
            false_alarms=ACCEPTED,
        )  # fmt: skip
    return most + (np.zeros(count) if robot.slack_readings is None else robot.slack_readings)


SPARE_REPEATS = 2
"""Equal readings beyond those that say that a sensor is frozen: looks and readings have clocks of
their own, so that one may be found twice."""


def add_emergency(
    builder: DiagramBuilder, scenario: Scenario, blocks: VisualServoBlocks
) -> dict[str, OutputPort]:
    """Adds a scenario's reaction to a servo; returns what it logs.

    Subsystems: break_detector (where breaks are found), emergency, failure_monitor (if watched).
    """
    settings = scenario.emergency
    if settings is None:
        return {}
    block, count = blocks.block, len(blocks.robot.cables)
    known = block.GetOutputPort(BROKEN)
    logged = {}
    if settings.known == FOUND:
        believed = blocks.believed.cables
        if not scenario.controller.pulleys:
            believed = believed.without_pulleys()
        detector = builder.AddNamedSystem(
            "break_detector",
            BreakDetector(
                believed,
                settings.rule(count),
                settings.rate,
                silent_readings(scenario, settings, blocks.robot),
            ),
        )
        for name, source in (
            ("X_WP", blocks.estimator.GetOutputPort("X_WP")),
            ("tensions", blocks.readings.port("measured_tensions")),
            ("lengths", blocks.readings.port("measured_lengths")),
        ):
            builder.Connect(source, detector.GetInputPort(name))
        known = detector.GetOutputPort("found_broken")
        logged = {"found_broken": known, "break_residuals": detector.GetOutputPort("residuals")}
    ways = _ways_out(scenario, settings, blocks)
    reaction = builder.AddNamedSystem("emergency", EmergencyReaction(settings, count, ways))
    builder.Connect(known, reaction.GetInputPort("found_broken"))
    builder.Connect(reaction.GetOutputPort("jammed"), block.GetInputPort(JAMMED))
    left_out = reaction.GetOutputPort("left_out")
    if settings.reaction != STOP:
        assert blocks.torque is not None
        builder.Connect(left_out, blocks.torque.GetInputPort("left_out"))
        builder.Connect(reaction.GetOutputPort("halted"), blocks.torque.GetInputPort("halted"))
    if settings.reaction == BRAKE:
        assert blocks.torque is not None
        builder.Connect(reaction.GetOutputPort("braking"), blocks.torque.GetInputPort("braking"))
    if ways is not None:
        assert blocks.torque is not None
        builder.Connect(blocks.estimator.GetOutputPort("X_WP"), reaction.GetInputPort("X_WP"))
        builder.Connect(
            reaction.GetOutputPort("halted_twist"), blocks.torque.GetInputPort("halted_twist")
        )
    if settings.reaction == RETREAT:
        logged["X_WP_retreat"] = reaction.GetOutputPort("goal")
    return logged | {"left_out": left_out} | _add_watch(builder, scenario, settings, blocks)


def _ways_out(
    scenario: Scenario, settings: EmergencySettings, blocks: VisualServoBlocks
) -> WaysOut | None:
    """What a reaction that moves the platform knows of it; None for others."""
    if settings.reaction not in (RETREAT, DESCEND):
        return None
    most = wanted_limits(scenario.torque_control or TorqueControl(), blocks.robot)[1]
    return ways_out(settings, blocks.robot, blocks.believed.cables, most)


def ways_out(settings: EmergencySettings, robot: Robot, believed: CableSet, most: float) -> WaysOut:
    """What a reaction that moves the platform knows of a robot.

    Args:
        settings: The reaction.
        robot: The robot.
        believed: Its cables as believed.
        most: Largest tension that is asked for [N].
    """
    cables = believed.without_pulleys()
    load = Load(robot.platform.mass, robot.center_of_mass(), robot.gravity_vector())
    anchors = cables.p_PB
    size = float(np.sqrt(np.mean(np.sum(anchors**2, axis=0))))
    home = robot.home.transform()

    def held(X_WP: RigidTransform, broken: Array) -> RigidTransform:
        left = broken == 0.0
        bounds = np.array([settings.least_tension * left, most * left])
        found = nearest_held_pose(X_WP, cables, load, bounds, size=size, starts=[home])
        return X_WP if found is None else found.X_WP

    return WaysOut(held, anchors, float(robot.frame.lower[2]))


def _add_watch(
    builder: DiagramBuilder,
    scenario: Scenario,
    settings: EmergencySettings,
    blocks: VisualServoBlocks,
) -> dict[str, OutputPort]:
    """Adds what watches for other failures, if asked for; returns what it logs."""
    if settings.watch is None:
        return {}
    assert blocks.torque is not None
    rules = watch_rules(scenario, settings, settings.watch, blocks.robot)
    monitor = builder.AddNamedSystem("failure_monitor", FailureMonitor(rules))
    for name, source in (
        ("torques", blocks.torque.GetOutputPort("motor_torques")),
        ("tensions", blocks.readings.port("measured_tensions")),
        ("lengths", blocks.readings.port("measured_lengths")),
        ("length_rates", blocks.block.GetOutputPort("unstrained_length_rates")),
        ("found", blocks.sight.GetOutputPort("found")),
        ("X_CO", blocks.sight.GetOutputPort("X_CO")),
    ):
        builder.Connect(source, monitor.GetInputPort(name))
    logged = (*FOUND_OF_WINCHES, *OF_CAMERA, "torque_residual", "length_lag")
    return {name: monitor.GetOutputPort(name) for name in logged}

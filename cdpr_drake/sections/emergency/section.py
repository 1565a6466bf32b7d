"""Section `emergency` of a scenario: its settings, and its blocks beside a servo."""

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar

import numpy as np
from pydrake.systems.framework import DiagramBuilder, OutputPort

from cdpr_drake.arrays import Array
from cdpr_drake.errors import SensorError
from cdpr_drake.estimation.break_detection import BreakRule, residual_noise, silent_reading
from cdpr_drake.estimation.failure_detection import AlarmRule
from cdpr_drake.estimation.failure_watch import EncoderWatch, MotorWatch, repeats_in_a_row
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.sensor_catalogue import TensionSensorModel, load_tension_sensor
from cdpr_drake.schema.declarations import FASTEST, In, OneOf, Refusal, Scope, settings, told
from cdpr_drake.sections.emergency.break_detector import BreakDetector
from cdpr_drake.sections.emergency.failure_monitor import (
    FOUND as FOUND_OF_WINCHES,
)
from cdpr_drake.sections.emergency.failure_monitor import (
    OF_CAMERA,
    FailureMonitor,
    WatchRules,
)
from cdpr_drake.sections.emergency.reaction import EmergencyReaction
from cdpr_drake.systems.controllers.break_reactions import (
    BRAKE,
    CONTINUE,
    DESCEND,
    HOLD,
    REACTIONS,
    REDISTRIBUTE,
    RETREAT,
    STOP,
    ReactionRule,
    ways_out,
)
from cdpr_drake.systems.controllers.torque_settings import TORQUE, TorqueControl
from cdpr_drake.systems.robots.failures import BROKEN, JAMMED
from cdpr_drake.systems.sections import Section

TOLD, FOUND = "told", "found"

ACCEPTED = 1e-3
"""False alarms that a threshold accepts in `HOURS` hours of runs."""

HOURS = 1.0

SPARE_REPEATS = 2
"""Equal readings beyond those that say that a sensor is frozen: looks and readings have clocks of
their own, so that one may be found twice."""


@settings
class WatchSettings:
    """When other failures than broken cables are told; nothing is done about them.

    A reading of an encoder is up to a period old: by default `lag` covers 0.5 m/s at 512 Hz.
    """

    torque: Annotated[
        float | None,
        In("N m", gt=0.0),
        "Torque of a motor that asked torque, tension, inertia and friction do not "
        "explain; null: static friction, the tension sensor's constant error, and noise.",
    ] = None
    bandwidth: Annotated[
        float,
        In("Hz", gt=0.0),
        "At which this torque is smoothed; below a sixth of `emergency.rate`.",
    ] = 10.0
    lag: Annotated[
        float, In("m", gt=0.0), "By how much a measured length may lag behind the drive's speed."
    ] = 0.001
    leak: Annotated[float, In("s", gt=0.0), "Time in which such differences are forgotten."] = 1.0
    in_a_row: Annotated[int, In(ge=1), "Samples in a row of torque and lag that make an alarm."] = 5
    dark: Annotated[float, In("s", gt=0.0), "Without a sight of the target."] = 0.12
    late: Annotated[float, In("s", gt=0.0), "With the very same sight of it."] = 0.12


@settings
class EmergencySettings(Section):
    """What is done when a cable has broken, and how that is known.

    All reactions but stop need `winches.mode` torque. A break is told, as by a switch on the drum,
    or found by a `BreakDetector`.
    """

    words = "What is done when a cable has broken, beside section failures"
    columns: ClassVar = {"found_broken": "flag", "left_out": "flag", "break_residuals": "m"}

    reaction: Annotated[str, OneOf(REACTIONS), "What is done."]
    motion: Annotated[
        str,
        OneOf((HOLD, CONTINUE)),
        "What redistribution is to do with the platform: hold it where it is, or continue.",
    ] = HOLD
    speed: Annotated[
        float,
        In("m/s", gt=0.0),
        "Largest speed of a retreat, of which turning counts with the anchor points' "
        "distance, and that of a descent.",
    ] = ReactionRule.speed
    least_tension: Annotated[
        float, In("N", ge=0.0), "Smallest tension of the cables left at the pose of a retreat."
    ] = ReactionRule.least_tension
    ground_distance: Annotated[
        float,
        In("m", ge=0.0),
        "Height of the lowest anchor point over the frame's lower end at which a descent ends.",
    ] = ReactionRule.ground_distance
    known: Annotated[
        str,
        OneOf((TOLD, FOUND)),
        "How it is known: told when it happens, or found from lengths and tensions.",
    ] = TOLD
    delay: Annotated[
        float,
        In("s", ge=0.0),
        "From when it is known until the brakes have closed, or the others are asked.",
    ] = ReactionRule.delay
    rate: Annotated[float, In("Hz", gt=0.0, le=FASTEST), "How often it is looked at."] = (
        ReactionRule.rate
    )
    pose_noise: Annotated[
        float,
        In("m", ge=0.0),
        "Standard deviation of the lengths that follow from the believed pose and the sensors.",
    ] = 0.0002
    pose_accuracy: Annotated[
        float,
        In("m", ge=0.0),
        "By how much the error of the believed pose, at an anchor point, may change while"
        " a cable does not pull.",
    ] = 0.003
    exit_accuracy: Annotated[
        float, In("m", ge=0.0), "Bound of the errors of believed exit points."
    ] = 0.003
    anchor_accuracy: Annotated[
        float, In("m", ge=0.0), "Bound of the errors of believed anchor points."
    ] = 0.001
    slack_below: Annotated[
        float | None,
        In("N", ge=0.0),
        "Measured tension up to which a cable may be broken: what its sensor may read "
        "without one; null: by the sensor's accuracy and noise.",
    ] = None
    in_a_row: Annotated[int, In(ge=1), "Samples in a row that make an alarm."] = 3
    watch: Annotated[
        WatchSettings | None,
        "Watches winches, sensors and camera, too, and logs alarms; null: broken cables "
        "alone. With winches.mode torque.",
    ] = None

    def samples(self) -> float:
        """Looks in `HOURS`."""
        return 3600.0 * HOURS * self.rate

    def break_rule(self, cables: int) -> BreakRule:
        """When it is found, with so many cables: `ACCEPTED` false alarms in `HOURS`."""
        noise = residual_noise(
            self.pose_noise, samples=self.samples(), cables=cables, false_alarms=ACCEPTED
        )
        points = self.exit_accuracy + self.anchor_accuracy
        return BreakRule(noise, points, self.pose_accuracy, self.in_a_row)

    def reaction_rule(self) -> ReactionRule:
        """What is done."""
        return ReactionRule(
            self.reaction, self.motion, self.speed, self.least_tension, self.ground_distance,
            self.delay, self.rate,
        )  # fmt: skip

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """Reactions that the scenario's winches cannot do."""
        scenario, robot = scope.whole, scope.robot
        mode, reaction = scenario.winches.mode, self.reaction
        if scenario.failures is None:
            accepted = "null, or with a section failures, which may be {}"
            yield "", "a section without failures", accepted
        if robot.winch_groups().are_shared():
            found = f"a section with {robot.name}, which has several cables on one winch"
            yield "", found, "null"
            return
        if reaction != REDISTRIBUTE and self.motion == CONTINUE:
            yield "motion", f"{CONTINUE} with reaction {reaction}", HOLD
        if self.watch is not None and mode != TORQUE:
            found = f"a section with winches.mode {mode}"
            yield "watch", found, f"null, or winches.mode {TORQUE}"
        elif self.watch is not None:
            try:
                watch_rules(scenario, self, self.watch, robot)
            except SensorError as problem:
                yield told(problem, "watch")
        if reaction != STOP and mode != TORQUE:
            found = f"{reaction} with winches.mode {mode}"
            yield "reaction", found, f"{STOP}, or winches.mode {TORQUE}"
        if reaction in (RETREAT, DESCEND) and not robot.motion_type().is_free:
            found = f"{reaction} with {robot.name}, whose platform does not move freely"
            yield "reaction", found, f"{STOP}, {REDISTRIBUTE}, {BRAKE}"
        most = (scenario.torque_control or TorqueControl()).wanted_limits(robot)[1]
        if reaction == RETREAT and self.least_tension >= most:
            accepted = f"below {most:g} [N], the largest wanted tension"
            yield "least_tension", f"{self.least_tension:g}", accepted

    def add_to(
        self, builder: DiagramBuilder, blocks: Any, settings: Any
    ) -> Mapping[str, OutputPort]:
        """Adds its blocks: break_detector (where breaks are found), emergency, failure_monitor (if
        it watches)."""
        block, count = blocks.block, len(blocks.robot.cables)
        known = block.GetOutputPort(BROKEN)
        logged = {}
        if self.known == FOUND:
            believed = blocks.believed.cables
            if not settings.controller.pulleys:
                believed = believed.without_pulleys()
            detector = builder.AddNamedSystem(
                blocks.prefix + "break_detector",
                BreakDetector(
                    believed,
                    self.break_rule(count),
                    self.rate,
                    silent_readings(settings, self, blocks.robot),
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
        rule, ways, torque = self.reaction_rule(), None, blocks.torque
        if self.reaction in (RETREAT, DESCEND):
            most = (settings.torque_control or TorqueControl()).wanted_limits(blocks.robot)[1]
            ways = ways_out(rule, blocks.robot, blocks.believed.cables, most)
        reaction = builder.AddNamedSystem(
            blocks.prefix + "emergency", EmergencyReaction(rule, count, ways)
        )
        builder.Connect(known, reaction.GetInputPort("found_broken"))
        builder.Connect(reaction.GetOutputPort("jammed"), block.GetInputPort(JAMMED))
        left_out = reaction.GetOutputPort("left_out")
        commands = () if self.reaction == STOP else ("left_out", "halted")
        if self.reaction == BRAKE:
            commands = (*commands, "braking")
        if ways is not None:
            commands = (*commands, "halted_twist")
            builder.Connect(blocks.estimator.GetOutputPort("X_WP"), reaction.GetInputPort("X_WP"))
        for name in commands:
            builder.Connect(reaction.GetOutputPort(name), torque.GetInputPort(name))
        if self.reaction == RETREAT:
            logged["X_WP_retreat"] = reaction.GetOutputPort("goal")
        return logged | {"left_out": left_out} | self._add_watch(builder, blocks, settings)

    def _add_watch(
        self, builder: DiagramBuilder, blocks: Any, settings: Any
    ) -> dict[str, OutputPort]:
        """Adds what watches for other failures, if asked for."""
        if self.watch is None:
            return {}
        rules = watch_rules(settings, self, self.watch, blocks.robot)
        monitor = builder.AddNamedSystem(blocks.prefix + "failure_monitor", FailureMonitor(rules))
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


def watch_rules(
    scenario: Any, settings: EmergencySettings, watch: WatchSettings, robot: Robot
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


def silent_readings(scenario: Any, settings: EmergencySettings, robot: Robot) -> Array:
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

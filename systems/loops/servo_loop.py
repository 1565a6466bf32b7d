"""A visual servo, from camera to winches, stepped without a diagram."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.diagrams.beliefs import winch_offsets
from cdpr_drake.systems.diagrams.camera import projected_camera
from cdpr_drake.systems.diagrams.estimators import known_tag_camera
from cdpr_drake.systems.diagrams.servo_models import LoopServo, servo_model
from cdpr_drake.systems.diagrams.servo_watches import LOGGED_OF_CABLES
from cdpr_drake.systems.diagrams.tension_management import make_corrector
from cdpr_drake.systems.loops.basis import loop_basis
from cdpr_drake.systems.loops.loop_log import LoopLog, RowOf
from cdpr_drake.systems.loops.loop_state import (
    Clock,
    Part,
    arrays_of,
    attribute,
    entry,
    first_time,
    restore_arrays,
)
from cdpr_drake.systems.loops.parts import (
    DelayedCamera,
    Estimate,
    Read,
    Sampled,
    checked_estimator,
    checked_sensor,
)
from cdpr_drake.systems.loops.robot_motion import LENGTHS, SLACK, SURPLUS, TENSIONS, RobotMotion
from cdpr_drake.systems.monitoring.run_monitor import NOT_YET, Outcome
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.systems.sensors.sensor_kinds import SENSORS
from cdpr_drake.systems.sensors.sensor_readings import check_rate

_ROWS = {"tensions": TENSIONS, "lengths": LENGTHS, "slack": SLACK, "surplus_lengths": SURPLUS}


class ServoLoop:
    """A scenario's visual servo: what `build_visual_servo` and a Simulator do, in one loop.

    At each event, when the period of camera, controller, sensor or log is over, the order is that
    of Drake: the robot moves on under the commands that held; the log gets its row, and a run whose
    outcome is known ends; camera and sensors look; estimators, servo, monitor and tension corrector
    decide, all from what stood there before any of them did.

    Attributes:
        scenario: The scenario.
        model: What the servo is about.
        log: What the run stores, under the names of a diagram's log.
        max_step: Integration step [s].
        time: Time that has been reached [s].
        outcome: How the run ended; RUNNING till then.
    """

    def __init__(self, scenario: Scenario) -> None:
        """Before the start, with the platform at rest at the initial pose.

        Args:
            scenario: The scenario; `check_loop` tells whether a loop can do it.

        Raises:
            RobotFileError: The robot's file is not accepted.
            ScenarioError: A sensor reads more often than the simulation steps, or an estimator or a
                sensor is a block that only a diagram can step.
            InfeasibleTensionError: The initial pose cannot be held.
        """
        basis = loop_basis(scenario)
        robot = basis.robot
        self.scenario, self.model = scenario, servo_model(scenario, robot, basis.model)
        self.time = 0.0
        self._since, self._judged = NOT_YET, Outcome.RUNNING
        self.outcome = Outcome.RUNNING
        self._control, self._logging, self._image = (
            Clock(1.0 / rate)
            for rate in (scenario.controller.rate, scenario.log_rate, scenario.camera.rate)
        )
        self._sensors: list[tuple[Clock, Sampled]] = []
        self._rates: dict[str, float] = {}
        self._servo, self._monitor = basis.servo, basis.monitor
        if self.model is not basis.model:
            self._servo = self.model.make_servo(scenario)
        self._outputs = self._servo.nothing()
        self._memory = self.model.controller.fresh_memory()
        m = len(robot.cables)
        self._added, self._thresholds = np.zeros(m), np.full(m, np.nan)
        self._offsets, self._commanded = winch_offsets(scenario, m), np.zeros(m)
        self._corrector = None
        if scenario.tension_management is not None:
            self._corrector = make_corrector(
                scenario, scenario.tension_management, robot, self.model.believed,
                scenario.cables.cable_set(robot),
            )  # fmt: skip
            self._law_memory = self._corrector.no_memory()
            self._correction = Clock(self._corrector.period)
        self._connect(robot)
        self.max_step = basis.max_step
        if scenario.integration.max_step is None:
            self.max_step = min(
                self.max_step, *(1.0 / rate for rate in self._rates.values()), np.inf
            )
        for sensor, rate in self._rates.items():
            check_rate(f"sensors.{sensor}_rate", rate, self.max_step)
        integration = scenario.integration
        self._motion = RobotMotion(
            robot,
            scenario,
            StepRule(
                method=integration.integrator, max_step=self.max_step, accuracy=integration.accuracy
            ),
            basis.motion,
        )
        self._motion.begin(basis.resting)
        if self._offsets is not None:  # winches run off before anybody commands them
            self._motion.command(self._offsets)
        self._clocks = [self._control, self._logging, self._image]
        self._clocks += [clock for clock, _ in self._sensors]
        if self._corrector is not None:
            self._clocks.append(self._correction)
        self._parts: list[tuple[Clock, DelayedCamera | Sampled]] = [
            *((self._image, eye) for eye in self._eyes), *self._sensors,
        ]  # fmt: skip
        self._struck: list[Clock] = []
        resting = {"X_CO_measured", "found", f"{self.model.target.mark}_px", *self._servo.logged()}
        self.log = LoopLog(self._logged(), resting | {"tension_corrections", "tension_thresholds"})

    def _connect(self, robot: Robot) -> None:
        """Makes cameras, estimators and sensors, and says who reads what."""
        scenario, model = self.scenario, self.model
        ports: dict[str, Callable[[], Any]] = {
            "X_WP": lambda: self._motion.pose(),
            "X_WO": lambda: model.motion.at(self.time),
            "tensions": lambda: self._motion.cables()[TENSIONS],
            "unstrained_lengths": lambda: self._motion.unstrained_lengths(),
            "platform_velocity": lambda: self._outputs["platform_velocity"],
        }
        read: Read = lambda name: ports[name]()  # noqa: E731
        camera = projected_camera(
            scenario.camera, model.target, model.mounting, model.pinhole,
            seed=scenario.seed, image_bias=scenario.perturbations.image_bias,
        )  # fmt: skip
        eye = DelayedCamera(camera, read, {"found", "X_CO", model.target.mark})
        self._eyes = [eye]
        ports |= {"found": eye.found, "X_CO": eye.pose, model.target.mark: eye.marks}
        task = model.estimator_task(scenario)
        kinds = (scenario.estimator.kind, *scenario.estimator.compare)
        systems = [checked_estimator(kind, task) for kind in kinds]
        self._estimates = [Estimate(system, read, self._now) for system in systems]
        needed = {SENSORS[sensor].reading for sensor in scenario.sensors.log}
        needed = needed.union(*(estimate.inputs for estimate in self._estimates))
        if self._corrector is not None:
            needed |= {"measured_tensions", "measured_lengths"}
        if needed & {"X_CK", "known_tag_found"}:
            assert scenario.estimator.known_tag is not None  # the settings were checked
            X_WK = scenario.estimator.known_tag.pose.transform()
            seen: Read = lambda name: X_WK if name == "X_WO" else ports[name]()  # noqa: E731
            second = known_tag_camera(scenario, robot, model.pinhole)
            tag = DelayedCamera(second, seen, {"X_CK", "known_tag_found"})
            self._eyes.append(tag)
            ports |= {"X_CK": tag.pose, "known_tag_found": tag.found}
        for name, kind in SENSORS.items():
            if kind.reading not in needed:
                continue
            sensor = checked_sensor(name, scenario, robot)
            if sensor is None:
                ports[kind.reading] = ports[kind.truth]
                continue
            part = Sampled(sensor, ports[kind.truth], kind.reading)
            self._sensors.append((Clock(sensor.period), part))
            self._rates[name] = float(scenario.sensors.rate(name) or 1.0 / sensor.period)
            ports[kind.reading] = part.reading
        self._ports = ports
        estimated = {**ports, "X_WP": self._estimates[0].pose}
        if self._corrector is not None:
            estimated |= {
                "tensions": ports["measured_tensions"],
                "lengths": ports["measured_lengths"],
            }
        self._read: Read = read
        self._read_estimated: Read = lambda name: estimated[name]()

    def _now(self) -> float:
        return self.time

    def _logged(self) -> dict[str, Callable[[], Any] | RowOf]:
        """What gives the quantities of the log, in the order of a diagram's."""
        scenario, ports, model = self.scenario, self._ports, self.model

        def output(name: str) -> Callable[[], Array]:
            return lambda: self._outputs[name]

        def of_cables(name: str) -> Callable[[], Array] | RowOf:
            if name == "unstrained_lengths":
                return self._motion.unstrained_lengths
            return RowOf(self._motion.cables, _ROWS[name])

        logged: dict[str, Callable[[], Any] | RowOf] = {
            "X_WP": self._motion.pose_matrix,
            "X_WP_estimated": self._estimates[0].pose,
            "X_CO_measured": ports["X_CO"],
            "found": ports["found"],
            f"{model.target.mark}_px": ports[model.target.mark],
        }
        for name in self._servo.logged():
            logged[name] = output(name)
        logged |= {name: of_cables(name) for name in LOGGED_OF_CABLES}
        plan = model.plan
        if plan is not None:
            logged["X_WP_planned"] = lambda: plan.pose(self.time)
        for name, other in zip(scenario.estimator.compare, self._estimates[1:], strict=True):
            logged[f"X_WP_{name}"] = other.pose
        for sensor in scenario.sensors.log:
            reading = SENSORS[sensor].reading
            logged[reading] = ports[reading]
        if self._corrector is not None:
            logged["tension_corrections"] = lambda: self._added
            logged["tension_thresholds"] = lambda: self._thresholds
        if self._motion.has_motors:
            logged["applied_torques"] = lambda: self._motion.torques()[0]
            logged["friction_torques"] = lambda: self._motion.torques()[1]
        return logged

    def start(self) -> None:
        """Takes the first samples, and writes the log's first row; then `advance_to` goes on."""
        self._look([part for _, part in self._sensors])
        self._struck = [clock for clock in self._clocks if clock.strikes(0.0)]
        self.log.append(0.0)

    def advance_to(self, boundary: float) -> None:
        """Goes on to a time [s], or until the outcome is known.

        Raises:
            CableGeometryError: A cable cannot run.
            DivergedError: Numbers are not finite any more.
        """
        clocks, logging = self._clocks, self._logging
        while self.time < boundary:
            if self._struck and self._struck != [logging]:
                self._update()
            self.time = now = first_time(clocks, boundary)
            self._motion.advance(now)
            for estimate in self._estimates:
                estimate.forget()
            self._struck = struck = [c for c in clocks if c.next == now and c.strikes(now)]
            if logging in struck:
                self.log.append(now)
            if self._judged and self._control in struck:
                self.outcome = self._judged
                return

    def _update(self) -> None:
        """Lets look and decide whose time has come."""
        struck, now = self._struck, self.time
        self._look([part for clock, part in self._parts if clock in struck])
        corrected = None
        if self._corrector is not None and self._correction in struck:
            corrected = self._corrector.correct(self._read_estimated, self._law_memory)
        if self._control in struck:
            outputs, memory = self._servo.decide(self._read_estimated, self._memory, now)
            self._since, self._judged = self._monitor.judge(self._read, self._since, now)
            for estimate in self._estimates:
                estimate.step()
            self._outputs |= outputs
            self._memory = memory
        if corrected is not None:
            self._added, self._thresholds, _ = corrected
        velocities = self._outputs["cable_velocities"]
        if self._corrector is not None:
            velocities = np.add(velocities, self._added, out=self._commanded)
        if self._offsets is not None:
            velocities = np.add(velocities, self._offsets, out=self._commanded)
        self._motion.command(velocities)
        self.log.refresh()

    def _look(self, parts: Sequence[DelayedCamera | Sampled]) -> None:
        """Takes images and samples of now, each of what stood there before the others."""
        looks = [part.after(self.time) for part in parts]
        for part, after in zip(parts, looks, strict=True):
            part.take(after)
            for estimate in self._estimates:
                if not estimate.inputs.isdisjoint(part.outputs):
                    estimate.forget()

    def state_arrays(self) -> dict[str, Array]:
        """All that the rest of the run depends on but its scenario, by names; no log."""
        return arrays_of(self._kept())

    def restore_state(self, arrays: Mapping[str, Array]) -> None:
        """Stands where another loop of the same scenario did when it gave `state_arrays`.

        Raises:
            ValueError: The arrays are those of another loop.
        """
        restore_arrays(self._kept(), arrays)
        self._motion.forget()
        self.log.refresh()

    def _kept(self) -> list[Part]:
        def clocks() -> Array:
            return np.array([[clock.next, clock in self._struck] for clock in self._clocks])

        def take_clocks(values: Array) -> None:
            for clock, (later, _) in zip(self._clocks, values, strict=True):
                clock.next = float(later)
            struck = values[:, 1] != 0.0
            self._struck = [
                c for c, is_struck in zip(self._clocks, struck, strict=True) if is_struck
            ]

        def run() -> Array:
            return np.array([self.time, *self._since, float(self._judged)])

        def take_run(values: Array) -> None:
            self.time, reached, lost, judged = values.tolist()
            self._since, self._judged = (reached, lost), Outcome(int(judged))

        parts = [
            Part("run", run, take_run), Part("clocks", clocks, take_clocks), *self._motion.kept(),
            attribute("servo", self, "_memory"),
        ]  # fmt: skip
        parts += [entry(name, self._outputs) for name in self._outputs]
        parts += [Part(f"eye{k}", eye.frames, eye.take) for k, eye in enumerate(self._eyes)]
        parts += [
            Part(f"sensor{k}", part.sample, part.take) for k, (_, part) in enumerate(self._sensors)
        ]
        parts += [
            attribute(f"estimate{k}", e, "memory")._replace(take=e.take)
            for k, e in enumerate(self._estimates)
        ]
        if self._corrector is not None:
            parts += [attribute(n, self, n) for n in ("_added", "_thresholds", "_law_memory")]
        return parts

    def servo(self) -> LoopServo:
        """What the run is of, for what reads its log."""
        model = self.model
        return LoopServo(
            **{field.name: getattr(model, field.name) for field in fields(model)},
            scenario=self.scenario,
            max_step=self.max_step,
        )

    def true_pose(self) -> RigidTransform:
        """X_WP of the platform now [m]."""
        return self._motion.pose()

    def step_errors(self) -> Array:
        """Largest estimated errors of a step so far, position [m] and rotation [rad]."""
        return self._motion.report[:2].copy()

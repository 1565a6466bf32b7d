"""Runs a scenario and keeps what it did."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.systems.analysis import Simulator, SimulatorStatus
from pydrake.systems.framework import Context

from cdpr_drake.analyses.reporting.log_on_disk import Log
from cdpr_drake.analyses.simulation.run_loop import (
    LONGEST_WARM_UP,
    EndedRun,
    advance,
    ended,
    fixed_step_simulator,
    go_on,
    left_unfinished,
)
from cdpr_drake.analyses.simulation.session import (
    DEFAULT_SESSION,
    RunSession,
    check_connected,
    resting,
)
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableGeometryError, DivergedError, ScenarioError
from cdpr_drake.numerics.explicit_integration import explicit_integrators
from cdpr_drake.systems.diagrams.servo_models import LoopServo
from cdpr_drake.systems.diagrams.torque_control import tension_limits
from cdpr_drake.systems.diagrams.visual_servo import VisualServo, build_visual_servo
from cdpr_drake.systems.loops.loop_choice import check_loop, uses_compiled_loop
from cdpr_drake.systems.loops.servo_loop import ServoLoop
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.monitoring.tension_watch import TensionExtremes
from cdpr_drake.systems.robots.settings import COMPILED
from cdpr_drake.systems.scenarios.run_settings import DIAGRAM
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario


@dataclass(frozen=True)
class TorqueReport:
    """What a servo by torque did, at every step and not only where the log has rows.

    Attributes:
        steps: Steps of its control.
        relaxed_steps: At how many no tensions within the limits gave the wrench.
        largest_rate: Largest rate of a taut cable's wanted tension [N/s].
        extremes: How far the true tensions went.
        limits: Smallest and largest tension that are accepted [N].
    """

    steps: int
    relaxed_steps: int
    largest_rate: float
    extremes: TensionExtremes
    limits: tuple[float, float]

    def excess(self) -> float:
        """By how much a tension was beyond its limits at most, 0 if never [N].

        Below the lower one counts from when all cables first pulled with it; NaN if they never did.
        """
        if not np.isfinite(self.extremes.taut_since):
            return float("nan")
        low, high = self.limits
        below = low - float(np.min(self.extremes.lowest))
        return max(below, float(np.max(self.extremes.highest)) - high, 0.0)


@dataclass(frozen=True, kw_only=True)
class RunResult(EndedRun):
    """What a run did.

    Attributes:
        servo: What was run: the diagram and its handles, or what a loop without one was of.
        broken: Times at which cables passed their breaking load, or -1, shape (m,) [s]; None where
            none is known.
        step_errors: Largest estimated errors of an integration step, position [m] and rotation
            [rad]; None where the engine does not say.
        images: Images taken, and those of them drawn whole, by a camera with a region of interest;
            None from others.
        torque: What a servo by torque did at each step of its control; None for others, and for
            runs that another program left behind.
        depth_image: The last image of a depth camera, shape (h, w) [m]; None where there is none,
            and for runs that another program left behind.
    """

    servo: VisualServo | LoopServo
    broken: Array | None = None
    step_errors: Array | None = None
    images: tuple[int, int] | None = None
    torque: TorqueReport | None = None
    depth_image: Array | None = None

    @property
    def loop(self) -> str:
        """What stepped it: diagram or compiled."""
        return COMPILED if isinstance(self.servo, LoopServo) else DIAGRAM


def servo_errors(servo: VisualServo, context: Context) -> tuple[float, float]:
    """True distance [m] and angle [rad] of the tag in the camera from its desired pose."""
    return servo.seen_error(servo.true_pose(context), context.get_time())


def make_simulator(servo: VisualServo, context: Context) -> Simulator:
    """A simulator with the scenario's integrator and fixed step.

    A robot that moves by itself leaves to it only what else is continuous.
    """
    method = servo.scenario.integration.integrator
    if method not in explicit_integrators():
        method = "runge_kutta3"
    return fixed_step_simulator(servo.diagram, context, method, servo.max_step)


def warm_up(servo: VisualServo) -> None:
    """Loads compiled kernels and starts the renderer, so that a run's clock does not count it.

    Where it diverges already, the run itself will, and keeps what it has logged.
    """
    simulator = make_simulator(servo, servo.make_context())
    with suppress(CableGeometryError, DivergedError, RuntimeError), resting(servo.remote):
        scenario = servo.scenario
        simulator.AdvanceTo(min(1.0 / scenario.camera.rate, scenario.duration, LONGEST_WARM_UP))


def run_scenario(
    scenario: Scenario, session: RunSession = DEFAULT_SESSION, **how: Any
) -> RunResult:
    """Simulates a scenario until its outcome is known or its duration is over.

    Args:
        scenario: The scenario.
        session: How it is run.
        how: Fields of the session one by one, as `log_folder` or `resume`.

    Raises:
        CdprError: The scenario cannot be built: robot, camera or initial pose; or it asks for the
            compiled loop, which cannot do it.
        CheckpointError: There is no checkpoint of this run.
        OSError: The log cannot be written.
    """
    session = session.having(how)
    check_connected(scenario, session.connect)
    if uses_compiled_loop(scenario):
        if session.prepare is not None:
            raise ScenarioError(
                f"{scenario.name}: integration.loop: found compiled, but Meshcat looks into a "
                "diagram; accepted: diagram or automatic"
            )
        return _run_loop(ServoLoop(check_loop(scenario)), session)
    return run_built(build_visual_servo(scenario), session)


def run_built(servo: VisualServo, session: RunSession = DEFAULT_SESSION, **how: Any) -> RunResult:
    """As `run_scenario`, for a diagram that is built already."""
    session = session.having(how)
    warm_up(servo)
    context = servo.make_context()
    keeper = session.keeper(
        servo.log, context, servo.log.read, servo.scenario, remote=servo.remote
    )  # fmt: skip
    simulator = make_simulator(servo, context)
    session.begin(simulator, servo.diagram, servo.remote)
    end = advance(
        simulator,
        servo.scenario.duration,
        lambda status: _outcome_after(servo, context, status),
        lambda: servo_errors(servo, context),
        session,
        keeper,
    )
    watch = servo.watch
    broken = None if watch is None else watch.broken(watch.GetMyContextFromRoot(context))
    return RunResult(
        **ended(end, keeper, context.get_time()),
        servo=servo,
        broken=broken,
        step_errors=None if end.outcome == Outcome.DIVERGED else servo.step_errors(context),
        images=servo.images(context),
        torque=_torque_report(servo, context),
        depth_image=servo.depth_image(context),
    )


def _torque_report(servo: VisualServo, context: Context) -> TorqueReport | None:
    torque, watch = servo.torque, servo.tension_range
    if torque is None or watch is None:
        return None
    own = torque.GetMyContextFromRoot(context)
    return TorqueReport(
        *torque.steps(own),
        torque.largest_rate(own),
        watch.extremes(watch.GetMyContextFromRoot(context)),
        tension_limits(servo.scenario, servo.robot),
    )


def _run_loop(loop: ServoLoop, session: RunSession) -> RunResult:
    """As `run_scenario`, without a diagram."""
    servo = loop.servo()
    keeper = session.keeper(loop.log, None, loop.log.read, loop.scenario, state=loop)
    duration = loop.scenario.duration

    def step(until: float) -> Outcome:
        loop.advance_to(min(until, duration))
        over = loop.time >= duration * (1.0 - 1e-12) and loop.outcome == Outcome.RUNNING
        return Outcome.TIMEOUT if over else loop.outcome

    if not session.resume:
        loop.start()
    end = go_on(
        lambda: loop.time,
        step,
        lambda: servo.seen_error(loop.true_pose(), loop.time),
        session,
        keeper,
    )
    return RunResult(
        **ended(end, keeper, loop.time),
        servo=servo,
        step_errors=None if end.outcome == Outcome.DIVERGED else loop.step_errors(),
    )


def unfinished_run(scenario: Scenario, log: Log) -> RunResult:
    """A run whose program ended before it did, from its scenario and what it had logged."""
    return RunResult(servo=_servo_of(scenario), **left_unfinished(log))


def _servo_of(scenario: Scenario) -> VisualServo | LoopServo:
    if uses_compiled_loop(scenario):
        return ServoLoop(check_loop(scenario)).servo()
    return build_visual_servo(scenario)


def _outcome_after(servo: VisualServo, context: Context, status: SimulatorStatus | None) -> Outcome:
    if (
        status is not None
        and status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition
    ):
        if status.system() is servo.watch:
            return Outcome.CABLE_BROKEN
        if servo.meters is not None and status.system() is servo.meters.stop:
            return Outcome.CONTACT
        return servo.monitor.outcome(servo.monitor.GetMyContextFromRoot(context))
    if context.get_time() >= servo.scenario.duration * (1.0 - 1e-12):
        return Outcome.TIMEOUT
    return Outcome.RUNNING

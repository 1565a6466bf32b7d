"""Runs a scenario and keeps what it did."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator, SimulatorStatus
from pydrake.systems.framework import Context

from cdpr_drake.analyses.runs.loop import Progress, advance
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableGeometryError
from cdpr_drake.systems.diagrams import VisualServo, build_visual_servo
from cdpr_drake.systems.monitoring import Outcome
from cdpr_drake.systems.scenarios import Scenario


@dataclass(frozen=True, kw_only=True)
class RunResult:
    """What a run did.

    Attributes:
        servo: The diagram and its handles.
        log: Times "time", shape (n,) [s], and the quantities of `RunLog`, shape (n, size).
        outcome: How it ended.
        message: Why, where there is more to say; else empty.
        sim_time: Simulated time [s].
        wall_time: Time that the simulation took, without building and writing [s].
        broken: Times at which cables passed their breaking load, or -1, shape (m,) [s]; None where
            none is known.
    """

    servo: VisualServo
    log: dict[str, Array]
    outcome: Outcome
    message: str
    sim_time: float
    wall_time: float
    broken: Array | None = None


def servo_errors(servo: VisualServo, context: Context) -> tuple[float, float]:
    """True distance [m] and angle [rad] of the tag in the camera from its desired pose."""
    plant = servo.cable_robot.plant
    X_WP = servo.cable_robot.in_plant.pose(plant.GetMyContextFromRoot(context))
    return servo.seen_error(X_WP, context.get_time())


def make_simulator(servo: VisualServo, context: Context) -> Simulator:
    """A simulator with the scenario's integrator and fixed step."""
    simulator = Simulator(servo.diagram, context)
    integrator = ResetIntegratorFromFlags(
        simulator, servo.scenario.integration.integrator, servo.max_step
    )
    integrator.set_fixed_step_mode(True)
    return simulator


def warm_up(servo: VisualServo) -> None:
    """Loads compiled kernels and starts the renderer, so that a run's clock does not count it.

    Where it diverges already, the run itself will, and keeps what it has logged.
    """
    simulator = make_simulator(servo, servo.make_context())
    with suppress(CableGeometryError, RuntimeError):
        simulator.AdvanceTo(min(1.0 / servo.scenario.camera.rate, servo.scenario.duration))


def run_scenario(
    scenario: Scenario,
    on_progress: Callable[[Progress], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> RunResult:
    """Simulates a scenario until its outcome is known or its duration is over.

    Args:
        scenario: The scenario.
        on_progress: Called every `REPORT_PERIOD` of simulated time.
        should_stop: Asked as often; True ends the run with outcome INTERRUPTED. A
            KeyboardInterrupt does the same.

    Raises:
        CdprError: The scenario cannot be built: robot, camera or initial pose.
    """
    return run_built(build_visual_servo(scenario), on_progress, should_stop)


def run_built(
    servo: VisualServo,
    on_progress: Callable[[Progress], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> RunResult:
    """As `run_scenario`, for a diagram that is built already."""
    warm_up(servo)
    context = servo.make_context()
    end = advance(
        make_simulator(servo, context),
        servo.scenario.duration,
        lambda status: _outcome_after(servo, context, status),
        lambda: servo_errors(servo, context),
        on_progress,
        should_stop,
    )
    log = servo.log.read(context)
    watch = servo.watch
    broken = None if watch is None else watch.broken(watch.GetMyContextFromRoot(context))
    return RunResult(
        servo=servo,
        log=log,
        outcome=end.outcome,
        message=end.message,
        sim_time=context.get_time(),
        wall_time=end.wall_time,
        broken=broken,
    )


def _outcome_after(servo: VisualServo, context: Context, status: SimulatorStatus) -> Outcome:
    if status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition:
        if status.system() is servo.watch:
            return Outcome.CABLE_BROKEN
        return servo.monitor.outcome(servo.monitor.GetMyContextFromRoot(context))
    if context.get_time() >= servo.scenario.duration * (1.0 - 1e-12):
        return Outcome.TIMEOUT
    return Outcome.RUNNING

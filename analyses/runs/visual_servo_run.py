"""Runs a scenario and keeps what it did."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator, SimulatorStatus
from pydrake.systems.framework import Context, Diagram

from cdpr_drake.analyses.reporting import Log
from cdpr_drake.analyses.runs.log_keeper import LogKeeper
from cdpr_drake.analyses.runs.loop import LONGEST_WARM_UP, Progress, advance, advance_loop
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableGeometryError, DivergedError, ScenarioError
from cdpr_drake.numerics import explicit_integrators
from cdpr_drake.systems.diagrams import LoopServo, VisualServo, build_visual_servo
from cdpr_drake.systems.loops import ServoLoop, check_loop, is_looped
from cdpr_drake.systems.monitoring import Outcome
from cdpr_drake.systems.robots import COMPILED
from cdpr_drake.systems.scenarios import DIAGRAM, Scenario

LEFT_UNFINISHED = "the program ended before the run did"
"""Message of a run that was made of what another program left behind."""


@dataclass(frozen=True, kw_only=True)
class RunResult:
    """What a run did.

    Attributes:
        servo: What was run: the diagram and its handles, or what a loop without one was of.
        log: Times "time", shape (n,) [s], and the quantities of `RunLog`, shape (n, size); a dict,
            or a `LogOnDisk` that reads a quantity each time that it is looked at.
        outcome: How it ended.
        message: Why, where there is more to say; else empty.
        sim_time: Simulated time [s].
        wall_time: Time that the simulation took, without building and writing [s].
        broken: Times at which cables passed their breaking load, or -1, shape (m,) [s]; None where
            none is known.
        step_errors: Largest estimated errors of an integration step, position [m] and rotation
            [rad]; None where the engine does not say.
    """

    servo: VisualServo | LoopServo
    log: Log
    outcome: Outcome
    message: str
    sim_time: float
    wall_time: float
    broken: Array | None = None
    step_errors: Array | None = None

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
    simulator = Simulator(servo.diagram, context)
    method = servo.scenario.integration.integrator
    if method not in explicit_integrators():
        method = "runge_kutta3"
    integrator = ResetIntegratorFromFlags(simulator, method, servo.max_step)
    integrator.set_fixed_step_mode(True)
    return simulator


def warm_up(servo: VisualServo) -> None:
    """Loads compiled kernels and starts the renderer, so that a run's clock does not count it.

    Where it diverges already, the run itself will, and keeps what it has logged.
    """
    simulator = make_simulator(servo, servo.make_context())
    with suppress(CableGeometryError, DivergedError, RuntimeError):
        scenario = servo.scenario
        simulator.AdvanceTo(min(1.0 / scenario.camera.rate, scenario.duration, LONGEST_WARM_UP))


def run_scenario(
    scenario: Scenario,
    on_progress: Callable[[Progress], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
    log_folder: Path | None = None,
    prepare: Callable[[Simulator, Diagram], None] | None = None,
) -> RunResult:
    """Simulates a scenario until its outcome is known or its duration is over.

    Args:
        scenario: The scenario.
        on_progress: Called every `REPORT_PERIOD` of simulated time.
        should_stop: Asked as often; True ends the run with outcome INTERRUPTED. A
            KeyboardInterrupt does the same.
        log_folder: A folder to be made, where the log grows while the run goes on, which then
            takes no more memory for being long; None: the log is kept in memory.
        prepare: Gets the simulator before it starts, and the diagram.

    Raises:
        CdprError: The scenario cannot be built: robot, camera or initial pose; or it asks for the
            compiled loop, which cannot do it.
        OSError: The log cannot be written.
    """
    if is_looped(scenario):
        if prepare is not None:
            raise ScenarioError(
                f"{scenario.name}: integration.loop: found compiled, but Meshcat looks into a "
                "diagram; accepted: diagram or automatic"
            )
        return _run_loop(ServoLoop(check_loop(scenario)), on_progress, should_stop, log_folder)
    return run_built(build_visual_servo(scenario), on_progress, should_stop, log_folder, prepare)


def run_built(
    servo: VisualServo,
    on_progress: Callable[[Progress], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
    log_folder: Path | None = None,
    prepare: Callable[[Simulator, Diagram], None] | None = None,
) -> RunResult:
    """As `run_scenario`, for a diagram that is built already."""
    warm_up(servo)
    context = servo.make_context()
    keeper = LogKeeper.of_sink(servo.log, context, servo.log.read, log_folder)
    simulator = make_simulator(servo, context)
    if prepare is not None:
        prepare(simulator, servo.diagram)
    end = advance(
        simulator,
        servo.scenario.duration,
        lambda status: _outcome_after(servo, context, status),
        lambda: servo_errors(servo, context),
        on_progress=on_progress,
        should_stop=should_stop,
        keep=keeper,
    )
    watch = servo.watch
    broken = None if watch is None else watch.broken(watch.GetMyContextFromRoot(context))
    return RunResult(
        servo=servo,
        log=keeper.finish(),
        outcome=end.outcome,
        message=end.message,
        sim_time=context.get_time(),
        wall_time=end.wall_time,
        broken=broken,
        step_errors=None if end.outcome == Outcome.DIVERGED else servo.step_errors(context),
    )


def _run_loop(
    loop: ServoLoop,
    on_progress: Callable[[Progress], None] | None,
    should_stop: Callable[[], bool] | None,
    log_folder: Path | None,
) -> RunResult:
    """As `run_scenario`, without a diagram."""
    servo = loop.servo()
    keeper = LogKeeper(loop.log.rows, loop.log.read, loop.log.clear, log_folder)
    duration = loop.scenario.duration

    def outcome_after() -> Outcome:
        ended = loop.time >= duration * (1.0 - 1e-12) and loop.outcome == Outcome.RUNNING
        return Outcome.TIMEOUT if ended else loop.outcome

    loop.start()
    end = advance_loop(
        loop,
        duration,
        outcome_after,
        lambda: servo.seen_error(loop.true_pose(), loop.time),
        on_progress=on_progress,
        should_stop=should_stop,
        keep=keeper,
    )
    return RunResult(
        servo=servo,
        log=keeper.finish(),
        outcome=end.outcome,
        message=end.message,
        sim_time=loop.time,
        wall_time=end.wall_time,
        step_errors=None if end.outcome == Outcome.DIVERGED else loop.step_errors(),
    )


def unfinished_run(scenario: Scenario, log: Log) -> RunResult:
    """A run whose program ended before it did, from its scenario and what it had logged."""
    return RunResult(
        servo=_servo_of(scenario),
        log=log,
        outcome=Outcome.INTERRUPTED,
        message=LEFT_UNFINISHED,
        sim_time=float(log["time"][-1]),
        wall_time=0.0,
    )


def _servo_of(scenario: Scenario) -> VisualServo | LoopServo:
    if is_looped(scenario):
        return ServoLoop(check_loop(scenario)).servo()
    return build_visual_servo(scenario)


def _outcome_after(servo: VisualServo, context: Context, status: SimulatorStatus | None) -> Outcome:
    if (
        status is not None
        and status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition
    ):
        if status.system() is servo.watch:
            return Outcome.CABLE_BROKEN
        return servo.monitor.outcome(servo.monitor.GetMyContextFromRoot(context))
    if context.get_time() >= servo.scenario.duration * (1.0 - 1e-12):
        return Outcome.TIMEOUT
    return Outcome.RUNNING

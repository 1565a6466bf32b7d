"""Advances a simulation in pieces, with reports and requests to stop, and says how it ended.

`advance` does so with a Drake simulator, `go_on` with whatever can be advanced. `EndedRun` is what
every run keeps, however it was simulated and whoever wrote its log.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.systems.analysis import (
    InitializeParams,
    ResetIntegratorFromFlags,
    Simulator,
    SimulatorStatus,
)
from pydrake.systems.framework import Context, Diagram

from cdpr_drake.analyses.reporting.log_on_disk import Log
from cdpr_drake.analyses.simulation.log_keeper import LogKeeper
from cdpr_drake.analyses.simulation.session import DEFAULT_SESSION, Progress, RunSession
from cdpr_drake.errors import CableGeometryError, ClientEndedError, DivergedError
from cdpr_drake.systems.monitoring.run_monitor import Outcome

REPORT_PERIOD = 0.1
"""Simulated time between reports of progress and looks at a request to stop [s]."""

LONGEST_WARM_UP = 1.0
"""Simulated time in which compiled kernels are loaded at the latest [s]; a camera of a frame an
hour is not waited for."""

BEYOND = 1e9
"""Metres, radians and their rates that no platform has, but one whose run has diverged."""


@dataclass(frozen=True)
class LoopEnd:
    """How a loop ended.

    Attributes:
        outcome: The outcome.
        message: Why, where there is more to say; else empty.
        wall_time: Time that it took [s].
    """

    outcome: Outcome
    message: str
    wall_time: float


def fixed_step_simulator(
    diagram: Diagram, context: Context | None, method: str, step: float
) -> Simulator:
    """A simulator by one of Drake's integrators, at steps of a fixed length [s].

    Args:
        diagram: What to simulate.
        context: From where; None: the diagram's default.
        method: Name of the integrator, such as runge_kutta3.
        step: Longest step [s].
    """
    simulator = Simulator(diagram, context)
    ResetIntegratorFromFlags(simulator, method, step).set_fixed_step_mode(True)
    return simulator


@np.errstate(over="ignore", invalid="ignore")  # a run that diverges says so in its outcome
def advance(
    simulator: Simulator,
    duration: float,
    outcome_after: Callable[[SimulatorStatus], Outcome],
    errors: Callable[[], tuple[float, float]],
    session: RunSession = DEFAULT_SESSION,
    keeper: LogKeeper | None = None,
) -> LoopEnd:
    """Advances until an outcome is known.

    Args:
        simulator: A simulator at the start, or where an earlier program left it.
        duration: Longest simulated time [s].
        outcome_after: Says after each piece how the run stands, RUNNING to go on.
        errors: Present distance [m] and angle [rad] from what is wanted, for reports.
        session: Who is told every `REPORT_PERIOD` of simulated time, and asked as often.
        keeper: Puts away as often what was logged; says whether this is the start.

    Raises:
        OSError: The log cannot be written.
    """
    params = InitializeParams()
    params.suppress_initialization_events = _earlier(keeper) is not None  # they were at the start
    simulator.Initialize(params)
    context = simulator.get_context()

    def is_lost() -> bool:
        state = context.get_continuous_state_vector().CopyToVector()
        return not np.all(np.abs(state) < BEYOND)

    return go_on(
        context.get_time,
        lambda until: outcome_after(simulator.AdvanceTo(min(until, duration))),
        errors,
        session,
        keeper,
        is_lost=is_lost,
    )


@np.errstate(over="ignore", invalid="ignore")
def go_on(
    now: Callable[[], float],
    step: Callable[[float], Outcome],
    errors: Callable[[], tuple[float, float]],
    session: RunSession = DEFAULT_SESSION,
    keeper: LogKeeper | None = None,
    *,
    is_lost: Callable[[], bool] = lambda: False,
) -> LoopEnd:
    """Advances whatever can be advanced until an outcome is known.

    Args:
        now: Its time [s].
        step: Advances it to a time [s], and says how the run stands, RUNNING to go on.
        errors: As for `advance`, and so are the others.
        session: See errors.
        keeper: See errors.
        is_lost: Whether its state has no sense any more, after a RuntimeError.

    Raises:
        OSError: The log cannot be written.
    """
    began = time.perf_counter() - (_earlier(keeper) or 0.0)
    outcome, message = Outcome.RUNNING, ""
    try:
        while outcome == Outcome.RUNNING:
            outcome = step(now() + REPORT_PERIOD)
            if keeper is not None and outcome == Outcome.RUNNING:  # nobody goes on from an end
                keeper()
            if session.on_progress is not None:
                passed = time.perf_counter() - began
                session.on_progress(Progress(now(), passed, *errors()))
            asked = session.should_stop
            if outcome == Outcome.RUNNING and asked is not None and asked():
                outcome = Outcome.INTERRUPTED
    except KeyboardInterrupt:
        outcome = Outcome.INTERRUPTED
    except ClientEndedError as problem:
        outcome, message = Outcome.CLIENT_ENDED, str(problem)
    except (CableGeometryError, DivergedError) as problem:  # no cable can run, or no number is left
        outcome, message = Outcome.DIVERGED, str(problem)
    except RuntimeError as problem:
        # Drake refuses NaN, and quaternions of numbers that have no squares; anything else is not
        # about the run.
        if "NaN" not in str(problem) and not is_lost():
            raise
        outcome, message = Outcome.DIVERGED, str(problem).splitlines()[0]
    return LoopEnd(outcome, message, time.perf_counter() - began)


def _earlier(keeper: LogKeeper | None) -> float | None:
    """Time that an earlier program took for what is behind [s]; None: it is the start."""
    return None if keeper is None else keeper.earlier


LEFT_UNFINISHED = "the program ended before the run did"
"""Message of a run that was made of what another program left behind."""


@dataclass(frozen=True, kw_only=True)
class EndedRun:
    """A run that has ended.

    Attributes:
        log: Times "time", shape (n,) [s], and the quantities that were logged, shape (n, size); a
            dict, or a `LogOnDisk` that reads a quantity each time that it is looked at.
        outcome: How it ended.
        message: Why, where there is more to say; else empty.
        sim_time: Simulated time [s].
        wall_time: Time that the simulation took, without building and writing [s].
    """

    log: Log
    outcome: Outcome
    message: str
    sim_time: float
    wall_time: float

    def ending(self) -> dict[str, Any]:
        """How it ended, as summaries have it."""
        return {
            "outcome": self.outcome.name.lower(),
            "message": self.message,
            "sim_time_s": self.sim_time,
            "wall_time_s": self.wall_time,
            "realtime_factor": self.sim_time / self.wall_time if self.wall_time > 0.0 else None,
        }


def ended(end: LoopEnd, keeper: LogKeeper, sim_time: float) -> dict[str, Any]:
    """Fields of an `EndedRun` of which a loop has come to its end at a time [s].

    Raises:
        OSError: The log cannot be written.
    """
    return {
        "log": keeper.finish(),
        "outcome": end.outcome,
        "message": end.message,
        "sim_time": sim_time,
        "wall_time": end.wall_time,
    }


def left_unfinished(log: Log) -> dict[str, Any]:
    """Fields of an `EndedRun` of which a program that ended before has left the log."""
    return {
        "log": log,
        "outcome": Outcome.INTERRUPTED,
        "message": LEFT_UNFINISHED,
        "sim_time": float(log["time"][-1]),
        "wall_time": 0.0,
    }

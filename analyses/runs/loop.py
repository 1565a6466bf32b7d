"""Advances a simulation in pieces, with reports, requests to stop, and an outcome at the end."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from pydrake.systems.analysis import Simulator, SimulatorStatus

from cdpr_drake.errors import CableGeometryError, DivergedError
from cdpr_drake.systems.monitoring import Outcome

REPORT_PERIOD = 0.1
"""Simulated time between reports of progress and looks at a request to stop [s]."""

LONGEST_WARM_UP = 1.0
"""Simulated time in which compiled kernels are loaded at the latest [s]; a camera of a frame an
hour is not waited for."""

BEYOND = 1e9
"""Metres, radians and their rates that no platform has, but one whose run has diverged."""


@dataclass(frozen=True)
class Progress:
    """Where a run stands.

    Attributes:
        sim_time: Simulated time [s].
        wall_time: Time since the run began [s].
        position_error: True distance of the tag from its desired position in the camera [m].
        rotation_error: The same as an angle [rad].
    """

    sim_time: float
    wall_time: float
    position_error: float
    rotation_error: float


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


@np.errstate(over="ignore", invalid="ignore")  # a run that diverges says so in its outcome
def advance(
    simulator: Simulator,
    duration: float,
    outcome_after: Callable[[SimulatorStatus | None], Outcome],
    errors: Callable[[], tuple[float, float]],
    *,
    on_progress: Callable[[Progress], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
    keep: Callable[[], None] | None = None,
) -> LoopEnd:
    """Advances until an outcome is known.

    Args:
        simulator: A simulator at the start.
        duration: Longest simulated time [s].
        outcome_after: Says after each piece how the run stands, RUNNING to go on.
        errors: Present distance [m] and angle [rad] from what is wanted, for reports.
        on_progress: Called every `REPORT_PERIOD` of simulated time.
        should_stop: Asked as often; True ends the run with outcome INTERRUPTED. A
            KeyboardInterrupt does the same.
        keep: Called as often, to put away what was logged.

    Raises:
        OSError: `keep` could not.
    """
    simulator.Initialize()
    simulation = _Simulation(simulator)
    try:
        return advance_loop(
            simulation,
            duration,
            lambda: outcome_after(simulation.status),
            errors,
            on_progress=on_progress,
            should_stop=should_stop,
            keep=keep,
        )
    except RuntimeError as problem:
        # Drake refuses NaN, and quaternions of numbers that have no squares; anything else is not
        # about the run.
        state = simulator.get_context().get_continuous_state_vector().CopyToVector()
        if "NaN" not in str(problem) and np.all(np.abs(state) < BEYOND):
            raise
        return LoopEnd(Outcome.DIVERGED, str(problem).splitlines()[0], simulation.passed())


class Loop(Protocol):
    """What can be advanced: a simulator behind `advance`, or a loop that is no diagram."""

    @property
    def time(self) -> float:
        """Simulated time [s]."""

    def advance_to(self, time: float) -> None:
        """Goes on to a time [s]."""


class _Simulation:
    """A simulator as a `Loop`."""

    def __init__(self, simulator: Simulator) -> None:
        self._simulator, self._context = simulator, simulator.get_context()
        self._began = time.perf_counter()
        self.status: SimulatorStatus | None = None

    @property
    def time(self) -> float:
        return float(self._context.get_time())

    def advance_to(self, time: float) -> None:
        self.status = self._simulator.AdvanceTo(time)

    def passed(self) -> float:
        return time.perf_counter() - self._began


def advance_loop(
    loop: Loop,
    duration: float,
    outcome_after: Callable[[], Outcome],
    errors: Callable[[], tuple[float, float]],
    *,
    on_progress: Callable[[Progress], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
    keep: Callable[[], None] | None = None,
) -> LoopEnd:
    """As `advance`, for anything that can be advanced and stands at its start."""
    began = time.perf_counter()
    outcome, message = Outcome.RUNNING, ""
    try:
        while outcome == Outcome.RUNNING:
            loop.advance_to(min(loop.time + REPORT_PERIOD, duration))
            outcome = outcome_after()
            if keep is not None:
                keep()
            if on_progress is not None:
                on_progress(Progress(loop.time, time.perf_counter() - began, *errors()))
            if outcome == Outcome.RUNNING and should_stop is not None and should_stop():
                outcome = Outcome.INTERRUPTED
    except KeyboardInterrupt:
        outcome = Outcome.INTERRUPTED
    except (CableGeometryError, DivergedError) as problem:  # no cable can run, or no number is left
        outcome, message = Outcome.DIVERGED, str(problem)
    return LoopEnd(outcome, message, time.perf_counter() - began)

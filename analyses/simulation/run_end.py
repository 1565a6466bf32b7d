"""What every run keeps, however it was simulated and whoever wrote its log."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from cdpr_drake.analyses.reporting import Log
from cdpr_drake.analyses.simulation.log_keeper import LogKeeper
from cdpr_drake.analyses.simulation.loop import LoopEnd
from cdpr_drake.systems.monitoring import Outcome

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

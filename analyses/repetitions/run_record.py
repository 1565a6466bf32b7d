"""What is kept of one run of many."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from cdpr_drake.arrays import Array

CONVERGED = "converged"


@dataclass(frozen=True, eq=False)
class RunRecord:
    """What is kept of a run.

    Attributes:
        index: Which of the scenarios it was.
        seed: Its seed.
        summary: Its summary, as `cdpr simulate` writes it.
        end: Last true pose of the platform in the frame of the desired one, as `pose_row`.
        traces: Arrays for figures, see `run_traces`; empty if they were not asked for.
    """

    index: int
    seed: int
    summary: dict[str, Any]
    end: Array
    traces: dict[str, Array]

    @property
    def converged(self) -> bool:
        """Whether the run reached its desired pose."""
        return bool(self.summary["outcome"] == CONVERGED)

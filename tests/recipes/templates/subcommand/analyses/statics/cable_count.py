"""How many cables a robot has."""

from __future__ import annotations

from dataclasses import dataclass

from cdpr_drake.analyses.frame.result import Result, Table
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import RobotWord
from cdpr_drake.models.robot_loader import as_robot


@dataclass(frozen=True, repr=False)
class CableCount(Result):
    """A number of cables."""

    cables: int

    def as_dict(self) -> dict[str, int]:
        """For JSON."""
        return {"cables": self.cables}

    def tables(self) -> list[Table]:
        """None."""
        return []

    def lines(self) -> list[str]:
        """The number."""
        return [f"{self.cables} cables"]


@verb()
def count_cables(robot: RobotWord, /) -> CableCount:
    """Counts the cables of a robot.

    Args:
        robot: Robot by name or file.
    """
    return CableCount(len(as_robot(robot, "count_cables").cables))

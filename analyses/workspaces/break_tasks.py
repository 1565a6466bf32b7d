"""Task of sweeps over the poses of a grid: is every single break of a cable survived there?"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from cdpr_drake.analyses.workspaces.pose_grid import plain
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid

if TYPE_CHECKING:
    from cdpr_drake.analyses.simulation.break_survival import BreakRequest

SURVIVES, EXCURSION, WORST, BEST = (
    "dynamic-single-failure",
    "break-excursion",
    "worst-cable",
    "best-reaction",
)

OF_BREAKS = (EXCURSION, WORST, BEST)
"""Measures that come with the kind."""

NUMBERED = (WORST, BEST)
"""Those that are numbers of something, and have no range."""

SECTIONS = ("cables", "winches", "damping", "torque_control", "integration")
"""Of the scenario that count."""


@dataclass(frozen=True, eq=False)
class BreakTask:
    """All single breaks at the poses of a grid, with every reaction.

    Attributes:
        robot: The robot.
        asked: What breaks lead to.
        grid: The poses.
    """

    robot: Robot
    asked: BreakRequest
    grid: WorkspaceGrid
    _last: dict[tuple[int, int], dict[str, np.ndarray]] = field(default_factory=dict)

    def arguments(self) -> dict[str, Any]:
        """What its numbers depend on, for JSON."""
        asked = self.asked
        return {
            "scenario": asked.scenario.name,
            "reactions": list(asked.reactions),
            "moving_m_s": plain(np.asarray(asked.velocity, float)),
            "after_s": asked.after,
            "limits_n": None if asked.limits is None else list(asked.limits),
            "cable_names": [one.name for one in self.robot.cables],
            **{name: plain(getattr(asked.scenario, name)) for name in SECTIONS},
        }

    def __call__(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """Arrays of the poses start to stop, shape (n,).

        `SURVIVES`; `EXCURSION`, how far the best reaction to the worst break goes [m]; `WORST`,
        number of that cable, from 1; `BEST`, number of that reaction among those asked for, from 1.
        The last three are NaN where all cables do not hold the pose. Kinds and measures ask one
        after the other: the last poses are kept.
        """
        if (start, stop) not in self._last:
            found = [self._at(number) for number in range(start, stop)]
            table = np.array(found, float).reshape(stop - start, 4)
            self._last.clear()
            self._last[start, stop] = {
                SURVIVES: table[:, 0] > 0.0, EXCURSION: table[:, 1], WORST: table[:, 2],
                BEST: table[:, 3],
            }  # fmt: skip
        return self._last[start, stop]

    def _at(self, number: int) -> tuple[float, float, float, float]:
        from cdpr_drake.analyses.simulation.break_survival import breaks_at  # most ask no such

        outcomes = breaks_at(self.robot, self.grid.poses(number, number + 1)[0], self.asked)
        if outcomes is None:
            return 0.0, np.nan, np.nan, np.nan
        cable, reaction, excursion, saved = outcomes.worst()
        return float(saved), excursion, cable + 1.0, reaction + 1.0

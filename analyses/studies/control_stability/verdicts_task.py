"""The verdicts on the poses of a grid, as a task of a sweep."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from cdpr_drake.analyses.stability import plain
from cdpr_drake.stability import (
    PerturbationBounds,
    StabilityCase,
    VerdictOptions,
    judge_all_verdicts,
)
from cdpr_drake.workspaces import WorkspaceGrid


@dataclass(frozen=True, eq=False)
class VerdictsTask:
    """Sweep task: at which poses of a grid is the servo stable, by every verdict?

    Attributes:
        case: Robot, scheme, target.
        bounds: What limits the perturbations.
        grid: The poses.
        options: How hard to look.
    """

    case: StabilityCase
    bounds: PerturbationBounds
    grid: WorkspaceGrid
    options: VerdictOptions

    def __call__(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """Per verdict whether the poses start to stop are stable, shape (n,) bool."""
        poses = self.grid.pose_rows(start, stop)
        found = judge_all_verdicts(self.case, self.bounds, poses, self.options)
        return {verdict: chunk.stable for verdict, chunk in found.items()}


def grid_arguments(grid: WorkspaceGrid) -> dict[str, Any]:
    """A grid for JSON: box, numbers of points, orientations."""
    return {
        "lower_m": plain(grid.lower),
        "upper_m": plain(grid.upper),
        "points": list(grid.shape[1:]),
        "angles_rad": plain(grid.angles),
    }

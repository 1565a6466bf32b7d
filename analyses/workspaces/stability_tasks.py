"""Tasks of sweeps over the poses of a grid: is the servo stable there, and by which verdict?"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from cdpr_drake.analyses.workspaces.pose_grid import grid_arguments, plain
from cdpr_drake.stability.perturbation_bounds import PerturbationBounds
from cdpr_drake.stability.stability_case import StabilityCase
from cdpr_drake.stability.verdict import (
    StabilityChunk,
    VerdictOptions,
    judge_all_verdicts,
    judge_stability,
)
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid


@dataclass(frozen=True, eq=False)
class GridTask:
    """What all of them are asked.

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

    def arguments(self) -> dict[str, Any]:
        """What its numbers depend on, for JSON."""
        return {
            "kind": type(self).__name__,
            "case": plain(self.case),
            "bounds": plain(self.bounds),
            "grid": grid_arguments(self.grid),
            "options": plain(self.options),
        }

    def judged(self, start: int, stop: int, verdict: str) -> StabilityChunk:
        """What one of `stability.verdict.VERDICTS` says of the poses start to stop."""
        poses = self.grid.pose_rows(start, stop)
        return judge_stability(self.case, self.bounds, poses, verdict, self.options)


@dataclass(frozen=True, eq=False)
class StabilityTask(GridTask):
    """By one verdict, with margins.

    Attributes:
        verdict: One of `stability.verdict.VERDICTS`.
    """

    verdict: str

    def __call__(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """Arrays `stable` and `margin` of the poses start to stop, shape (n,)."""
        found = self.judged(start, stop, self.verdict)
        return {"stable": found.stable, "margin": found.margin}


@dataclass(frozen=True, eq=False)
class SampledTask(GridTask):
    """By samples, without margins, which would be most of what is kept of many grids."""

    def __call__(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """Array `stable` of the poses start to stop, shape (n,) bool."""
        return {"stable": self.judged(start, stop, "sampled").stable}


@dataclass(frozen=True, eq=False)
class VerdictsTask(GridTask):
    """By every verdict."""

    def __call__(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """Per verdict whether the poses start to stop are stable, shape (n,) bool."""
        poses = self.grid.pose_rows(start, stop)
        found = judge_all_verdicts(self.case, self.bounds, poses, self.options)
        return {verdict: chunk.stable for verdict, chunk in found.items()}

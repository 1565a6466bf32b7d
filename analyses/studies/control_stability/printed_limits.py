"""What printed rows cannot be, whatever is chosen where the thesis is silent.

Three things hold by the thesis' own definition (3.27) and its spheres of errors (3.3.1):

- a common shift of all exit points is a shift of the platform the other way. So the errors of the
  row r_A = r contain those of a row r_bp = R as long as R <= r + r_bp - r_A of the baseline, and
  the workspace at r_A = r cannot be larger than at that r_bp. This needs no computation;
- the same errors with one common shift of the exit points lie within those of a row r_bp = R as
  soon as R >= r + r_bp - r_A of the baseline. A row that leaves less than that R has exit points
  that are wrong otherwise than in common;
- outside of `stable_target_exists` no target, view or camera makes the criterion positive definite.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from cdpr_drake.analyses.studies.published.stability_tables import BASELINE_VALUES, PublishedTable
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.stability.no_stable_target import stable_target_exists
from cdpr_drake.stability.perturbation_bounds import PerturbationBounds
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid

DIGIT = 0.15
"""Printed shares that differ by less may differ in their last digit alone [points]."""

LENGTH_ROUNDING = 1e-9
"""Lengths that differ by less are the same [m]."""


@dataclass(frozen=True)
class NestedPair:
    """Two printed rows, the errors of the second within those of the first.

    Attributes:
        table: Name of their table.
        r_A: Bound on exit points of the first row [m].
        r_bp: Bound on the platform's place of the second [m].
        first: Printed share of the first [%].
        second: That of the second [%]; by (3.27) not smaller.
    """

    table: str
    r_A: float
    r_bp: float
    first: float
    second: float

    @property
    def contradictory(self) -> bool:
        """Whether the first is larger by more than the last digit."""
        return self.first > self.second + DIGIT

    @property
    def less(self) -> bool:
        """Whether the first is smaller by more than the last digit."""
        return self.first < self.second - DIGIT


def nested_pairs(table: PublishedTable) -> list[NestedPair]:
    """For each printed r_A the largest printed r_bp whose errors it contains."""
    spare = BASELINE_VALUES["r_bp"] - BASELINE_VALUES["r_A"]
    pairs = []
    for r_A, first in table.rows.get("r_A", {}).items():
        within = [R for R in table.rows.get("r_bp", {}) if r_A + spare + LENGTH_ROUNDING >= R]
        if within:
            r_bp = max(within)
            pairs.append(NestedPair(table.name, r_A, r_bp, first, table.rows["r_bp"][r_bp]))
    return pairs


def covering_pairs(table: PublishedTable) -> list[NestedPair]:
    """For each printed r_A the smallest printed r_bp whose errors contain a common shift by r_A.

    Of the pairs `less` ones have exit points that are not wrong in common.
    """
    spare = BASELINE_VALUES["r_bp"] - BASELINE_VALUES["r_A"]
    pairs = []
    for r_A, first in table.rows.get("r_A", {}).items():
        around = [R for R in table.rows.get("r_bp", {}) if r_A + spare <= R + LENGTH_ROUNDING]
        if around:
            r_bp = min(around)
            pairs.append(NestedPair(table.name, r_A, r_bp, first, table.rows["r_bp"][r_bp]))
    return pairs


def rising_rows(table: PublishedTable) -> list[tuple[str, float, float]]:
    """Bounds and pairs of values of which the larger one leaves more, which (3.27) forbids."""
    return [
        (bound, low, high)
        for bound, rows in table.rows.items()
        for low, high in pairwise(sorted(rows))
        if rows[high] > rows[low] + DIGIT
    ]


@dataclass(frozen=True, eq=False)
class AnyTargetTask:
    """Sweep task: at which poses of a grid may some target make the servo stable?

    Attributes:
        cables: The robot's.
        bounds: What limits the perturbations.
        grid: The poses.
    """

    cables: CableSet
    bounds: PerturbationBounds
    grid: WorkspaceGrid

    def __call__(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """Whether the poses start to stop may be stable, shape (n,) bool."""
        poses = self.grid.pose_rows(start, stop)
        return {"stable": stable_target_exists(self.cables, self.bounds, poses)}

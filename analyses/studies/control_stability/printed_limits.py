"""What printed rows cannot be, whatever is chosen where the thesis is silent.

Three things hold by the thesis' own definition (3.27) and its spheres of errors (3.3.1):

- a common shift of all exit points is a shift of the platform the other way. So the errors of the
  row r_A = r contain those of a row r_bp = R as long as R <= r + r_bp - r_A of the baseline, and
  the workspace at r_A = r cannot be larger than at that r_bp. This needs no computation;
- the same errors with one common shift of the exit points lie within those of a row r_bp = R as
  soon as R >= r + r_bp - r_A of the baseline. A row that leaves less than that R has exit points
  that are wrong otherwise than in common;
- outside of `stable_target_exists` no target, view or camera makes the criterion positive definite;
  `limit_cases` holds the rows against what that leaves.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from cdpr_drake.analyses.studies.control_stability.recipes import (
    ANY_TARGET,
    BY_NAME,
    RULES,
    asked_tables,
    box_percent,
    poses_inside,
    table_grid,
)
from cdpr_drake.analyses.studies.control_stability.tables import published
from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Run, Runs
from cdpr_drake.analyses.studies.framework.study import Arrays, Case, Form
from cdpr_drake.analyses.studies.published.recipe_variants import (
    FULLY_CONSTRAINED,
    OTHER_ANCHORS,
    PRESENT,
    RECIPES,
)
from cdpr_drake.analyses.studies.published.stability_recipe import recipe_bounds
from cdpr_drake.analyses.studies.published.stability_tables import (
    BASELINE_VALUES,
    TABLES,
    PublishedTable,
)
from cdpr_drake.analyses.workspaces.pose_grid import grid_arguments, plain
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.stability.no_stable_target import stable_target_exists
from cdpr_drake.stability.perturbation_bounds import PerturbationBounds
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid

DIGIT = 0.15
"""Printed shares that differ by less may differ in their last digit alone [points]."""

LENGTH_ROUNDING = 1e-9
"""Lengths that differ by less are the same [m]."""

POINT_BOUNDS = ("r_A", "r_B")
"""Bounds whose rows are held against what any target leaves."""


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

    def arguments(self) -> dict[str, Any]:
        """What its numbers depend on, for JSON."""
        return {
            "kind": type(self).__name__,
            "cables": plain(self.cables),
            "bounds": plain(self.bounds),
            "grid": grid_arguments(self.grid),
        }


LimitRow = tuple[PublishedTable, str, str, float]
"""A table, the recipe whose anchor points are taken, a bound and its value."""


def limit_rows(tables: Sequence[PublishedTable] = TABLES) -> list[LimitRow]:
    """Printed rows that are held against what any target leaves.

    Those of the planar robot are none of them: what it sees of the object is wrong, too.
    """
    return [
        (table, arrangement, bound, value)
        for table in tables
        if table.robot != "planar"
        for bound in POINT_BOUNDS
        for value in table.rows[bound]
        for arrangement in (
            (PRESENT.name, *OTHER_ANCHORS) if table.robot == FULLY_CONSTRAINED else (PRESENT.name,)
        )
    ]


def limit_cases(form: Form) -> Iterator[Case]:
    """What any target leaves of rows; it is the same for every scheme, and computed once."""
    cables: dict[tuple[str, str], CableSet] = {}
    alike: dict[tuple[str, str, str, float], str] = {}
    for table, arrangement, bound, value in limit_rows(asked_tables(form)):
        poses = table_grid(table.robot, form.grid)
        robot = table.robot, arrangement
        if robot not in cables:  # to read its file takes a moment
            cables[robot] = RECIPES[arrangement].cables(table.robot)
        bounds = recipe_bounds(table, bound, value)
        name = f"any target {table.name} {arrangement} {bound}={value:g}"
        first = alike.setdefault((*robot, bound, value), name)
        yield Case(
            name=name,
            keys={
                "question": ANY_TARGET, "arrangement": arrangement, "table": table.name,
                "bound": bound, "value": value, "grid": form.grid,
            },
            task=AnyTargetTask(cables[robot], bounds, poses) if first == name else None,
            items=poses.size,
            same_task="" if first == name else first,
            printed={"at_most_percent": f"{table.rows[bound][value]:g}"},
        )  # fmt: skip


def limit_row(case: Case, arrays: Arrays) -> dict[str, Any]:
    """The largest of the shares of the grid's box by all rules of the volume."""
    grid = table_grid(BY_NAME[case.keys["table"]].robot, case.keys["grid"])
    inside = poses_inside(grid, arrays)
    return {"at_most_percent": max(box_percent(grid, inside, rule) for rule in RULES)}


def limits_of(runs: Runs, **where: Any) -> Runs:
    """All rows of what any target leaves.

    Args:
        runs: Of the study.
        where: Values of their key columns.

    Raises:
        MissingRuns: One of them is not there.
    """
    rows = runs(question=ANY_TARGET, **where)
    if len(rows) < len(limit_rows()):
        raise MissingRuns(ANY_TARGET)
    return rows


def excluded(run: Run) -> bool:
    """Whether more is printed in a row than any target leaves."""
    return bool(published(run) > run["at_most_percent"] + DIGIT)

"""Rows under PBVS over many targets of the camera: which one they choose, and what none can give.

Kinds of cases, values of the key column `scan`:

- TARGETS: for each target of `camera_targets` the rows of d_theta_pc of tables A.9 and A.10, and
  for each arrangement of points the rows of A.11 that are missed, on a grid with every second
  column;
- SEEN: the same rows of A.9 and A.10 where an error of the camera's mounting also turns what is
  seen, for several rotation errors;
- KEPT: all rows of A.9 and A.10 by the target in use and by those that TARGETS and SEEN choose;
- PAIRS: the poses at which some target, which may be another one at every pose, is unstable in the
  row d_theta_pc = 50 deg, where A.9 and A.10 print 0, and stable in another row. If less is left
  than that row prints, the two rows do not belong to the same targets.

A target is tried in the place of the recipe's; all else is as the recipe in use has it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from cdpr_drake.analyses.studies.control_stability.camera_targets import (
    CENTRE_TARGET,
    CHOSEN_TARGET,
    DIAGONAL_TURN,
    HEIGHT,
    HEIGHTS,
    IN_USE_TARGET,
    NO_TURN,
    SEEN_TARGET,
    CameraTarget,
    goals,
    same_errors,
    seen_turned,
    with_target,
)
from cdpr_drake.analyses.studies.framework.study import Case, Form
from cdpr_drake.analyses.studies.published.recipe_variants import (
    FULLY_CONSTRAINED,
    IN_USE,
    RECIPES,
    Recipe,
)
from cdpr_drake.analyses.studies.published.stability_recipe import (
    recipe_bounds,
    recipe_case,
    recipe_grid,
    recipe_options,
)
from cdpr_drake.analyses.studies.published.stability_tables import TABLES, PublishedTable
from cdpr_drake.analyses.workspaces.pose_grid import plain
from cdpr_drake.analyses.workspaces.stability_tasks import SampledTask
from cdpr_drake.stability.perturbation_bounds import PerturbationBounds
from cdpr_drake.stability.stability_case import StabilityCase
from cdpr_drake.stability.verdict import VerdictOptions, judge_stability
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid, grid_by_count
from cdpr_drake.workspaces.volume import VolumeRule, workspace_volume

TARGETS, SEEN, KEPT, PAIRS = "targets", "seen turned", "kept rows", "pairs of rows"
"""Kinds of cases."""

CHOOSING_BOUND = "d_theta_pc_deg"
"""Its rows choose a target."""

CHOOSING_TABLES, ELEVENTH = ("A.9", "A.10"), "A.11"

ELEVENTH_ROWS = (
    ("r_bp", 0.03), ("d_theta_bp_deg", 20.0), ("r_A", 0.03), ("r_A", 0.04), ("r_bp", 0.1),
    ("r_B", 0.03),
)  # fmt: skip
"""Rows of A.11 that are scanned: the baseline, and those that the recipe in use misses."""

ELEVENTH_LENGTHS = (0.0, 1.0, 1.75)
"""Of e_t, for A.11 [m]."""

ARRANGEMENTS = (
    IN_USE.name, "present", "kept-cables", "upper-on-upper", "other-corners-independent",
    "lower-on-upper-independent",
)  # fmt: skip
"""Recipes whose points of the fully constrained ACROBOT are tried."""

AGAINST = (CHOOSING_BOUND, 50.0)
"""The row in which nothing is left of A.9 and A.10."""

PAIRED_ROWS = (
    ("d_theta_bp_deg", 20.0), ("d_theta_bp_deg", 30.0), ("d_theta_bp_deg", 40.0), ("r_bp", 0.5),
    ("r_A", 0.04), ("r_B", 0.03),
)  # fmt: skip
"""Rows that are held against it."""

PAIRED_LENGTHS = (1.0, 1.25, 1.5, 1.75, 2.0)
"""Of e_t, for PAIRS: a shorter one does not empty the workspace at 50 deg [m]."""

WHOLE, HALF, QUICK = "whole", "every second column", "quick"
"""Grids."""


def table_named(name: str) -> PublishedTable:
    """A printed table."""
    return next(table for table in TABLES if table.name == name)


@cache
def scan_grid(robot: str, name: str) -> WorkspaceGrid:
    """A grid of a robot's tables: WHOLE, HALF with all planes, or QUICK."""
    grid = recipe_grid(robot, name == QUICK)
    if name != HALF:
        return grid
    _, nx, ny, nz = grid.shape
    return grid_by_count(grid.lower, grid.upper, [(nx + 1) // 2, (ny + 1) // 2, nz])


@dataclass(frozen=True, eq=False)
class ScanTask:
    """Sweep task: several rows of a table at the poses of a grid, by samples.

    Attributes:
        case: Robot, scheme, target.
        rows: What limits the perturbations of each row; what is asked twice is computed once.
        grid: The poses.
        options: How hard to look.
    """

    case: StabilityCase
    rows: tuple[PerturbationBounds, ...]
    grid: WorkspaceGrid
    options: VerdictOptions

    def __call__(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """Array `stable` of the poses start to stop, a column a row, shape (n, rows) bool."""
        found = {
            bounds: SampledTask(self.case, bounds, self.grid, self.options)(start, stop)["stable"]
            for bounds in dict.fromkeys(self.rows)
        }
        return {"stable": np.stack([found[bounds] for bounds in self.rows], axis=1)}


@dataclass(frozen=True, eq=False)
class PairTask:
    """Sweep task: poses with a target that is unstable in one row and stable in another.

    Attributes:
        case: Robot and scheme; target and camera are replaced.
        robot: Name of the robot, whose box goals belong to.
        targets: The targets.
        against: What limits the perturbations in the row in which they are to be unstable.
        rows: The same of the rows in which they are to be stable, each by itself.
        grid: The poses.
        options: How hard to look.
    """

    case: StabilityCase
    robot: str
    targets: tuple[CameraTarget, ...]
    against: PerturbationBounds
    rows: tuple[PerturbationBounds, ...]
    grid: WorkspaceGrid
    options: VerdictOptions

    def __call__(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """Array `stable` of the poses start to stop, a column a row, shape (n, rows) bool."""
        poses = self.grid.pose_rows(start, stop)
        found = np.zeros((len(poses), len(self.rows)), bool)
        for target in self.targets:
            case = with_target(self.case, self.robot, target)
            asked = np.flatnonzero(~np.all(found, axis=1))
            unstable = asked[~self._stable(case, self.against, poses[asked])]
            for row, bounds in enumerate(self.rows):
                left = unstable[~found[unstable, row]]
                found[left, row] = self._stable(case, bounds, poses[left])
        return {"stable": found}

    def _stable(
        self, case: StabilityCase, bounds: PerturbationBounds, poses: np.ndarray
    ) -> np.ndarray:
        if not len(poses):
            return np.zeros(0, bool)
        return judge_stability(case, bounds, poses, "sampled", self.options).stable

    def arguments(self) -> dict[str, Any]:
        """What the numbers depend on, for JSON."""
        return {
            "case": plain(self.case),
            "robot": self.robot,
            "targets": [target.name for target in self.targets],
            "against": plain(self.against),
            "rows": [plain(bounds) for bounds in self.rows],
            "shape": self.grid.shape,
            "options": plain(self.options),
        }


def scan_targets(quick: bool = False) -> list[CameraTarget]:
    """Targets for A.9 and A.10: both grids; the chosen and the used one with other cameras too.

    Args:
        quick: A few of each.
    """
    if quick:
        return [*same_errors((0.0, 1.5))[:3], IN_USE_TARGET]
    others = [
        replace(target, height=height)
        for height in HEIGHTS
        if height != HEIGHT
        for target in (CHOSEN_TARGET, IN_USE_TARGET)
    ]
    return [*same_errors(), *goals(), *others]


def eleventh_targets(quick: bool = False) -> list[CameraTarget]:
    """Targets for A.11; quick: the one in use and no way to go."""
    if quick:
        return [CENTRE_TARGET, *same_errors((0.0,))]
    return [*same_errors(ELEVENTH_LENGTHS), *goals()]


def paired_targets(quick: bool = False) -> tuple[CameraTarget, ...]:
    """Targets of PAIRS: both grids, and with other rotation errors; those that decide most first.

    Args:
        quick: One e_t.
    """
    if quick:
        return (CHOSEN_TARGET,)
    first = sorted(same_errors(PAIRED_LENGTHS), key=lambda target: abs(target.length - 1.5))
    turned = [
        target
        for turn in (NO_TURN, DIAGONAL_TURN)
        for target in (*same_errors(PAIRED_LENGTHS[::2], turn=turn), *goals(turn=turn))
    ]
    return (*first, *goals(), *turned)


def targeted_case(
    table: PublishedTable, target: CameraTarget, recipe: Recipe = IN_USE
) -> StabilityCase:
    """The case of a table by a recipe, with another target and camera."""
    return with_target(_case_of(table.robot, table.scheme, recipe.name), table.robot, target)


@cache
def _case_of(robot: str, scheme: str, recipe: str) -> StabilityCase:
    return recipe_case(robot, scheme, RECIPES[recipe])


@cache
def _options_of(robot: str) -> VerdictOptions:
    return recipe_options(robot)


def share_of(grid: WorkspaceGrid, stable: np.ndarray) -> float:
    """Share of the cells of a grid that have all corners stable [%].

    Args:
        grid: The grid, of one orientation.
        stable: Which poses are stable, in their order.
    """
    inside = np.asarray(stable, bool).reshape(grid.shape)[0]
    return 100.0 * workspace_volume(inside, grid.axes, VolumeRule.CORNERS).share


def rows_asked(scan: str, table: PublishedTable) -> list[tuple[str, float]]:
    """Bound and value of the rows of a table that a kind of cases has, in the order of columns."""
    if scan == PAIRS:
        return list(PAIRED_ROWS)
    if table.robot == FULLY_CONSTRAINED:
        return list(ELEVENTH_ROWS)
    names = tuple(table.rows) if scan == KEPT else (CHOOSING_BOUND,)
    return [(bound, value) for bound in names for value in table.rows[bound]]


def scan_cases(form: Form) -> Iterator[Case]:
    """All cases of the scan."""
    scanned, whole = (QUICK, QUICK) if form.quick else (HALF, WHOLE)
    for name in CHOOSING_TABLES:
        for target in (IN_USE_TARGET, CHOSEN_TARGET, SEEN_TARGET):
            yield _rows_case(KEPT, name, target, whole)
        for target in seen_turned():
            yield _rows_case(SEEN, name, target, scanned)
        yield _pairs_case(name, scanned, form.quick)
    for name in CHOOSING_TABLES:
        for target in scan_targets(form.quick):
            yield _rows_case(TARGETS, name, target, scanned)
    for arrangement in ARRANGEMENTS:
        for target in eleventh_targets(form.quick):
            yield _rows_case(TARGETS, ELEVENTH, target, scanned, RECIPES[arrangement])


def scan_row(case: Case, arrays: Mapping[str, np.ndarray]) -> dict[str, Any]:
    """The row of a case.

    Returns:
        share_percent: A number a column of `stable`, in the order of `rows_asked`.
    """
    grid = scan_grid(case.keys["robot"], case.keys["grid"])
    return {"share_percent": [share_of(grid, column) for column in arrays["stable"].T]}


def _keys(scan: str, table: PublishedTable, grid: str, points: str) -> dict[str, Any]:
    # Not `table`, by which rows of recipes are found.
    return {
        "scan": scan, "of_table": table.name, "robot": table.robot, "grid": grid, "points": points,
    }  # fmt: skip


def _rows_case(
    scan: str, name: str, target: CameraTarget, grid: str, recipe: Recipe = IN_USE
) -> Case:
    table = table_named(name)
    poses = scan_grid(table.robot, grid)
    # How points are wrong is that of the recipe in use for all arrangements.
    rows = tuple(target.bounds(recipe_bounds(table, *row)) for row in rows_asked(scan, table))
    case = targeted_case(table, target, recipe)
    return Case(
        name=f"{scan} {name} {recipe.name}, {target.name}",
        keys={**_keys(scan, table, grid, recipe.name), **target.keys()},
        task=ScanTask(case, rows, poses, _options_of(table.robot)),
        items=poses.size,
    )


def _pairs_case(name: str, grid: str, quick: bool) -> Case:
    table = table_named(name)
    poses = scan_grid(table.robot, grid)
    task = PairTask(
        _case_of(table.robot, table.scheme, IN_USE.name), table.robot, paired_targets(quick),
        recipe_bounds(table, *AGAINST),
        tuple(recipe_bounds(table, *row) for row in rows_asked(PAIRS, table)), poses,
        _options_of(table.robot),
    )  # fmt: skip
    return Case(
        name=f"{PAIRS} {name}", keys=_keys(PAIRS, table, grid, IN_USE.name), task=task,
        items=poses.size,
    )  # fmt: skip

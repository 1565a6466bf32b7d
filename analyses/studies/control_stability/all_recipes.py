"""Every recipe on every printed row, and what the printed rows cannot be, whatever is chosen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

from cdpr_drake.analyses.reporting.log_files import write_json
from cdpr_drake.analyses.reporting.progress import DEFAULT_STUDY_SESSION, StudySession, WorkProgress
from cdpr_drake.analyses.reporting.provenance import code_version, package_versions
from cdpr_drake.analyses.reporting.statements import (
    Statement,
    names_of_checks,
    new_table,
    statement_table,
)
from cdpr_drake.analyses.studies.catalogue import StudyEntry
from cdpr_drake.analyses.studies.control_stability.exchanges import (
    ExchangeRow,
    exchange_rows,
    exchange_tasks,
)
from cdpr_drake.analyses.studies.control_stability.printed_limits import (
    AnyTargetTask,
    covering_pairs,
    nested_pairs,
)
from cdpr_drake.analyses.studies.control_stability.recipe_judges import (
    RECIPE_CHECKS,
    FoundRecipes,
    recipe_statements,
)
from cdpr_drake.analyses.studies.control_stability.recipes import (
    CHUNK,
    QUICK_TABLES,
    RULES,
    RecipeQuestions,
    RecipeStudy,
)
from cdpr_drake.analyses.studies.control_stability.table_reasons import LimitRow, reasons_table
from cdpr_drake.analyses.studies.published.recipe_variants import (
    FULLY_CONSTRAINED,
    OTHER_ANCHORS,
    PRESENT,
    RECIPES,
    Recipe,
    arranged_anchors,
)
from cdpr_drake.analyses.studies.published.stability_recipe import (
    recipe_bounds,
    recipe_case,
    recipe_grid,
    recipe_options,
)
from cdpr_drake.analyses.studies.published.stability_tables import TABLES, PublishedTable
from cdpr_drake.analyses.sweeps.sweep import run_study_sweep
from cdpr_drake.analyses.sweeps.workers import SweepTask
from cdpr_drake.analyses.visualization.figure_files import DEFAULT_FORMATS
from cdpr_drake.analyses.workspaces.pose_grid import plain
from cdpr_drake.analyses.workspaces.stability_tasks import SampledTask
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid
from cdpr_drake.workspaces.volume import cell_hull_share, workspace_volume

POINT_BOUNDS = ("r_A", "r_B")
"""Bounds whose rows are held against what any target leaves."""


@dataclass(frozen=True, eq=False)
class RecipesStudy:
    """What every recipe gives.

    Attributes:
        quick: Whether it was the quick form, on coarse grids.
        asked: Tables that were to be computed.
        recipes: By name, with the rows that are finished.
        limits: What any target leaves, of the rows that vary points.
        arrangements: Share at the baseline of A.11 by arrangement of anchor points [%].
        exchanges: What single exchanges of two cables leave.
        progress: Where it stood at the end.
    """

    quick: bool
    asked: tuple[PublishedTable, ...]
    recipes: dict[str, RecipeStudy]
    limits: tuple[LimitRow, ...]
    arrangements: dict[str, float]
    exchanges: tuple[ExchangeRow, ...]
    progress: WorkProgress

    @property
    def interrupted(self) -> bool:
        """Whether it was stopped before the end."""
        return self.progress.done < self.progress.total

    @property
    def statements(self) -> list[Statement]:
        """What is judged; of the quick form names only, but for what needs no grid."""
        if self.quick and self.interrupted:
            return []
        return recipe_statements(self._found(), self.quick)

    def _found(self) -> FoundRecipes:
        return FoundRecipes(
            self.recipes, self.limits, self.arrangements, self.exchanges, self.quick
        )

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON: recipes, rows, limits, statements."""
        return {
            "study": "stability-recipes",
            "quick": self.quick,
            "interrupted": self.interrupted,
            "wall_time_s": self.progress.wall_time,
            "versions": package_versions(),
            "recipes": {
                name: {
                    **_recipe_as_dict(one.recipe),
                    "mean_absolute_difference_points": one.as_dict()[
                        "mean_absolute_difference_points"
                    ],
                    "rows": [asdict(row) for row in one.rows],
                }
                for name, one in self.recipes.items()
            },
            "any_target": [asdict(row) for row in self.limits],
            "nested_rows": [
                {**asdict(pair), "contradictory": pair.contradictory}
                for table in TABLES
                for pair in nested_pairs(table)
            ],
            "covering_rows": [
                {**asdict(pair), "less": pair.less}
                for table in TABLES
                for pair in covering_pairs(table)
            ],
            "reasons": [
                {**asdict(reason), "explained": reason.explained}
                for reason in self._found().reasons()
            ],
            "anchor_arrangements": self.arrangements,
            "exchanges": [asdict(row) for row in self.exchanges],
            "statements": [statement.as_dict() for statement in self.statements],
        }

    def tables(self) -> list[Table]:
        """Means by recipe and table, over all rows, and apart for those in sight and others."""
        tables = [
            _means(self, words, fitted)
            for words, fitted in (
                ("all rows", None),
                ("rows in sight when the study's recipe was chosen", True),
                ("rows that were not", False),
            )
        ]
        tables.append(_limits_table(self.limits, self.quick))
        tables.append(_pairs_table())
        tables.append(reasons_table(self._found().reasons(), self.quick))
        if self.statements:
            tables.append(statement_table("What follows for the printed tables", self.statements))
        return tables

    def write(self, folder: Path, formats: Sequence[str] = DEFAULT_FORMATS) -> None:
        """Writes `results.json`; there are no figures."""
        write_json(folder / "results.json", self.as_dict())


def study_recipes(
    quick: bool = False, session: StudySession = DEFAULT_STUDY_SESSION
) -> RecipesStudy:
    """Evaluates all recipes on all rows, and what any target leaves.

    Args:
        quick: A.11 on a coarse grid.
        session: How it is run.

    Raises:
        OutputFolderError: The folder belongs to other arguments, or cannot be written.
        SweepError: A local process died.
    """
    asked = tuple(table for table in TABLES if not quick or table.name in QUICK_TABLES)
    questions = RecipeQuestions()
    for recipe in RECIPES.values():
        for table in asked:
            questions.add(recipe, table, quick)
    limits = _limit_tasks(asked, quick)
    arranged = _arrangement_tasks(quick)
    exchanged = exchange_tasks(quick)
    tasks: dict[str, tuple[SweepTask, int]] = {
        **questions.tasks,
        **{name: (task, task.grid.size) for name, task in limits.items()},
        **{name: (task, task.grid.size) for name, task in arranged.items()},
        **{name: (task, task.grid.size) for name, (*_, task) in exchanged.items()},
    }
    arguments = {
        "cdpr_drake": code_version(),
        "study": "stability-recipes",
        "quick": quick,
        "recipes": {name: _recipe_as_dict(recipe) for name, recipe in RECIPES.items()},
        "bounds": {name: plain(task.bounds) for name, (task, _) in questions.tasks.items()},
        "any_target": {name: plain(task.bounds) for name, task in limits.items()},
    }
    result = run_study_sweep(tasks, CHUNK, "poses", arguments, session)
    recipes = {
        name: RecipeStudy(
            recipe, quick, asked, questions.rows(recipe, result.finished), result.progress
        )
        for name, recipe in RECIPES.items()
    }
    left = {name: _largest_share(task.grid, result.finished[name]["stable"])
            for name, task in limits.items() if name in result.finished}  # fmt: skip
    rows = tuple(
        LimitRow(table.name, bound, value, table.rows[bound][value], left[name], arrangement)
        for table in asked
        for bound in POINT_BOUNDS
        for value in table.rows[bound]
        for arrangement in _arrangements(table)
        if (name := _limit_name(table.robot, arrangement, bound, value)) in left
    )
    shares = {
        name.removeprefix("anchors "): _share(task.grid, result.finished[name]["stable"], "corners")
        for name, task in arranged.items()
        if name in result.finished
    }
    return RecipesStudy(
        quick, asked, recipes, rows, shares, exchange_rows(exchanged, result.finished),
        result.progress,
    )  # fmt: skip


ENTRY = StudyEntry(study_recipes, continues=True, judges=names_of_checks(RECIPE_CHECKS))


def _recipe_as_dict(recipe: Recipe) -> dict[str, Any]:
    return {**asdict(recipe), "points": dict(recipe.points)}


def _arrangements(table: PublishedTable) -> tuple[str, ...]:
    """Names of recipes whose anchor points are tried for a table."""
    if table.robot == FULLY_CONSTRAINED:
        return ("present", *OTHER_ANCHORS)
    return ("present",)


def _limit_name(robot: str, arrangement: str, bound: str, value: float) -> str:
    return f"any target {robot} {arrangement} {bound}={value:g}"


def _limit_tasks(asked: Sequence[PublishedTable], quick: bool) -> dict[str, AnyTargetTask]:
    """What any target leaves, by robot: it is the same for every scheme."""
    tasks: dict[str, AnyTargetTask] = {}
    for table in asked:
        if table.scheme == "pbvs" and table.robot == "planar":
            continue
        grid = recipe_grid(table.robot, quick)
        for arrangement in _arrangements(table):
            cables = RECIPES[arrangement].cables(table.robot)
            for bound in POINT_BOUNDS:
                for value in table.rows[bound]:
                    bounds = recipe_bounds(table, bound, value)
                    name = _limit_name(table.robot, arrangement, bound, value)
                    tasks.setdefault(name, AnyTargetTask(cables, bounds, grid))
    return tasks


def _arrangement_tasks(quick: bool) -> dict[str, SampledTask]:
    """The baseline of A.11 with every arrangement of anchor points."""
    table = next(table for table in TABLES if table.robot == FULLY_CONSTRAINED)
    case = recipe_case(table.robot, table.scheme, PRESENT)
    bounds = recipe_bounds(table, "r_bp", 0.03)
    grid, options = recipe_grid(table.robot, quick), recipe_options(table.robot)
    signs = {"as its exit point": (False, False), "other x": (True, False),
             "other y": (False, True), "opposite": (True, True)}  # fmt: skip
    tasks: dict[str, SampledTask] = {}
    for above, flips in signs.items():
        for below, others in signs.items():
            for crossed in (False, True):
                cables = arranged_anchors(case.cables, flips, others, crossed)
                name = f"anchors {'lower' if crossed else 'upper'}, {above}; {below}"
                tasks[name] = SampledTask(replace(case, cables=cables), bounds, grid, options)
    return tasks


def _share(grid: WorkspaceGrid, stable: np.ndarray, rule: str) -> float:
    inside = np.asarray(stable, bool).reshape(grid.shape)[0]
    return 100.0 * workspace_volume(inside, grid.axes, rule).share


def _largest_share(grid: WorkspaceGrid, stable: np.ndarray) -> float:
    """The largest of the shares by all rules of the volume [%]."""
    inside = np.asarray(stable, bool).reshape(grid.shape)[0]
    used = inside.reshape([n for n in inside.shape if n > 1])
    return max(100.0 * cell_hull_share(used), *(_share(grid, stable, rule) for rule in RULES[::2]))


def _means(study: RecipesStudy, words: str, fitted: bool | None) -> Table:
    names = [table.name for table in study.asked]
    table = new_table(
        f"Mean absolute difference to the printed shares [points], {words}",
        ("recipe",), (*names, "all"),
    )  # fmt: skip
    sight = "; ".join(
        f"{name}: {one.recipe.sight}" for name, one in study.recipes.items() if one.recipe.sight
    )
    table.caption = f"Chosen with more rows in sight: {sight or 'none'}."
    if study.quick:
        table.caption += " Coarse grid: the differences mean little."
    for name, one in study.recipes.items():
        means = [one.difference(RULES[0], asked, fitted) for asked in (*names, None)]
        table.add_row(name, *("" if np.isnan(mean) else f"{mean:.1f}" for mean in means))
    some = next(iter(study.recipes.values())).rows
    counts = [
        sum(fitted in (None, row.fitted) and asked in (None, row.table) for row in some)
        for asked in (*names, None)
    ]
    table.add_row("rows", *map(str, counts))
    return table


def _limits_table(limits: Sequence[LimitRow], quick: bool) -> Table:
    table = new_table(
        "Rows that print more than any target, view or camera leaves where each point is wrong "
        "within its own sphere; share of the full workspace in per cent",
        ("table", "anchors", "row"), ("printed", "at most"),
    )  # fmt: skip
    table.caption = "At most: the largest by all rules of the volume."
    if quick:
        table.caption += " Coarse grid."
    for row in limits:
        if row.excluded:
            table.add_row(
                row.table, row.arrangement, f"{row.bound} = {row.value:g} m",
                f"{row.printed:.1f}", f"{row.at_most:.1f}",
            )  # fmt: skip
    return table


def _pairs_table() -> Table:
    table = new_table(
        "Printed rows of exit points beside rows of the platform's place, share in per cent",
        ("table", "row", "beside", "what it says"), ("printed", "beside it"),
    )  # fmt: skip
    table.caption = "From the printed numbers alone."
    for asked in TABLES:
        told = [(pair, "contradiction: leaves more") for pair in nested_pairs(asked)
                if pair.contradictory]  # fmt: skip
        told += [(pair, "not a common shift") for pair in covering_pairs(asked) if pair.less]
        for pair, words in told:
            table.add_row(
                pair.table, f"r_A = {pair.r_A:g} m", f"r_bp = {pair.r_bp:g} m", words,
                f"{pair.first:.1f}", f"{pair.second:.1f}",
            )  # fmt: skip
    return table

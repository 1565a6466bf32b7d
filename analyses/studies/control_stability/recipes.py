"""One variant of the recipe on every row of every table, by the thesis' own verdict: samples.

Volumes are counted by three rules, so that a rule costs no second run.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

from cdpr_drake.analyses.reporting.log_files import write_json
from cdpr_drake.analyses.reporting.progress import DEFAULT_STUDY_SESSION, StudySession, WorkProgress
from cdpr_drake.analyses.reporting.provenance import code_version, package_versions
from cdpr_drake.analyses.reporting.statements import new_table
from cdpr_drake.analyses.studies.published.recipe_choices import chosen_on
from cdpr_drake.analyses.studies.published.recipe_variants import IN_USE, RECIPES, Recipe
from cdpr_drake.analyses.studies.published.stability_recipe import (
    recipe_bounds,
    recipe_case,
    recipe_grid,
    recipe_options,
)
from cdpr_drake.analyses.studies.published.stability_tables import TABLES, PublishedTable
from cdpr_drake.analyses.sweeps.sweep import run_study_sweep
from cdpr_drake.analyses.visualization.figure_files import DEFAULT_FORMATS
from cdpr_drake.analyses.workspaces.pose_grid import plain
from cdpr_drake.analyses.workspaces.stability_tasks import SampledTask
from cdpr_drake.stability.perturbation_bounds import PerturbationBounds
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid
from cdpr_drake.workspaces.volume import cell_hull_share, workspace_volume

CHUNK = 2000
"""Poses per chunk, about a second's work."""

QUICK_TABLES = ("A.11",)
"""Tables of the quick form, on coarse grids."""

CELL_HULLS = "cell hulls"
RULES = ("corners", CELL_HULLS, "points")
"""Rules of volumes; the first is that of the study."""


@dataclass(frozen=True)
class RecipeRow:
    """One printed row, and what a recipe gives for it.

    Attributes:
        table: Name of the table.
        bound: Name of the bound, angles with _deg.
        value: Its value [m, deg].
        published: Published share [%].
        fitted: Whether the study's recipe was chosen with this row in sight.
        shares: Ours by rule of the volume [%].
    """

    table: str
    bound: str
    value: float
    published: float
    fitted: bool
    shares: dict[str, float]


@dataclass(frozen=True, eq=False)
class RecipeStudy:
    """What a recipe gives.

    Attributes:
        recipe: The recipe.
        quick: Whether it was the quick form, on coarse grids.
        asked: Tables that were to be computed.
        rows: Rows that are finished.
        progress: Where it stood at the end.
    """

    recipe: Recipe
    quick: bool
    asked: tuple[PublishedTable, ...]
    rows: tuple[RecipeRow, ...]
    progress: WorkProgress

    @property
    def interrupted(self) -> bool:
        """Whether it was stopped before the end."""
        return self.progress.done < self.progress.total

    def difference(self, rule: str, table: str | None = None, fitted: bool | None = None) -> float:
        """Mean absolute difference of shares in points; NaN where there are no such rows.

        Args:
            rule: Of the volume.
            table: Rows of one table, or of all.
            fitted: Rows that were in sight, or the others, or both.
        """
        some = [
            abs(row.shares[rule] - row.published)
            for row in self.rows
            if table in (None, row.table) and fitted in (None, row.fitted)
        ]
        return float(np.mean(some)) if some else float("nan")

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON: recipe, versions, means, rows."""
        names = [table.name for table in self.asked]
        return {
            "study": "control-stability",
            "recipe": {**asdict(self.recipe), "points": dict(self.recipe.points)},
            "quick": self.quick,
            "interrupted": self.interrupted,
            "wall_time_s": self.progress.wall_time,
            "versions": package_versions(),
            "mean_absolute_difference_points": {
                rule: {
                    name: _number(self.difference(rule, name))
                    for name in names
                    if any(row.table == name for row in self.rows)
                }
                for rule in RULES
            },
            "rows": [asdict(row) for row in self.rows],
        }

    def tables(self) -> list[Table]:
        """Means by table and rule, over all rows, those in sight and the others."""
        table = new_table(
            f"Recipe {self.recipe.name}: mean absolute difference to the printed shares [points]",
            ("table",), ("rows", *RULES, "corners, in sight", "corners, others"),
        )  # fmt: skip
        table.caption = self.recipe.words
        if self.quick:
            table.caption += ". Coarse grid: the differences mean little."
        for one in self.asked:
            count = sum(row.table == one.name for row in self.rows)
            if not count:
                continue
            means = [self.difference(rule, one.name) for rule in RULES]
            means += [self.difference(RULES[0], one.name, fitted) for fitted in (True, False)]
            cells = ["" if np.isnan(mean) else f"{mean:.1f}" for mean in means]
            table.add_row(one.title, f"{count} of {one.size}", *cells)
        return [table]

    def write(self, folder: Path, formats: Sequence[str] = DEFAULT_FORMATS) -> None:
        """Writes `results.json`; there are no figures."""
        write_json(folder / "results.json", self.as_dict())


def study_recipe(
    quick: bool = False, session: StudySession = DEFAULT_STUDY_SESSION, recipe: str = IN_USE.name
) -> RecipeStudy:
    """Evaluates a recipe on every row; each is a task of a sweep.

    Args:
        quick: A.11 on a coarse grid.
        session: How it is run.
        recipe: Its name.

    Raises:
        OutputFolderError: The folder belongs to other arguments, or cannot be written.
        SweepError: A local process died.
    """
    chosen = RECIPES[recipe]
    asked = tuple(table for table in TABLES if not quick or table.name in QUICK_TABLES)
    questions = RecipeQuestions()
    for table in asked:
        questions.add(chosen, table, quick)
    tasks = questions.tasks
    arguments = {
        "cdpr_drake": code_version(),
        "study": "control-stability, recipe",
        "recipe": chosen.name,
        "quick": quick,
        "bounds": {name: plain(task.bounds) for name, (task, _) in tasks.items()},
    }
    result = run_study_sweep(tasks, CHUNK, "poses", arguments, session)
    rows = questions.rows(chosen, result.finished)
    return RecipeStudy(chosen, quick, asked, rows, result.progress)


class RecipeQuestions:
    """Rows of recipes as tasks of a sweep; what several ask alike is computed once.

    Attributes:
        tasks: Sweep tasks and their numbers of poses, by name.
    """

    def __init__(self) -> None:
        """None yet."""
        self.tasks: dict[str, tuple[SampledTask, int]] = {}
        self._asked: dict[str, list[tuple[PublishedTable, str, float, str]]] = {}
        self._alike: dict[tuple[str, PerturbationBounds, str], str] = {}

    def add(self, recipe: Recipe, table: PublishedTable, quick: bool) -> None:
        """Asks for all rows of a table by a recipe."""
        grid = recipe_grid(table.robot, quick)
        case = recipe_case(table.robot, table.scheme, recipe)
        options = recipe_options(table.robot)
        about = json.dumps(plain(case), sort_keys=True)
        asked = self._asked.setdefault(recipe.name, [])
        for bound, values in table.rows.items():
            for value in values:
                bounds = recipe_bounds(table, bound, value, recipe)
                # Every bound's row at the baseline asks the same, and so do recipes that differ
                # elsewhere.
                key = (table.robot, bounds, about)
                name = self._alike.setdefault(key, f"{recipe.name} {table.name} {bound}={value:g}")
                asked.append((table, bound, value, name))
                self.tasks.setdefault(name, (SampledTask(case, bounds, grid, options), grid.size))

    def rows(
        self, recipe: Recipe, finished: Mapping[str, Mapping[str, np.ndarray]]
    ) -> tuple[RecipeRow, ...]:
        """The rows of a recipe that are finished."""
        return tuple(
            _row(table, bound, value, self.tasks[name][0].grid, finished[name]["stable"])
            for table, bound, value, name in self._asked.get(recipe.name, ())
            if name in finished
        )


def _row(
    table: PublishedTable, bound: str, value: float, grid: WorkspaceGrid, stable: np.ndarray
) -> RecipeRow:
    inside = np.asarray(stable, bool).reshape(grid.shape)[0]
    volumes = {
        rule: workspace_volume(inside, grid.axes, rule) for rule in RULES if rule != CELL_HULLS
    }
    box = next(iter(volumes.values())).full
    used = inside.reshape([n for n in inside.shape if n > 1])
    sizes = {rule: volume.value for rule, volume in volumes.items()}
    sizes[CELL_HULLS] = cell_hull_share(used) * box
    return RecipeRow(
        table.name, bound, value, table.rows[bound][value], chosen_on(table.name, bound, value),
        {rule: 100.0 * sizes[rule] / table.full for rule in RULES},
    )  # fmt: skip


def _number(value: float) -> float | None:
    return None if np.isnan(value) else value

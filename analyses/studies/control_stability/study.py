"""Study: the servoing thesis' control stability workspaces, by samples, by search, and by proof."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.table import Table

from cdpr_drake.analyses.reporting.progress import (
    DEFAULT_STUDY_SESSION,
    StoppableStudy,
    StudySession,
    WorkProgress,
)
from cdpr_drake.analyses.reporting.provenance import code_version, package_versions
from cdpr_drake.analyses.reporting.statements import Statement, statement_table
from cdpr_drake.analyses.studies.control_stability.figures import control_stability_drawings
from cdpr_drake.analyses.studies.control_stability.statements import control_stability_statements
from cdpr_drake.analyses.studies.control_stability.tables import (
    StabilityRow,
    control_stability_tables,
    rows_of,
)
from cdpr_drake.analyses.studies.framework.seeded_study import DrawnStudy
from cdpr_drake.analyses.studies.published.recipe_choices import CHOICES
from cdpr_drake.analyses.studies.published.stability_recipe import (
    RECIPE,
    recipe_bounds,
    recipe_case,
    recipe_grid,
    recipe_options,
    single_bounds,
)
from cdpr_drake.analyses.studies.published.stability_tables import (
    BASELINE_VALUES,
    TABLES,
    PublishedTable,
)
from cdpr_drake.analyses.sweeps.sweep import run_study_sweep
from cdpr_drake.analyses.workspaces.pose_grid import plain
from cdpr_drake.analyses.workspaces.stability_tasks import VerdictsTask
from cdpr_drake.stability.perturbation_bounds import PerturbationBounds
from cdpr_drake.stability.verdict import VERDICTS
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid
from cdpr_drake.workspaces.volume import VolumeRule, workspace_volume

CHUNK = 500
"""Poses per chunk, a second's work or less, a few in rows of coverage."""

SHARE = "share"
"""Stands for the name of a bound in rows of coverage."""

COVERAGE_SHARES = (0.25, 1.0)
"""Parts of the baseline bounds at which certified poses are counted against searched ones."""

ROW_PIECES, COVERAGE_PIECES, QUICK_PIECES = 1, 600, 20
"""Pieces of a certificate at most, in rows of the tables and in rows of coverage, full and quick:
cutting the perturbations where the whole proves nothing would take hours in rows of large bounds.
"""

QUICK_TABLES = ("A.8", "A.10", "A.17")
"""Tables of the quick form."""


@dataclass(frozen=True, eq=False)
class ControlStabilityStudy(DrawnStudy, StoppableStudy):
    """What the study found.

    Attributes:
        tables_asked: Tables that were to be repeated.
        rows: Rows that were finished.
        quick: Whether it was the quick form, on coarse grids.
        progress: Where it stood at the end, and what earlier sessions had left of it.
    """

    tables_asked: tuple[PublishedTable, ...]
    rows: tuple[StabilityRow, ...]
    quick: bool
    progress: WorkProgress

    @property
    def statements(self) -> list[Statement]:
        """What the thesis states of its tables, judged; of the quick form names only."""
        if self.quick and self.interrupted:
            return []
        return control_stability_statements(self.rows, self.quick)

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON: parameters, versions, rows, statements."""
        return {
            "study": "control-stability",
            "quick": self.quick,
            "interrupted": self.interrupted,
            "poses": self.progress.counts("judged"),
            "wall_time_s": self.progress.wall_time,
            "parameters": {
                "recipe": RECIPE,
                "choices": [asdict(choice) for choice in CHOICES],
                "baseline": BASELINE_VALUES,
                "options": {
                    table.name: asdict(recipe_options(table.robot)) for table in self.tables_asked
                },
                "pieces_in_rows_with_published_values": ROW_PIECES,
                "pieces_in_rows_of_coverage": QUICK_PIECES if self.quick else COVERAGE_PIECES,
            },
            "printed_rows": {
                table.name: {"repeated": len(rows_of(table, self.rows)), "of": table.size}
                for table in self.tables_asked
            },
            "versions": package_versions(),
            "rows": [asdict(row) for row in self.rows],
            "statements": [statement.as_dict() for statement in self.statements],
        }

    def tables(self) -> list[Table]:
        """Tables for the terminal."""
        tables = control_stability_tables(self.tables_asked, self.rows, self.quick)
        if self.statements:
            tables.append(statement_table("What the servoing thesis states", self.statements))
        return tables

    def drawings(self) -> Mapping[str, Callable[[], Figure]]:
        """A figure for each table of which there are rows."""
        return control_stability_drawings(self.tables_asked, self.rows)


@dataclass(frozen=True)
class _Job:
    """One row that is to be computed."""

    table: PublishedTable
    bound: str
    value: float
    bounds: PerturbationBounds

    @property
    def name(self) -> str:
        return f"{self.table.name} {self.label}"

    @property
    def label(self) -> str:
        return f"{self.bound}={self.value:g}"


def study_control_stability(
    quick: bool = False,
    session: StudySession = DEFAULT_STUDY_SESSION,
) -> ControlStabilityStudy:
    """Repeats the tables; each row is a task of a sweep.

    Args:
        quick: Three tables, few rows, coarse grids, to see that everything works; without, all
            468 printed rows.
        session: How it is run.

    Raises:
        OutputFolderError: The folder belongs to other arguments, or cannot be written.
        SweepError: A local process died.

    Source: servoing thesis 3.3 and A.5.
    """
    asked = tuple(table for table in TABLES if not quick or table.name in QUICK_TABLES)
    grids = {table.name: recipe_grid(table.robot, quick) for table in asked}
    jobs = [job for table in asked for job in _jobs(table, quick)]
    cases = {table.name: recipe_case(table.robot, table.scheme) for table in asked}
    tasks: dict[str, tuple[VerdictsTask, int]] = {}
    task_of: dict[str, str] = {}
    coverage_pieces = QUICK_PIECES if quick else COVERAGE_PIECES
    alike: dict[tuple[str, PerturbationBounds, int], str] = {}
    for job in jobs:
        grid = grids[job.table.name]
        pieces = coverage_pieces if job.bound == SHARE else ROW_PIECES
        options = recipe_options(job.table.robot, pieces)
        # Every bound's row at the baseline asks the same; it is computed once.
        name = alike.setdefault((job.table.name, job.bounds, options.pieces), job.name)
        task_of[job.name] = name
        if name == job.name:
            task = VerdictsTask(cases[job.table.name], job.bounds, grid, options)
            tasks[name] = (task, grid.size)
    different = [job for job in jobs if job.name in tasks]
    result = run_study_sweep(tasks, CHUNK, "poses", _arguments(different, tasks, quick), session)
    rows = [
        _row(job, grids[job.table.name], result.finished[task_of[job.name]])
        for job in jobs
        if task_of[job.name] in result.finished
    ]
    return ControlStabilityStudy(asked, tuple(rows), quick, result.progress)


def _jobs(table: PublishedTable, quick: bool) -> Iterator[_Job]:
    """The rows of a table; the baseline comes once."""
    some = next(iter(table.rows))
    baseline = recipe_bounds(table, some, BASELINE_VALUES[some])
    baseline = single_bounds(baseline.varied(exits="common", anchors="common"), "r_bp", 0.03)
    for share in COVERAGE_SHARES:
        yield _Job(table, SHARE, share, baseline.scaled(share))
    for name, row in table.rows.items():
        values = list(row)
        for value in values[1:-1:2] if quick else values:
            yield _Job(table, name, value, recipe_bounds(table, name, value))


def _arguments(
    jobs: list[_Job], tasks: Mapping[str, tuple[VerdictsTask, int]], quick: bool
) -> dict[str, Any]:
    """All that the numbers depend on, for JSON."""
    tables: dict[str, Any] = {}
    for job in jobs:
        task, _ = tasks[job.name]
        table = tables.setdefault(
            job.table.name,
            {
                "case": plain(task.case),
                "grid": _grid_arguments(task.grid),
                "options": plain(task.options),
                "bounds": {},
            },
        )
        table["bounds"][job.label] = {**job.bounds.as_dict(), "pieces": task.options.pieces}
    return {
        "cdpr_drake": code_version(),
        "study": "control-stability",
        "quick": quick,
        "tables": tables,
    }


def _grid_arguments(grid: WorkspaceGrid) -> dict[str, Any]:
    """A grid for JSON: box, numbers of points, orientations."""
    return {
        "lower_m": plain(grid.lower),
        "upper_m": plain(grid.upper),
        "points": list(grid.shape[1:]),
        "angles_rad": plain(grid.angles),
    }


def _row(job: _Job, grid: WorkspaceGrid, stable: Mapping[str, np.ndarray]) -> StabilityRow:
    table = job.table
    sampled, searched, certified = (stable[verdict] for verdict in VERDICTS)
    return StabilityRow(
        table=table.name,
        bound=job.bound,
        value=job.value,
        published=None if job.bound == SHARE else table.rows[job.bound][job.value],
        shares={
            verdict: 100.0
            * workspace_volume(inside.reshape(grid.shape)[0], grid.axes, VolumeRule.CORNERS).value
            / table.full
            for verdict, inside in stable.items()
        },
        poses={verdict: int(np.sum(inside)) for verdict, inside in stable.items()},
        grid=grid.size,
        ordered=bool(np.all(certified <= searched) and np.all(searched <= sampled)),
    )

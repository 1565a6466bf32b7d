"""Study: the servoing thesis' control stability workspaces, by samples, by search, and by proof."""

from __future__ import annotations

import json
import platform
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

from cdpr_drake.analyses import stability_recipe
from cdpr_drake.analyses.published_stability import BASELINE_VALUES, TABLES, PublishedTable
from cdpr_drake.analyses.stability_recipe import (
    DRAWS,
    recipe_bounds,
    recipe_case,
    recipe_grid,
    single_bounds,
)
from cdpr_drake.analyses.study_control_stability_figures import write_control_stability_figures
from cdpr_drake.analyses.study_control_stability_tables import control_stability_tables
from cdpr_drake.analyses.study_progress import StudyProgress
from cdpr_drake.perturbation_bounds import PerturbationBounds
from cdpr_drake.stability_verdict import VERDICTS, VerdictOptions, judge_all
from cdpr_drake.workspace_grid import WorkspaceGrid
from cdpr_drake.workspace_volume import VolumeRule, workspace_volume

RESULTS = "results.json"
"""Numbers and parameters of the study, rewritten after every row."""

CHUNK = 1500
"""Poses between two looks at whether to stop."""

COVERAGE_SHARES = (0.25, 1.0)
"""Parts of the baseline bounds at which certified poses are counted against searched ones."""

QUICK_TABLES = ("A.8", "A.10", "A.17")
"""Tables of the quick form."""


@dataclass(frozen=True)
class StabilityRow:
    """One row of a table.

    Attributes:
        table: Name of the table.
        bound: Name of the bound that the row sets, angles with _deg; of a row of coverage "share".
        value: Its value [m, deg], or the part of the baseline bounds.
        published: Published share of the full workspace [%]; None for a row of coverage.
        shares: Share of the full workspace by verdict, cells with all corners stable [%].
        poses: Stable poses of the grid by verdict.
        grid: Poses of the grid.
        ordered: Whether at every pose certified implies searched and searched implies sampled.
    """

    table: str
    bound: str
    value: float
    published: float | None
    shares: dict[str, float]
    poses: dict[str, int]
    grid: int
    ordered: bool


@dataclass(frozen=True, eq=False)
class ControlStabilityStudy:
    """What the study found.

    Attributes:
        tables_asked: Tables that were to be repeated.
        rows: Rows that were finished.
        quick: Whether it was the quick form, on coarse grids.
        interrupted: Whether it was stopped before the end.
        wall_time: Time it took [s].
    """

    tables_asked: tuple[PublishedTable, ...]
    rows: tuple[StabilityRow, ...]
    quick: bool
    interrupted: bool
    wall_time: float

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON: parameters, versions, rows."""
        return {
            "study": "control-stability",
            "quick": self.quick,
            "interrupted": self.interrupted,
            "wall_time_s": self.wall_time,
            "parameters": {
                "draws": DRAWS,
                "seed": 0,
                "recipe": stability_recipe.__doc__,
                "baseline": BASELINE_VALUES,
                "options": asdict(_options()),
            },
            "versions": {
                "python": platform.python_version(),
                **{name: version(name) for name in ("cdpr_drake", "drake", "numpy", "numba")},
            },
            "rows": [asdict(row) for row in self.rows],
        }

    def tables(self) -> list[Table]:
        """Tables for the terminal."""
        return control_stability_tables(self.tables_asked, self.rows, self.quick)

    def write(self, folder: Path) -> None:
        """Writes `results.json` and the figures into a folder that exists."""
        _write(folder, self)
        write_control_stability_figures(folder, self.tables_asked, self.rows)


def study_control_stability(
    quick: bool = False,
    folder: Path | None = None,
    on_progress: Callable[[StudyProgress], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> ControlStabilityStudy:
    """Repeats the tables.

    Args:
        quick: Three tables, few rows, coarse grids, to see that everything works.
        folder: Where to keep `results.json` up to date while it runs; None: nowhere.
        on_progress: Called often.
        should_stop: Asked as often; what was finished is kept.

    Source: servoing thesis 3.3 and A.5.
    """
    asked = tuple(table for table in TABLES if not quick or table.name in QUICK_TABLES)
    began = time.perf_counter()
    rows: list[StabilityRow] = []
    grids = {table.name: recipe_grid(table.robot, quick) for table in asked}
    jobs = [(table, *job) for table in asked for job in _jobs(table, quick)]
    total = sum(grids[table.name].size for table, *_ in jobs)
    done = 0

    def study(interrupted: bool) -> ControlStabilityStudy:
        return ControlStabilityStudy(
            asked, tuple(rows), quick, interrupted, time.perf_counter() - began
        )

    for table, bound, value, bounds in jobs:
        grid = grids[table.name]
        stable = []
        for chunk in _chunks(table, bounds, grid):
            stable.append(chunk)
            done += chunk.shape[1]
            if on_progress is not None:
                words = f"{table.name} {bound} = {value:g}"
                wall = time.perf_counter() - began
                on_progress(StudyProgress(words, done, total, wall, "poses/s"))
            if should_stop is not None and should_stop():
                return study(interrupted=True)
        rows.append(_row(table, bound, value, grid, np.concatenate(stable, axis=1)))
        if folder is not None:
            _write(folder, study(interrupted=True))
    return study(interrupted=False)


def _jobs(table: PublishedTable, quick: bool) -> Iterator[tuple[str, float, PerturbationBounds]]:
    """Name of the bound, value and bounds of every row of a table; the baseline comes once."""
    some = next(iter(table.rows))
    baseline = recipe_bounds(table, some, BASELINE_VALUES[some])
    baseline = single_bounds(baseline.varied(exits="common", anchors="common"), "r_bp", 0.03)
    for share in COVERAGE_SHARES:
        yield "share", share, baseline.scaled(share)
    for name, row in table.rows.items():
        values = list(row)
        for value in values[1:-1:2] if quick else values:
            yield name, value, recipe_bounds(table, name, value)


def _options() -> VerdictOptions:
    return VerdictOptions(draws=DRAWS, margins=False)


def _chunks(
    table: PublishedTable, bounds: PerturbationBounds, grid: WorkspaceGrid
) -> Iterator[np.ndarray]:
    """Which poses are stable by each verdict, shape (3, n), chunk by chunk."""
    case = recipe_case(table.robot, table.scheme)
    for start in range(0, grid.size, CHUNK):
        poses = grid.pose_rows(start, min(start + CHUNK, grid.size))
        found = judge_all(case, bounds, poses, _options())
        yield np.array([found[verdict].stable for verdict in VERDICTS])


def _row(
    table: PublishedTable, bound: str, value: float, grid: WorkspaceGrid, stable: np.ndarray
) -> StabilityRow:
    by_verdict = dict(zip(VERDICTS, stable, strict=True))
    sampled, searched, certified = stable
    return StabilityRow(
        table.name,
        bound,
        value,
        None if bound == "share" else table.rows[bound][value],
        {
            verdict: 100.0
            * workspace_volume(inside.reshape(grid.shape)[0], grid.axes, VolumeRule.CORNERS).value
            / table.full
            for verdict, inside in by_verdict.items()
        },
        {verdict: int(np.sum(inside)) for verdict, inside in by_verdict.items()},
        grid.size,
        bool(np.all(certified <= searched) and np.all(searched <= sampled)),
    )


def _write(folder: Path, study: ControlStabilityStudy) -> None:
    (folder / RESULTS).write_text(
        json.dumps(study.as_dict(), indent=2, allow_nan=False) + "\n", encoding="utf-8"
    )

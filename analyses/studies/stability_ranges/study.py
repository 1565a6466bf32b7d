"""Study: how large errors may be before a servo's stability is lost."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from matplotlib.figure import Figure
from rich.table import Table

from cdpr_drake.analyses.reporting.progress import (
    DEFAULT_STUDY_SESSION,
    StoppableStudy,
    StudySession,
    WorkProgress,
)
from cdpr_drake.analyses.reporting.provenance import code_version, package_versions
from cdpr_drake.analyses.reporting.statements import Statement, evaluate_checks
from cdpr_drake.analyses.studies.framework.seeded_study import DrawnStudy
from cdpr_drake.analyses.studies.published.stability_recipe import DRAWS
from cdpr_drake.analyses.studies.stability_ranges import (
    planar_statements,
    robot_limits,
    robots,
    single_errors,
    single_statements,
    spatial_statements,
)
from cdpr_drake.analyses.studies.stability_ranges.answers import FoundRows
from cdpr_drake.analyses.studies.stability_ranges.figures import range_drawings
from cdpr_drake.analyses.studies.stability_ranges.item import RangeItem, RangeRow
from cdpr_drake.analyses.studies.stability_ranges.tables import range_tables
from cdpr_drake.analyses.studies.stability_ranges.vision import vision_items
from cdpr_drake.analyses.sweeps.sweep import run_study_sweep


@dataclass(frozen=True, eq=False)
class StabilityRangesStudy(DrawnStudy, StoppableStudy):
    """What the study found.

    Attributes:
        rows: Questions that were answered.
        quick: Whether it was the quick form, of fewer and coarser questions.
        progress: Where it stood at the end, and what earlier sessions had left of it.
    """

    rows: tuple[RangeRow, ...]
    quick: bool
    progress: WorkProgress

    @property
    def statements(self) -> list[Statement]:
        """What the servoing thesis states, judged."""
        return range_statements(self.rows, self.quick and not self.interrupted)

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON."""
        return {
            "study": "stability-ranges",
            "quick": self.quick,
            "interrupted": self.interrupted,
            "questions": self.progress.counts("answered"),
            "wall_time_s": self.progress.wall_time,
            "parameters": _parameters(),
            "versions": package_versions(),
            "rows": [asdict(row) for row in self.rows],
            "statements": [statement.as_dict() for statement in self.statements],
        }

    def tables(self) -> list[Table]:
        """One table for each section, and the statements."""
        return range_tables(self.rows, self.statements, self.quick)

    def drawings(self) -> Mapping[str, Callable[[], Figure]]:
        """The figures that the rows suffice for."""
        return range_drawings(self.rows)


CHECKS = (*planar_statements.CHECKS, *spatial_statements.CHECKS, *single_statements.CHECKS)
"""All of them, in the order of the thesis."""


def range_statements(rows: Sequence[RangeRow], quick: bool = False) -> list[Statement]:
    """The servoing thesis' statements whose rows are there, in the order of the thesis; of the
    `quick` form also the names of the others."""
    return evaluate_checks(CHECKS, FoundRows(rows), quick)


def range_items(quick: bool) -> list[RangeItem]:
    """All questions; each has a name of its own and depends on no other."""
    return [
        *vision_items(quick), *robots.robot_items(quick), *single_errors.single_items(quick)
    ]  # fmt: skip


def study_stability_ranges(
    quick: bool = False,
    session: StudySession = DEFAULT_STUDY_SESSION,
) -> StabilityRangesStudy:
    """Runs the study; each question is a task of a sweep.

    Args:
        quick: Fewer and coarser questions, to see that everything works.
        session: How it is run.

    Raises:
        OutputFolderError: The folder belongs to other arguments, or cannot be written.
        SweepError: A local process died.

    Source: servoing thesis 3.2.1, 3.2.2, 3.3.2 and 3.4.2.
    """
    items = range_items(quick)
    tasks = {item.name: (item, 1) for item in items}
    result = run_study_sweep(tasks, 1, "questions", _arguments(items, quick), session)
    rows = [item.row(result.finished[item.name]) for item in items if item.name in result.finished]
    return StabilityRangesStudy(tuple(rows), quick, result.progress)


def _parameters() -> dict[str, Any]:
    return {
        "single errors": {"draws": DRAWS, "seed": 0, "robot": single_errors.ROBOT},
        "combinations": {
            "options": asdict(robot_limits.OPTIONS),
            "turn step [deg]": robot_limits.TURN_STEP,
            "tilt step [deg]": robot_limits.TILT_STEP,
            "robots": [robots.PLANAR, robots.SPATIAL],
        },
    }


def _arguments(items: Sequence[RangeItem], quick: bool) -> dict[str, Any]:
    """All that the numbers depend on, for JSON."""
    return {
        "cdpr_drake": code_version(),
        "study": "stability-ranges",
        "quick": quick,
        **_parameters(),
        "questions": {item.name: item.arguments() for item in items},
    }

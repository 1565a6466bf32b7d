"""Study: how large errors may be before a servo's stability is lost."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from rich.table import Table

from cdpr_drake.analyses.ranges import robot_items, robot_limits, single_items
from cdpr_drake.analyses.ranges.range_figures import write_range_figures
from cdpr_drake.analyses.ranges.range_item import RangeItem, RangeRow
from cdpr_drake.analyses.ranges.range_statements import range_statements
from cdpr_drake.analyses.ranges.range_tables import range_tables
from cdpr_drake.analyses.ranges.robot_items import robot_items as items_of_robots
from cdpr_drake.analyses.ranges.single_items import single_items as items_of_single_errors
from cdpr_drake.analyses.ranges.vision_items import vision_items
from cdpr_drake.analyses.stability_recipe import DRAWS
from cdpr_drake.analyses.statements import Statement
from cdpr_drake.analyses.study_progress import StudyProgress

RESULTS = "results.json"
"""Numbers of the study, rewritten after every question."""


@dataclass(frozen=True, eq=False)
class StabilityRangesStudy:
    """What the study found.

    Attributes:
        rows: Questions that were answered.
        quick: Whether it was the quick form, of fewer and coarser questions.
        interrupted: Whether it was stopped before the end.
        wall_time: Time it took [s].
    """

    rows: tuple[RangeRow, ...]
    quick: bool
    interrupted: bool
    wall_time: float

    @property
    def statements(self) -> list[Statement]:
        """What the servoing thesis states, judged."""
        return range_statements(self.rows)

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON."""
        return {
            "study": "stability-ranges",
            "quick": self.quick,
            "interrupted": self.interrupted,
            "wall_time_s": self.wall_time,
            "parameters": {
                "single errors": {"draws": DRAWS, "seed": 0, "robot": single_items.ROBOT},
                "combinations": {
                    "options": asdict(robot_limits.OPTIONS),
                    "turn step [deg]": robot_limits.TURN_STEP,
                    "tilt step [deg]": robot_limits.TILT_STEP,
                    "robots": [robot_items.PLANAR, robot_items.SPATIAL],
                },
            },
            "rows": [asdict(row) for row in self.rows],
            "statements": [statement.as_dict() for statement in self.statements],
        }

    def tables(self) -> list[Table]:
        """One table for each section, and the statements."""
        return range_tables(self.rows, self.statements, self.quick)

    def write(self, folder: Path) -> None:
        """Writes `results.json` and the figures into a folder that exists."""
        _write(folder, self)
        write_range_figures(folder, self.rows)


def range_items(quick: bool) -> list[RangeItem]:
    """All questions; each has a name of its own and depends on no other."""
    return [*vision_items(quick), *items_of_robots(quick), *items_of_single_errors(quick)]


def study_stability_ranges(
    quick: bool = False,
    folder: Path | None = None,
    on_progress: Callable[[StudyProgress], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> StabilityRangesStudy:
    """Runs the study.

    Args:
        quick: Fewer and coarser questions, to see that everything works.
        folder: Where to keep `results.json` up to date while it runs; None: nowhere.
        on_progress: Called after every question.
        should_stop: Asked as often; what was finished is kept.

    Source: servoing thesis 3.2.1, 3.2.2, 3.3.2 and 3.4.2.
    """
    began = time.perf_counter()
    items = range_items(quick)
    rows: list[RangeRow] = []

    def study(interrupted: bool) -> StabilityRangesStudy:
        wall = time.perf_counter() - began
        return StabilityRangesStudy(tuple(rows), quick, interrupted, wall)

    for item in items:
        rows.append(item.row(item.compute()))
        if folder is not None:
            _write(folder, study(interrupted=True))
        if on_progress is not None:
            wall = time.perf_counter() - began
            on_progress(StudyProgress(item.name, len(rows), len(items), wall, "questions/s"))
        if should_stop is not None and should_stop():
            return study(interrupted=True)
    return study(interrupted=False)


def _write(folder: Path, study: StabilityRangesStudy) -> None:
    (folder / RESULTS).write_text(
        json.dumps(study.as_dict(), indent=2, allow_nan=False) + "\n", encoding="utf-8"
    )

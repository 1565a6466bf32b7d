"""Study of what moving points is worth: ACROBOT for wrenches to resist, CAROCA for visual servoing.

Exit points move by up to 10 cm, anchor points of CAROCA by up to 5 cm, with the half-turn symmetry
of both robots kept. `study_design` runs a search for each robot and proves its best design: what
was gained is proven, not taken from the search.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

from cdpr_drake.analyses.design.candidates import make_candidates
from cdpr_drake.analyses.design.confirmation import Confirmation, confirm
from cdpr_drake.analyses.design.results import DesignResult, write_design
from cdpr_drake.analyses.design.search import DesignSearch, search_design
from cdpr_drake.analyses.design.settings import DesignSettings, GoalSettings, MirrorSettings
from cdpr_drake.analyses.reporting.log_files import write_json
from cdpr_drake.analyses.reporting.progress import DEFAULT_STUDY_SESSION, StudySession, WorkProgress
from cdpr_drake.analyses.reporting.provenance import code_version, package_versions
from cdpr_drake.analyses.reporting.statements import Statement, statement_table, verdict
from cdpr_drake.analyses.sweeps.folder import SweepFolder
from cdpr_drake.analyses.sweeps.sweep import STARTING
from cdpr_drake.analyses.visualization.figure_files import DEFAULT_FORMATS

REACH = 0.1
"""How far exit points move at most, either way along each axis [m]."""

FORCE = 5.0
"""Forces that ACROBOT shall resist along each axis [N], a seventh of its platform's weight."""

HALF_TURN = ("C1-C5", "C2-C6", "C3-C7", "C4-C8")
"""Cables of both robots that half a turn about z exchanges."""

BOXES, QUICK_BOXES = 200_000, 500
"""Boxes of each robot that are judged."""


@dataclass(frozen=True)
class DesignItem:
    """A robot, and what is wanted of it.

    Attributes:
        robot: Its name.
        goal: Name of the goal.
        force: Forces to resist [N].
        generations: Of the search, quick and full.
        counts: Points of the grid, quick and full.
        anchors: How far anchor points move [m].
    """

    robot: str
    goal: str
    force: float
    generations: tuple[int, int]
    counts: tuple[tuple[int, int, int], tuple[int, int, int]]
    anchors: float = 0.0

    def settings(self, quick: bool) -> DesignSettings:
        """What the search is asked for."""
        settings = DesignSettings(goals=[GoalSettings(name=self.goal)])
        settings.exit_points.reach = np.full(3, REACH)
        settings.anchor_points.reach = np.full(3, self.anchors)
        settings.mirrors = [MirrorSettings(axis="xy", pairs=list(HALF_TURN))]
        settings.force = self.force
        settings.generations = self.generations[0 if quick else 1]
        settings.poses.counts = np.array(self.counts[0 if quick else 1], float)
        return settings


ITEMS = (
    DesignItem("acrobot_large", "wrench-feasible", FORCE, (2, 100), ((5, 5, 4), (9, 9, 7))),
    DesignItem("caroca", "csw", 0.0, (2, 60), ((3, 3, 2), (9, 9, 5)), anchors=0.05),
)


@dataclass(frozen=True, eq=False)
class DesignStudy:
    """What the study found.

    Attributes:
        quick: Whether it was the quick form.
        results: Searches, finished or not.
        progress: Where it stood at the end.
    """

    quick: bool
    results: tuple[DesignResult, ...]
    progress: WorkProgress

    @property
    def interrupted(self) -> bool:
        """Whether it was stopped before the end."""
        return len(self.results) < len(ITEMS) or any(one.interrupted for one in self.results)

    @property
    def statements(self) -> list[Statement]:
        """Whether each design is better, by what was proven."""
        found = []
        for result in self.results:
            for one in result.confirmed:
                gain = "" if one.gain is None else f", {100.0 * one.gain:+.1f} %"
                words = f"{result.robot}, points moved within {100.0 * REACH:g} cm: more {one.goal}"
                numbers = f"{one.original:.4g} to {one.design:.4g} {one.unit}{gain}"
                why = "" if one.sure else "proven volumes; open boxes could turn it round"
                better = one.design > one.original
                found.append(Statement(words, "", numbers, verdict(one.sure, better), why))
        return found

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON."""
        return {
            "study": "design",
            "quick": self.quick,
            "interrupted": self.interrupted,
            "wall_time_s": self.progress.wall_time,
            "versions": package_versions(),
            "designs": {one.robot: one.as_dict() for one in self.results},
            "statements": [one.as_dict() for one in self.statements],
        }

    def tables(self) -> list[Table]:
        """Tables for the terminal."""
        tables = [table for one in self.results for table in one.tables()]
        return [*tables, statement_table("What was gained, by proof", self.statements)]

    def write(self, folder: Path, formats: Sequence[str] = DEFAULT_FORMATS) -> dict[str, str]:
        """Writes robot file and designs of each robot, `results.json`, then the figures of all.

        Returns:
            Of each figure that could not be written, the file and why, in one line.
        """
        for one in self.results:
            (folder / one.robot).mkdir(exist_ok=True)
            if one.search.best is not None:
                write_design(one.search, one.robot, folder / one.robot)
            one.write_data(folder / one.robot)
        write_json(folder / "results.json", self.as_dict())
        failed = {}
        for one in self.results:
            for name, why in one.write_figures(folder / one.robot, formats).items():
                failed[f"{one.robot}/{name}"] = why
        return failed


def study_design(quick: bool = False, session: StudySession = DEFAULT_STUDY_SESSION) -> DesignStudy:
    """Runs the study.

    Args:
        quick: Few generations, coarse grids, few boxes, to see that everything works.
        session: How it is run.

    Raises:
        OutputFolderError: The folder belongs to other arguments, or cannot be written.
        CdprError: A robot cannot be asked.
    """
    if session.folder is not None:
        about = {"cdpr_drake": code_version(), "study": "design", "quick": quick}
        SweepFolder(session.folder, about)
    results: list[DesignResult] = []
    last = WorkProgress(STARTING, 0, 1, 0.0, rate="designs/s", items="designs")
    for number, item in enumerate(ITEMS):
        settings = item.settings(quick)
        candidates = make_candidates(item.robot, settings, "study design")
        seen = last

        def tell(progress: WorkProgress, before: WorkProgress = seen, number: int = number) -> None:
            """Robots count alike: a design of one takes as long as many of another."""
            nonlocal last
            share = progress.done / max(progress.total, 1.0)
            found = progress.found / max(progress.total, 1.0)
            last = WorkProgress(
                f"{ITEMS[number].robot}, {progress.what}", 100.0 * (number + share),
                100.0 * len(ITEMS), before.wall_time + progress.wall_time, rate="% of a robot/s",
                found=before.found + 100.0 * found, items="% of a robot",
            )  # fmt: skip
            session.tell(last)

        folder = None if session.folder is None else session.folder / item.robot
        search = search_design(
            item.robot, candidates, settings, replace(session, folder=folder, on_progress=tell)
        )
        proven: tuple[Confirmation, ...] = ()
        stop = session.should_stop
        if search.best is not None and not search.interrupted and not (stop and stop()):
            proven = _proven(item, search, QUICK_BOXES if quick else BOXES, session)
        results.append(DesignResult(item.robot, search, proven))
        if search.interrupted or (stop is not None and stop()):
            break
    return DesignStudy(quick, tuple(results), last)


def _proven(
    item: DesignItem, search: DesignSearch, boxes: int, session: StudySession
) -> tuple[Confirmation, ...]:
    with tempfile.TemporaryDirectory() as folder:
        file = write_design(search, item.robot, Path(folder))
        one = confirm(
            item.goal, item.robot, str(file), search.judging, boxes=boxes,
            should_stop=session.should_stop,
        )  # fmt: skip
    return () if one is None else (one,)

"""Study of what moving points is worth: ACROBOT for wrenches to resist, CAROCA for visual servoing.

Exit points move by up to 10 cm, anchor points of CAROCA by up to 5 cm, with the half-turn symmetry
of both robots kept. A search is run for each robot, and its best design proven: what was gained is
proven, not taken from the search.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
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
from cdpr_drake.analyses.reporting.progress import DEFAULT_STUDY_SESSION, StudySession, WorkProgress
from cdpr_drake.analyses.reporting.provenance import code_version
from cdpr_drake.analyses.studies.framework.runs import Runs, pack_row
from cdpr_drake.analyses.studies.framework.statement import OURS, Check, Finding, statement
from cdpr_drake.analyses.studies.framework.study import Case, Form, Study, StudyResult
from cdpr_drake.analyses.sweeps.folder import SweepFolder
from cdpr_drake.analyses.sweeps.sweep import STARTING
from cdpr_drake.analyses.visualization.figure_files import DEFAULT_FORMATS
from cdpr_drake.models.robot_loader import load_robot

REACH = 0.1
"""How far exit points move at most, either way along each axis [m]."""

FORCE = 5.0
"""Forces that ACROBOT shall resist along each axis [N], a seventh of its platform's weight."""

HALF_TURN = ("C1-C5", "C2-C6", "C3-C7", "C4-C8")
"""Cables of both robots that half a turn about z exchanges."""

BOXES, QUICK_BOXES = 200_000, 8000
"""Boxes of each robot that are judged: with 500 what is proven of ACROBOT is one box or two."""


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


def cases(form: Form) -> Iterator[Case]:
    """The robots."""
    for item in ITEMS:
        yield Case(name=item.robot, keys={"robot": item.robot, "goal": item.goal})


def _gained(item: DesignItem) -> Check:
    """Whether the design of a robot is better, by what was proven."""

    @statement(
        f"{item.robot}, points moved within {100.0 * REACH:g} cm: more {item.goal}",
        rule="more is proven of the design than can be true of the robot; in part: than is proven "
        "of that; not, where less can be true than is proven of the robot; else boxes that are "
        "open decide",
        basis=OURS,
        name=f"{item.robot}_gain",
    )
    def check(runs: Runs) -> Finding:
        one = runs.one(robot=item.robot)
        gain = "" if one["gain"] is None else f", {100.0 * one['gain']:+.1f} %"
        sure, more = one["sure_whatever_is_open"], one["design"] > one["original"]
        less = one["design"] + one["design_open"] <= one["original"]
        return Finding(
            found=f"{one['original']:.4g} to {one['design']:.4g} {one['unit']}{gain}",
            held=[sure] if sure or more or less else [],
            some=more,
            why="" if sure else "proven volumes; open boxes could turn it round",
        )

    return check


@dataclass(frozen=True, eq=False)
class DesignStudyResult(StudyResult):
    """What the study found.

    Attributes:
        results: Searches, finished or not.
    """

    results: tuple[DesignResult, ...]

    @property
    def interrupted(self) -> bool:
        """Whether it was stopped before the end."""
        return len(self.results) < len(ITEMS) or any(one.interrupted for one in self.results)

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON; `numbers` has the searches, by robot."""
        left_out = ("wall_time_s", "versions")
        searches = {
            one.robot: {name: v for name, v in one.as_dict().items() if name not in left_out}
            for one in self.results
        }
        return super().as_dict() | {"numbers": searches}

    def tables(self) -> list[Table]:
        """Tables for the terminal."""
        return [*(table for one in self.results for table in one.tables()), *super().tables()]

    def write(self, folder: Path, formats: Sequence[str] = DEFAULT_FORMATS) -> dict[str, str]:
        """Writes robot file and designs of each robot, `runs.csv` and `results.json`, then the
        figures of all.

        Returns:
            Of each figure that could not be written, the file and why, in one line.
        """
        for one in self.results:
            (folder / one.robot).mkdir(exist_ok=True)
            if one.search.best is not None:
                write_design(one.search, one.robot, folder / one.robot)
            one.write_data(folder / one.robot)
        failed = super().write(folder, formats)
        for one in self.results:
            for name, why in one.write_figures(folder / one.robot, formats).items():
                failed[f"{one.robot}/{name}"] = why
        return failed


class DesignStudy(Study):
    """The study: a search with generations for each robot, in a folder of its own, then a proof."""

    def __call__(
        self, quick: bool = False, session: StudySession = DEFAULT_STUDY_SESSION
    ) -> DesignStudyResult:
        """Runs it.

        Args:
            quick: Few generations, coarse grids, few boxes, to see that everything works.
            session: How it is run.

        Raises:
            OutputFolderError: The folder belongs to other arguments, or cannot be written.
            CdprError: A robot cannot be asked.
        """
        if session.folder is not None:
            about = {"cdpr_drake": code_version(), "study": self.name, "quick": quick}
            SweepFolder(session.folder, about)
        results, progress = _searched(quick, session)
        rows = {
            result.robot: pack_row(_row(result, proof))
            for result in results
            for proof in result.confirmed
            if proof.finished
        }
        form = Form(quick)
        return DesignStudyResult(self, form, tuple(self.plan(form)), rows, progress, results)


def _row(result: DesignResult, proof: Confirmation) -> dict[str, Any]:
    """What was proven of a robot and of its best design, in `unit`, and of how many designs."""
    judged = {"designs_judged": len(result.search.values)}
    return {name: value for name, value in proof.as_dict().items() if name != "goal"} | judged


def _searched(quick: bool, session: StudySession) -> tuple[tuple[DesignResult, ...], WorkProgress]:
    """Searches and proofs of the robots one after the other, and where they stood at the end."""
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
        results.append(
            DesignResult(item.robot, search, proven, load_robot(item.robot).geometry_words())
        )
        if search.interrupted or (stop is not None and stop()):
            break
    return tuple(results), last


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


STUDY = DesignStudy(
    name="design",
    title="What moving points of robots is worth",
    cases=cases,
    checks=[_gained(item) for item in ITEMS],
    stated="What was gained, by proof",
    parameters=lambda form: {
        "reach_m": REACH, "force_n": FORCE, "boxes": QUICK_BOXES if form.quick else BOXES,
    },
    unit="percent",
)  # fmt: skip

"""Runs the study: every question is a task of a sweep, kept as it comes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
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
from cdpr_drake.analyses.reporting.statements import Statement
from cdpr_drake.analyses.studies.framework.seeded_study import DrawnStudy
from cdpr_drake.analyses.studies.workspaces.distances import (
    POSES,
    QUICK_POSES,
    ROBOTS,
    SEED,
    TURN,
    DistanceTask,
)
from cdpr_drake.analyses.studies.workspaces.figures import workspace_drawings
from cdpr_drake.analyses.studies.workspaces.items import (
    EVERY,
    FIGURE,
    FoundWorkspace,
    LeftOut,
    WorkspaceItem,
    figure_items,
    kind_items,
)
from cdpr_drake.analyses.studies.workspaces.statements import workspace_statements
from cdpr_drake.analyses.studies.workspaces.tables import shares_of, workspace_tables
from cdpr_drake.analyses.sweeps.sweep import run_study_sweep

CHUNK_POSES = 4096
"""Poses per chunk; seconds of work with stability, else milliseconds."""


@dataclass(frozen=True, eq=False)
class WorkspacesStudy(DrawnStudy, StoppableStudy):
    """What the study found.

    Attributes:
        quick: Whether it was the quick form, of coarse grids.
        found: Finished questions, in their order.
        left_out: Kinds that robots cannot be asked for, with the reason.
        progress: Where it stood at the end, and what earlier sessions had left of it.
        distances: By robot, at which poses clearances differ from Drake's distances.
    """

    quick: bool
    found: tuple[FoundWorkspace, ...]
    left_out: tuple[LeftOut, ...]
    progress: WorkProgress
    distances: Mapping[str, Mapping[str, np.ndarray]] = field(default_factory=dict)

    @property
    def statements(self) -> list[Statement]:
        """What the thesis states and what has to hold, judged."""
        return workspace_statements(self.found, self.distances, self.quick and not self.interrupted)

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON: volumes of the figures, shares of kinds, statements."""
        return {
            "study": "workspaces",
            "quick": self.quick,
            "interrupted": self.interrupted,
            "poses": self.progress.counts(),
            "versions": package_versions(),
            "figures": [_figure_row(one) for one in self.found if one.item.group == FIGURE],
            "kinds": {one.item.robot: _kind_row(one) for one in self.found if _is_every(one)},
            "left_out": [asdict(one) for one in self.left_out],
            "statements": [statement.as_dict() for statement in self.statements],
        }

    def tables(self) -> list[Table]:
        """Tables for the terminal."""
        return workspace_tables(self.found, self.left_out, self.statements, self.quick)

    def drawings(self) -> Mapping[str, Callable[[], Figure]]:
        """See `workspace_drawings`."""
        return workspace_drawings(self.found)


def study_workspaces(
    quick: bool = False, session: StudySession = DEFAULT_STUDY_SESSION
) -> WorkspacesStudy:
    """Runs the study.

    Args:
        quick: Coarse grids, to see that everything works.
        session: How it is run.

    Raises:
        OutputFolderError: The folder belongs to other arguments, or cannot be written.
        SweepError: A local process died.

    Source: servoing thesis 1.3.3; Gazebo thesis 2.6.
    """
    items, left_out = study_items(quick)
    tasks: dict[str, Any] = {
        item.name: (item.question.task(), item.question.grid.size) for item in items
    }
    poses = QUICK_POSES if quick else POSES
    compared = {f"{robot}, distances": robot for robot in ROBOTS}
    tasks |= {name: (DistanceTask(robot), poses) for name, robot in compared.items()}
    arguments = {
        "cdpr_drake": code_version(),
        "study": "workspaces",
        "quick": quick,
        "questions": {item.name: item.question.arguments() for item in items},
        "compared": {
            "robots": list(ROBOTS),
            "poses_of_each": poses,
            "seed": SEED,
            "turn_rad": TURN,
        },
    }
    result = run_study_sweep(tasks, CHUNK_POSES, "poses", arguments, session)
    found = [
        FoundWorkspace(
            item,
            {k: np.asarray(result.finished[item.name][k], bool) for k in item.question.kinds},
        )
        for item in items
        if item.name in result.finished
    ]
    distances = {
        robot: result.finished[name] for name, robot in compared.items() if name in result.finished
    }
    return WorkspacesStudy(quick, tuple(found), tuple(left_out), result.progress, distances)


def study_items(quick: bool) -> tuple[list[WorkspaceItem], list[LeftOut]]:
    """All questions, and the kinds that are not asked for."""
    some, left_out = kind_items(quick)
    return [*figure_items(quick), *some], left_out


def _is_every(one: FoundWorkspace) -> bool:
    return one.item.group == EVERY


def _figure_row(one: FoundWorkspace) -> dict[str, Any]:
    volume = one.volume(one.holds["static"])
    return {
        "robot": one.item.robot,
        "lower_limit_n": one.item.limits[0],
        "upper_limit_n": one.item.limits[1],
        "upper_limit_over_robot_file": one.item.upper_share,
        "points": list(one.item.question.grid.shape[1:]),
        "pose_share": float(np.mean(one.holds["static"])),
        "volume_m3": volume.value,
        "frame_m3": volume.full,
        "frame_share": volume.share,
    }


def _kind_row(one: FoundWorkspace) -> dict[str, Any]:
    about = one.item.question.about
    assert about.required is not None
    assert about.motion is not None
    return {
        "points": list(one.item.question.grid.shape[1:]),
        "limits_n": list(one.item.limits),
        "required_box_nm_n": about.required.box.tolist(),
        "acceleration_box_rad_s2_m_s2": about.motion.accelerations.box.tolist(),
        "scenario": one.item.question.scenario,
        "pose_shares": shares_of(one),
        "frame_shares": {kind: one.volume(holds).share for kind, holds in one.holds.items()},
        "pose_shares_of_pairs": {
            a: {b: float(np.mean(one.holds[a] & one.holds[b])) for b in one.holds}
            for a in one.holds
        },
    }

"""A better robot, searched and proven."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from cdpr_drake.analyses.design.candidates import make_candidates
from cdpr_drake.analyses.design.confirmation import BOXES, confirm
from cdpr_drake.analyses.design.goals import GOALS
from cdpr_drake.analyses.design.results import DesignResult, write_design
from cdpr_drake.analyses.design.search import search_design
from cdpr_drake.analyses.design.settings import (
    DesignSettings,
    GoalSettings,
    load_design_settings,
)
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.front.session import Session, asked_workers, kept_folder
from cdpr_drake.analyses.reporting.progress import WorkSession
from cdpr_drake.analyses.visualization.figure_files import DEFAULT_FORMATS
from cdpr_drake.errors import DesignError
from cdpr_drake.models.robot_loader import load_robot, robot_reference
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.typed_yaml import closest

REACH = 0.1
"""Without settings, exit points move so far, either way along each axis that they can [m]."""


def plain_design(robot: Robot, goals: str | Sequence[str]) -> DesignSettings:
    """What is searched where only goals are given: exit points, which move by `REACH`.

    Args:
        robot: The robot.
        goals: Names of `GOALS`, of weight 1.

    Raises:
        DesignError: A goal is unknown.
    """
    names = (goals,) if isinstance(goals, str) else tuple(goals)
    for name in names:
        if name not in GOALS:
            raise DesignError(f"goals: {name!r} is unknown; {closest(name, GOALS)}")
    settings = DesignSettings(goals=[GoalSettings(name=name, weight=1.0) for name in names])
    settings.exit_points.reach = np.full(3, REACH)
    if robot.is_planar():
        settings.exit_points.reach = np.array([REACH, REACH, 0.0])
    return settings


@verb()
def optimize_design(
    robot: Robot | str | Path,
    settings: DesignSettings | Path | str | Sequence[str],
    folder: Path | str | None = None,
    *,
    generations: int | None = None,
    boxes: int = BOXES,
    workers: int | str = 1,
    formats: Sequence[str] = DEFAULT_FORMATS,
    source: str = "design",
    session: Session | None = None,
) -> DesignResult:
    """Searches where points of a robot should be, how many cables, which drum and motor.

    What the best design is better by is proven, not taken from the search.

    Args:
        robot: The robot, or its name or path.
        settings: What may change and what is wanted: `DesignSettings`, or a file of them that ends
            in .yaml; or a goal, a name of `GOALS`, or several: exit points move by `REACH` then.
        folder: Where the search, the robot file of the best design, results and figures are kept,
            and the search is continued from; None: nowhere.
        generations: Number of generations; None: as the settings say.
        boxes: Largest number of boxes that prove a volume, for each robot.
        workers: Processes, where kernels use all processors in one, or the address of a Dask
            scheduler.
        formats: Endings of the files of figures.
        source: Where `DesignSettings` come from, for messages.
        session: Who follows the search and may stop it; None: nobody.

    Raises:
        DesignError: The settings make no sense; names the field.
        CdprError: The robot cannot be asked for a goal.
        OutputFolderError: The folder belongs to other arguments, or cannot be written.
    """
    told, (count, scheduler) = session or Session(), asked_workers(workers)
    with robot_reference(robot, "optimize_design") as name, _kept(folder, told) as there:
        where = Path(there)
        loaded = load_robot(name, "optimize_design")
        asked, words = _settings(loaded, settings, source)
        if generations is not None:
            asked = replace(asked, generations=generations)
        candidates = make_candidates(name, asked, words)
        given = robot if isinstance(robot, Robot) else name
        with told.computing():
            search = search_design(
                given, candidates, asked,
                WorkSession(where, told.progress, told.stop, count, scheduler),
            )  # fmt: skip
        confirmed, file = [], None
        if search.best is not None and not search.interrupted:
            file = write_design(search, loaded.name, where)
            with told.doing("proving") as say:
                for goal in search.names:
                    one = confirm(
                        goal, name, str(file), search.judging, boxes=boxes, say=say,
                        should_stop=told.stop,
                    )  # fmt: skip
                    confirmed += [] if one is None else [one]
        found = DesignResult(loaded.name, search, tuple(confirmed), loaded.geometry_words())
        if folder is None:
            return found
        with told.doing("Writing results"):
            failed = found.write(where, formats)
    return replace(found, folder=where, file=file, failed=failed)


def _kept(folder: Path | str | None, session: Session) -> AbstractContextManager[Path | str]:
    """The folder, or one that goes with the block."""
    return TemporaryDirectory() if folder is None else kept_folder(folder, session)


def _settings(
    robot: Robot, settings: DesignSettings | Path | str | Sequence[str], source: str
) -> tuple[DesignSettings, str]:
    """Settings, and where they come from in words."""
    if isinstance(settings, DesignSettings):
        return settings, source
    if isinstance(settings, Path) or (
        isinstance(settings, str) and settings.endswith((".yaml", ".yml"))
    ):
        return load_design_settings(Path(settings)), str(settings)
    return plain_design(robot, settings), source

"""The search for a better robot, and the proof of its gain: the verb `optimize_design`."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from cyclopts import Parameter

from cdpr_drake.analyses.design.candidates import make_candidates
from cdpr_drake.analyses.design.confirmation import BOXES, confirm
from cdpr_drake.analyses.design.design_result import ROBOT_FILE, Design
from cdpr_drake.analyses.design.goals import GOALS
from cdpr_drake.analyses.design.search import goal_context, search_design
from cdpr_drake.analyses.design.settings import (
    SEARCHES,
    DesignSettings,
    GoalSettings,
    load_design_settings,
)
from cdpr_drake.analyses.frame.folder import Folder, write_result
from cdpr_drake.analyses.frame.follow import NOBODY, Follow
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import (
    DEFAULT_FORMATS,
    Formats,
    InputFile,
    OutFolder,
    RobotWord,
    Switch,
    Workers,
    one_of,
    words,
)
from cdpr_drake.analyses.reporting.provenance import code_version
from cdpr_drake.analyses.workspaces.pose_grid import plain
from cdpr_drake.errors import DesignError, accepted_names
from cdpr_drake.models.robot_loader import load_robot, robot_reference
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.typed_yaml import closest

if TYPE_CHECKING:
    pass

REACH = 0.1
"""Without parameters exit points move so far, either way along each axis that they can [m]."""

QUICK_GENERATIONS, QUICK_BOXES = 3, 2000


def goal_of(word: str) -> GoalSettings:
    """A goal of NAME or NAME=WEIGHT.

    Raises:
        DesignError: The name is unknown, or the weight is not above 0.
    """
    name, _, weight = word.partition("=")
    if name not in GOALS:
        raise DesignError(f"goals: {name!r} is unknown; {closest(name, GOALS)}")
    try:
        value = float(weight or 1.0)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0.0):
        raise DesignError(f"goals: found {word!r}; accepted: NAME=WEIGHT with a weight above 0")
    return GoalSettings(name=name, weight=value)


Goals = Annotated[
    Sequence[str] | None,
    words(str, "NAME or NAME=WEIGHT", "NAME[=WEIGHT]", name="--goal", many=True,
          completer=lambda _: list(GOALS)),
]  # fmt: skip


@verb()
def optimize_design(
    robot: RobotWord, *, goals: Goals = None, parameters: InputFile = None,
    force: float | None = None, moment: float | None = None,
    search: Annotated[str | None, one_of(SEARCHES)] = None, generations: int | None = None,
    seed: int | None = None, boxes: int = BOXES, quick: Switch = False, workers: Workers = 1,
    folder: OutFolder = None, overwrite: Switch = False, formats: Formats = DEFAULT_FORMATS,
    follow: Annotated[Follow, Parameter(parse=False)] = NOBODY,
) -> Design:  # fmt: skip
    """Searches for the best points, number of cables, drum and motor of a robot.

    Writes the best design as a robot file. Its gain is proven afterwards, not read off the search.
    The same command continues an interrupted one.

    Args:
        robot: Robot by name or file.
        goals: Goal, NAME or NAME=WEIGHT; may be repeated: static, wrench-feasible, wrench-closure,
            interference-free, statically-stable, singularity-free, csw, capacity-margin, stiffness,
            frequency, dexterity, clearance, survives, breaks-survived, tension-factor, payload,
            accuracy, power, speed, cables.
        parameters: YAML file of what may change, goals, poses, budget; without it exit points move
            by 0.1 m; in Python also `DesignSettings`.
        force: Forces to resist, up to so much along each axis [N].
        moment: Moments to resist, up to so much about each axis [N m].
        search: evolution, or slopes: far fewer designs, for the goal capacity-margin alone.
        generations: Number of generations; a larger number continues a finished search.
        seed: Seed of the search.
        boxes: Largest number of boxes that prove a volume, for each robot.
        quick: A short form, to see that it works.
        workers: Processes, whose kernels use all processors each, or a Dask scheduler.
        folder: Results folder; default: one named by the arguments below design/; in Python nothing
            is kept.
        overwrite: Replace results of other arguments in the folder.
        formats: Formats of the figures in the folder.
        follow: Who follows the work.

    Raises:
        DesignError: A goal, a number or the parameters are not accepted; names the field.
        CdprError: The robot cannot be asked for a goal.
        OutputFolderError: The folder holds other results or files, or cannot be written.
    """
    if quick:
        boxes = QUICK_BOXES
        generations = QUICK_GENERATIONS if generations is None else generations
    with robot_reference(robot, "optimize_design") as name, ExitStack() as stack:
        loaded = load_robot(name, "optimize_design")
        source = str(parameters) if isinstance(parameters, str | Path) else "design"
        settings = _settings(loaded, goals, parameters, {
            "force": force, "moment": moment, "search": search, "generations": generations,
            "seed": seed,
        })  # fmt: skip
        candidates = make_candidates(name, settings, source)
        judging = goal_context(robot if isinstance(robot, Robot) else name, settings)
        same = replace(settings, generations=1)  # more of them go on
        arguments = {
            "cdpr_drake": code_version(), "robot": candidates.text, "settings": plain(same),
            "grid": plain(judging.grid), "bounds": plain(judging.bounds.as_dict()),
        }  # fmt: skip
        if folder is None and follow.results is not None:
            subject = json.dumps({"robot": candidates.text, "settings": repr(same)}, sort_keys=True)
            digest = hashlib.sha256(subject.encode()).hexdigest()[:8]
            folder = follow.results / f"{loaded.name}-{digest}"
        where = folder or Path(stack.enter_context(TemporaryDirectory()), "design")
        results = stack.enter_context(Folder(Path(where), arguments, overwrite, grows=True))
        try:
            design = search_design(
                candidates, settings, judging, results, workers=workers, follow=follow
            )
        except DesignError as problem:
            if goals or parameters is None:
                raise
            raise DesignError(f"{source}: {problem}") from problem
        design = replace(design, folder=None if folder is None else results.path)
        if design.complete and design.best is not None:
            file = _write_robot(design, design.best, results)
            proofs = (
                confirm(goal, name, str(file), judging, boxes=boxes, follow=follow)
                for goal in design.names
            )
            design = replace(design, confirmed=tuple(filter(None, proofs)))
        if folder is not None and not design.interrupted:
            write_result(design, results, formats, follow)
        elif folder is not None:
            design.write(results)
            follow.say("stopped; the same command goes on")
    return design


def _settings(
    robot: Robot, goals: str | Sequence[str] | None, parameters: Any, changes: dict[str, Any]
) -> DesignSettings:
    """What is searched: parameters, or exit points that move by `REACH`, with changes.

    Raises:
        DesignError: A goal, a number or the parameters are not accepted.
    """
    if parameters is None:
        settings = DesignSettings(goals=[])
        settings.exit_points.reach = np.array([REACH, REACH, 0.0 if robot.is_planar() else REACH])
    elif isinstance(parameters, DesignSettings):
        settings = parameters
    else:
        settings = load_design_settings(Path(parameters))
    for name, value in changes.items():
        least = 1 if name == "generations" else 0
        if isinstance(value, int | float) and not (math.isfinite(value) and value >= least):
            raise DesignError(f"{name}: found {value:g}; accepted: >= {least}")
    settings = replace(settings, **{k: v for k, v in changes.items() if v is not None})
    if settings.search not in SEARCHES:
        raise DesignError(
            f"search: found {settings.search!r}; {accepted_names(settings.search, SEARCHES)}"
        )
    if goals:
        names = (goals,) if isinstance(goals, str) else goals
        settings = replace(settings, goals=[goal_of(name) for name in names])
    names = [goal.name for goal in settings.goals]
    if not names:
        raise DesignError(f"goals: found none; accepted: {', '.join(GOALS)}")
    if len(set(names)) < len(names):
        raise DesignError(f"goals: found {', '.join(names)}; accepted: each goal once")
    return settings


def _write_robot(design: Design, best: int, folder: Folder) -> Path:
    """Writes the robot file of the best design, which loads as any other, and returns its path."""
    title = f"{design.robot}, design of {len(design.values)} judged for {', '.join(design.names)}"
    text = design.candidates.robot_text(design.sets[best], design.coordinates[best], title)
    folder.write_text(ROBOT_FILE, text)
    load_robot(str(folder.path / ROBOT_FILE))
    return folder.path / ROBOT_FILE

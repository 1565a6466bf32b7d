"""`cdpr design`: searches a better robot, and proves that it is one."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from cdpr_drake.analyses.design.candidates import make_candidates
from cdpr_drake.analyses.design.confirmation import BOXES
from cdpr_drake.analyses.design.goals import GOALS
from cdpr_drake.analyses.design.settings import (
    SEARCHES,
    DesignSettings,
    GoalSettings,
    load_design_settings,
)
from cdpr_drake.analyses.front.design import REACH, optimize_design
from cdpr_drake.analyses.reporting.output_folder import shown_path
from cdpr_drake.analyses.reporting.progress import WorkProgress
from cdpr_drake.cli.command_session import CommandSession
from cdpr_drake.cli.completion import words_among
from cdpr_drake.cli.grid_options import ForceToResist, MomentToResist, default_folder
from cdpr_drake.cli.options import (
    FigureFormats,
    ResultsAsJson,
    RobotName,
    Scheduler,
    named_options,
    parse_formats,
)
from cdpr_drake.cli.process import INTERRUPTED
from cdpr_drake.cli.run_endings import report_failures
from cdpr_drake.cli.terminal import print_json, wide_console
from cdpr_drake.errors import CdprError, accepted_names
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.schema.typed_yaml import closest

STOPPING = "Stopping after the designs under way, which are kept; Ctrl-C again drops them"
"""Answer to the first Ctrl-C."""

QUICK_GENERATIONS, QUICK_BOXES = 3, 2000


def design(
    robot: RobotName,
    goal: Annotated[
        list[str] | None,
        typer.Option(
            help="Goal, NAME or NAME=WEIGHT; may be repeated: " + ", ".join(GOALS) + ".",
            autocompletion=words_among(GOALS),
        ),
    ] = None,
    parameters: Annotated[
        Path | None,
        typer.Option(
            help="YAML file of what may change, goals, poses, budget; without it exit points move "
            f"by {REACH:g} m."
        ),
    ] = None,
    force: ForceToResist = None,
    moment: MomentToResist = None,
    by: Annotated[
        str | None,
        typer.Option(
            "--search",
            help="evolution, or slopes: far fewer designs, for --goal capacity-margin alone.",
            autocompletion=words_among(SEARCHES),
        ),
    ] = None,
    generations: Annotated[
        int | None,
        typer.Option(
            help="Number of generations; a larger number continues a finished search.", min=1
        ),
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Of the search.", min=0)] = None,
    boxes: Annotated[
        int,
        typer.Option(help="Largest number of boxes that prove a volume, for each robot.", min=1),
    ] = BOXES,
    quick: Annotated[bool, typer.Option(help="A short form, to see that it works.")] = False,
    out: Annotated[
        Path | None,
        typer.Option(help="Results folder; default: one named by the arguments below design/."),
    ] = None,
    workers: Annotated[
        int, typer.Option(help="Processes; the kernels of one process use all processors.", min=1)
    ] = 1,
    scheduler: Scheduler = None,
    figure_format: FigureFormats = "png",
    as_json: ResultsAsJson = False,
) -> int:
    """Searches for the best points, number of cables, drum and motor of a robot.

    Writes the best design as a robot file. Its gain is proven afterwards, not read off the search.
    The same command continues an interrupted one.
    """
    formats = parse_formats(figure_format)
    source = "design" if parameters is None else str(parameters)
    settings = _plain() if parameters is None else load_design_settings(parameters)
    if quick and generations is None:
        generations = QUICK_GENERATIONS
    for name, value in (
        ("force", _positive("--force", force)), ("moment", _positive("--moment", moment)),
        ("generations", generations), ("seed", seed),
    ):  # fmt: skip
        if value is not None:
            setattr(settings, name, value)
    if by is not None:
        if by not in SEARCHES:
            raise CdprError(f"--search: found {by!r}; {accepted_names(by, SEARCHES)}")
        settings.search = by
    if goal:
        settings.goals = [_goal(words) for words in goal]
    if not settings.goals:
        raise CdprError(f"--goal: found none; accepted: {', '.join(GOALS)}")
    names = [one.name for one in settings.goals]
    if len(set(names)) < len(names):
        raise CdprError(f"--goal: found {', '.join(names)}; accepted: each goal once")
    loaded = load_robot(robot, "cdpr design")
    if parameters is None and loaded.is_planar():
        settings.exit_points.reach = np.array([REACH, REACH, 0.0])
    options = {"goals": "--goal"} if goal else {}
    options |= {} if by is None else {"search": "--search"}
    candidates = make_candidates(robot, settings, source)
    arguments = {"robot": candidates.text, "settings": repr(replace(settings, generations=1))}
    folder = out if out is not None else default_folder("design", loaded.name, arguments)
    with (
        named_options(options),  # fields of the file bear their own names
        DesignSession(STOPPING, folder, f"design {loaded.name}") as session,
    ):
        found = optimize_design(
            robot, settings, folder, boxes=QUICK_BOXES if quick else boxes,
            workers=scheduler or workers, formats=formats, source=source, session=session,
        )  # fmt: skip
    where = shown_path(folder.resolve())
    if as_json:
        print_json(found.as_dict())
    else:
        printer = wide_console(150)
        for table in found.tables():
            printer.print(table)
        if found.file is not None:
            printer.print(f"robot file: {shown_path(found.file.resolve())}")
        printer.print(f"results: {where}")
    code = report_failures(session.console, found.failed, where, None)
    if found.interrupted:
        session.say("Interrupted; run again with the same arguments to continue")
        return INTERRUPTED
    return code


class DesignSession(CommandSession):
    """What a terminal shows of a search."""

    def progress(self, progress: WorkProgress) -> None:
        """Moves the bar; says that a search is continued once it is known how far it was."""
        if progress.done > progress.found or progress.found == progress.total:
            super().progress(progress)
        else:
            self.show(**self.fields(progress))

    def fields(self, progress: WorkProgress) -> dict[str, Any]:
        """Of the bar."""
        return {
            "completed": progress.done,
            "total": progress.total,
            "state": f"{progress.done:.0f}/{progress.total:.0f} designs, {progress.what}",
        }


def _plain() -> DesignSettings:
    """What is searched without a file."""
    settings = DesignSettings(goals=[])
    settings.exit_points.reach = np.full(3, REACH)
    return settings


def _positive(option: str, value: float | None) -> float | None:
    if value is not None and not (math.isfinite(value) and value >= 0.0):
        raise CdprError(f"{option}: found {value:g}; accepted: >= 0")
    return value


def _goal(words: str) -> GoalSettings:
    name, _, weight = words.partition("=")
    if name not in GOALS:
        raise CdprError(f"--goal: {name!r} is unknown; {closest(name, GOALS)}")
    try:
        value = float(weight or 1.0)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0.0):
        raise CdprError(f"--goal: found {words!r}; accepted: NAME=WEIGHT with a weight above 0")
    return GoalSettings(name=name, weight=value)

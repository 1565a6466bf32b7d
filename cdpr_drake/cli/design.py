"""`cdpr design`: searches a better robot, and proves that it is one."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from cdpr_drake.analyses.design.candidates import make_candidates
from cdpr_drake.analyses.design.confirmation import confirm
from cdpr_drake.analyses.design.goals import GOALS
from cdpr_drake.analyses.design.results import DesignResult, write_design
from cdpr_drake.analyses.design.search import search_design
from cdpr_drake.analyses.design.settings import (
    SEARCHES,
    DesignSettings,
    GoalSettings,
    load_design_settings,
)
from cdpr_drake.analyses.reporting.output_folder import continued_folder
from cdpr_drake.analyses.reporting.progress import StudySession, WorkProgress
from cdpr_drake.cli.completion import words_among
from cdpr_drake.cli.grid_options import ForceToResist, MomentToResist, default_folder
from cdpr_drake.cli.options import FigureFormats, ResultsAsJson, RobotName, Scheduler, parse_formats
from cdpr_drake.cli.process import INTERRUPTED, StopRequest
from cdpr_drake.cli.run_endings import SayContinued, report_failures, shown_path
from cdpr_drake.cli.terminal import message_console, print_json, progress_bar, wide_console, working
from cdpr_drake.errors import CdprError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.schema.typed_yaml import closest

STOPPING = "Stopping after the designs under way, which are kept; Ctrl-C again drops them"
"""Answer to the first Ctrl-C."""

REACH = 0.1
"""Without a file, exit points move so far, either way along each axis that they can [m]."""

QUICK_GENERATIONS, QUICK_BOXES = 3, 2000


def design(
    robot: RobotName,
    goal: Annotated[
        list[str] | None,
        typer.Option(
            help="What is wanted, NAME or NAME=WEIGHT; may be repeated: " + ", ".join(GOALS) + ".",
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
        int | None, typer.Option(help="Generations; more of them continue a search.", min=1)
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Of the search.", min=0)] = None,
    boxes: Annotated[
        int, typer.Option(help="Boxes that prove a volume, at most, for each robot.", min=1)
    ] = 200_000,
    quick: Annotated[bool, typer.Option(help="A short form, to see that it works.")] = False,
    out: Annotated[
        Path | None,
        typer.Option(help="Results folder; without, one named by the arguments below design/."),
    ] = None,
    workers: Annotated[
        int, typer.Option(help="Processes; kernels use all processors in one.", min=1)
    ] = 1,
    scheduler: Scheduler = None,
    figure_format: FigureFormats = "png",
    as_json: ResultsAsJson = False,
) -> int:
    """Searches where points of a robot should be, how many cables, which drum and motor.

    The best design becomes a robot file; what it is better by is proven, not taken from the search.
    Run again with the same arguments, it continues where it was stopped or killed.
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
            raise CdprError(f"--search: found {by!r}; accepted: {', '.join(SEARCHES)}")
        settings.search = by
    if goal:
        settings.goals = [_goal(words) for words in goal]
    if not settings.goals:
        raise CdprError(f"--goal: found none; accepted: {', '.join(GOALS)}")
    names = [one.name for one in settings.goals]
    if len(set(names)) < len(names):
        raise CdprError(f"--goal: found {', '.join(names)}; accepted: each once")
    loaded = load_robot(robot)
    if parameters is None and loaded.is_planar():
        settings.exit_points.reach = np.array([REACH, REACH, 0.0])
    candidates = make_candidates(robot, settings, source)
    arguments = {"robot": candidates.text, "settings": repr(replace(settings, generations=1))}
    folder = out if out is not None else default_folder("design", loaded.name, arguments)
    console, stop = message_console(), StopRequest(STOPPING)
    with continued_folder(folder):
        with stop.listening(), progress_bar(console) as bar:
            task = bar.add_task(f"design {loaded.name}", total=None, state="starting")
            say_continued = SayContinued(bar.console, folder)

            def show(progress: WorkProgress) -> None:
                known = progress.done > progress.found or progress.found == progress.total
                if known:
                    say_continued(progress)
                bar.update(
                    task,
                    completed=progress.done,
                    total=progress.total,
                    state=f"{progress.done:.0f}/{progress.total:.0f} designs, {progress.what}",
                )

            session = StudySession(folder, show, stop, workers, None, scheduler)
            search = search_design(robot, candidates, settings, session)
        confirmed = []
        file = None
        if search.best is not None and not search.interrupted:
            file = write_design(search, loaded.name, folder)
            most = QUICK_BOXES if quick else boxes
            with stop.listening(), working(console, "proving") as say:
                for name in names:
                    one = confirm(
                        name, robot, str(file), search.judging, boxes=most, say=say,
                        should_stop=stop,
                    )  # fmt: skip
                    confirmed += [] if one is None else [one]
        result = DesignResult(loaded.name, search, tuple(confirmed))
        with working(console, "Writing results"):
            failed = result.write(folder, formats)
    if as_json:
        print_json(result.as_dict())
    else:
        printer = wide_console(150)
        for table in result.tables():
            printer.print(table)
        if file is not None:
            printer.print(f"robot file: {shown_path(file.resolve())}")
        printer.print(f"results: {shown_path(folder.resolve())}")
    code = report_failures(console, failed, shown_path(folder.resolve()), None)
    if result.interrupted:
        console.print("Interrupted; run again with the same arguments to continue")
        return INTERRUPTED
    return code


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

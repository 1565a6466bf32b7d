"""A better robot, searched and proven: numbers, tables, figures, the robot file, all designs."""

from __future__ import annotations

import csv
import hashlib
import io
import json
import math
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from cyclopts import Parameter

from cdpr_drake.analyses.design.candidates import make_candidates
from cdpr_drake.analyses.design.confirmation import BOXES, Confirmation, confirm
from cdpr_drake.analyses.design.goals import GOALS
from cdpr_drake.analyses.design.search import (
    DesignSearch,
    goal_context,
    search_arguments,
    search_design,
)
from cdpr_drake.analyses.design.settings import (
    SEARCHES,
    DesignSettings,
    GoalSettings,
    load_design_settings,
)
from cdpr_drake.analyses.frame.folder import Folder
from cdpr_drake.analyses.frame.follow import NOBODY, Follow, Progress
from cdpr_drake.analyses.frame.result import Result, Table
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import (
    Formats,
    InputFile,
    OutFolder,
    RobotWord,
    Switch,
    Workers,
    one_of,
    words,
)
from cdpr_drake.analyses.planning.plans import written
from cdpr_drake.analyses.reporting.provenance import package_versions
from cdpr_drake.analyses.visualization.figure_files import DEFAULT_FORMATS
from cdpr_drake.analyses.workspaces.pose_grid import plain
from cdpr_drake.arrays import Array
from cdpr_drake.errors import DesignError, accepted_names
from cdpr_drake.models.robot_loader import load_robot, parse_robot, robot_reference
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.palette import IDEAL, PLATFORM, nth_look
from cdpr_drake.schema.typed_yaml import closest

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TABLE, RESULTS, ROBOT_FILE = "designs.csv", "results.json", "design/robot.yaml"
"""Files of a results folder: all designs in the order of the search, numbers, the best design."""

REACH = 0.1
"""Without parameters exit points move so far, either way along each axis that they can [m]."""

QUICK_GENERATIONS, QUICK_BOXES = 3, 2000

INTERRUPTED = 130
"""Exit code of a search that was stopped."""


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


@dataclass(frozen=True, eq=False, repr=False)
class Design(Result):
    """A finished or stopped search, and what was confirmed of its best design.

    Attributes:
        robot: Name of the robot as it was.
        search: The search.
        confirmed: Volumes proven of the robot and of the design.
        geometry: Geometry of the cables in words, as `Robot.geometry_words`.
        folder: Results folder; None if nothing was kept.
        failed: Of files that could not be written, the name and why.
    """

    robot: str
    search: DesignSearch
    confirmed: tuple[Confirmation, ...] = ()
    geometry: str = ""
    folder: Path | None = None
    failed: dict[str, str] = field(default_factory=dict)

    @property
    def file(self) -> Path | None:
        """The robot file of the best design; None: there is none."""
        if self.folder is None or not self.search.complete or self.search.best is None:
            return None
        return self.folder / ROBOT_FILE

    @property
    def interrupted(self) -> bool:
        """True if the search or the proofs were stopped before the end."""
        return not (self.search.complete and all(proof.finished for proof in self.confirmed))

    @property
    def exit_code(self) -> int:
        """Of a stopped search."""
        return INTERRUPTED if self.interrupted else 0

    def as_dict(self) -> dict[str, Any]:
        """For JSON: goals of robot, best design and front, and what was confirmed."""
        search, best = self.search, self.search.best
        grid = search.judging.grid
        return {
            "robot": self.robot,
            "geometry": self.geometry,
            "interrupted": self.interrupted,
            "designs_judged": len(search.values),
            "refused": int(np.sum(~np.all(np.isfinite(search.values), axis=1))),
            "coordinates": search.candidates.size,
            "wall_time_s": search.wall_time,
            "settings": plain(search.settings),
            "grid_points": list(grid.shape[1:]),
            "orientations": len(grid.angles),
            "goals": {
                name: {"title": GOALS[name].title, "unit": GOALS[name].unit}
                for name in search.names
            },
            "original": _named(search.names, search.original),
            "best": None if best is None else {
                "design": best,
                "cables": [k + 1 for k in search.candidates.cable_sets[search.sets[best]]],
                "score": float(search.scores[best]),
                **_named(search.names, search.values[best]),
            },
            "front": [
                {"design": int(k), **_named(search.names, search.values[k])} for k in search.front
            ],
            "confirmed": [proof.as_dict() for proof in self.confirmed],
            "versions": package_versions(),
        }  # fmt: skip

    def tables(self) -> list[Table]:
        """Goals of the robot and of the best design, and what is proven of both."""
        search, best = self.search, self.search.best
        rows = []
        for k, name in enumerate(search.names):
            sign = -1.0 if GOALS[name].smaller else 1.0
            after = "-" if best is None else f"{sign * search.values[best, k]:.5g}"
            rows.append((name, GOALS[name].unit, f"{sign * search.original[k]:.5g}", after))
        title = (
            f"{self.robot}, {self.geometry}: goals on the search's grid, {len(search.values)} "
            "designs"
        )
        goals = Table(title, ("goal", "unit", "robot", "best design"), rows)
        if not self.confirmed:
            return [goals]
        headings = ("goal", "robot", "best design", "unit", "open", "gain", "how")
        return [goals, Table("Proven of both, not by the search", headings, [
            (proof.goal, f"{proof.original:.5g}", f"{proof.design:.5g}", proof.unit,
             f"{proof.original_open:.3g}, {proof.design_open:.3g}",
             "-" if proof.gain is None else f"{100.0 * proof.gain:+.1f} %", proof.method)
            for proof in self.confirmed
        ])]  # fmt: skip

    def lines(self) -> list[str]:
        """Where results are."""
        lines = [] if self.file is None else [f"robot file: {self.file}"]
        lines += [] if self.folder is None else [f"results: {self.folder}"]
        return lines

    def figures(self) -> dict[str, Callable[[], Figure]]:
        """How the score rose; what goals cost each other; which points moved."""
        figures: dict[str, Callable[[], Figure]] = {"progress": partial(_progress, self)}
        if len(self.search.names) > 1:
            figures["pareto"] = partial(_pareto, self)
        if self.search.best is not None:
            figures["points"] = partial(_points, self)
        return figures

    def write(self, folder: Folder) -> None:
        """Writes the table of designs, then the numbers."""
        search, front = self.search, set(self.search.front.tolist())
        text = io.StringIO(newline="")
        rows = csv.writer(text)
        coordinates = [f"x{k + 1}" for k in range(search.candidates.size)]
        rows.writerow(["design", "cables", *coordinates, *search.names, "score", "on_front"])
        for k, x in enumerate(search.coordinates):
            cables = " ".join(str(c + 1) for c in search.candidates.cable_sets[search.sets[k]])
            values = _named(search.names, search.values[k]).values()
            rows.writerow([k, cables, *x.tolist(), *values, search.scores[k], k in front])
        with folder.file(TABLE) as part:
            part.write_bytes(text.getvalue().encode())
        folder.write_json(RESULTS, self.as_dict())


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
        if folder is None and follow.results is not None:
            folder = follow.results / _name(loaded.name, candidates.text, settings)
        where = folder or Path(stack.enter_context(TemporaryDirectory()), "design")
        judging = goal_context(name, settings.poses, settings)
        arguments = search_arguments(candidates, settings, judging)
        results = stack.enter_context(Folder(Path(where), arguments, overwrite, grows=True))
        try:
            # A robot that was given as one is searched as such.
            subject = robot if isinstance(robot, Robot) else name
            solution = search_design(
                subject, candidates, settings, results, workers=workers, follow=follow
            )
        except DesignError as problem:
            if goals or parameters is None:
                raise
            raise DesignError(f"{source}: {problem}") from problem
        design = Design(loaded.name, solution, geometry=loaded.geometry_words(),
                        folder=None if folder is None else results.path)  # fmt: skip
        if solution.complete and solution.best is not None:

            def say(words: str) -> None:
                follow.progress(Progress(words, 1.0, 1.0))

            file = write_design(solution, loaded.name, results)
            proofs = (
                confirm(goal, name, str(file), solution.judging, boxes=boxes, say=say,
                        should_stop=follow.stop) for goal in solution.names
            )  # fmt: skip
            design = replace(design, confirmed=tuple(filter(None, proofs)))
        if folder is not None and not design.interrupted:
            written(design, results, formats, follow)
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


def _name(robot: str, text: str, settings: DesignSettings) -> str:
    """Name of a folder that the same robot and settings find again."""
    arguments = {"robot": text, "settings": repr(replace(settings, generations=1))}
    digest = hashlib.sha256(json.dumps(arguments, sort_keys=True).encode()).hexdigest()
    return f"{robot}-{digest[:8]}"


def write_design(search: DesignSearch, robot: str, folder: Folder) -> Path:
    """Writes the robot file of the best design, which loads as any other, and returns its path.

    Raises:
        DesignError: No design could be judged.
    """
    best = search.best
    if best is None:
        raise DesignError("design: no design could be judged; accepted: smaller reaches")
    title = f"{robot}, design of {len(search.values)} judged for {', '.join(search.names)}"
    text = search.candidates.robot_text(search.sets[best], search.coordinates[best], title)
    folder.write_text(ROBOT_FILE, text)
    load_robot(str(folder.path / ROBOT_FILE))
    return folder.path / ROBOT_FILE


def _named(names: Sequence[str], values: Array) -> dict[str, float | None]:
    """Goals by name, as they are: not with the sign changed."""
    return {
        name: None if not np.isfinite(value) else float(-value if GOALS[name].smaller else value)
        for name, value in zip(names, values, strict=True)
    }


def _progress(design: Design) -> Figure:
    from cdpr_drake.analyses.visualization.figure_style import new_figure

    figure, axes = new_figure(1, 1, (7.5, 5.0), f"{design.robot}: search")
    _draw_progress(axes, design.search)
    return figure


def _pareto(design: Design) -> Figure:
    from cdpr_drake.analyses.visualization.figure_style import new_figure

    search, names = design.search, design.search.names
    pairs = list(pairwise(names))
    size = (6.5 * len(pairs), 5.5)
    figure, axes = new_figure(1, len(pairs), size, f"{design.robot}: what goals cost each other")
    for panel, (x, y) in zip(np.atleast_1d(axes), pairs, strict=True):
        _draw_front(panel, search, names.index(x), names.index(y))
    return figure


def _points(design: Design) -> Figure:
    from cdpr_drake.analyses.visualization.figure_style import new_figure

    figure, axes = new_figure(1, 2, (12.0, 5.5), f"{design.robot}: points moved")
    _draw_points(axes, design.search)
    return figure


def _draw_progress(axes: Any, search: DesignSearch) -> None:
    from cdpr_drake.analyses.visualization.figure_style import line_style

    for number in range(len(search.candidates.cable_sets)):
        chosen = search.scores[search.sets == number]
        if not len(chosen):
            continue
        look = nth_look(number)
        words = f"{len(search.candidates.cable_sets[number])} cables"
        index = np.arange(1, len(chosen) + 1)
        axes.plot(index, chosen, ".", color=look.color, markersize=3, alpha=0.5)
        best = np.fmax.accumulate(chosen)
        axes.step(
            index, best, where="post", color=look.color, linestyle=look.dash, label=f"best, {words}"
        )
    weights = np.array([goal.weight for goal in search.settings.goals])
    original = np.where(np.isfinite(search.original), np.sign(search.original), 0.0) @ weights
    axes.axhline(original, **line_style(IDEAL), label="robot as it is")
    axes.set(xlabel="designs judged", ylabel="score (robot as it is: 1 for each weight)")
    axes.legend(loc="lower right")


def _draw_front(axes: Any, search: DesignSearch, x: int, y: int) -> None:
    sign = np.array([-1.0 if GOALS[name].smaller else 1.0 for name in search.names])
    shown = search.values * sign
    axes.plot(shown[:, x], shown[:, y], ".", color="#a0a0a0", markersize=3, label="designs")
    front = search.front[np.argsort(shown[search.front, x])]
    look = nth_look(1)
    axes.plot(
        shown[front, x], shown[front, y], linestyle=look.dash, marker=look.marker,
        color=look.color, markersize=6, label="no other is better in everything",
    )  # fmt: skip
    original = search.original * sign
    axes.plot(
        original[x], original[y], "*", color="black", markersize=14, label="robot as it is",
    )  # fmt: skip
    if search.best is not None:
        best = shown[search.best]
        axes.plot(
            best[x], best[y], "D", markerfacecolor="none", markeredgecolor=PLATFORM.color,
            markeredgewidth=2, markersize=11, label="best score",
        )  # fmt: skip
    for axis, k in ((axes.set_xlabel, x), (axes.set_ylabel, y)):
        name = search.names[k]
        unit = "" if GOALS[name].unit == "-" else f" [{GOALS[name].unit}]"
        axis(f"{name}{unit}" + (", less is better" if GOALS[name].smaller else ""))
    axes.legend(loc="best")


def _draw_points(axes: Any, search: DesignSearch) -> None:
    from cdpr_drake.analyses.visualization.figure_style import few_ticks

    assert search.best is not None
    candidates = search.candidates
    before = parse_robot(candidates.text, Path("robot"))
    after = candidates.robot(search.sets[search.best], search.coordinates[search.best])
    cables = list(candidates.cable_sets[search.sets[search.best]])
    old_set, new_set = before.cable_set(), after.cable_set()
    for panel, title, frame, old, new in (
        (axes[0], "exit points, from above", "W", old_set.p_WA, new_set.p_WA),
        (axes[1], "anchor points, from above", "P", old_set.p_PB, new_set.p_PB),
    ):
        panel.plot(
            old[0], old[1], "o", markerfacecolor="none", color="black", label="robot as it is"
        )
        panel.plot(new[0], new[1], "s", color=nth_look(0).color, markersize=5, label="best design")
        for k, i in enumerate(cables):
            panel.plot([old[0, i], new[0, k]], [old[1, i], new[1, k]], "-", color="#707070", lw=1)
        places: dict[tuple[float, ...], list[str]] = {}
        for i in cables:
            places.setdefault(tuple(old[:2, i].tolist()), []).append(before.cables[i].name)
        for place, names in places.items():
            inward = (-12 if place[0] > 0.0 else 8, -14 if place[1] > 0.0 else 8)
            panel.annotate(", ".join(names), place, xytext=inward, textcoords="offset points",
                         ha="right" if place[0] > 0.0 else "left")  # fmt: skip
        few_ticks(panel.xaxis)
        panel.set(
            xlabel=f"x in {frame} [m]", ylabel=f"y in {frame} [m]", title=title, aspect="equal"
        )  # fmt: skip
        panel.legend(loc="center")

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
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from cyclopts import Parameter

from cdpr_drake.analyses.design.candidates import make_candidates
from cdpr_drake.analyses.design.confirmation import BOXES, Confirmation, confirm
from cdpr_drake.analyses.design.goals import GOALS, goal_signs
from cdpr_drake.analyses.design.search import DesignSearch, goal_context, search_design
from cdpr_drake.analyses.design.settings import (
    SEARCHES,
    DesignSettings,
    GoalSettings,
    load_design_settings,
)
from cdpr_drake.analyses.frame.folder import Folder
from cdpr_drake.analyses.frame.follow import NOBODY, Follow
from cdpr_drake.analyses.frame.result import STOPPED, Result, Table
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
from cdpr_drake.analyses.planning.plans import written
from cdpr_drake.analyses.reporting.provenance import code_version, package_versions
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
        return STOPPED if self.interrupted else 0

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
        signs = goal_signs(search.names)
        before = [f"{value:.5g}" for value in signs * search.original]
        after = ["-"] * len(signs)
        if best is not None:
            after = [f"{value:.5g}" for value in signs * search.values[best]]
        units = [GOALS[name].unit for name in search.names]
        title = (
            f"{self.robot}, {self.geometry}: goals on the search's grid, {len(search.values)} "
            "designs"
        )
        rows = list(zip(search.names, units, before, after, strict=True))
        tables = [Table(title, ("goal", "unit", "robot", "best design"), rows)]
        if self.confirmed:
            headings = ("goal", "robot", "best design", "unit", "open", "gain", "how")
            tables.append(Table("Proven of both, not by the search", headings, [
                (proof.goal, f"{proof.original:.5g}", f"{proof.design:.5g}", proof.unit,
                 f"{proof.original_open:.3g}, {proof.design_open:.3g}",
                 "-" if proof.gain is None else f"{100.0 * proof.gain:+.1f} %", proof.method)
                for proof in self.confirmed
            ]))  # fmt: skip
        return tables

    def lines(self) -> list[str]:
        """Where results are."""
        lines = [] if self.file is None else [f"robot file: {self.file}"]
        lines += [] if self.folder is None else [f"results: {self.folder}"]
        return lines

    def figures(self) -> dict[str, Callable[[], Figure]]:
        """How the score rose; what goals cost each other; which points moved."""
        figures = {"progress": self._progress}
        if len(self.search.names) > 1:
            figures["pareto"] = self._pareto
        if self.search.best is not None:
            figures["points"] = self._points
        return figures

    def _progress(self) -> Figure:
        from cdpr_drake.analyses.frame.figures import line_style, new_figure

        search = self.search
        figure, axes = new_figure(1, 1, (7.5, 5.0), f"{self.robot}: search")
        for number, cables in enumerate(search.candidates.cable_sets):
            scores = search.scores[search.sets == number]
            if not len(scores):
                continue
            look, index = nth_look(number), np.arange(1, len(scores) + 1)
            axes.plot(index, scores, ".", color=look.color, markersize=3, alpha=0.5)
            axes.step(
                index, np.fmax.accumulate(scores), where="post", color=look.color,
                linestyle=look.dash, label=f"best, {len(cables)} cables",
            )  # fmt: skip
        weights = np.array([goal.weight for goal in search.settings.goals])
        original = np.where(np.isfinite(search.original), np.sign(search.original), 0.0) @ weights
        axes.axhline(original, **line_style(IDEAL), label="robot as it is")
        axes.set(xlabel="designs judged", ylabel="score (robot as it is: 1 for each weight)")
        axes.legend(loc="lower right")
        return figure

    def _pareto(self) -> Figure:
        from cdpr_drake.analyses.frame.figures import new_figure

        search, signs, look = self.search, goal_signs(self.search.names), nth_look(1)
        pairs = list(pairwise(range(len(signs))))
        title = f"{self.robot}: what goals cost each other"
        figure, panels = new_figure(1, len(pairs), (6.5 * len(pairs), 5.5), title)
        values, original = search.values * signs, search.original * signs
        labels = [
            name + ("" if GOALS[name].unit == "-" else f" [{GOALS[name].unit}]")
            + (", less is better" if GOALS[name].smaller else "")
            for name in search.names
        ]  # fmt: skip
        for axes, (x, y) in zip(np.atleast_1d(panels), pairs, strict=True):
            axes.plot(
                values[:, x], values[:, y], ".", color="#a0a0a0", markersize=3, label="designs"
            )
            front = search.front[np.argsort(values[search.front, x])]
            axes.plot(
                values[front, x], values[front, y], linestyle=look.dash, marker=look.marker,
                color=look.color, markersize=6, label="no other is better in everything",
            )  # fmt: skip
            axes.plot(
                original[x], original[y], "*", color="black", markersize=14, label="robot as it is"
            )
            if search.best is not None:
                best = values[search.best]
                axes.plot(
                    best[x], best[y], "D", markerfacecolor="none", markeredgecolor=PLATFORM.color,
                    markeredgewidth=2, markersize=11, label="best score",
                )  # fmt: skip
            axes.set(xlabel=labels[x], ylabel=labels[y])
            axes.legend(loc="best")
        return figure

    def _points(self) -> Figure:
        from cdpr_drake.analyses.frame.figures import few_ticks, new_figure

        search = self.search
        assert search.best is not None
        figure, panels = new_figure(1, 2, (12.0, 5.5), f"{self.robot}: points moved")
        before = parse_robot(search.candidates.text, Path("robot"))
        after = search.candidates.robot(search.sets[search.best], search.coordinates[search.best])
        cables = list(search.candidates.cable_sets[search.sets[search.best]])
        for axes, kind, frame, old, new in (
            (panels[0], "exit", "W", before.exit_points(), after.exit_points()),
            (panels[1], "anchor", "P", before.anchor_points(), after.anchor_points()),
        ):
            axes.plot(*old[:2], "o", markerfacecolor="none", color="black", label="robot as it is")
            axes.plot(*new[:2], "s", color=nth_look(0).color, markersize=5, label="best design")
            places: dict[tuple[float, ...], list[str]] = {}
            for k, i in enumerate(cables):
                axes.plot(*np.array([old[:2, i], new[:2, k]]).T, "-", color="#707070", lw=1)
                places.setdefault(tuple(old[:2, i].tolist()), []).append(before.cables[i].name)
            for (x, y), names in places.items():
                axes.annotate(
                    ", ".join(names), (x, y), textcoords="offset points",
                    xytext=(-12 if x > 0.0 else 8, -14 if y > 0.0 else 8),
                    ha="right" if x > 0.0 else "left",
                )  # fmt: skip
            few_ticks(axes.xaxis)
            axes.set(
                xlabel=f"x in {frame} [m]", ylabel=f"y in {frame} [m]",
                title=f"{kind} points, from above", aspect="equal",
            )  # fmt: skip
            axes.legend(loc="center")
        return figure

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
            solution = search_design(
                candidates, settings, judging, results, workers=workers, follow=follow
            )
        except DesignError as problem:
            if goals or parameters is None:
                raise
            raise DesignError(f"{source}: {problem}") from problem
        design = Design(loaded.name, solution, geometry=loaded.geometry_words(),
                        folder=None if folder is None else results.path)  # fmt: skip
        if solution.complete and solution.best is not None:
            file = _write_robot(solution, solution.best, loaded.name, results)
            proofs = (
                confirm(goal, name, str(file), judging, boxes=boxes, follow=follow)
                for goal in solution.names
            )
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


def _write_robot(search: DesignSearch, best: int, robot: str, folder: Folder) -> Path:
    """Writes the robot file of the best design, which loads as any other, and returns its path."""
    title = f"{robot}, design of {len(search.values)} judged for {', '.join(search.names)}"
    text = search.candidates.robot_text(search.sets[best], search.coordinates[best], title)
    folder.write_text(ROBOT_FILE, text)
    load_robot(str(folder.path / ROBOT_FILE))
    return folder.path / ROBOT_FILE


def _named(names: Sequence[str], values: Array) -> dict[str, float | None]:
    """Goals by name, as they are: not with the sign changed."""
    return {
        name: float(value) if np.isfinite(value) else None
        for name, value in zip(names, values * goal_signs(names), strict=True)
    }

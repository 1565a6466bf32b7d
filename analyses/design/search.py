"""The search for a design: generations of candidates, each of which is kept as it is judged."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.design.candidates import Candidates
from cdpr_drake.analyses.design.goals import GoalContext, check_goals, evaluate_goals
from cdpr_drake.analyses.design.search_methods import (
    SLOPES,
    EvolutionSearch,
    Slopes,
    SlopeSearch,
    default_population,
    pareto_front,
)
from cdpr_drake.analyses.design.settings import BY_SLOPES, DesignSettings, PosesSettings
from cdpr_drake.analyses.frame.folder import Folder
from cdpr_drake.analyses.frame.follow import NOBODY, Count, Follow
from cdpr_drake.analyses.frame.jobs import Processes, finished_jobs
from cdpr_drake.analyses.reporting.provenance import code_version
from cdpr_drake.analyses.workspaces.pose_grid import plain
from cdpr_drake.analyses.workspaces.stability_defaults import workspace_defaults
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError, DesignError
from cdpr_drake.models.robot_loader import as_robot, parse_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.numerics.own_terms import ProgramReport
from cdpr_drake.schema.json_text import load_json
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet
from cdpr_drake.workspaces.pose_grid import grid_by_count

JUDGED = "judged.jsonl"
"""Goals of each design, a line each, as it is judged."""


@dataclass(frozen=True, eq=False)
class DesignSearch:
    """What a search found.

    Attributes:
        candidates: The designs that there may be.
        settings: What was wanted.
        judging: What designs were judged by.
        original: Goals of the robot as it is, larger is better, shape (goals,).
        sets: Number of the set of cables of each design judged, shape (n,).
        coordinates: The designs, in the order of the search, shape (n, size).
        values: Their goals, larger is better, shape (n, goals).
        scores: Weighted sums, as `scores_of`, shape (n,).
        complete: True if it was not stopped.
        earlier: How many of the designs an earlier command had judged.
        wall_time: Time that the search took [s].
        program: Of a `DesignProgram` with own terms, how it was solved; None: by a search.
    """

    candidates: Candidates
    settings: DesignSettings
    judging: GoalContext
    original: Array
    sets: np.ndarray
    coordinates: Array
    values: Array
    scores: Array
    complete: bool = True
    earlier: int = 0
    wall_time: float = 0.0
    program: ProgramReport | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the goals."""
        return tuple(goal.name for goal in self.settings.goals)

    @property
    def best(self) -> int | None:
        """Number of the design of the largest score; None where none could be judged."""
        return int(np.nanargmax(self.scores)) if np.any(np.isfinite(self.scores)) else None

    @property
    def front(self) -> np.ndarray:
        """Numbers of the designs that no other one is better than in everything."""
        return np.flatnonzero(pareto_front(self.values))


def goal_context(robot: Robot | str, poses: PosesSettings, settings: DesignSettings) -> GoalContext:
    """What designs of a robot are judged by.

    Raises:
        CdprError: The box is empty or outside the robot's frame.
    """
    name = robot.name if isinstance(robot, Robot) else robot
    robot = as_robot(robot)
    defaults = workspace_defaults(robot, name)
    lower = defaults.lower if poses.lower is None else poses.lower
    upper = defaults.upper if poses.upper is None else poses.upper
    if np.any(lower > upper):
        raise DesignError("poses: found lower above upper; accepted: lower <= upper [m]")
    lowest, highest = robot.frame.bounds()
    if np.any(lower < lowest) or np.any(upper > highest):
        raise DesignError(
            f"poses: found a box that leaves the frame of {robot.name}; accepted: one in it"
        )
    counts = [
        1 if low == high else int(n)
        for low, high, n in zip(lower, upper, poses.counts, strict=True)
    ]
    turn = np.radians(poses.turn_deg)
    axes = [row for row in robot.motion_type().rows or () if row < 3]
    angles = [np.zeros(3)]
    if turn > 0.0:
        angles += [sign * turn * np.eye(3)[axis] for axis in axes for sign in (1.0, -1.0)]
    grid = grid_by_count(lower, upper, counts, [tuple(a) for a in angles])
    half = np.array([settings.moment] * 3 + [settings.force] * 3)
    required = SpatialSet(box=half) if np.any(half > 0.0) else None
    return GoalContext(grid, required, defaults.bounds)


def scores_of(values: Array, original: Array, settings: DesignSettings) -> Array:
    """Weighted sums of goals, each relative to the robot as it is, shape (n,).

    A goal that is 0 there counts as it is; one that is infinite or NaN there is judged by sign.
    """
    weights = np.array([goal.weight for goal in settings.goals])
    size = np.where(np.isfinite(original) & (original != 0.0), np.abs(original), 1.0)
    return np.asarray(values, float) / size @ weights


def evaluate_original(candidates: Candidates, judging: GoalContext, names: Sequence[str]) -> Array:
    """Goals of the robot as it is, with all its cables, larger is better.

    Raises:
        CdprError: It cannot be asked for a goal; says why.
    """
    robot = parse_robot(candidates.text, Path("robot"))
    check_goals(robot, judging, names)
    return evaluate_goals(robot, judging, tuple(names))


def search_design(
    robot: Robot | str,
    candidates: Candidates,
    settings: DesignSettings,
    folder: Folder | None = None,
    *,
    workers: int | str | None = 1,
    follow: Follow = NOBODY,
) -> DesignSearch:
    """Searches the best design of each set of cables by evolution, or by slopes.

    With a folder that an earlier search of the same arguments has left the search goes on: designs
    are kept one by one, and the search, which follows from their goals, is replayed.

    Args:
        robot: The robot, or its name or path.
        candidates: What it may become.
        settings: What is wanted.
        folder: Open folder of `search_arguments`; None: nothing is kept.
        workers: As of `finished_jobs`; the kernels of one process use all processors.
        follow: Who follows.

    Raises:
        OutputFolderError: The folder cannot be written.
        CdprError: The robot cannot be asked for a goal.
    """
    slopes = _slopes_of(settings)
    judging = goal_context(robot, settings.poses, settings)
    names = tuple(goal.name for goal in settings.goals)
    original = evaluate_original(candidates, judging, names)
    search = _Search(candidates, settings, judging, names, original, folder, workers, follow)
    with search.standing:
        for number in range(len(candidates.cable_sets)):
            if candidates.size and slopes is not None:
                complete = search.by_slopes(number, slopes)
            else:
                complete = search.by_evolution(number)
            if not complete:
                break
    values = np.array(search.values).reshape(-1, len(names))
    return DesignSearch(
        candidates, settings, judging, original, np.array(search.sets, int),
        np.array(search.designs).reshape(-1, candidates.size), values,
        scores_of(values, original, settings), complete, search.earlier,
        time.perf_counter() - search.count.began,
    )  # fmt: skip


def _slopes_of(settings: DesignSettings) -> Slopes | None:
    """Slopes of the only goal, if they are asked for; None by evolution.

    Raises:
        DesignError: There are none of what is wanted.
    """
    if settings.search != BY_SLOPES:
        return None
    names = [goal.name for goal in settings.goals]
    if len(names) != 1 or names[0] not in SLOPES:
        raise DesignError(
            f"search: found slopes for {', '.join(names)}; accepted with slopes: one goal of "
            f"{', '.join(SLOPES)}"
        )
    return SLOPES[names[0]]


def judged(
    candidates: Candidates, names: tuple[str, ...], judging: GoalContext,
    design: tuple[int, Array],
) -> list[float]:  # fmt: skip
    """Goals of a design, a set of cables and coordinates, larger is better; NaN if it cannot be."""
    try:
        return evaluate_goals(candidates.robot(*design), judging, names).tolist()
    except CdprError:  # no robot at all, or one that cannot be asked
        return [np.nan] * len(names)


class _Search:
    """What was judged so far, and where the search stands."""

    def __init__(
        self, candidates: Candidates, settings: DesignSettings, judging: GoalContext,
        names: tuple[str, ...], original: Array, folder: Folder | None, workers: int | str | None,
        follow: Follow,
    ) -> None:  # fmt: skip
        self.sets: list[int] = []
        self.designs: list[Array] = []
        self.values: list[Array] = []
        self.standing = Processes()
        self.earlier = 0
        self._candidates, self._settings, self._judging = candidates, settings, judging
        self._original, self._folder, self._workers = original, folder, workers
        self._work = partial(judged, candidates, names, judging)
        self._follow, self._best, self._said = follow, -np.inf, set[str]()
        self._known = {} if folder is None or not folder.resumed else _read(folder.path / JUDGED)
        if folder is not None and self._known:  # without a line that a kill has cut
            lines = (json.dumps(item) + "\n" for item in self._known.items())
            folder.write_text(JUDGED, "".join(lines))
        slopes = settings.search == BY_SLOPES
        self._population = settings.population or default_population(candidates.size)
        each = self._population if candidates.size and not slopes else 1
        rounds = settings.generations if candidates.size else 1
        total = len(candidates.cable_sets) * rounds * each
        self.count = Count(follow, total, min(len(self._known), total), unit="designs")

    def by_evolution(self, number: int) -> bool:
        """Seeks the best design of a set of cables; a set that cannot change is judged once.

        Returns:
            False if it was stopped.
        """
        size, settings = self._candidates.size, self._settings
        search = EvolutionSearch(size, self._population, settings.seed) if size else None
        for generation in range(settings.generations if size else 1):
            X = np.zeros((1, 0)) if search is None else search.ask()
            values = self._judge(f"set{number}-generation{generation:04d}", number, X)
            if values is None:
                return False
            if search is not None:
                search.tell(self._scores(values))
        return True

    def by_slopes(self, number: int, slopes: Slopes) -> bool:
        """Seeks the best design of a set of cables, one design after the other.

        Slopes are computed again when a search goes on: they follow from the design.

        Returns:
            False if it was stopped.
        """
        search, most = SlopeSearch(self._candidates.size), self._settings.generations
        for step in range(most):
            design = search.ask()
            values = self._judge(f"set{number}-step{step:04d}", number, design[np.newaxis])
            if values is None:
                return False
            value = float(values[0, 0])
            every, by = np.empty(0), np.empty((0, len(design)))
            if search.wants_slopes(value):
                every, by = slopes(self._candidates, number, design, self._judging)
            search.tell(value, every, by)
            if search.ended:
                self.count.total -= most - step - 1
                break
        return True

    def _judge(self, name: str, number: int, X: Array) -> Array | None:
        """Goals of designs, shape (n, goals); None if it was stopped before all were judged."""
        keys = [f"{name}-{k}" for k in range(len(X))]
        lacking = [k for k, key in enumerate(keys) if key not in self._known]
        self.earlier += len(X) - len(lacking)
        for finished in finished_jobs(
            self._work, [(number, X[k]) for k in lacking], self._workers, stop=self._follow.stop,
            say=self._say, name="design", standing=self.standing,
        ):  # fmt: skip
            if finished.problem is not None:
                raise finished.problem
            self._keep(keys[lacking[finished.number]], finished.result or [])
            best = f"best {self._best:.4g}" if np.isfinite(self._best) else name
            self.count.add(1, best)
        values = [self._known[key] for key in keys if key in self._known]
        if len(values) < len(X):
            return None
        goals = np.array(values, float).reshape(len(X), -1)
        self.sets += [number] * len(X)
        self.designs += list(X)
        self.values += list(goals)
        finite = np.all(np.isfinite(goals), axis=1)
        self._best = max([self._best, *self._scores(goals)[finite]])
        return goals

    def _say(self, words: str) -> None:
        """Says words of a cluster once, not in each generation."""
        if words not in self._said:
            self._said.add(words)
            self._follow.say(words)

    def _keep(self, key: str, values: list[float]) -> None:
        self._known[key] = values
        if self._folder is not None:
            with self._folder.writing(), self._folder.claim(JUDGED).open("a") as file:
                file.write(json.dumps([key, values]) + "\n")

    def _scores(self, values: Array) -> Array:
        return scores_of(values, self._original, self._settings)


def _read(path: Path) -> dict[str, list[float]]:
    """Goals of judged designs by their keys; a line that a kill has cut does not count.

    Raises:
        DesignError: A line is none that this program wrote.
    """
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True) if path.exists() else []
    try:
        return dict(load_json(line) for line in lines if line.endswith("\n"))
    except (ValueError, TypeError) as problem:
        raise DesignError(f"{path}: found no lines of a search: {problem}") from problem


def search_arguments(
    candidates: Candidates, settings: DesignSettings, judging: GoalContext
) -> dict[str, Any]:
    """All that the numbers depend on, for JSON."""
    arguments: dict[str, Any] = plain(
        {
            "cdpr_drake": code_version(),
            "robot": candidates.text,
            "settings": replace(settings, generations=1),  # more of them go on
            "grid": judging.grid,
            "bounds": judging.bounds.as_dict(),
        }
    )
    return arguments

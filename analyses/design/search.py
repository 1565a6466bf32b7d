"""The search for a design: by evolution, or by slopes; each design is kept as it is judged.

* `evolve` is CMA-ES by the package cmaes, a generation at a time; it needs no gradients.
* `climb` seeks the largest least value of many smooth functions by their slopes; `SLOPES` has
  those of goals by the coordinates of a design.

Source: Hansen and Ostermeier, Completely derandomized self-adaptation in evolution strategies,
2001; see `climb`.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Generator, Sequence
from functools import cache, partial
from itertools import count
from pathlib import Path

import numpy as np
from scipy.optimize import linprog

from cdpr_drake.analyses.design.candidates import Candidates
from cdpr_drake.analyses.design.design_result import Design
from cdpr_drake.analyses.design.goals import GoalContext, check_goals, evaluate_goals
from cdpr_drake.analyses.design.settings import BY_SLOPES, DesignSettings
from cdpr_drake.analyses.frame.folder import Folder
from cdpr_drake.analyses.frame.follow import NOBODY, Count, Follow
from cdpr_drake.analyses.frame.jobs import Processes, finished_jobs
from cdpr_drake.analyses.workspaces.robot_conditions import pose_conditions
from cdpr_drake.analyses.workspaces.stability_defaults import workspace_defaults
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError, DesignError, install_words
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.json_text import load_json
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet, resisting
from cdpr_drake.workspaces.pose_grid import grid_by_count
from cdpr_drake.workspaces.wrench_capacity import margin_slopes

JUDGED = "judged.jsonl"
"""Goals of each design, a line each, as it is judged."""

STEP = 0.2
"""Standard deviation of the first generation, of boxes of width 1."""

REFUSED = 1e9
"""Score, with the sign changed, of designs that cannot be judged."""

FIRST_STEP, LARGEST_STEP, SMALLEST_STEP = 0.1, 0.5, 1e-4
"""Half widths of the box around the best design in which slopes are believed, of boxes of width 1:
at first, at most, and where the search ends."""

GOOD = 0.1
"""Share of the promised gain from which on a step is accepted; from half on the box grows."""


def goal_context(robot: Robot | str, settings: DesignSettings) -> GoalContext:
    """Poses, wrenches and bounds by which designs of a robot are judged.

    Raises:
        CdprError: The box of poses is empty or outside the robot's frame.
    """
    name = robot.name if isinstance(robot, Robot) else robot
    robot, poses = as_robot(robot), settings.poses
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
    counts = np.where(lower == upper, 1, poses.counts).astype(int).tolist()
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
    check_goals(candidates.present, judging, names)
    return evaluate_goals(candidates.present, judging, names)


def search_design(
    candidates: Candidates, settings: DesignSettings, judging: GoalContext,
    folder: Folder | None = None, *, workers: int | str | None = 1, follow: Follow = NOBODY,
) -> Design:  # fmt: skip
    """Searches the best design of each set of cables by evolution, or by slopes.

    With a folder that an earlier search of the same arguments has left the search goes on: designs
    are kept one by one, and the search, which follows from their goals, is replayed.

    Args:
        candidates: The designs that there may be.
        settings: Goals, and how long to search.
        judging: As `goal_context`.
        folder: Open folder; None: nothing is kept.
        workers: As of `finished_jobs`; the kernels of one process use all processors.
        follow: Who follows.

    Raises:
        OutputFolderError: The folder cannot be written.
        CdprError: The robot cannot be asked for a goal, or there are no slopes of them.
    """
    names = settings.goal_names
    by_slopes = settings.search == BY_SLOPES
    if by_slopes and not (len(names) == 1 and names[0] in SLOPES):
        raise DesignError(
            f"search: found slopes for {', '.join(names)}; accepted with slopes: one goal of "
            f"{', '.join(SLOPES)}"
        )
    judge = _Judge(candidates, settings, judging, folder, workers, follow)
    began = time.perf_counter()
    size, most = candidates.size, settings.generations if candidates.size else 1
    population = settings.population or 4 + math.floor(3 * math.log(max(size, 1)))  # as Hansen
    judge.expect(len(candidates.cable_sets) * most * (population if size and not by_slopes else 1))
    complete = True
    with judge.processes:
        for number in range(len(candidates.cable_sets)):
            if by_slopes and size:
                slopes_at = partial(SLOPES[names[0]], candidates, number, judging)
                search, word = climb(size, most, slopes_at), "step"
            else:
                search = evolve(size, population, most, settings.seed, judge.scores)
                word = "generation"
            complete = judge.follow_search(search, f"set{number}-{word}", number, most)
            if not complete:
                break
    values = np.array(judge.values).reshape(-1, len(names))
    return Design(
        candidates, settings, judging, judge.original, np.array(judge.sets, int),
        np.array(judge.designs).reshape(-1, size), values, judge.scores(values), complete,
        judge.earlier, time.perf_counter() - began,
    )  # fmt: skip


Search = Generator[Array, Array, None]
"""Yields designs, shape (n, size), and is sent their goals, larger is better, shape (n, goals); NaN
where a design cannot be judged."""


def evolve(
    size: int, population: int, generations: int, seed: int, score: Callable[[Array], Array]
) -> Search:
    """Seeks the largest score by evolution, from the middle of the box [0, 1]^size.

    Args:
        size: Number of coordinates; of 0 the only design is asked for once.
        population: Designs of a generation.
        generations: Number of generations.
        seed: Of the random numbers.
        score: Scores of goals, shape (n,).

    Raises:
        DesignError: The package cmaes is not installed.
    """
    if size == 0:
        yield np.zeros((1, 0))
        return
    try:
        from cmaes import CMA
    except ImportError as problem:
        raise DesignError(
            f"design: the package cmaes is not installed; {install_words('design')}"
        ) from problem
    padded = max(size, 2)  # CMA wants several coordinates: the second of one does nothing
    search = CMA(
        mean=np.full(padded, 0.5), sigma=STEP, bounds=np.tile([0.0, 1.0], (padded, 1)), seed=seed,
        population_size=population,
    )  # fmt: skip
    for _ in range(generations):
        designs = [search.ask() for _ in range(population)]
        scores = score((yield np.array(designs)[:, :size]))
        losses = np.where(np.isfinite(scores), -scores, REFUSED)
        search.tell(list(zip(designs, losses.tolist(), strict=True)))


def climb(size: int, most: int, slopes_at: Callable[[Array], tuple[Array, Array]]) -> Search:
    """Seeks the largest least value of many smooth functions by their slopes.

    It asks for one design after the other, from the middle of the box [0, 1]^size, whose only goal
    is the least value. Each step is a linear program: the largest least value of the linearised
    functions within a box around the best design, whose size follows how well the last promise was
    kept. Where one function is the least alone that is an ascent along its slope; where several
    are, it goes between them, which an ascent could not.

    Args:
        size: Number of coordinates.
        most: Largest number of designs.
        slopes_at: All values at a design, shape (n,), and their slopes, shape (n, size).

    Source: Madsen, An algorithm for minimax solution of overdetermined systems of non-linear
    equations, 1975; Nocedal and Wright, Numerical Optimization, 4.
    """
    design, step, promised = np.full(size, 0.5), FIRST_STEP, np.inf
    best, value = design, -np.inf
    values, slopes = np.empty(0), np.empty((0, size))
    for _ in range(most):
        least = float((yield design[np.newaxis])[0, 0])
        gain = least - value
        if np.isfinite(value):
            share = gain / promised if np.isfinite(gain) else -np.inf
            if share < GOOD:
                step *= 0.4
            elif share > 0.5:
                step = min(1.5 * step, LARGEST_STEP)
        elif not np.isfinite(least):
            return  # the first design is refused, and there are no slopes
        if gain > 0.0:
            best, value = design, least
            values, slopes = slopes_at(best)
        if step < SMALLEST_STEP:
            return
        low, high = np.maximum(-step, -best), np.minimum(step, 1.0 - best)
        program = linprog(  # the largest t with values + slopes s >= t
            np.append(np.zeros(size), -1.0),
            A_ub=np.hstack([-slopes, np.ones((len(values), 1))]), b_ub=values,
            bounds=[*zip(low, high, strict=True), (None, None)], method="highs",
        )  # fmt: skip
        promised = -np.inf if program.x is None else float(program.x[-1] - value)
        if promised <= 1e-9 * max(abs(value), 1e-9):
            return
        design = np.clip(best + program.x[:-1], 0.0, 1.0)


Slopes = Callable[[Candidates, int, GoalContext, Array], tuple[Array, Array]]
"""Values at all poses of the grid, shape (n,), and their slopes by the coordinates, (n, size)."""


def _capacity_margin(
    candidates: Candidates, number: int, judging: GoalContext, coordinates: Array
) -> tuple[Array, Array]:
    robot, grid = candidates.robot(number, coordinates), judging.grid
    about = pose_conditions(robot, required=judging.required)
    positions, rotations = grid.positions(0, grid.size), grid.rotations(0, grid.size)
    demand = resisting(about.case, about.required or SpatialSet(), rotations)
    slopes = margin_slopes(about.case, positions, rotations, demand)
    cables = list(candidates.cable_sets[number])
    m = candidates.points.reach.shape[1] // 2
    by_points = np.zeros((grid.size, 3, 2 * m))
    by_points[:, :, cables] = slopes.exits
    by_points[:, :, [m + k for k in cables]] = slopes.anchors
    by_coordinates = candidates.points.slopes(by_points)
    # Of the winch, each on a scale of its own logarithm: the largest tension is what it pulls.
    pull, signs = robot.tension_limits(None)[1], {"drum_radius": -1.0}
    winch = [
        slopes.upper * pull * signs.get(name, 1.0) * np.log(high / low)
        for name, (low, high) in candidates.ranges.items()
    ]
    return slopes.found.margins, np.column_stack([by_coordinates, *winch])


SLOPES: dict[str, Slopes] = {"capacity-margin": _capacity_margin}
"""By names of goals."""


def judged(
    candidates: Candidates, names: Sequence[str], judging: GoalContext, design: tuple[int, Array]
) -> list[float]:
    """Goals of a design, a set of cables and coordinates, larger is better; NaN if it cannot be."""
    try:
        return evaluate_goals(candidates.robot(*design), judging, names).tolist()
    except CdprError:  # no robot at all, or one that cannot be asked
        return [np.nan] * len(names)


class _Judge:
    """Judges designs, each of them once, and keeps the goals of all in the folder."""

    def __init__(
        self, candidates: Candidates, settings: DesignSettings, judging: GoalContext,
        folder: Folder | None, workers: int | str | None, follow: Follow,
    ) -> None:  # fmt: skip
        names = settings.goal_names
        self.original = evaluate_original(candidates, judging, names)
        self.sets: list[int] = []
        self.designs: list[Array] = []
        self.values: list[Array] = []
        self.earlier = 0
        self.processes = Processes()
        self.scores = partial(scores_of, original=self.original, settings=settings)
        self._work = partial(judged, candidates, names, judging)
        self._folder, self._workers, self._follow, self._best = folder, workers, follow, -np.inf
        self._say = cache(follow.say)  # words of a cluster once, not in each generation
        self._goals: dict[str, list[float]] = {}
        if folder is not None and folder.resumed:
            self._goals = _read(folder.path / JUDGED)
        if folder is not None and self._goals:  # without a line that a kill has cut
            lines = (json.dumps(item) + "\n" for item in self._goals.items())
            folder.write_text(JUDGED, "".join(lines))

    def expect(self, total: int) -> None:
        """Begins to count that many designs."""
        self._count = Count(self._follow, total, min(len(self._goals), total), unit="designs")

    def follow_search(self, search: Search, name: str, number: int, most: int) -> bool:
        """Judges all that a search of a set of cables asks for; False if it was stopped."""
        X = next(search)
        for k in count():
            values = self._judge(f"{name}{k:04d}", number, X)
            if values is None:
                return False
            try:
                X = search.send(values)
            except StopIteration:
                self._count.total -= most - k - 1
                break
        return True

    def _judge(self, name: str, number: int, X: Array) -> Array | None:
        """Goals of designs, shape (n, goals); None if it was stopped before all were judged."""
        keys = [f"{name}-{k}" for k in range(len(X))]
        lacking = [k for k, key in enumerate(keys) if key not in self._goals]
        self.earlier += len(X) - len(lacking)
        for finished in finished_jobs(
            self._work, [(number, X[k]) for k in lacking], self._workers, stop=self._follow.stop,
            say=self._say, name="design", standing=self.processes,
        ):  # fmt: skip
            if finished.problem is not None:
                raise finished.problem
            self._keep(keys[lacking[finished.number]], finished.result or [])
            best = f"best {self._best:.4g}" if np.isfinite(self._best) else name
            self._count.add(1, best)
        if not all(key in self._goals for key in keys):
            return None
        values = np.array([self._goals[key] for key in keys], float).reshape(len(X), -1)
        self.sets += [number] * len(X)
        self.designs += list(X)
        self.values += list(values)
        finite = np.all(np.isfinite(values), axis=1)
        self._best = max([self._best, *self.scores(values)[finite]])
        return values

    def _keep(self, key: str, goals: list[float]) -> None:
        self._goals[key] = goals
        if self._folder is not None:
            with self._folder.writing(), self._folder.claim(JUDGED).open("a") as file:
                file.write(json.dumps([key, goals]) + "\n")


def _read(path: Path) -> dict[str, list[float]]:
    """Goals of judged designs by their keys; a line that a kill has cut does not count."""
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True) if path.exists() else []
    try:
        return dict(load_json(line) for line in lines if line.endswith("\n"))
    except (ValueError, TypeError) as problem:
        raise DesignError(f"{path}: found no lines of a search: {problem}") from problem

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

import numpy as np
from scipy.optimize import linprog

from cdpr_drake.analyses.design.candidates import Candidates
from cdpr_drake.analyses.design.design_result import Design
from cdpr_drake.analyses.design.goals import GOALS, GoalContext, check_goals, goal_signs
from cdpr_drake.analyses.design.settings import BY_SLOPES, DesignSettings
from cdpr_drake.analyses.frame.folder import Folder
from cdpr_drake.analyses.frame.follow import NOBODY, Count, Follow
from cdpr_drake.analyses.frame.job import FinishedJob
from cdpr_drake.analyses.frame.jobs import Processes, finished_jobs
from cdpr_drake.analyses.workspaces.conditions import CONDITIONS, Poses
from cdpr_drake.analyses.workspaces.robot_conditions import pose_conditions
from cdpr_drake.analyses.workspaces.stability_defaults import workspace_defaults
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError, DesignError, SweepError, install_words
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


def evaluate_design(
    candidates: Candidates, judging: GoalContext, names: Sequence[str],
    design: tuple[int, Array] | None = None,
) -> Array:  # fmt: skip
    """Values of goals, larger is better: those of which less is better with the sign changed.

    Args:
        candidates: The designs that there may be.
        judging: What they are judged by.
        names: Names of `GOALS`.
        design: Number of a set of cables, and coordinates; None: the robot as it is.

    Raises:
        CdprError: There is no such robot, or it cannot be asked.
    """
    robot = candidates.present if design is None else candidates.robot(*design)
    grid, values = judging.grid, []
    at = Poses(0, grid.size, grid.positions(0, grid.size), grid.rotations(0, grid.size))
    for name in names:
        goal = GOALS[name]
        if goal.value is not None:
            values.append(goal.value(robot, judging))
            continue
        about = pose_conditions(robot, required=judging.required)
        numbers = np.asarray(CONDITIONS[goal.condition].value(about, at), float)
        values.append(goal.combine(np.where(np.isfinite(numbers), numbers, 0.0)))
    return np.array(values, float) * goal_signs(names)


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
    check_goals(candidates.present, judging, names)
    original = evaluate_design(candidates, judging, names)
    goals = _read(folder)
    size, most = candidates.size, settings.generations if candidates.size else 1
    population = settings.population or 4 + math.floor(3 * math.log(max(size, 1)))  # as Hansen
    total = len(candidates.cable_sets) * most * (population if size and not by_slopes else 1)
    counter = Count(follow, total, min(len(goals), total), unit="designs")
    score = partial(scores_of, original=original, settings=settings)
    say = cache(follow.say)  # words of a cluster once, not in each generation
    work = partial(evaluate_design, candidates, judging, names)
    began, best, earlier, complete = time.perf_counter(), -np.inf, 0, True
    sets: list[int] = []
    designs: list[Array] = []
    values: list[Array] = []
    with Processes() as standing:
        for number in range(len(candidates.cable_sets)):
            if by_slopes and size:
                slopes_at = partial(SLOPES[names[0]], candidates, number, judging)
                search, word = climb(size, most, slopes_at), "step"
            else:
                search = evolve(size, population, most, settings.seed, score)
                word = "generation"
            X = next(search)
            for k in count():
                name = f"set{number}-{word}{k:04d}"
                keys = [f"{name}-{j}" for j in range(len(X))]
                lacking = [j for j, key in enumerate(keys) if key not in goals]
                earlier += len(X) - len(lacking)
                for job in finished_jobs(
                    work, [(number, X[j]) for j in lacking], workers, stop=follow.stop, say=say,
                    name="design", standing=standing,
                ):  # fmt: skip
                    key = keys[lacking[job.number]]
                    goals[key] = _goals(job, len(names))
                    if folder is not None:
                        with folder.writing(), folder.claim(JUDGED).open("a") as file:
                            file.write(json.dumps([key, goals[key]]) + "\n")
                    counter.add(1, f"best {best:.4g}" if np.isfinite(best) else name)
                complete = all(key in goals for key in keys)
                if not complete:
                    break
                rows = np.array([goals[key] for key in keys], float).reshape(len(X), -1)
                sets += [number] * len(X)
                designs += list(X)
                values += list(rows)
                best = max([best, *score(rows)[np.all(np.isfinite(rows), axis=1)]])
                try:
                    X = search.send(rows)
                except StopIteration:
                    counter.total -= most - k - 1
                    break
            if not complete:
                break
    all_values = np.array(values).reshape(-1, len(names))
    return Design(
        candidates, settings, judging, original, np.array(sets, int),
        np.array(designs).reshape(-1, size), all_values, score(all_values), complete, earlier,
        time.perf_counter() - began,
    )  # fmt: skip


def _goals(job: FinishedJob[Array], count: int) -> list[float]:
    """Goals of a judged design; NaN where it is no robot, or one that cannot be asked.

    Raises:
        SweepError: Its process died, or the cluster cannot be used.
    """
    if job.problem is None and job.result is not None:
        return [float(value) for value in job.result]
    if isinstance(job.problem, CdprError) and not isinstance(job.problem, SweepError):
        return [math.nan] * count
    raise job.problem or SweepError("design: found no goals")


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


def _read(folder: Folder | None) -> dict[str, list[float]]:
    """Goals by keys of designs that an earlier search of a folder has judged."""
    if folder is None or not folder.resumed or not (folder.path / JUDGED).exists():
        return {}
    lines = (folder.path / JUDGED).read_text(encoding="utf-8").splitlines(keepends=True)
    lines = [line for line in lines if line.endswith("\n")]  # a kill may have cut the last one
    folder.write_text(JUDGED, "".join(lines))
    try:
        return dict(load_json(line) for line in lines)
    except (ValueError, TypeError) as problem:
        where = folder.path / JUDGED
        raise DesignError(f"{where}: found no lines of a search: {problem}") from problem

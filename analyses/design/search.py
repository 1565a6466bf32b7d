"""The search for a design: generations of candidates, each one a task of a sweep that is kept."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.design.candidates import Candidates
from cdpr_drake.analyses.design.evolution import EvolutionSearch, default_population, pareto_front
from cdpr_drake.analyses.design.goals import GoalContext, check_goals, evaluate_goals
from cdpr_drake.analyses.design.maximin import SLOPES, Slopes, SlopeSearch
from cdpr_drake.analyses.design.settings import BY_SLOPES, DesignSettings, PosesSettings
from cdpr_drake.analyses.reporting.progress import NOBODY_FOLLOWS, WorkProgress, WorkSession
from cdpr_drake.analyses.reporting.provenance import code_version
from cdpr_drake.analyses.sweeps.folder import SweepFolder
from cdpr_drake.analyses.sweeps.sweep import STARTING, run_sweep
from cdpr_drake.analyses.sweeps.worker_pool import PersistentPool
from cdpr_drake.analyses.workspaces.pose_grid import plain
from cdpr_drake.analyses.workspaces.stability_defaults import workspace_defaults
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError, DesignError
from cdpr_drake.models.robot_loader import as_robot, parse_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.numerics.own_terms import ProgramReport
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet
from cdpr_drake.workspaces.pose_grid import grid_by_count


@dataclass(frozen=True, eq=False)
class DesignTask:
    """Sweep task: the goals of the designs of a generation; NaN where a design cannot be."""

    candidates: Candidates
    number: int
    coordinates: Array
    names: tuple[str, ...]
    judging: GoalContext

    def __call__(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """Array `values` of the designs start to stop, shape (n, goals), larger is better."""
        values = np.full((stop - start, len(self.names)), np.nan)
        for row, x in zip(values, self.coordinates[start:stop], strict=True):
            try:
                row[:] = evaluate_goals(
                    self.candidates.robot(self.number, x), self.judging, self.names
                )
            except CdprError:
                continue  # no robot at all, or one that cannot be asked
        return {"values": values}


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
        progress: Where the search stood at the end.
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
    progress: WorkProgress
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

    @property
    def interrupted(self) -> bool:
        """Whether it was stopped before the end."""
        return self.progress.done < self.progress.total


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
    session: WorkSession = NOBODY_FOLLOWS,
) -> DesignSearch:
    """Searches the best design of each set of cables by CMA-ES.

    With a folder in the session it continues where it was stopped or killed: designs judged are
    kept one by one, and the search is replayed from them.

    Args:
        robot: The robot, or its name or path.
        candidates: What it may become.
        settings: What is wanted.
        session: How it is run; without a number of workers one, whose kernels use all processors.

    Raises:
        OutputFolderError: The folder belongs to other arguments, or cannot be written.
        CdprError: The robot cannot be asked for a goal.
    """
    slopes = _slopes_of(settings)
    judging = goal_context(robot, settings.poses, settings)
    names = tuple(goal.name for goal in settings.goals)
    original = evaluate_original(candidates, judging, names)
    population = settings.population or default_population(candidates.size)
    rounds = settings.generations if candidates.size else 1
    each = population if candidates.size and slopes is None else 1
    total = len(candidates.kept) * rounds * each
    folder = None
    if session.folder is not None:
        folder = SweepFolder(session.folder, search_arguments(candidates, settings, judging))
    # Each generation is a sweep of its own, for which no process shall be started anew.
    with PersistentPool(session.workers or 1) as pool:
        record = _Record(session, lambda values: scores_of(values, original, settings), total, pool)
        for number in range(len(candidates.kept)):
            task = DesignTask(candidates, number, np.zeros((0, 0)), names, judging)
            if candidates.size and slopes is not None:
                _ascend(record, folder, slopes, task, rounds)
            else:
                _evolve(record, folder, task, (each, settings.seed), rounds)
            if record.stopped:
                break
    if folder is not None and not record.stopped:
        folder.finish(record.kept)
    values = np.array(record.values).reshape(-1, len(names))
    designs = np.array(record.designs).reshape(-1, candidates.size)
    return DesignSearch(
        candidates, settings, judging, original, np.array(record.sets, int), designs, values,
        scores_of(values, original, settings), record.progress,
    )  # fmt: skip


def _slopes_of(settings: DesignSettings) -> Slopes | None:
    """Slopes of the only goal, where they are asked for; None by evolution.

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


def _evolve(
    record: _Record,
    folder: SweepFolder | None,
    like: DesignTask,
    drawn: tuple[int, int],
    rounds: int,
) -> None:
    """Seeks the best design of a set of cables by evolution, `drawn`: population and seed; a set
    that cannot change is judged once."""
    search = None
    if like.candidates.size:
        search = EvolutionSearch(like.candidates.size, *drawn)
    for generation in range(rounds):
        X = np.zeros((1, 0)) if search is None else search.ask()
        name = f"set{like.number}-generation{generation:04d}"
        values = record.judge(name, replace(like, coordinates=X), folder)
        if values is None:
            return
        if search is not None:
            search.tell(record.score(values))


def _ascend(
    record: _Record, folder: SweepFolder | None, slopes: Slopes, like: DesignTask, most: int
) -> None:
    """Seeks the best design of a set of cables by slopes, one design after the other.

    Slopes are reckoned again where a search continues: they follow from the design.
    """
    search = SlopeSearch(like.candidates.size)
    for step in range(most):
        design = search.ask()
        name = f"set{like.number}-step{step:04d}"
        values = record.judge(name, replace(like, coordinates=design[np.newaxis]), folder)
        if values is None:
            return
        value = float(values[0, 0])
        every, by = np.empty(0), np.empty((0, len(design)))
        if search.wants_slopes(value):
            every, by = slopes(like.candidates, like.number, design, like.judging)
        search.tell(value, every, by)
        if search.ended:
            record.shorten(most - step - 1)
            return


class _Record:
    """What was judged so far, and where the search stands."""

    def __init__(
        self,
        session: WorkSession,
        score: Callable[[Array], Array],
        total: int,
        pool: PersistentPool,
    ) -> None:
        self.sets: list[int] = []
        self.designs: list[Array] = []
        self.values: list[Array] = []
        self.kept: dict[str, dict[str, np.ndarray]] = {}
        self.stopped = False
        self.progress = WorkProgress(STARTING, 0, total, 0.0, rate="designs/s", items="designs")
        self.score, self._session, self._pool = score, session, pool
        self._best, self._wall, self._earlier = -np.inf, 0.0, 0.0

    def judge(self, name: str, task: DesignTask, folder: SweepFolder | None) -> Array | None:
        """Goals of a generation; None where it was stopped before its end."""
        count, session = len(task.coordinates), self._session
        result = run_sweep(
            {name: (task, count)}, 1, folder, items="designs", standing=self._pool,
            scheduler=session.scheduler, on_progress=self._show, should_stop=session.should_stop,
        )  # fmt: skip
        self._show(result.progress)
        self._wall += result.progress.wall_time
        self._earlier += result.progress.found
        if result.arrays is None:
            self.stopped = True
            return None
        values = result.arrays[name]["values"]
        self.kept |= result.arrays
        self.sets += [task.number] * count
        self.designs += list(task.coordinates)
        self.values += list(values)
        self._best = max([self._best, *self.score(values)[np.all(np.isfinite(values), axis=1)]])
        return values

    def shorten(self, by: int) -> None:
        """So many designs less are left to judge than were thought."""
        self.progress = replace(self.progress, total=self.progress.total - by)

    def _show(self, progress: WorkProgress) -> None:
        words = f"best {self._best:.4g}" if np.isfinite(self._best) else STARTING
        self.progress = replace(
            self.progress, what=words, done=len(self.values) + progress.done,
            wall_time=self._wall + progress.wall_time, found=self._earlier + progress.found,
        )  # fmt: skip
        if self._session.on_progress is not None:
            self._session.on_progress(self.progress)


def search_arguments(
    candidates: Candidates, settings: DesignSettings, judging: GoalContext
) -> dict[str, Any]:
    """All that the numbers depend on, for JSON."""
    found: dict[str, Any] = plain(
        {
            "cdpr_drake": code_version(),
            "robot": candidates.text,
            "settings": replace(settings, generations=1),  # more of them continue
            "grid": judging.grid,
            "bounds": judging.bounds.as_dict(),
        }
    )
    return found

"""Proven paths against RRT* with shortcuts and free motions, on problems drawn by a seed.

`python -m cdpr_drake.analyses.benchmarks.proven_paths --out FOLDER` writes `table.csv`, row by row,
and with `--free N` afterwards `free.csv`; the same command goes on after the last whole row.
OMPL is asked if it can be imported, else its columns are empty. Walls, pillars and shelves stand in
the frames of three robots; starts and goals are drawn among the poses that the exact checks accept
and whose straight line they do not. Paths are judged by the exact checks of poses, not by the sets.
"""

from __future__ import annotations

import argparse
import csv
import importlib
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.planning.free_motion import FreeSettings, solve_free_motion
from cdpr_drake.analyses.planning.robot_path_task import LimitSettings, length_scale, path_task
from cdpr_drake.analyses.workspaces.proven_sets import ProofSettings, ProvenSets
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError, DataFileError, PlanningError
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.planning.path_in_sets import ProvenMotion, proven_motion
from cdpr_drake.planning.path_task import PathTask
from cdpr_drake.workspaces.cable_interference import box_row
from cdpr_drake.workspaces.proven_cells import CELLS

ROBOTS = {"caroca": 0.1, "macarm": 1.0, "ipanema_1": 0.5}
"""Robots, and the half width of the box of accelerations that is proven [m/s^2]. Suspended ones
give little; the last two have cables from below, too."""

PROBLEMS = {
    "caroca": (3, 3, 2), "macarm": (2, 2, 2), "ipanema_1": (2, 2, 2),
}  # fmt: skip
"""Problems with the wall, the pillars and the shelf."""

SCENES = ("wall", "pillars", "shelf")

FARTHEST = 0.25
"""Starts and goals are farther apart than this share of the frame's diagonal."""

ROOM = 0.02
"""Starts and goals hold so far round, too, as a share of the frame."""

LOOKS, CHECKED = 200, 100_000
"""Samples of a straight line, and of a path that is judged."""

RRT_SECONDS = 8.0
"""Processor time of RRT* [s]."""

RRT_CHECKS = 0.005
"""Way between checked states of RRT*, as a share of the extent of the space."""

BOXES = 150_000
"""Boxes that are judged for the sets of a scene, of all kinds."""

ROUGH_BOXES, ROUGH_CELLS = 2000, 2**12
"""Of sets that starts and goals are drawn with, where only the exact checks matter."""

TABLE, FREE_TABLE = "table.csv", "free.csv"

NAMES = ("seed", "robot", "scene", "problem")
"""First columns of both tables."""

COLUMNS = (
    *NAMES, "straight_m", "sets", "sets_s", "found", "length_m", "curve_m", "bound_m", "path_s",
    "duration_s", "infeasible", "samples", "rrt_m", "rrt_s", "rrt_infeasible", "ratio",
)  # fmt: skip

FREE_COLUMNS = (*NAMES, "free_s", "free")


@dataclass(frozen=True, eq=False)
class Problem:
    """A start and a goal among obstacles.

    Attributes:
        robot: The robot.
        task: Its limits.
        scene: One of `SCENES`.
        number: Of those of the scene, from 1.
        ends: Start and goal, shape (6,) each [m, rad].
        judges: Sets that know the exact checks.
        obstacles: Boxes, shape (o, 15).
    """

    robot: Robot
    task: PathTask
    scene: str
    number: int
    ends: tuple[Array, Array]
    judges: ProvenSets
    obstacles: Array


def scene_boxes(robot: Robot, scene: str) -> Array:
    """Obstacles by shares of a robot's frame, shape (o, 15)."""
    low, high = robot.reach()
    size = high - low
    shares = {
        "wall": [((0.5, 0.5, 0.15), (0.04, 0.35, 0.3))],
        "pillars": [((0.42, 0.42, 0.18), (0.05, 0.05, 0.36)),
                    ((0.58, 0.6, 0.18), (0.05, 0.05, 0.36))],
        "shelf": [((0.5, 0.5, 0.27), (0.3, 0.15, 0.02)), ((0.36, 0.5, 0.13), (0.02, 0.15, 0.26)),
                  ((0.64, 0.5, 0.13), (0.02, 0.15, 0.26))],
    }  # fmt: skip
    return np.array(
        [box_row(low + np.array(m) * size, np.array(s) * size) for m, s in shares[scene]]
    )


def good_poses(sets: ProvenSets, positions: Array) -> np.ndarray:
    """Whether all kinds hold by the exact checks, shape (n,), without turns."""
    R = np.repeat(np.eye(3)[np.newaxis], len(positions), axis=0)
    return np.all(np.array(list(sets.judge(positions, R).values())), axis=0)


def drawn_ends(sets: ProvenSets, robot: Robot, count: int, seed: int) -> list[tuple[Array, Array]]:
    """Pairs of poses that hold, far apart, whose straight line does not hold."""
    low, high = robot.reach()
    random = np.random.default_rng(seed)
    places = random.uniform(low, high, (6000, 3))
    corners = np.array([np.zeros(3), *product((-1.0, 1.0), repeat=3)])
    for corner in corners:
        places = places[good_poses(sets, places + ROOM * corner * (high - low))]
    found: list[tuple[Array, Array]] = []
    for a, b in zip(places[0::2], places[1::2], strict=False):
        if np.linalg.norm(b - a) < FARTHEST * np.linalg.norm(high - low):
            continue
        line = a + np.linspace(0.0, 1.0, LOOKS)[:, np.newaxis] * (b - a)
        if not np.all(good_poses(sets, line)):
            found.append((np.append(a, np.zeros(3)), np.append(b, np.zeros(3))))
        if len(found) == count:
            break
    return found


def proof_settings(task: PathTask, boxes: int, cells: int) -> ProofSettings:
    """How sets are proven for the tensions of a task."""
    return ProofSettings(boxes=boxes, cells=cells, limits=(task.limits.lower, task.limits.upper))


def scenes_of_problems(seed: int) -> Iterator[list[Problem]]:
    """The problems of each robot and scene, in order."""
    for name, acceleration in ROBOTS.items():
        robot = load_robot(name)
        task = path_task(robot, LimitSettings())
        for k, scene in enumerate(SCENES):
            boxes, count = scene_boxes(robot, scene), PROBLEMS[name][k]
            judges = ProvenSets.find(
                robot, None, None, boxes, acceleration,
                settings=proof_settings(task, ROUGH_BOXES, ROUGH_CELLS),
            )  # fmt: skip
            ends = drawn_ends(judges, robot, count, seed + k)
            if len(ends) < count:
                print(f"{name}, {scene}: {len(ends)} problems of {count} found", flush=True)
            yield [
                Problem(robot, task, scene, number, pair, judges, boxes)
                for number, pair in enumerate(ends, 1)
            ]


def proven_sets(problems: Sequence[Problem]) -> tuple[ProvenSets, float]:
    """Sets for all problems of a scene, and the processor time that they took [s]."""
    one = problems[0]
    settings = proof_settings(one.task, BOXES, CELLS)
    asked = (one.robot, None, None, one.obstacles, ROBOTS[one.robot.name])
    begin = time.process_time()
    try:
        must = [pose for problem in problems for pose in problem.ends]
        sets = ProvenSets.find(*asked, settings=settings, must=must)
    except CdprError:  # a pose at the very border: without those that must be in
        sets = ProvenSets.find(*asked, settings=settings)
    return sets, time.process_time() - begin


def judged_motion(problem: Problem, found: ProvenMotion) -> int:
    """Of `CHECKED` samples of a motion, at how many a kind does not hold by the exact checks."""
    path = found.path.path
    s = np.linspace(0.0, path.length, CHECKED)
    return int(np.count_nonzero(~good_poses(problem.judges, path.points(s)[:, 4:7])))


def rrt_star(problem: Problem) -> tuple[float, float, int] | None:
    """Length of RRT*'s path with shortcuts, processor time, samples that fail; None: no path.

    Raises:
        ImportError: OMPL is not installed.
    """
    base, geometric = (importlib.import_module(f"ompl.{name}") for name in ("base", "geometric"))
    util = importlib.import_module("ompl.util")
    util.setLogLevel(util.LogLevel.LOG_ERROR)
    low, high = problem.robot.reach()
    space = base.RealVectorStateSpace(3)
    bounds = base.RealVectorBounds(3)
    for k in range(3):
        bounds.setLow(k, float(low[k]))
        bounds.setHigh(k, float(high[k]))
    space.setBounds(bounds)
    setup = geometric.SimpleSetup(space)

    def valid(state: Any) -> bool:
        return bool(good_poses(problem.judges, np.array([[state[0], state[1], state[2]]]))[0])

    setup.setStateValidityChecker(valid)
    setup.getSpaceInformation().setStateValidityCheckingResolution(RRT_CHECKS)
    states = []
    for pose in problem.ends:
        state = space.allocState()
        for k in range(3):
            state[k] = float(pose[k])
        states.append(state)
    setup.setStartAndGoalStates(*states)
    setup.setPlanner(geometric.RRTstar(setup.getSpaceInformation()))
    begin = time.process_time()

    def over() -> bool:
        return time.process_time() - begin > RRT_SECONDS

    setup.solve(base.PlannerTerminationCondition(over))
    if not setup.haveExactSolutionPath():
        return None
    path = setup.getSolutionPath()
    geometric.PathSimplifier(setup.getSpaceInformation()).simplifyMax(path)
    took = time.process_time() - begin
    corners = np.array([[state[0], state[1], state[2]] for state in path.getStates()])
    ways = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1)))
    at = np.linspace(0.0, ways[-1], CHECKED)
    samples = np.column_stack([np.interp(at, ways, corners[:, k]) for k in range(3)])
    return float(ways[-1]), took, int(np.count_nonzero(~good_poses(problem.judges, samples)))


def free_motion(problem: Problem) -> tuple[float, str]:
    """Processor time of a free motion among the same obstacles, and its duration or its refusal."""
    ends = [pose_from_angles(pose[:3], pose[3:]) for pose in problem.ends]
    asked = FreeSettings(start=ends[0], goal=ends[1], clearance=0.0, obstacles=problem.obstacles)
    begin = time.process_time()
    try:
        words = f"{solve_free_motion(problem.robot, problem.task, asked).duration:.3f} s"
    except PlanningError as problem_found:
        words = str(problem_found)[:80]
    return time.process_time() - begin, words


def row_of(problem: Problem, sets: ProvenSets) -> dict[str, Any]:
    """All that is measured of a problem, by `COLUMNS`."""
    row: dict[str, Any] = {
        "straight_m": float(np.linalg.norm(problem.ends[1] - problem.ends[0])),
        "sets": len(sets), "found": "yes",
    }  # fmt: skip
    begin = time.process_time()
    try:
        found = proven_motion(sets, *problem.ends, problem.task, length_scale(problem.robot))
        row |= {
            "path_s": time.process_time() - begin, "length_m": found.path.length,
            "curve_m": found.path.curve.polygon, "bound_m": found.path.lower_bound,
            "duration_s": found.plan.duration, "samples": CHECKED,
            "infeasible": judged_motion(problem, found),
        }  # fmt: skip
    except CdprError as refusal:
        row["found"] = str(refusal)
    try:
        other = rrt_star(problem)
    except ImportError:
        other = None
    if other is not None:
        row |= {"rrt_m": other[0], "rrt_s": other[1], "rrt_infeasible": other[2]}
        if "length_m" in row:
            row["ratio"] = row["length_m"] / other[0]
    return row


@dataclass(frozen=True, eq=False)
class Table:
    """A file of rows that grows, and goes on where an earlier run ended.

    Attributes:
        path: The file.
        columns: Its columns; the first are `NAMES`.
        seed: Of its problems.
    """

    path: Path
    columns: tuple[str, ...]
    seed: int

    def done(self) -> set[tuple[str, str, int]]:
        """Robot, scene and number of its whole rows; a half row at the end is cut off.

        Raises:
            DataFileError: It is of another seed, or of other columns.
        """
        if not self.path.is_file():
            with self.path.open("w", newline="", encoding="utf-8") as file:
                csv.writer(file).writerow(self.columns)
            return set()
        text = self.path.read_bytes()
        self.path.write_bytes(text[: text.rfind(b"\n") + 1])
        with self.path.open(newline="", encoding="utf-8") as file:
            reader = csv.DictReader(file)
            if tuple(reader.fieldnames or ()) != self.columns:
                raise DataFileError(f"{self.path}: found other columns; accepted: this version's")
            rows = list(reader)
        if any(row["seed"] != str(self.seed) for row in rows):
            raise DataFileError(f"{self.path}: found seed {rows[0]['seed']}; accepted: {self.seed}")
        return {(row["robot"], row["scene"], int(row["problem"])) for row in rows}

    def add(self, problem: Problem, row: dict[str, Any]) -> None:
        """Writes what was measured of a problem."""
        names = dict(zip(NAMES, (self.seed, *key_of(problem)), strict=True))
        with self.path.open("a", newline="", encoding="utf-8") as file:
            csv.DictWriter(file, self.columns).writerow({**names, **row})
        print({**names, **row}, flush=True)


def key_of(problem: Problem) -> tuple[str, str, int]:
    """Robot, scene and number."""
    return problem.robot.name, problem.scene, problem.number


def main(words: Sequence[str] | None = None) -> int:
    """Runs all problems; writes the tables as they grow."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--free", type=int, default=0, help="problems of each scene of which free motions run"
    )
    given = parser.parse_args(words)
    given.out.mkdir(parents=True, exist_ok=True)
    table = Table(given.out / TABLE, COLUMNS, given.seed)
    done = table.done()
    for problems in scenes_of_problems(given.seed):
        missing = [problem for problem in problems if key_of(problem) not in done]
        if not missing:
            continue
        sets, took = proven_sets(problems)
        for problem in missing:
            table.add(problem, {"sets_s": took, **row_of(problem, sets)})
    if given.free > 0:
        table = Table(given.out / FREE_TABLE, FREE_COLUMNS, given.seed)
        done = table.done()
        for problems in scenes_of_problems(given.seed):
            for problem in problems[: given.free]:
                if key_of(problem) not in done:
                    table.add(
                        problem, dict(zip(FREE_COLUMNS[4:], free_motion(problem), strict=True))
                    )
    return 0


if __name__ == "__main__":
    raise SystemExit(main())

"""Proven paths against RRT* with shortcuts and free motions, on problems drawn by a seed.

`python -m cdpr_drake.analyses.benchmarks.proven_paths --out FOLDER` writes `table.csv`.
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
from cdpr_drake.errors import CdprError, PlanningError
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.planning.path_in_sets import ProvenMotion, proven_motion
from cdpr_drake.planning.path_task import PathTask
from cdpr_drake.workspaces.cable_interference import box_row

ROBOTS = {"caroca": 0.1, "swinburne": 0.1, "macarm": 1.0}
"""Robots, and the half width of the box of accelerations that is proven [m/s^2]. Suspended ones
give little; MACARM has cables from below, too."""

PROBLEMS = {
    "caroca": (3, 3, 2), "swinburne": (2, 2, 2), "macarm": (2, 2, 2),
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

COLUMNS = (
    "robot", "scene", "problem", "straight_m", "sets", "sets_s", "found", "length_m", "curve_m",
    "bound_m", "path_s", "duration_s", "infeasible", "samples", "rrt_m", "rrt_s", "rrt_infeasible",
    "ratio", "free_s", "free",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Problem:
    """A start and a goal among obstacles."""

    robot: Robot
    task: PathTask
    scene: str
    number: int
    ends: tuple[Array, Array]
    sets: ProvenSets
    sets_time: float
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


def all_problems(seed: int) -> Iterator[Problem]:
    """Problems in order; those of a scene share their sets."""
    for name, acceleration in ROBOTS.items():
        robot = load_robot(name)
        task = path_task(robot, LimitSettings())
        settings = ProofSettings(boxes=BOXES, limits=(task.limits.lower, task.limits.upper))
        for k, scene in enumerate(SCENES):
            boxes = scene_boxes(robot, scene)
            rough = ProvenSets.find(
                robot, None, None, boxes, acceleration,
                settings=ProofSettings(boxes=2000, cells=2**12, limits=settings.limits),
            )  # fmt: skip
            ends = drawn_ends(rough, robot, PROBLEMS[name][k], seed + k)
            begin = time.process_time()
            try:
                sets = ProvenSets.find(
                    robot, None, None, boxes, acceleration, settings=settings,
                    must=[pose for pair in ends for pose in pair],
                )  # fmt: skip
            except CdprError:  # a pose at the very border: without those that must be in
                sets = ProvenSets.find(robot, None, None, boxes, acceleration, settings=settings)
            took = time.process_time() - begin
            for number, pair in enumerate(ends, 1):
                yield Problem(robot, task, scene, number, pair, sets, took, boxes)


def judged_motion(problem: Problem, found: ProvenMotion) -> int:
    """Of `CHECKED` samples of a motion, at how many a kind does not hold by the exact checks."""
    path = found.path.path
    s = np.linspace(0.0, path.length, CHECKED)
    return int(np.count_nonzero(~good_poses(problem.sets, path.points(s)[:, 4:7])))


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
        return bool(good_poses(problem.sets, np.array([[state[0], state[1], state[2]]]))[0])

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
    return float(ways[-1]), took, int(np.count_nonzero(~good_poses(problem.sets, samples)))


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


def row_of(problem: Problem, free: bool) -> dict[str, Any]:
    """All that is measured of a problem, by `COLUMNS`."""
    row: dict[str, Any] = {
        "robot": problem.robot.name, "scene": problem.scene, "problem": problem.number,
        "straight_m": float(np.linalg.norm(problem.ends[1] - problem.ends[0])),
        "sets": len(problem.sets), "sets_s": problem.sets_time, "found": "yes",
    }  # fmt: skip
    begin = time.process_time()
    try:
        found = proven_motion(
            problem.sets, *problem.ends, problem.task, length_scale(problem.robot)
        )
        row |= {
            "path_s": time.process_time() - begin, "length_m": found.path.length,
            "curve_m": found.path.curve.polygon, "bound_m": found.path.lower_bound,
            "duration_s": found.plan.duration, "samples": CHECKED,
            "infeasible": judged_motion(problem, found),
        }  # fmt: skip
    except CdprError as refusal:
        row["found"] = str(refusal)[:60]
    try:
        other = rrt_star(problem)
    except ImportError:
        other = None
    if other is not None:
        row |= {"rrt_m": other[0], "rrt_s": other[1], "rrt_infeasible": other[2]}
        if "length_m" in row:
            row["ratio"] = row["length_m"] / other[0]
    if free:
        row["free_s"], row["free"] = free_motion(problem)
    return row


def main(words: Sequence[str] | None = None) -> int:
    """Runs all problems; writes the table as it grows."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--free", type=int, default=0, help="problems of which free motions run")
    given = parser.parse_args(words)
    given.out.mkdir(parents=True, exist_ok=True)
    with (given.out / "table.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS)
        writer.writeheader()
        for number, problem in enumerate(all_problems(given.seed)):
            row = row_of(problem, number < given.free)
            writer.writerow(row)
            file.flush()
            print(row, flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())

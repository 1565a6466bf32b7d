"""The examples: a trajectory by three programs, ACROBOT's tensions, methods on a grid of poses."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from cdpr_drake.analyses.reporting.timing import interleaved, processor_seconds
from cdpr_drake.analyses.studies.framework.runs import Row, Run
from cdpr_drake.analyses.studies.framework.study import Case, Form
from cdpr_drake.arrays import Array
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.tensions.methods import (
    distribute,
    distribute_batch,
    feasible_polygon,
    solution_space,
)
from cdpr_drake.tensions.problem import TensionProblem, TensionStatus
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory

TRAJECTORY, METHODS = "trajectory", "methods on a grid"
"""Examples beside the poses of `POSES`."""

START, END = np.array([0.0, -2.0, 2.0]), np.array([3.0, 1.0, 3.0])
"""Gazebo thesis 6.2, at rest in both, platform unturned [m]."""

DURATION = 100.0
"""Gazebo thesis 6.2 [s]."""

SAMPLES = 201
"""Moments at which programs are compared."""

MOTION = ("positions_m", "velocities_m_s", "accelerations_m_s2")
"""What a program says of the trajectory, shape (SAMPLES, 3) each."""

ROBOT = "acrobot_large"

POSES = {"homing": (0.0, 0.0, 0.15), "border": (0.35, -0.27, 0.45)}
"""Figure 1.19 a and b, platform unturned [m]."""

PRINTED = {
    "homing": (5.22, 5.46, 5.16, 5.41, 5.13, 5.39, 5.22, 5.46),
    "border": (2.08, 2.08, 2.43, 2.58, 3.74, 4.30, 12.76, 13.31),
}
"""Tensions by the barycenter method, servoing thesis 1.3.4 [N]."""

LEAST = 0.0
"""Lower limit of figure 1.17c, to which figure 1.19 refers [N]."""

SHOWN = ("barycenter", "median", "optimally_safe")
"""Methods whose points are drawn in the polygons."""

POTT = "improved_closed_form"
"""The method of [Pot14], which the thesis calls the median method."""

COMPARED = ("pseudo_inverse", POTT, "median", "barycenter")
"""Methods that are run on the grid."""

TRUTH = "linear_program"
"""The method whose verdict on existence counts; it always finds tensions where there are some."""

GRID, QUICK_GRID = (13, 13, 9), (4, 4, 3)
"""Poses on which methods are compared, along x, y and z."""

REPEATS, QUICK_REPEATS = 15, 3

TIMED = 4000
"""Poses of one timing at least; those of the grid come again."""

OFF = 1e-6
"""Tensions balance the weight that leave no more of it, and keep limits that are no further beyond
[N, N m]."""


def cases(form: Form) -> Iterator[Case]:
    """The trajectory, the poses, and the grid, on which methods are timed."""
    grid, repeats = (QUICK_GRID, QUICK_REPEATS) if form.quick else (GRID, REPEATS)
    yield Case(name=TRAJECTORY, keys={"example": TRAJECTORY})
    for name in POSES:
        yield Case(name=name, keys={"example": name})
    yield Case(
        name=METHODS,
        keys={"example": METHODS},
        data={"grid": grid, "repeats": repeats},
        alone=True,
    )


def measure(case: Case, seed: int) -> Row:
    """One example: see `trajectory_row`, `polygon_row`, `methods_row`."""
    if case.name == TRAJECTORY:
        return trajectory_row()
    return methods_row(**case.data) if case.name == METHODS else polygon_row(case.name)


def trajectory_row() -> Row:
    """The trajectory by each of `PROGRAMS`.

    Returns:
        times_s, shape (SAMPLES,); of each program its name with each of `MOTION`.
    """
    row: dict[str, Any] = {"times_s": _times()}
    for name, program in PROGRAMS.items():
        row |= dict(zip((f"{name}_{what}" for what in MOTION), program(), strict=True))
    return row


def by_trajectory() -> tuple[Array, Array, Array]:
    """`MOTION` by the class that moves simulated robots."""
    poses = tuple(pose_from_angles(place, np.zeros(3)) for place in (START, END))
    trajectory = PoseTrajectory(poses, (DURATION,))
    rows = np.array([trajectory.motion(float(time)) for time in _times()])
    return rows[:, 4:7], rows[:, 10:13], rows[:, 16:19]


def by_conditions() -> tuple[Array, Array, Array]:
    """By a second program: the six conditions (6.9) to (6.14) as equations in six coefficients."""
    powers = np.arange(6)
    rows = []
    for time in (0.0, DURATION):
        for order in range(3):
            factors = np.ones(6)
            for k in range(order):
                factors = factors * (powers - k)
            exponents = np.maximum(powers - order, 0)
            rows.append(factors * np.power(time, exponents))
    still = np.zeros(3)
    wanted = np.array([START, still, still, END, still, still])
    return _sampled(np.linalg.solve(np.array(rows), wanted))


def by_printed_coefficients() -> tuple[Array, Array, Array]:
    """By (6.16) to (6.21) as they are printed, for a motion from rest to rest."""
    way = END - START
    third = 20.0 * way / (2.0 * DURATION**3)
    fourth = 30.0 * way / (2.0 * DURATION**4)
    fifth = 12.0 * way / (2.0 * DURATION**5)
    return _sampled(np.array([START, np.zeros(3), np.zeros(3), third, fourth, fifth]))


PROGRAMS = {
    "class": by_trajectory, "conditions": by_conditions, "printed": by_printed_coefficients,
}  # fmt: skip
"""The trajectory by the class, by another program, by the coefficients that are printed."""


def _times() -> Array:
    return np.linspace(0.0, DURATION, SAMPLES)


def _sampled(coefficients: Array) -> tuple[Array, Array, Array]:
    """Polynomials with coefficients c_k of t^k, shape (6, 3)."""
    p = np.polynomial.polynomial
    x, v, a = (
        np.asarray(p.polyval(_times(), p.polyder(coefficients, order)), np.float64).T
        for order in range(3)
    )
    return x, v, a


def polygon_row(name: str) -> Row:
    """The polygon of figure 1.19 at a pose of `POSES`.

    Returns:
        area_n2; vertices_n, shape (2, k); by each method of `SHOWN` its tensions_n, shape (m,),
        the same in the plane of the polygon, etas_n, shape (2,), and their least distance from a
        limit, margins_n.
    """
    problem = _problem(load_robot(ROBOT), np.array(POSES[name]))
    tensions = {method: distribute(problem, method).tensions for method in SHOWN}
    _, N = solution_space(problem)
    x, y = vertices = feasible_polygon(problem)
    return {
        "area_n2": 0.5 * abs(float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))),
        "vertices_n": vertices,
        "tensions_n": {method: t.tolist() for method, t in tensions.items()},
        "etas_n": {method: (N.T @ t).tolist() for method, t in tensions.items()},
        "margins_n": {
            method: np.min(np.minimum(t - problem.lower, problem.upper - t))
            for method, t in tensions.items()
        },
    }


def _problem(robot: Robot, place: Array) -> TensionProblem:
    limits = (LEAST, robot.tension_limits()[1])
    cables = robot.cable_set(pulleys=False)
    return tension_problem(
        robot, pose_from_angles(place, np.zeros(3)), limits=limits, cables=cables
    )


def held_problems(counts: tuple[int, int, int]) -> list[TensionProblem]:
    """Problems at those poses of a grid in the frame that can be held, by `TRUTH`.

    Args:
        counts: Positions along x, y and z.
    """
    robot = load_robot(ROBOT)
    axes = [
        low + (np.arange(count) + 0.5) * (high - low) / count
        for low, high, count in zip(robot.frame.lower, robot.frame.upper, counts, strict=True)
    ]
    found = []
    for place in np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3):
        try:
            problem = _problem(robot, place)
        except TensionProblemError:  # W is singular
            continue
        if distribute(problem, TRUTH).status == TensionStatus.FEASIBLE:
            found.append(problem)
    return found


def methods_row(grid: tuple[int, int, int], repeats: int) -> Row:
    """Every method of `COMPARED` on the poses of a grid that can be held, timed in turns.

    Args:
        grid: Positions along x, y and z.
        repeats: Of the timing.

    Returns:
        poses: how many these are; by each method solved: where it says that its tensions hold the
        platform within the limits; wrong: of these, where limits or balance are broken,
        recomputed; pushing: where one of its tensions is negative; cost_us: processor time of one
        pose, on one core, the median of repeats.
    """
    problems = held_problems(grid)
    again = -(-TIMED // len(problems))
    W = np.tile(np.array([p.W for p in problems]), (again, 1, 1))
    w = np.tile(np.array([p.wrench for p in problems]), (again, 1))
    low, high = problems[0].lower, problems[0].upper

    def cost(method: str) -> float:
        return processor_seconds(lambda: distribute_batch(W, w, low, high, method, threads=1))

    seconds = interleaved([partial(cost, method) for method in COMPARED], repeats)
    found: dict[str, Any] = {"poses": len(problems), "solved": {}, "wrong": {}, "pushing": {}}
    for method in COMPARED:
        solutions = [distribute(problem, method) for problem in problems]
        solved = [
            (problem, solution.tensions)
            for problem, solution in zip(problems, solutions, strict=True)
            if solution.status == TensionStatus.FEASIBLE
        ]
        found["solved"][method] = len(solved)
        found["wrong"][method] = sum(not _holds(*pair) for pair in solved)
        found["pushing"][method] = sum(bool(np.any(s.tensions < 0.0)) for s in solutions)
    costs = {m: 1e6 * one / len(W) for m, one in zip(COMPARED, seconds, strict=True)}
    return {**found, "cost_us": costs}


def _holds(problem: TensionProblem, t: Array) -> bool:
    """Whether tensions, shape (m,) [N], balance the weight within the limits."""
    low, high = t - problem.lower, problem.upper - t
    left = problem.W @ t + problem.wrench
    return bool(min(low.min(), high.min()) >= -OFF and np.max(np.abs(left)) <= OFF)


def motion(row: Run, program: str) -> list[Array]:
    """`MOTION` of a program."""
    return [row[f"{program}_{what}"] for what in MOTION]

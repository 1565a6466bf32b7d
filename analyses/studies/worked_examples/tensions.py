"""ACROBOT's tensions at the poses of figure 1.19, and methods on a grid of poses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdpr_drake.analyses.reporting.timing import interleaved, processor_seconds
from cdpr_drake.arrays import Array
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.tensions.batch import distribute_batch
from cdpr_drake.tensions.methods import distribute, feasible_polygon, solution_space
from cdpr_drake.tensions.problem import TensionProblem, TensionStatus

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

REPEATS, QUICK_REPEATS = 15, 3

TIMED = 4000
"""Poses of one timing at least; those of the grid come again."""

OFF = 1e-6
"""Tensions balance the weight that leave no more of it, and keep limits that are no further beyond
[N, N m]."""


@dataclass(frozen=True, eq=False)
class ExamplePolygon:
    """The feasible polygon at a pose.

    Attributes:
        problem: Holding the platform there.
        vertices: Of the polygon, shape (2, k) [N].
        tensions: By method, shape (m,) [N].
        etas: The same in the plane of the polygon, shape (2,) [N].
    """

    problem: TensionProblem
    vertices: Array
    tensions: dict[str, Array]
    etas: dict[str, Array]

    @property
    def area(self) -> float:
        """Of the polygon [N^2]."""
        x, y = self.vertices
        return 0.5 * abs(float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))))

    def margin(self, method: str) -> float:
        """Least distance of a method's tensions from a limit [N]."""
        t = self.tensions[method]
        return float(np.min(np.minimum(t - self.problem.lower, self.problem.upper - t)))


@dataclass(frozen=True)
class MethodOnGrid:
    """A method at the poses of a grid that can be held.

    Attributes:
        poses: How many these are.
        solved: Where it says that its tensions hold the platform within the limits.
        wrong: Of these, where limits or balance are broken, recomputed.
        pushing: Where one of its tensions is negative.
        microseconds: Processor time of one pose, on one core, the median of repeats [us].
    """

    poses: int
    solved: int
    wrong: int
    pushing: int
    microseconds: float


def example_polygon(name: str) -> ExamplePolygon:
    """The polygon of figure 1.19 at a pose of `POSES`."""
    robot = load_robot(ROBOT)
    problem = _problem(robot, np.array(POSES[name]))
    tensions = {method: distribute(problem, method).tensions for method in SHOWN}
    _, N = solution_space(problem)
    etas = {method: N.T @ t for method, t in tensions.items()}
    return ExamplePolygon(problem, feasible_polygon(problem), tensions, etas)


def _problem(robot: Robot, place: Array) -> TensionProblem:
    limits = (LEAST, robot.tension_limits()[1])
    return tension_problem(robot, pose_from_angles(place, np.zeros(3)), limits=limits)


def held_problems(counts: tuple[int, int, int]) -> list[TensionProblem]:
    """Problems at those poses of a grid in the frame that can be held, by `TRUTH`."""
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


def methods_on_grid(counts: tuple[int, int, int], quick: bool) -> dict[str, MethodOnGrid]:
    """Every method of `COMPARED` on the poses of a grid, timed in turns.

    Args:
        counts: Positions along x, y and z.
        quick: Whether to repeat the timing less often.
    """
    problems = held_problems(counts)
    again = -(-TIMED // len(problems))
    W = np.tile(np.array([p.W for p in problems]), (again, 1, 1))
    w = np.tile(np.array([p.wrench for p in problems]), (again, 1))
    low, high = problems[0].lower, problems[0].upper

    def cost(method: str) -> float:
        return processor_seconds(lambda: distribute_batch(W, w, low, high, method, threads=1))

    works = [lambda method=method: cost(method) for method in COMPARED]
    seconds = interleaved(works, QUICK_REPEATS if quick else REPEATS)
    found = {}
    for method, one in zip(COMPARED, seconds, strict=True):
        solutions = [distribute(problem, method) for problem in problems]
        solved = [
            (problem, solution.tensions)
            for problem, solution in zip(problems, solutions, strict=True)
            if solution.status == TensionStatus.FEASIBLE
        ]
        found[method] = MethodOnGrid(
            poses=len(problems),
            solved=len(solved),
            wrong=sum(not _holds(*pair) for pair in solved),
            pushing=sum(bool(np.any(s.tensions < 0.0)) for s in solutions),
            microseconds=1e6 * one / len(W),
        )
    return found


def _holds(problem: TensionProblem, t: Array) -> bool:
    """Whether tensions, shape (m,) [N], balance the weight within the limits."""
    low, high = t - problem.lower, problem.upper - t
    left = problem.W @ t + problem.wrench
    return bool(min(low.min(), high.min()) >= -OFF and np.max(np.abs(left)) <= OFF)

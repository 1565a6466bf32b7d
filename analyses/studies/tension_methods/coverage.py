"""How much of a grid of poses each tension method solves, and how long it takes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np

from cdpr_drake.analyses.reporting.timing import interleaved, seconds_each, seconds_per_call
from cdpr_drake.analyses.statics.tension_query import applicable_methods
from cdpr_drake.arrays import Array
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.tensions.batch import distribute_batch
from cdpr_drake.tensions.methods import distribute
from cdpr_drake.tensions.problem import TensionProblem, TensionStatus

TURNS_DEG = ((0.0, 0.0, 0.0), (5.0, -5.0, 10.0))
"""Angles of the platform at every position of the grid [deg]."""

TIMED = 50
"""Feasible poses over which a method is timed."""

TRUTH = "linear_program"
"""The method whose verdict counts."""


@dataclass(frozen=True, kw_only=True)
class MethodCoverage:
    """One method on the grid of one robot.

    Attributes:
        robot: Name of the robot.
        method: Name of the method.
        poses: Poses of the grid.
        feasible: Poses that can be held, by the linear program.
        solved: Of these, how many the method solves.
        wrong: Poses where the method's verdict on existence contradicts the linear program.
        mean_largest_tension: Mean over the solved poses of the largest tension [N]; NaN for none.
        microseconds: One call of `distribute` with its checks, on feasible poses, median [us].
        kernel_microseconds: One pose of the batch form on one core [us].
    """

    robot: str
    method: str
    poses: int
    feasible: int
    solved: int
    wrong: int
    mean_largest_tension: float
    microseconds: float
    kernel_microseconds: float

    @property
    def share(self) -> float:
        """Share of the feasible poses that the method solves."""
        return self.solved / max(self.feasible, 1)

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        found = asdict(self) | {"share": self.share}
        return {
            name: None if isinstance(value, float) and not np.isfinite(value) else value
            for name, value in found.items()
        }


NUMBERS: dict[str, type] = {
    each.name: {"int": int, "float": float}[str(each.type)]
    for each in fields(MethodCoverage)
    if each.name not in ("robot", "method")
}
"""What is a number in a `MethodCoverage`, each with its type, in their order."""


def grid_problems(robot_name: str, counts: tuple[int, int, int]) -> list[TensionProblem]:
    """The problems of holding still at the poses of a grid that fills the robot's frame.

    A planar robot keeps to its plane, and turns about z only.

    Args:
        robot_name: Name of the robot.
        counts: Positions along x, y and z.
    """
    robot = load_robot(robot_name)
    # Cells' middles, so that no position lies on the frame.
    axes = [
        low + (np.arange(count) + 0.5) * (high - low) / count
        for low, high, count in zip(robot.frame.lower, robot.frame.upper, counts, strict=True)
    ]
    turns = np.radians(TURNS_DEG)
    if robot.is_planar():
        axes[2] = robot.home.transform().translation()[2:]
        turns[:, :2] = 0.0
    problems = []
    for turn in turns:
        for place in np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3):
            try:
                problems.append(tension_problem(robot, pose_from_angles(place, turn)))
            except TensionProblemError:  # W is singular
                continue
    return problems


@dataclass(frozen=True)
class CoverageTask:
    """Methods on the grid of one robot, as the items of a task of a sweep.

    Attributes:
        robot: Name of the robot.
        counts: Positions along x, y and z.
        methods: Names of the methods.
    """

    robot: str
    counts: tuple[int, int, int]
    methods: tuple[str, ...]

    def __call__(self, start: int, stop: int) -> dict[str, Array]:
        """`NUMBERS` of these methods, shape (n, k)."""
        rows = cover(self.robot, self.counts, self.methods[start:stop])
        return {"numbers": np.array([[float(getattr(r, name)) for name in NUMBERS] for r in rows])}

    def rows(self, arrays: Mapping[str, Array]) -> list[MethodCoverage]:
        """The rows of which these are the arrays."""
        return [
            MethodCoverage(
                robot=self.robot,
                method=method,
                **{name: NUMBERS[name](value) for name, value in zip(NUMBERS, row, strict=True)},
            )
            for method, row in zip(self.methods, arrays["numbers"].tolist(), strict=True)
        ]


def cover(
    robot_name: str, counts: tuple[int, int, int], only: Sequence[str] | None = None
) -> list[MethodCoverage]:
    """Methods on a grid.

    Args:
        robot_name: Name of the robot.
        counts: Positions along x, y and z.
        only: Names of the methods; None: every applicable one.
    """
    problems = grid_problems(robot_name, counts)
    truth = np.array([distribute(p, TRUTH).status == TensionStatus.FEASIBLE for p in problems])
    feasible = [p for p, good in zip(problems, truth, strict=True) if good]
    rows = []
    methods = applicable_methods(problems[0]) if only is None and problems else only or ()
    for method in methods:
        solutions = [distribute(p, method) for p in problems]
        solved = np.array([s.status == TensionStatus.FEASIBLE for s in solutions])
        said = np.array([s.status != TensionStatus.INFEASIBLE for s in solutions])
        largest = [
            float(np.max(s.tensions)) for s, good in zip(solutions, solved, strict=True) if good
        ]
        single, batch = _times(method, feasible[:TIMED])
        rows.append(
            MethodCoverage(
                robot=robot_name,
                method=method,
                poses=len(problems),
                feasible=int(np.sum(truth)),
                solved=int(np.sum(solved & truth)),
                wrong=int(np.sum(said != truth)),
                mean_largest_tension=float(np.mean(largest)) if largest else float("nan"),
                microseconds=single,
                kernel_microseconds=batch,
            )
        )
    return rows


def _times(method: str, problems: list[TensionProblem]) -> tuple[float, float]:
    """Microseconds of one call of `distribute`, and of one pose of the batch form."""
    if not problems:
        return float("nan"), float("nan")

    W = np.array([p.W for p in problems])
    w = np.array([p.wrench for p in problems])
    low, high = problems[0].lower, problems[0].upper
    works: list[Callable[[], float]] = [
        lambda: seconds_each(problems, lambda p: distribute(p, method)),
        lambda: seconds_per_call(lambda: distribute_batch(W, w, low, high, method, threads=1), 5),
    ]
    # A method that needs long has no use for many repeats.
    single, batch = interleaved(works, 1 if works[0]() * len(problems) > 0.3 else 5)
    return 1e6 * single, 1e6 * batch / len(problems)

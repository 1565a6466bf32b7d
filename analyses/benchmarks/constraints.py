"""Benchmarks of constraints for programs: kernels against Drake's automatic derivatives."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from pydrake.autodiffutils import InitializeAutoDiff
from pydrake.math import RigidTransform
from pydrake.planning import KinematicTrajectoryOptimization
from pydrake.solvers import PyFunctionConstraint, SnoptSolver
from pydrake.trajectories import BsplineTrajectory

from cdpr_drake.analyses.benchmarks.autodiff_terms import FreeTerms
from cdpr_drake.analyses.planning.robot_path_task import LimitSettings, path_task
from cdpr_drake.analyses.reporting.timing import (
    TimingRow,
    interleaved,
    processor_seconds,
)
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.convex_shapes import ConvexShape
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.planning.place_constraints import (
    CableClearance,
    ObstacleClearance,
    TargetInView,
)
from cdpr_drake.planning.pose_constraint import PoseConstraint
from cdpr_drake.planning.pose_coordinates import RelativePose
from cdpr_drake.planning.tension_constraints import LengthRates, TensionBalance, TensionFeasible

ROBOT, TENSIONS = "acrobot_large", (1.0, 60.0)

MARK, SLOPES, NEAREST = np.array([[-0.063], [0.0], [0.02]]), np.array([0.65, 0.5]), 0.1

PILLAR = np.array([0.06, 0.06, 0.35])
"""Of a box that stands on the ground in the middle [m]."""

START, GOAL = RigidTransform([-0.3, 0.0, 0.25]), RigidTransform([0.3, 0.0, 0.25])

BALL = 0.13
"""Radius of a ball round the platform, which the automatic form has in its place [m]."""

CLEARANCE, APART = 0.005, 0.006

CONTROL_POINTS, SAMPLES = 10, 13
SPEED, ACCELERATION = 0.5, 2.0

BEND = 0.2
"""How far the first guess is bent to the side [m]."""

Evaluate = Callable[[Any], Any]


def constraint_rows(quick: bool) -> list[TimingRow]:
    """All rows of this file; `quick` calls less, and leaves the whole program out."""
    rows = [_call_row(name, *both, 5 if quick else 20, 3) for name, both in pairs().items()]
    return rows if quick else [*rows, program_row(3)]


def pairs() -> dict[str, tuple[PoseConstraint, Evaluate]]:
    """Constraints by kernels, and the same by automatic derivatives, of an array of AutoDiffXd."""
    robot = load_robot(ROBOT)
    cables = robot.cable_set().without_pulleys()
    task = path_task(robot, LimitSettings(tensions=TENSIONS, reserve=0.0), cables)
    terms, here = FreeTerms(task, START), RelativePose(START)
    balance, apart = TensionBalance(task, here), CableClearance(cables, here, APART)
    camera = robot.camera_mount("onboard").pose.transform()
    largest, unit = task.limits.upper, balance.unit
    low, high = np.array([0.0, 0.0, 0.0]), np.array([0.0, 0.0, PILLAR[2]])
    ball = [ConvexShape.sphere(np.zeros(3), 0.0)]
    pillar = [ConvexShape.capsule(low, high, 0.5 * PILLAR[0])]

    def at(x: Any) -> Any:
        return terms.point(x[:6])

    return {
        "tensions as variables": (
            balance, lambda x: terms.unbalanced(at(x), largest * x[6:]) / unit,
        ),
        "margin of tensions": (TensionFeasible(task, here), lambda x: terms.margin(at(x))),
        "cables apart": (apart, lambda x: terms.cable_gaps(at(x), apart.pairs)),
        "off an obstacle": (
            ObstacleClearance(cables, here, pillar, ball, 0.0, 0.0),
            lambda x: terms.capsule_gaps(at(x), low, high, 0.5 * PILLAR[0]),
        ),
        "target in view": (
            TargetInView(here, camera, (SLOPES[0], SLOPES[1]), MARK, NEAREST),
            lambda x: terms.view(at(x), camera, SLOPES, MARK),
        ),
        "cable speeds": (
            LengthRates(cables, here, 1.0),
            lambda x: terms.cable_speeds(terms.point(x[:6], x[6:12])),
        ),
    }  # fmt: skip


def numbers(constraint: PoseConstraint) -> Array:
    """Coordinates off all limits, and tensions behind them."""
    random = np.random.default_rng(0)
    size = constraint.coordinates.sizes[constraint.order]
    return np.concatenate([
        0.05 * random.normal(size=size), random.uniform(0.1, 0.5, constraint.extra)
    ])  # fmt: skip


def _call_row(
    name: str, ours: PoseConstraint, automatic: Evaluate, calls: int, repeats: int
) -> TimingRow:
    """A call as solvers make it: Drake asks for values and gradient."""
    x = numbers(ours)
    given = InitializeAutoDiff(x).ravel()
    kernel = ours.as_drake()
    r = len(ours.lower)
    other = PyFunctionConstraint(len(x), automatic, np.zeros(r), np.ones(r), name)

    def each(constraint: PyFunctionConstraint, count: int) -> float:
        """Processor time of a call [us]."""
        return (
            1e6 / count * processor_seconds(lambda: [constraint.Eval(given) for _ in range(count)])
        )

    own, slow = interleaved([lambda: each(kernel, 20 * calls), lambda: each(other, calls)], repeats)
    words = f"{name}, value and gradient of {r} rows"
    baseline = "the same source on AutoDiffXd"
    return TimingRow(words, own, "us", baseline, slow, slow / own, ratio_means="times faster")


def program_row(repeats: int) -> TimingRow:
    """A motion past a pillar by Drake's KinematicTrajectoryOptimization, as `solved_program`."""
    both = pairs()
    own, slow = interleaved(
        [
            lambda: processor_seconds(lambda: solved_program(both, True)),
            lambda: processor_seconds(lambda: solved_program(both, False)),
        ],
        repeats,
    )
    return TimingRow(
        "past a pillar by KinematicTrajectoryOptimization, SNOPT", own, "s",
        "the same program on AutoDiffXd", slow, slow / own, ratio_means="times faster",
    )  # fmt: skip


def solved_program(
    both: dict[str, tuple[PoseConstraint, Evaluate]], by_kernels: bool
) -> tuple[bool, float, BsplineTrajectory]:
    """Least time and length past a capsule in the pillar, from rest to rest.

    The platform is a ball in either form, so that both solve the same program.

    Returns:
        Whether it was solved, the time [s], and the coordinates over time.
    """
    trajectory = KinematicTrajectoryOptimization(6, CONTROL_POINTS)
    prog = trajectory.get_mutable_prog()
    end = RelativePose(START).coordinates(GOAL)
    for k, place in ((0, np.zeros(6)), (1, end)):
        trajectory.AddPathPositionConstraint(place, place, k)
        trajectory.AddPathVelocityConstraint(np.zeros(6), np.zeros(6), k)
    limit = np.full(6, SPEED)
    trajectory.AddVelocityBounds(-limit, limit)
    most = np.full(6, ACCELERATION)
    trajectory.AddAccelerationBounds(-most, most)
    trajectory.AddDurationConstraint(0.1, 10.0)
    trajectory.AddDurationCost(1.0)
    trajectory.AddPathLengthCost(1.0)
    for name, least in (
        ("margin of tensions", np.zeros(1)),
        ("cables apart", None),
        ("off an obstacle", np.array([*np.full(8, CLEARANCE), CLEARANCE + BALL])),
    ):
        ours, automatic = both[name]
        low = ours.lower if least is None else least
        high = np.full(len(low), np.inf)
        for s in np.linspace(0.0, 1.0, SAMPLES):
            if by_kernels:
                kernel = ours.as_drake()
                kernel.UpdateLowerBound(low)
            else:
                kernel = PyFunctionConstraint(6, automatic, low, high, name)
            trajectory.AddPathPositionConstraint(kernel, s)
    bent = np.linspace(0.0, 1.0, CONTROL_POINTS)[:, np.newaxis] * end
    bent[:, 4] += BEND * np.sin(np.pi * np.linspace(0.0, 1.0, CONTROL_POINTS))
    trajectory.SetInitialGuess(
        BsplineTrajectory(trajectory.basis(), [row[:, np.newaxis] for row in bent])
    )
    result = SnoptSolver().Solve(prog)
    found = trajectory.ReconstructTrajectory(result)
    return bool(result.is_success()), float(found.end_time()), found

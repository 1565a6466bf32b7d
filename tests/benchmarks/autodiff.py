"""Constraints for programs against the source of the same kernels on AutoDiffXd.

What `planning` does by kernels with derivatives by hand is done here by Drake's automatic ones,
slowly and independently: tests compare the values and gradients, benchmarks the times.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np
from pydrake.autodiffutils import AutoDiffXd, InitializeAutoDiff
from pydrake.math import RigidTransform
from pydrake.solvers import PyFunctionConstraint
from scipy.optimize import linprog

from cdpr_drake.analyses.planning.robot_path_task import path_task, robot_limits
from cdpr_drake.arrays import Array
from cdpr_drake.control.task_space import floating_wrench
from cdpr_drake.geometry.convex_shapes import ConvexShape
from cdpr_drake.geometry.motion_kernel import floating_motion
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.geometry.pulley_kernel import pulley_line
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.numerics.kernel_calls import any_scalar
from cdpr_drake.planning.path_task import PathTask
from cdpr_drake.planning.place_constraints import CableClearance, ObstacleClearance, TargetInView
from cdpr_drake.planning.pose_constraint import PoseConstraint
from cdpr_drake.planning.pose_coordinates import RelativePose
from cdpr_drake.planning.tension_constraints import LengthRates, TensionBalance, TensionFeasible
from cdpr_drake.trajectories.pose_path import PIECE_NUMBERS, POINT_SIZE, path_point
from cdpr_drake.workspaces.cable_distance_kernel import segments_shares
from tests.benchmarks.ratios import Ratio, per_call, ratios

START = RigidTransform([-0.3, 0.0, 0.25])

MARK, SLOPES, NEAREST = np.array([[-0.063], [0.0], [0.02]]), (0.65, 0.5), 0.1
"""Of a view."""

FOOT, TOP, RADIUS = np.zeros(3), np.array([0.0, 0.0, 0.35]), 0.03
"""Of a pillar, a capsule [m]."""

APART = 0.006
"""Between cables [m]."""

TOUCHING = 1e-16
"""Added to squared distances, which have no derivative where segments cross [m^2]."""

CALLS = 20
"""On AutoDiffXd; kernels are called 20 times as often."""

Evaluate = Callable[[Any], Any]

_point = any_scalar(path_point)
_motion = any_scalar(floating_motion)
_wrench = any_scalar(floating_wrench)
_line = any_scalar(pulley_line)


def benchmark() -> Iterator[Ratio]:
    """Each constraint as solvers call it, who want value and gradient of AutoDiffXd."""
    for name, (constraint, automatic) in pairs().items():
        yield from ratios(constraint_ways(name, constraint, automatic), 5)


def constraint_ways(
    name: str, constraint: PoseConstraint, automatic: Evaluate
) -> dict[str, Callable[[], float]]:
    """A constraint by its kernel, what of this pydrake and the kernel take, and by AutoDiffXd."""
    x, r = numbers(constraint), len(constraint.lower)
    variables = InitializeAutoDiff(x).ravel()

    def of_pydrake(function: Evaluate) -> Callable[[], object]:
        written = PyFunctionConstraint(len(x), function, np.zeros(r), np.ones(r), name)
        return partial(written.Eval, variables)

    empty = of_pydrake(lambda z: np.repeat(z[:1], r))
    return {
        name: per_call(partial(constraint.as_drake().Eval, variables), 20 * CALLS),
        "  values and Jacobian alone": per_call(
            partial(constraint.evaluate, x[np.newaxis]), 20 * CALLS
        ),
        "  an empty constraint of pydrake": per_call(empty, 20 * CALLS),
        "its source on AutoDiffXd": per_call(of_pydrake(automatic), CALLS),
    }


def pairs() -> dict[str, tuple[PoseConstraint, Evaluate]]:
    """Constraints by kernels, and the same functions of an array of AutoDiffXd, by name."""
    robot = load_robot("acrobot_large")
    cables = robot.cable_set().without_pulleys()
    task = path_task(robot, robot_limits(robot, (1.0, 60.0)), cables)
    terms, here = Terms(task), RelativePose(START)
    balance, apart = TensionBalance(task, here), CableClearance(cables, here, APART)
    camera = robot.camera_mount("onboard").pose.transform()
    platform = [ConvexShape.sphere(np.zeros(3), 0.0)]
    pillar = [ConvexShape.capsule(FOOT, TOP, RADIUS)]
    largest, unit, at = task.limits.upper, balance.unit, terms.point
    return {
        "tensions as variables": (
            balance, lambda x: terms.unbalanced(at(x[:6]), largest * x[6:]) / unit,
        ),
        "margin of tensions": (TensionFeasible(task, here), lambda x: terms.margin(at(x[:6]))),
        "cables apart": (apart, lambda x: terms.cable_gaps(at(x[:6]), apart.pairs)),
        "off an obstacle": (
            ObstacleClearance(cables, here, pillar, platform, 0.0, 0.0),
            lambda x: terms.pillar_gaps(at(x[:6])),
        ),
        "target in view": (
            TargetInView(here, camera, SLOPES, MARK, NEAREST),
            lambda x: terms.view(at(x[:6]), camera),
        ),
        "cable speeds": (
            LengthRates(cables, here, 1.0), lambda x: terms.cable_speeds(at(x[:6], x[6:12])),
        ),
    }  # fmt: skip


def numbers(constraint: PoseConstraint) -> Array:
    """Coordinates off all limits, and tensions behind them."""
    random = np.random.default_rng(0)
    size = constraint.coordinates.sizes[constraint.order]
    return np.concatenate([
        0.05 * random.normal(size=size), random.uniform(0.1, 0.5, constraint.extra)
    ])  # fmt: skip


class Terms:
    """Terms of a robot's motion on any scalar; coordinates (g, d) of a pose count from `START`."""

    def __init__(self, task: PathTask) -> None:
        """With cables, dynamics and limits."""
        self._limits, self._p_WA = task.limits, task.cables.p_WA.T
        self._cables, self._dynamics = task.cables.packed(), task.dynamics.packed()

    def point(self, q: Any, v: Any = None) -> Any:
        """Pose row, V_WP, A_WP of coordinates and their rates, shape (19,)."""
        w, x, y, z = pose_row(START)[:4]
        # (1, g) times the quaternion of the start, as a linear map of (1, g).
        turn = np.array([[w, -x, -y, -z], [x, w, z, -y], [y, -z, w, x], [z, y, -x, w]])
        piece = np.zeros(PIECE_NUMBERS, dtype=np.asarray(q).dtype)
        piece[:4] = turn @ np.concatenate([[1.0], q[:3]])
        piece[4:7] = START.translation() + q[3:]
        if v is not None:
            piece[7:11], piece[11:14] = turn[:, 1:] @ v[:3], v[3:]
        out = np.zeros(POINT_SIZE, dtype=piece.dtype)
        _point(piece, 0.0, out)
        return out

    def lines(self, point: Any) -> list[tuple[Any, ...]]:
        """Of each cable the unit vector A' to B and the arm in W, (ux, uy, uz, rx, ry, rz)."""
        X = _motion(point[:13])
        return [_line(X, cable)[1:] for cable in self._cables]

    def unbalanced(self, point: Any, tensions: Any) -> Any:
        """Wrench that the cables give less what the motion needs, shape (6,) [N m, N]."""
        state, out = np.zeros(13, dtype=point.dtype), np.zeros(6, dtype=point.dtype)
        state[:] = point[:13]
        _wrench(state, point, self._dynamics, np.zeros(4), out)
        total = -out
        for t, (ux, uy, uz, rx, ry, rz) in zip(tensions, self.lines(point), strict=True):
            moment = (ry * uz - rz * uy, rz * ux - rx * uz, rx * uy - ry * ux)
            for k, part in enumerate((*moment, ux, uy, uz)):
                total[k] = total[k] - t * part
        return total

    def margin(self, point: Any) -> Any:
        """Largest s with tensions that keep s off their limits [N], a program of HiGHS.

        Its derivative is that of the balance times its multipliers.
        """
        lines = [[value(x) for x in line] for line in self.lines(point)]
        lower, upper, m = self._limits.lower, self._limits.upper, len(lines)
        columns = np.array([[*np.cross(line[3:], line[:3]), *line[:3]] for line in lines]).T
        load = np.array([value(x) for x in self.unbalanced(point, np.zeros(m))])
        one = np.ones((m, 1))
        A = np.vstack([np.hstack([-np.eye(m), one]), np.hstack([np.eye(m), one])])
        b = np.concatenate([np.full(m, -lower), np.full(m, upper)])
        balance = np.hstack([columns, np.zeros((len(load), 1))])
        best = linprog(
            [*np.zeros(m), -1.0], A_ub=A, b_ub=b, A_eq=balance, b_eq=load, bounds=(None, None)
        )
        return np.array([best.x[m] - best.eqlin.marginals @ self.unbalanced(point, best.x[:m])])

    def cable_speeds(self, point: Any) -> Any:
        """dl/dt of the cables, shape (m,) [m/s]."""
        wx, wy, wz, vx, vy, vz = point[7:13]
        return np.array([
            ux * (vx + wy * rz - wz * ry) + uy * (vy + wz * rx - wx * rz)
            + uz * (vz + wx * ry - wy * rx)
            for ux, uy, uz, rx, ry, rz in self.lines(point)
        ])  # fmt: skip

    def cable_gaps(self, point: Any, pairs: np.ndarray) -> Any:
        """Distances of the centre lines of pairs of cables from exit points, shape (p,) [m]."""
        segments = list(zip(self._p_WA, self._anchors(point), strict=True))
        return np.array([segments_gap(segments[i], segments[j]) for i, j in pairs])

    def pillar_gaps(self, point: Any) -> Any:
        """Distances of cables, and of Po, from the pillar, shape (m + 1,) [m]."""
        place = point[4:7]
        segments = [*zip(self._p_WA, self._anchors(point), strict=True), (place, place)]
        return np.array([segments_gap(segment, (FOOT, TOP)) - RADIUS for segment in segments])

    def _anchors(self, point: Any) -> list[Any]:
        """Anchor points p_WB, one of shape (3,) for each cable [m]."""
        return [point[4:7] + np.array(line[3:]) for line in self.lines(point)]

    def view(self, point: Any, camera: RigidTransform) -> Any:
        """How far the marks are within the view; as `TargetInView`."""
        R, p, X = camera.rotation().matrix(), camera.translation(), _motion(point[:13])
        margins: list[Any] = []
        for Q in MARK.T:
            d = Q - point[4:7]
            p_PQ = np.array([X[k] * d[0] + X[3 + k] * d[1] + X[6 + k] * d[2] for k in range(3)])
            x, y, z = R.T @ (p_PQ - p)
            margins += [SLOPES[0] * z - x, SLOPES[0] * z + x]
            margins += [SLOPES[1] * z - y, SLOPES[1] * z + y, z]
        return np.array(margins)


def value(x: Any) -> float:
    """A number that may carry derivatives, without them."""
    return float(x.value()) if isinstance(x, AutoDiffXd) else float(x)


def segments_gap(first: Sequence[Any], second: Sequence[Any]) -> Any:
    """Distance of two segments, each two ends of shape (3,), of any scalar [m].

    The derivative of a distance is that of its nearest points as if they stayed where they are on
    their segments, so shares along these are numbers and carry no derivative.
    """
    x, y = segments_shares(*(np.array([value(c) for c in end]) for end in (*first, *second)))
    d = first[0] + x * (first[1] - first[0]) - second[0] - y * (second[1] - second[0])
    return np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2] + TOUCHING)

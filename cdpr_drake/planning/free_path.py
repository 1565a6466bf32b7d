"""A motion whose path is free, as a Drake MathematicalProgram that grows by what is added to it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations
from typing import Any

import numpy as np
from pydrake.autodiffutils import AutoDiffXd, ExtractValue
from pydrake.math import RigidTransform
from pydrake.solvers import Binding, MathematicalProgram, MathematicalProgramResult

from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError
from cdpr_drake.planning.free_path_solution import (
    FreePathSolution,
    multipliers,
    solve,
    violation,
)
from cdpr_drake.planning.free_path_terms import Capsule, FreeTerms, segments_gap
from cdpr_drake.planning.path_task import PathTask
from cdpr_drake.trajectories import PIECE_NUMBERS, PosePath, TimedPath

KNOTS = 16
"""Usual number of knots."""

FEWEST, MOST = 4, 200
"""Numbers of knots that are accepted."""

SHARED = 1e-9
"""Cables whose exit or anchor points are nearer share it, and always touch there [m]."""

Evaluate = Callable[[Any], Any]


class FreePathProgram:
    """A motion from rest to rest in free space: coordinates at knots, and the time between them.

    Knots are the same time apart. Between them the acceleration of the coordinates is linear in
    time, so that their way is cubic. At each knot the tensions give the wrench that the motion
    needs. Variables are named q, v, a and t, with knot and number, and T; the tensions t are shares
    of the largest one. Costs and constraints are added by `Add...`; what is missing may be added to
    `prog()`. Gradients are exact: the source of the kernels runs on AutoDiffXd.

    Coordinates: see `free_path_terms`.
    """

    def __init__(
        self,
        task: PathTask,
        start: RigidTransform,
        goal: RigidTransform,
        knots: int = KNOTS,
        duration: tuple[float, float] = (0.05, 60.0),
    ) -> None:
        """With both ends at rest, the dynamics, and the limits of tensions.

        Args:
            task: The robot and its limits.
            start: X_WP at the start [m].
            goal: X_WP at the end [m].
            knots: Number of knots.
            duration: Shortest and longest time [s].

        Raises:
            PlanningError: A number is not accepted, or the goal is turned too far from the start.
        """
        if not FEWEST <= knots <= MOST:
            raise PlanningError(f"knots: found {knots}; accepted: {FEWEST} to {MOST}")
        if not 0.0 < duration[0] <= duration[1] < np.inf:
            raise PlanningError(f"duration: found {duration} s; accepted: 0 < shortest <= longest")
        self.task, self.terms = task, FreeTerms(task, start)
        end = self.terms.coordinates(goal)
        n, m = len(end), task.cables.count
        self._prog = MathematicalProgram()
        add = self._prog.NewContinuousVariables
        self._q, self._v, self._a = (add(knots, n, name) for name in "qva")
        self._t, self._T = add(knots, m, "t"), add(1, "T")
        self._bindings: dict[str, list[Binding]] = {}
        bound = self._prog.AddBoundingBoxConstraint
        self._keep("duration", bound(duration[0], duration[1], self._T[0]))
        zero = np.zeros(n)
        for k, place in ((0, zero), (knots - 1, end)):
            for values, variables in ((place, self._q[k]), (zero, self._v[k])):
                self._keep("ends", bound(values, values, variables))
        for k in range(knots - 1):
            self._keep("motion", self._link(k))
        rest = max(float(np.linalg.norm(self.terms.unbalanced(self._rest(), np.zeros(m)))), 1.0)
        scale = task.limits.upper

        def balance(x: Any) -> Any:
            point = self.terms.point(x[:n], x[n : 2 * n], x[2 * n : 3 * n])
            return self.terms.unbalanced(point, scale * x[3 * n :]) / rest

        for k in range(knots):
            variables = np.concatenate([self._q[k], self._v[k], self._a[k], self._t[k]])
            self._keep("dynamics", self._constrain(balance, zero, zero, variables))
        low = np.full(self._t.shape, task.limits.lower / scale)
        for k in range(knots):
            self._keep("tensions", bound(low[k], np.ones(m), self._t[k]))

    def prog(self) -> MathematicalProgram:
        """The program."""
        return self._prog

    def duration(self) -> Any:
        """The variable of the time from start to goal [s]."""
        return self._T[0]

    def coordinates(self) -> Any:
        """Variables of the coordinates at the knots, shape (k, n)."""
        return self._q

    def velocities(self) -> Any:
        """Variables of their derivatives by time, shape (k, n)."""
        return self._v

    def accelerations(self) -> Any:
        """Variables of their second derivatives, shape (k, n)."""
        return self._a

    def tensions(self) -> Any:
        """Variables of the tensions as shares of the largest tension, shape (k, m)."""
        return self._t

    def constraints(self) -> dict[str, list[Binding]]:
        """What was added, by name."""
        return self._bindings

    def AddCableSpeedLimits(self) -> None:
        """Cable speeds within the limit of the task, at every knot and halfway between.

        At knots alone a motion could be faster between them, where it jerks to and fro.
        """
        m, most = self.task.cables.count, self.task.limits.cable_speed
        n, parts = self._q.shape[1], len(self._q) - 1

        def speeds(x: Any) -> Any:
            return self.terms.cable_speeds(self.terms.point(x[:n], x[n : 2 * n])) / most

        def between(x: Any) -> Any:
            q, v, a, b = (x[i * n : (i + 1) * n] for i in range(4))
            h = x[4 * n] / parts
            place = q + h * (0.5 * v + h * (5.0 * a + b) / 48.0)
            return speeds(np.concatenate([place, v + h * (3.0 * a + b) / 8.0]))

        one = np.ones(m)
        for k in range(parts):
            here = [self._q[k], self._v[k], self._a[k], self._a[k + 1]]
            self._keep(
                "cable speeds",
                self._constrain(between, -one, one, np.concatenate([*here, self._T])),
            )
            if k > 0:
                variables = np.concatenate(here[:2])
                self._keep("cable speeds", self._constrain(speeds, -one, one, variables))

    def AddPlaceBounds(self, lower: Array, upper: Array, margin: float = 0.0) -> None:
        """Po within a box of W, corners of shape (3,) [m], and off its sides by a margin [m].

        Raises:
            PlanningError: The box has no inside.
        """
        low, high = np.asarray(lower, float) + margin, np.asarray(upper, float) - margin
        if not np.all(low < high):
            raise PlanningError(
                f"box: found {low} to {high} m with its margin; accepted: an inside"
            )
        self._at_knots("place", lambda point: point[4:7], low, high)

    def AddObstacles(
        self, obstacles: Sequence[Capsule], clearance: float, platform: tuple[Array, float]
    ) -> None:
        """Cables, and a ball around the platform, stay off obstacles, at every knot.

        Args:
            obstacles: What stands in the way.
            clearance: Least distance of the cables' centre lines and of the ball [m].
            platform: The ball: its middle in P, shape (3,), and its radius [m].
        """
        middle, radius = np.asarray(platform[0], float), float(platform[1])
        A = self.task.cables.p_WA.T

        def gaps(point: Any) -> Any:
            ball = self.terms.from_platform(point, middle)
            found = []
            for one in obstacles:
                fixed = (np.asarray(one.start, float), np.asarray(one.end, float))
                for begin, B in zip(A, self.terms.ends(point), strict=True):
                    gap = segments_gap((begin, B), fixed, [begin, _value(B), *fixed])
                    found.append(gap - one.radius)
                here = _value(ball)
                gap = segments_gap((ball, ball), fixed, [here, here, *fixed])
                found.append(gap - one.radius - radius)
            return np.array(found)

        count = len(obstacles) * (len(A) + 1)
        low = np.full(count, clearance)
        self._at_knots("obstacles", gaps, low, np.full(count, np.inf))

    def AddCableClearance(self, distance: float) -> None:
        """Centre lines of cables that share no point stay a distance [m] apart, at every knot."""
        A, B = self.task.cables.p_WA.T, self.task.cables.p_PB.T
        pairs = [
            (i, j)
            for i, j in combinations(range(len(A)), 2)
            if np.linalg.norm(A[i] - A[j]) > SHARED and np.linalg.norm(B[i] - B[j]) > SHARED
        ]

        def gaps(point: Any) -> Any:
            ends = self.terms.ends(point)
            plain = [_value(end) for end in ends]
            return np.array([
                segments_gap((A[i], ends[i]), (A[j], ends[j]), [A[i], plain[i], A[j], plain[j]])
                for i, j in pairs
            ])  # fmt: skip

        low = np.full(len(pairs), distance)
        self._at_knots("cables apart", gaps, low, np.full(len(pairs), np.inf))

    def AddFieldOfView(
        self, X_PC: RigidTransform, slopes: tuple[float, float], points: Array, nearest: float
    ) -> None:
        """Points of W are in the view of a camera on the platform, at every knot.

        Args:
            X_PC: Pose of the camera C, z forward [m].
            slopes: Tangents of half of the view's angles along x and y of C.
            points: p_WQ, shape (3, p) [m].
            nearest: Least depth z of the points in C, above 0 [m].

        Source: servoing thesis, chapter 4, where the target stays in view.
        """
        R, p = X_PC.rotation().matrix(), X_PC.translation()

        def seen(point: Any) -> Any:
            found = []
            for Q in np.asarray(points, float).T:
                x, y, z = R.T @ (self.terms.in_platform(point, Q) - p)
                found += [slopes[0] * z - x, slopes[0] * z + x]
                found += [slopes[1] * z - y, slopes[1] * z + y, z - nearest]
            return np.array(found)

        count = 5 * np.shape(points)[1]
        self._at_knots("view", seen, np.zeros(count), np.full(count, np.inf))

    def AddLeastTime(self, weight: float = 1.0) -> None:
        """Cost: the time from start to goal, times a weight [1/s]."""
        self._prog.AddLinearCost([weight], 0.0, self._T)

    def AddTensionCost(self, weight: float = 1.0, wanted: float = 0.0) -> None:
        """Cost: mean square of the tensions less a wanted one, over that of the largest tension.

        With 0 wanted it goes as the energy that the motors lose in their windings in a given time.

        Args:
            weight: Of the cost.
            wanted: Wanted tension of all cables [N].
        """
        k, m = self._t.shape
        share = np.full(k * m, wanted / self.task.limits.upper)
        Q = 2.0 * weight / (k * m) * np.eye(k * m)
        self._prog.AddQuadraticErrorCost(0.5 * Q, share, self._t.ravel())

    def Solve(self, duration: float = 1.0) -> FreePathSolution:
        """Solves from a straight line at rest at both ends, in so much time [s].

        The first solver that is there: SNOPT, IPOPT, NLopt. The answer says whether it succeeded.
        """
        self._guess(duration)
        result, name, words, took = solve(self._prog)
        success = bool(result.is_success())
        T = float(result.GetSolution(self._T)[0])
        return FreePathSolution(
            task=self.task,
            success=success,
            status=words,
            solver=name,
            solve_time=took,
            cost=float(result.get_optimal_cost()),
            duration=T,
            violations={key: violation(result, some) for key, some in self._bindings.items()},
            multipliers={key: multipliers(result, some) for key, some in self._bindings.items()},
            times=np.linspace(0.0, T, len(self._q)),
            tensions=self.task.limits.upper * np.asarray(result.GetSolution(self._t)),
            trajectory=self._trajectory(result) if success else None,
        )

    def _trajectory(self, result: MathematicalProgramResult) -> TimedPath:
        """The motion: cubic coordinates from knot to knot, along a path whose parameter is time."""
        q, v, a = (np.asarray(result.GetSolution(x)) for x in (self._q, self._v, self._a))
        times = np.linspace(0.0, float(result.GetSolution(self._T)[0]), len(q))
        pieces = np.zeros((len(q) - 1, PIECE_NUMBERS))
        for k, piece in enumerate(pieces):
            growth = (a[k + 1] - a[k]) / (6.0 * (times[1] - times[0]))
            for power, part in enumerate((q[k], v[k], 0.5 * a[k], growth)):
                piece[7 * power : 7 * power + 7] = self.terms.row(part, power)
        return TimedPath.make(PosePath(times, pieces), times, np.ones(len(times)))

    def _guess(self, duration: float) -> None:
        set_guess = self._prog.SetInitialGuess
        s = np.linspace(0.0, 1.0, len(self._q))[:, np.newaxis]
        goal = np.asarray(self._bindings["ends"][2].evaluator().lower_bound())
        set_guess(self._q, s**3 * (10.0 + s * (-15.0 + 6.0 * s)) * goal)
        set_guess(self._v, 30.0 * s**2 * (1.0 - s) ** 2 / duration * goal)
        set_guess(self._a, 60.0 * s * (1.0 + s * (-3.0 + 2.0 * s)) / duration**2 * goal)
        lim = self.task.limits
        low, high = lim.lower / lim.upper, min(1.0, 3.0 * lim.lower / lim.upper + 0.2)
        set_guess(self._t, np.full(self._t.shape, 0.5 * (low + high)))
        set_guess(self._T, np.array([duration]))

    def _rest(self) -> Array:
        n = self._q.shape[1]
        zero = np.zeros(n)
        return np.asarray(self.terms.point(zero, zero, zero), float)

    def _link(self, k: int) -> Binding:
        """The knots k and k + 1 belong to one motion."""
        n, parts = self._q.shape[1], len(self._q) - 1

        def gap(x: Any) -> Any:
            q0, v0, a0, q1, v1, a1 = (x[i * n : (i + 1) * n] for i in range(6))
            h = x[6 * n] / parts
            way = q1 - q0 - h * v0 - h * h * (2.0 * a0 + a1) / 6.0
            return np.concatenate([way, v1 - v0 - 0.5 * h * (a0 + a1)])

        both = [part[j] for j in (k, k + 1) for part in (self._q, self._v, self._a)]
        zero = np.zeros(2 * n)
        return self._constrain(gap, zero, zero, np.concatenate([*both, self._T]))

    def _at_knots(self, name: str, function: Evaluate, low: Array, high: Array) -> None:
        for variables in self._q:
            self._keep(
                name, self._constrain(lambda x: function(self.terms.point(x)), low, high, variables)
            )

    def _constrain(self, function: Evaluate, low: Array, high: Array, variables: Any) -> Binding:
        return self._prog.AddConstraint(function, lb=low, ub=high, vars=variables)

    def _keep(self, name: str, binding: Binding) -> None:
        binding.evaluator().set_description(name)
        self._bindings.setdefault(name, []).append(binding)


def _value(x: Any) -> Array:
    """Numbers of an array that may carry derivatives."""
    if x.dtype == object and isinstance(x[0], AutoDiffXd):
        return np.ascontiguousarray(ExtractValue(x).ravel())
    return np.ascontiguousarray(x, dtype=float)

"""A motion whose path is free, as a Drake MathematicalProgram that grows by what is added to it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from pydrake.math import RigidTransform
from pydrake.solvers import Binding, MathematicalProgram, MathematicalProgramResult

from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError
from cdpr_drake.planning.failures import MOST_NAMED
from cdpr_drake.planning.free_path_solution import (
    MISSED,
    FreePathSolution,
    multipliers,
    solve,
    violation,
)
from cdpr_drake.planning.free_path_surroundings import cable_gaps, obstacle_gaps, view_gaps
from cdpr_drake.planning.free_path_terms import Capsule, FreeTerms
from cdpr_drake.planning.path_task import PathTask, pose_words
from cdpr_drake.trajectories.pose_path import PIECE_NUMBERS, PosePath
from cdpr_drake.trajectories.timed_path import TimedPath

KNOTS = 16
"""Usual number of knots."""

FEWEST, MOST = 4, 200
"""Numbers of knots that are accepted."""

Evaluate = Callable[..., Any]

Rows = Sequence[str]
"""Words for the rows of a constraint: which cable, which pair of cables, ..."""


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
        self._rows: dict[str, Rows] = {}
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
            self._keep("tensions", bound(low[k], np.ones(m), self._t[k]), self._cable_words())

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
        parts = len(self._q) - 1

        def speeds(q: Any, v: Any) -> Any:
            return self.terms.cable_speeds(self.terms.point(q, v)) / most

        def between(x: Any) -> Any:
            return speeds(*self.terms.halfway(x, parts)[:2])

        one, n = np.ones(m), self._q.shape[1]
        for k in range(parts):
            here = self._constrain(between, -one, one, self._stretch(k))
            self._keep("cable speeds", here, self._cable_words())
            if k > 0:
                variables = np.concatenate([self._q[k], self._v[k]])
                here = self._constrain(lambda x: speeds(x[:n], x[n:]), -one, one, variables)
                self._keep("cable speeds", here)

    def AddWinchLimits(self) -> None:
        """Torques, cable accelerations and the speed of Po within the task's limits, at every knot.

        Those that are finite; the latter two halfway between knots, too. Torques are the inertia's
        and the tension's, as of `MotionLimits`.
        """
        lim, m, n = self.task.limits, self.task.cables.count, self._q.shape[1]
        names, last, turn = self._cable_words(), len(self._q) - 1, lim.inertia / lim.ratio
        one, most = np.ones(m), np.full(1, lim.speed**2)

        def torques(x: Any) -> Any:
            growth = self.terms.cable_accelerations(x[:n], x[n : 2 * n], x[2 * n : 3 * n])
            return (turn * growth - lim.ratio * lim.upper * x[3 * n :]) / lim.torque

        def growth(q: Any, v: Any, a: Any) -> Any:
            return self.terms.cable_accelerations(q, v, a) / lim.cable_acceleration

        def square(q: Any, v: Any) -> Any:
            x, y, z = self.terms.point(q, v)[10:13]
            return np.array([x * x + y * y + z * z])

        for k in range(last + 1):
            here = np.concatenate([self._q[k], self._v[k], self._a[k], self._t[k]])
            if np.isfinite(lim.torque):
                self._keep("torques", self._constrain(torques, -one, one, here), names)
            for name, function, low, high, bound in (
                ("cable accelerations", growth, -one, one, lim.cable_acceleration),
                ("speed of Po", square, np.zeros(1), most, lim.speed),
            ):
                if not np.isfinite(bound):
                    continue
                words = names if function is growth else ()
                size = 3 if function is growth else 2

                def at_knot(x: Any, function: Evaluate = function, size: int = size) -> Any:
                    return function(*(x[i * n : (i + 1) * n] for i in range(size)))

                def between(x: Any, function: Evaluate = function, size: int = size) -> Any:
                    return function(*self.terms.halfway(x, last)[:size])

                self._keep(name, self._constrain(at_knot, low, high, here[: size * n]), words)
                if k < last:
                    self._keep(name, self._constrain(between, low, high, self._stretch(k)))

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
        self._at_knots("place", lambda point: point[4:7], low, high, ("x", "y", "z"))

    def AddObstacles(
        self, obstacles: Sequence[Capsule], clearance: float, platform: tuple[Array, float]
    ) -> None:
        """Cables, and a ball around the platform, stay off obstacles, at every knot.

        Args:
            obstacles: What stands in the way.
            clearance: Least distance of the cables' centre lines and of the ball [m].
            platform: The ball: its middle in P, shape (3,), and its radius [m].
        """
        gaps, names = obstacle_gaps(self.terms, obstacles, platform, self._cable_words())
        low = np.full(len(names), clearance)
        self._at_knots("obstacles", gaps, low, np.full(len(names), np.inf), names)

    def AddCableClearance(self, distance: float) -> None:
        """Centre lines of cables that share no point stay a distance [m] apart, at every knot."""
        gaps, names = cable_gaps(self.terms, self._cable_words())
        low = np.full(len(names), distance)
        self._at_knots("cables apart", gaps, low, np.full(len(names), np.inf), names)

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
        seen, names = view_gaps(self.terms, X_PC, slopes, points, nearest)
        most = np.full(len(names), np.inf)
        self._at_knots("view", seen, np.zeros(len(names)), most, names)

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

    def AddEnergyCost(self, weight: float = 1.0) -> None:
        """Cost: integral over time of the mean square of the tensions, over the largest's [1/s].

        As the heat of the windings of motors that hold the tensions; unlike `AddTensionCost` it
        counts how long, so that the time may be free.
        """
        share = weight / self._t.size

        def heat(x: Any) -> Any:
            return share * x[-1] * np.sum(x[:-1] * x[:-1])

        self._prog.AddCost(heat, vars=np.concatenate([self._t.ravel(), self._T]))

    def Solve(self, duration: float = 1.0) -> FreePathSolution:
        """Solves from a straight line at rest at both ends, in so much time [s].

        The first solver that is there: SNOPT, IPOPT, NLopt. The answer says whether it succeeded.
        """
        self._guess(duration)
        result, name, words, took = solve(self._prog)
        success = bool(result.is_success())
        T = float(result.GetSolution(self._T)[0])
        missed = {key: violation(result, some) for key, some in self._bindings.items()}
        return FreePathSolution(
            task=self.task,
            success=success,
            status=words,
            solver=name,
            solve_time=took,
            cost=float(result.get_optimal_cost()),
            duration=T,
            violations={key: size for key, (size, _, _) in missed.items()},
            worst=self._worst(result, missed),
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

    def _worst(
        self, result: MathematicalProgramResult, missed: dict[str, tuple[float, int, int]]
    ) -> str:
        """What is missed most: its name, where on the way, and which cable or row."""
        name = max(missed, key=lambda key: missed[key][0])
        size, number, row = missed[name]
        if size <= MISSED:
            return ""
        variables = (self._q, self._v, self._a, self._t)
        q, v, a, t = (np.asarray(result.GetSolution(x)) for x in variables)
        last = len(q) - 1
        k = round(number / max(len(self._bindings[name]) - 1, 1) * last)
        what = self._rows.get(name, ())
        who = what[row % len(what)] if what else ""
        here = [self.terms.at_limit(q[i], v[i], a[i], t[i]) for i in range(len(q))]
        common = Counter(i for cables in here for i in cables).most_common()
        cables = here[k] or [i for i, _ in common]
        names = ", ".join(self.task.name(i) for i in cables[:MOST_NAMED]) or "none"
        place = pose_words(np.asarray(self.terms.point(q[k], v[k], a[k]), float))
        return (
            f"{name} by {size:.3g}{f' of {who}' if who else ''}, {k / last:.0%} of the way, at "
            f"{place}; cables at a limit {'there' if here[k] else 'on the way'}: {names}"
        )

    def _stretch(self, k: int) -> Any:
        """Variables of which the motion from knot k to the next is made, as of `halfway`."""
        parts = (self._q[k], self._v[k], self._a[k], self._a[k + 1], self._T)
        return np.concatenate(parts)

    def _cable_words(self) -> list[str]:
        return [self.task.name(i) for i in range(self.task.cables.count)]

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

    def _at_knots(
        self, name: str, function: Evaluate, low: Array, high: Array, rows: Rows = ()
    ) -> None:
        for variables in self._q:
            bound = self._constrain(lambda x: function(self.terms.point(x)), low, high, variables)
            self._keep(name, bound, rows)

    def _constrain(self, function: Evaluate, low: Array, high: Array, variables: Any) -> Binding:
        return self._prog.AddConstraint(function, lb=low, ub=high, vars=variables)

    def _keep(self, name: str, binding: Binding, rows: Rows = ()) -> None:
        binding.evaluator().set_description(name)
        self._rows.setdefault(name, rows)
        self._bindings.setdefault(name, []).append(binding)

"""A motion whose path is free, as a Drake MathematicalProgram that grows by what is added to it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from pydrake.math import RigidTransform
from pydrake.solvers import Binding, MathematicalProgram, MathematicalProgramResult

from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError
from cdpr_drake.geometry.convex_shapes import ConvexShape
from cdpr_drake.planning.free_path_checks import (
    Asked,
    Place,
    Refinement,
    missed_most,
    missed_words,
)
from cdpr_drake.planning.free_path_pieces import between, fitted, link
from cdpr_drake.planning.free_path_solution import (
    FreePathSolution,
    multipliers,
    solve,
    violation,
)
from cdpr_drake.planning.path_task import PathTask
from cdpr_drake.planning.place_constraints import (
    CableClearance,
    ObstacleClearance,
    PlaceWithin,
    PlatformSpeed,
    TargetInView,
)
from cdpr_drake.planning.pose_constraint import Differentiable, PoseConstraint, drake_function
from cdpr_drake.planning.pose_coordinates import RelativePose
from cdpr_drake.planning.tension_constraints import (
    LengthAccelerations,
    LengthRates,
    MotorTorques,
    TensionBalance,
    TensionFeasible,
)
from cdpr_drake.trajectories.pose_path import PIECE_NUMBERS, PosePath
from cdpr_drake.trajectories.timed_path import TimedPath

KNOTS = 16
"""Usual number of knots."""

FEWEST, MOST = 4, 200
"""Numbers of knots that are accepted."""

Guess = PosePath | TimedPath | None
"""Where a solver starts: a path, a motion, or the straight line."""


class FreePathProgram:
    """A motion from rest to rest in free space: coordinates at knots, and the time between them.

    Knots are the same time apart. Between them the acceleration of the coordinates is linear in
    time, so that their way is cubic. At each knot the tensions give the wrench that the motion
    needs. Variables are named q, v, a and t, with knot and number, and T; the tensions t are shares
    of the largest one. Costs and constraints are added by `Add...`; what is missing may be added to
    `prog()`, as any `PoseConstraint` of `pose_coordinates`. Values and gradients are exact and come
    from kernels.

    Coordinates: see `pose_coordinates.RelativePose`.
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
        self.task = task
        self.pose_coordinates = RelativePose(start, task.dynamics.motions)
        self._end = self.pose_coordinates.coordinates(goal)
        n, m = len(self._end), task.cables.count
        self._prog = MathematicalProgram()
        add = self._prog.NewContinuousVariables
        self._q, self._v, self._a = (add(knots, n, name) for name in "qva")
        self._t, self._T = add(knots, m, "t"), add(1, "T")
        self._bindings: dict[str, list[Binding]] = {}
        self._places: dict[str, list[Place]] = {}
        self._rows: dict[str, list[tuple[str, ...]]] = {}
        self._own: list[tuple[PoseConstraint, Place, Any]] = []
        self._watched: list[PoseConstraint] = []
        self._between_asked: set[Asked] = set()
        bound = self._prog.AddBoundingBoxConstraint
        self._keep("duration", bound(duration[0], duration[1], self._T[0]), (0, 0.0))
        zero = np.zeros(n)
        for k, place in ((0, zero), (knots - 1, self._end)):
            for values, variables in ((place, self._q[k]), (zero, self._v[k])):
                self._keep("ends", bound(values, values, variables), (k, 0.0))
        for k in range(knots - 1):
            self._keep("motion", self._link(k), (k, 0.0))
        balance = TensionBalance(task, self.pose_coordinates)
        for k in range(knots):
            self._at_knot(balance, k)
        low = np.full(m, task.limits.lower / task.limits.upper)
        for k in range(knots):
            box = bound(low, np.ones(m), self._t[k])
            self._keep("tensions", box, (k, 0.0), self._cable_words())

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
        limit = self.task.limits.cable_speed
        self.Add(LengthRates(self.task.cables, self.pose_coordinates, limit), halfway=True)

    def AddWinchLimits(self) -> None:
        """Torques, cable accelerations and the speed of Po within the task's limits, at every knot.

        Those that are finite; the latter two halfway between knots, too. Torques are the inertia's
        and the tension's, as of `MotionLimits`.
        """
        lim, cables, here = self.task.limits, self.task.cables, self.pose_coordinates
        if np.isfinite(lim.torque):
            self.Add(MotorTorques(self.task, here))
        if np.isfinite(lim.cable_acceleration):
            self.Add(LengthAccelerations(cables, here, lim.cable_acceleration), halfway=True)
        if np.isfinite(lim.speed):
            self.Add(PlatformSpeed(here, lim.speed), halfway=True)

    def AddPlaceBounds(self, lower: Array, upper: Array, margin: float = 0.0) -> None:
        """Po within a box of W, corners of shape (3,) [m], and off its sides by a margin [m].

        Raises:
            PlanningError: The box has no inside.
        """
        low, high = np.asarray(lower, float) + margin, np.asarray(upper, float) - margin
        self.Add(PlaceWithin(self.pose_coordinates, low, high))

    def AddObstacles(
        self,
        obstacles: Sequence[ConvexShape],
        clearance: float,
        bodies: Sequence[ConvexShape],
        cable_clearance: float | None = None,
    ) -> None:
        """Cables and the platform stay off obstacles, at every knot.

        Args:
            obstacles: What stands in the way, in W.
            clearance: Least distance of the bodies [m].
            bodies: The platform's, in P.
            cable_clearance: Of the cables' centre lines; None: that of the bodies [m].
        """
        lines = clearance if cable_clearance is None else cable_clearance
        self.Add(
            ObstacleClearance(
                self.task.cables, self.pose_coordinates, obstacles, bodies, lines, clearance,
                names=self._cable_words(),
            )
        )  # fmt: skip

    def AddCableClearance(self, distance: float) -> None:
        """Centre lines of cables that share no point stay a distance [m] apart, at every knot."""
        words = self._cable_words()
        self.Add(CableClearance(self.task.cables, self.pose_coordinates, distance, words))

    def AddFieldOfView(
        self, X_PC: RigidTransform, slopes: tuple[float, float], points: Array, nearest: float
    ) -> None:
        """Points of W are in the view of a camera on the platform, at every knot.

        Arguments as of `TargetInView`.
        """
        self.Add(TargetInView(self.pose_coordinates, X_PC, slopes, points, nearest))

    def Add(self, constraint: PoseConstraint, halfway: bool = False) -> None:
        """Adds a constraint at every knot.

        One without tensions is also asked for between the knots, where `Solve` refines. Distances
        of the platform from obstacles are asked for by planes between them, which have no kinks.

        Args:
            constraint: Of `pose_coordinates`; its further numbers, if any, are the tensions.
            halfway: Whether it holds halfway between knots, too.
        """
        for part in constraint.smooth_parts():
            for k in range(len(self._q)):
                self._at_knot(part, k)
                if halfway and k + 1 < len(self._q):
                    self._between(part, (k, 0.5))
                    self._between_asked.add((constraint.description, k, 0.5))
        if constraint.extra == 0:
            self._watched.append(constraint)

    def _between(self, constraint: PoseConstraint, place: Place) -> None:
        """Adds a constraint without tensions at one place between knots."""
        (k, share), parts = place, len(self._q) - 1
        size = (constraint.highest + 1) * self._q.shape[1]

        def there(x: Array) -> tuple[Array, Array]:
            pose, by_piece = between(
                x[: len(x) - constraint.extra], parts, share, constraint.highest
            )
            if constraint.extra == 0:
                return pose, by_piece
            jacobian = np.zeros((size + constraint.extra, len(x)))
            jacobian[:size, : by_piece.shape[1]] = by_piece
            jacobian[size:, by_piece.shape[1] :] = np.eye(constraint.extra)
            return np.concatenate([pose, x[len(x) - constraint.extra :]]), jacobian

        pieces = [self._q[k], self._v[k], self._a[k], self._a[k + 1], self._T]
        pieces += self._own_variables(constraint, place)
        bound = constraint.AddTo(self._prog, np.concatenate(pieces), through=there)
        self._keep(constraint.description, bound, place, constraint.rows)

    def _own_variables(self, constraint: PoseConstraint, place: Place) -> list[Any]:
        if not constraint.own_variables:
            return []
        own = self._prog.NewContinuousVariables(constraint.extra, "n")
        self._own.append((constraint, place, own))
        return [own]

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

        def heat(x: Array) -> tuple[Array, Array]:
            square = share * float(x[:-1] @ x[:-1])
            slope = np.append(2.0 * share * x[-1] * x[:-1], square)
            return np.array([square * x[-1]]), slope[np.newaxis]

        whole = drake_function(heat)
        self._prog.AddCost(lambda x: whole(x)[0], vars=np.concatenate([self._t.ravel(), self._T]))

    def Solve(
        self, duration: float = 1.0, guess: Guess = None, refine: Refinement | None = None
    ) -> FreePathSolution:
        """Solves from a guess, at rest at both ends, and again where the motion misses something.

        The first solver that is there: SNOPT, IPOPT, NLopt. What was asked at knots is then looked
        at between them; where it is missed, it is asked for at these places too, and the program is
        solved again from what was found. The answer says whether all of this succeeded: what is
        still missed between knots after the last round is no success, see `FreePathSolution`.

        Args:
            duration: Time of the guess; that of a `TimedPath` is its own [s].
            guess: From start to goal; None: the straight line.
            refine: How it is looked at between the knots; None: the usual way.
        """
        refine = refine or Refinement()
        self._guess(duration, guess)
        result, name, words, took = solve(self._prog)
        asked, rounds = self._asked(), 0
        while result.is_success():
            if rounds == refine.rounds:
                break
            missed = refine.missed(self._watched, self._found(result), self._between_asked)
            if not missed:
                break
            for constraint, place in missed:
                for part in constraint.smooth_parts():
                    self._between(part, place)
            rounds += 1
            for again in (False, True):
                if not again:
                    self._guess(duration, guess)
                else:  # from what was found; variables of new planes are the last ones
                    q, v, a, T = self._found(result)
                    self._guess_own(q, v, a, T)
                start = self._prog.initial_guess()
                if again:
                    start[: len(result.get_x_val())] = result.get_x_val()
                better, name, words, more = solve(self._prog, start)
                took += more
                if better.is_success():
                    break
            if not better.is_success():
                # What was found is a motion, and says between the knots what it misses.
                words = f"{result.get_solution_result().name}; refined: {words}"
                break
            result, asked = better, self._asked()
        return self._solution(result, asked, (name, words, took), rounds, refine)

    def _asked(self) -> dict[str, list[Binding]]:
        """What the program has now: a solution knows no more."""
        return {name: list(some) for name, some in self._bindings.items()}

    def _solution(
        self,
        result: MathematicalProgramResult,
        asked: dict[str, list[Binding]],
        told: tuple[str, str, float],
        rounds: int,
        refine: Refinement,
    ) -> FreePathSolution:
        solved = bool(result.is_success())
        found = self._found(result)
        missed = {key: violation(result, some) for key, some in asked.items()}
        watched = [TensionFeasible(self.task, self.pose_coordinates), *self._watched]
        T = float(result.GetSolution(self._T)[0])
        between = refine.look(watched, found) if solved else {}
        left = [
            f"{key} by {between[key].missed:.3g}{f' of {who}' if (who := between[key].who) else ''}"
            for key in sorted({one.description for one in self._watched})
            if solved and refine.rounds and not between[key].kept
        ]
        words = told[1]
        if left:
            words += f"; missed between knots after {rounds} rounds: {', '.join(left)}"
        return FreePathSolution(
            task=self.task,
            success=solved and not left,
            status=words,
            solver=told[0],
            solve_time=told[2],
            cost=float(result.get_optimal_cost()),
            duration=T,
            violations={key: size for key, (size, _, _) in missed.items()},
            between=between,
            worst=self._worst(result, missed),
            multipliers={key: multipliers(result, some) for key, some in asked.items()},
            times=np.linspace(0.0, T, len(self._q)),
            tensions=self.task.limits.upper * np.asarray(result.GetSolution(self._t)),
            trajectory=self._trajectory(result) if solved else None,
        )

    def _found(self, result: MathematicalProgramResult) -> tuple[Array, Array, Array, float]:
        q, v, a = (np.asarray(result.GetSolution(x)) for x in (self._q, self._v, self._a))
        return q, v, a, float(result.GetSolution(self._T)[0])

    def _trajectory(self, result: MathematicalProgramResult) -> TimedPath:
        """The motion: cubic coordinates from knot to knot, along a path whose parameter is time."""
        q, v, a, T = self._found(result)
        times = np.linspace(0.0, T, len(q))
        pieces = np.zeros((len(q) - 1, PIECE_NUMBERS))
        for k, piece in enumerate(pieces):
            growth = (a[k + 1] - a[k]) / (6.0 * (times[1] - times[0]))
            for power, part in enumerate((q[k], v[k], 0.5 * a[k], growth)):
                piece[7 * power : 7 * power + 7] = self.pose_coordinates.numbers(part, power)
        return TimedPath.make(PosePath(times, pieces), times, np.ones(len(times)))

    def _worst(
        self, result: MathematicalProgramResult, missed: dict[str, tuple[float, int, int]]
    ) -> str:
        """What is missed most: its name, where on the way, and which cable or row."""
        name = missed_most(missed)
        if name is None:
            return ""
        size, number, row = missed[name]
        k, share = self._places[name][number]
        q, v, a, _ = self._found(result)
        t = np.asarray(result.GetSolution(self._t))
        what = self._rows[name][number]
        who = f" of {what[row % len(what)]}" if what else ""
        motion = np.concatenate([q, v, a], axis=1)
        words = missed_words(self.task, self.pose_coordinates, motion, t, k)
        way = (k + share) / (len(q) - 1)
        return f"{name} by {size:.3g}{who}, {way:.0%} of the way, {words}"

    def _cable_words(self) -> tuple[str, ...]:
        return tuple(self.task.name(i) for i in range(self.task.cables.count))

    def _guess(self, duration: float, guess: Guess) -> None:
        set_guess = self._prog.SetInitialGuess
        s = np.linspace(0.0, 1.0, len(self._q))[:, np.newaxis]
        share = s**3 * (10.0 + s * (-15.0 + 6.0 * s))
        if guess is None:
            q = share * self._end
            v = 30.0 * s**2 * (1.0 - s) ** 2 / duration * self._end
            a = 60.0 * s * (1.0 + s * (-3.0 + 2.0 * s)) / duration**2 * self._end
        else:
            if isinstance(guess, TimedPath):
                duration = guess.end_time - guess.start_time
                poses = [guess.pose(guess.start_time + x * duration) for x in s[:, 0]]
            else:
                poses = [guess.pose(x * guess.length) for x in share[:, 0]]
            q = np.array([self.pose_coordinates.coordinates(X) for X in poses])
            q[0], q[-1] = 0.0, self._end
            v, a = fitted(q, duration)
        set_guess(self._q, q)
        set_guess(self._v, v)
        set_guess(self._a, a)
        lim = self.task.limits
        low, high = lim.lower / lim.upper, min(1.0, 3.0 * lim.lower / lim.upper + 0.2)
        set_guess(self._t, np.full(self._t.shape, 0.5 * (low + high)))
        set_guess(self._T, np.array([duration]))
        self._guess_own(q, v, a, duration)

    def _guess_own(self, q: Array, v: Array, a: Array, duration: float) -> None:
        """Guesses variables that belong to one constraint, from a motion."""
        for constraint, (k, share), own in self._own:
            x = q[k]
            if share > 0.0:
                piece = np.concatenate([q[k], v[k], a[k], a[k + 1], [duration]])
                x, _ = between(piece, len(q) - 1, share, 0)
            self._prog.SetInitialGuess(own, constraint.guess(x))

    def _link(self, k: int) -> Binding:
        """The knots k and k + 1 belong to one motion."""
        n, parts = self._q.shape[1], len(self._q) - 1
        both = [part[j] for j in (k, k + 1) for part in (self._q, self._v, self._a)]
        zero = np.zeros(2 * n)
        linked: Differentiable = lambda x: link(x, parts)  # noqa: E731
        return self._prog.AddConstraint(
            drake_function(linked), lb=zero, ub=zero, vars=np.concatenate([*both, self._T])
        )

    def _at_knot(self, constraint: PoseConstraint, k: int) -> None:
        given = [(self._q, self._v, self._a)[i][k] for i in range(constraint.highest + 1)]
        if constraint.own_variables:
            given += self._own_variables(constraint, (k, 0.0))
        elif constraint.extra:
            given.append(self._t[k])
        bound = constraint.AddTo(self._prog, np.concatenate(given))
        self._keep(constraint.description, bound, (k, 0.0), constraint.rows)

    def _keep(self, name: str, binding: Binding, place: Place, rows: Sequence[str] = ()) -> None:
        binding.evaluator().set_description(name)
        self._rows.setdefault(name, []).append(tuple(rows))
        self._places.setdefault(name, []).append(place)
        self._bindings.setdefault(name, []).append(binding)

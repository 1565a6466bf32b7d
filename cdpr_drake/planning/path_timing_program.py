"""The fastest law of time along a path as one convex program, which takes terms of one's own.

With u = d2s/dt2 and x = (ds/dt)^2, the time is the sum of 2 D / (sqrt x_i + sqrt x_i+1) over the
stretches of length D, which a second-order cone program minimises: all speeds and tensions at once,
where the passes of `path_timing` go from station to station. The program takes the damping of a
platform at its roots, which may be below those of x: its time is then a lower bound.

Source: Verscheure, Demeulenaere, Swevers, De Schutter, Diehl, Time-optimal path tracking for
robots: a convex optimization approach, 2009.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from pydrake.solvers import MathematicalProgram, RotatedLorentzConeConstraint
from scipy.linalg import null_space

from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError, accepted_names
from cdpr_drake.numerics.own_terms import OwnTerms, ProgramValues, is_convex
from cdpr_drake.numerics.program_functions import ProgramCost
from cdpr_drake.planning.path_task import PathTask, samples_at
from cdpr_drake.planning.path_timing import STATIONS, PathPlan, plan_along_path, stations_of_leg
from cdpr_drake.planning.station_kernel import BASIS, BEND, RATE, T_0, T_U, T_X
from cdpr_drake.trajectories.pose_path import PosePath
from cdpr_drake.trajectories.timed_path import TimedPath

ENDS = (0.0, 1.0)
"""Where within a stretch the limits are asked: at both ends, as the passes do."""

SPEEDS, ACCELERATIONS, TENSIONS = "speeds_squared", "accelerations", "tensions"
KINDS = (SPEEDS, ACCELERATIONS, TENSIONS)
"""Values that own terms may be of."""

LEAST_SQUARE = 1e-12
"""Where the slope of the time by a squared speed would be infinite, as at rest [m^2/s^2]."""

LEAST_SHARE = 1e-3
"""Of the largest squared speed, where solvers of nonlinear programs start at stations at rest."""

NO_SPEED = 1e-6
"""Share of the largest (ds/dt)^2 below which two stations in a row are at rest [-]."""


@dataclass(frozen=True, eq=False)
class PathAsks:
    """What points of a path ask of cables, with u = d2s/dt2 and x = (ds/dt)^2, k points.

    Attributes:
        balance: E, shape (k, n, m), with E t = by_u u + by_x x + by_root sqrt(x) + rest for
            tensions t [N].
        by_u: Shape (k, n).
        by_x: Shape (k, n).
        by_root: Of the platform's damping, shape (k, n).
        rest: Shape (k, n).
        rates: l' of the cables, shape (k, m) [-].
        bends: l'', shape (k, m) [1/m].
        reach: |p'| of Po, shape (k,) [-].
    """

    balance: Array
    by_u: Array
    by_x: Array
    by_root: Array
    rest: Array
    rates: Array
    bends: Array
    reach: Array


Asks = Callable[[PosePath, Array], PathAsks]
"""What a leg of a path asks at parameters s, shape (k,) [m]."""


def task_asks(task: PathTask) -> Asks:
    """What the passes reckon with: tensions up to the null space of the wrench matrix.

    Their balance is written along an orthonormal basis of what is not in it, shape (n, m).
    """

    def asks(leg: PosePath, places: Array) -> PathAsks:
        points = leg.points(places)
        rows, reach = task.stations(points)
        damping = task.stations(points, np.ones(len(points)))[0][:, T_X] - rows[:, T_X]
        m = rows.shape[2]
        E = np.array(
            [null_space(one[BASIS:]).T if one.shape[0] > BASIS else np.eye(m) for one in rows]
        )
        by_u, by_x, by_root, rest = (
            np.einsum("knm,km->kn", E, t)
            for t in (rows[:, T_U], rows[:, T_X], damping, rows[:, T_0])
        )
        return PathAsks(E, by_u, by_x, by_root, rest, rows[:, RATE], rows[:, BEND], reach)

    return asks


class TimeCost(ProgramCost):
    """The time by squared speeds at stations [s], with its gradient."""

    def __init__(self, ways: Array) -> None:
        """With the lengths of the stretches, shape (n,) [m]."""
        self._ways = ways

    def value(self, x: Array) -> tuple[float, Array]:
        """Time, and its derivatives; squares below a small one count as that."""
        root = np.sqrt(np.maximum(x, LEAST_SQUARE))
        both = root[1:] + root[:-1]
        by_both = -2.0 * self._ways / both**2
        slope = np.zeros(len(x))
        slope[1:] += by_both
        slope[:-1] += by_both
        return float(np.sum(2.0 * self._ways / both)), slope * 0.5 / root


class PathTimingProgram(OwnTerms):
    """A motion from rest to rest along a path: speeds at stations and tensions of every stretch.

    Variables of `prog()`: x = (ds/dt)^2 at the stations [m^2/s^2], their roots, the inverse of the
    sum of the roots of each stretch, and tensions where limits are asked, as shares of their range.
    Own terms are of `speeds_squared` [m^2/s^2], `accelerations`, d2s/dt2 of the stretches [m/s^2],
    or `tensions` [N], in the order of stretches, of `at` and of cables; or of the tensions of one
    cable by its name. A cost counts in seconds beside the time.

    With nothing added `Solve` is `plan_along_path`. With own terms Drake solves the whole program:
    a convex one by Clarabel, another by SNOPT, to the best law that is near the fastest.

    Attributes:
        task: The robot and its limits.
        path: The path.
        places: s of the stations, shape (n + 1,) [m].
    """

    problem_kind = PlanningError

    def __init__(
        self,
        task: PathTask,
        path: PosePath,
        stations: int = STATIONS,
        start_time: float = 0.0,
        *,
        at: Sequence[float] = ENDS,
        asks: Asks | None = None,
        even: int | None = None,
    ) -> None:
        """With all limits of the task.

        Args:
            task: The robot and its limits.
            path: The path; where its direction jumps, the platform rests.
            stations: As `plan_along_path`.
            start_time: When the motion begins [s].
            at: Shares of a stretch where its limits are asked, from 0 to 1.
            asks: What points of the path ask; None: as the passes reckon.
            even: So many stretches of one length, for a path without inner rests; None: stretches
                are those of the passes.

        Raises:
            PlanningError: A cable cannot run, or the wrench matrix is singular; the number of
                stations is not accepted.
        """
        self.task, self.path = task, path
        self._count, self._start_time, self._at = stations, start_time, tuple(at)
        if even is None:
            self._legs = stations_of_leg(path, stations)
        else:
            self._legs = [(path, np.linspace(0.0, path.length, even + 1))]
        self.places = np.concatenate(
            [self._legs[0][1][:1], *(places[1:] for _, places in self._legs)]
        )
        self._asks = task_asks(task) if asks is None else asks
        n, m, lim = len(self.places) - 1, task.cables.count, task.limits
        self._ways = np.diff(self.places) if even is None else np.full(even, path.length / even)
        self._scale = 1.0 / max(lim.upper - lim.lower, 1.0)
        self._prog = MathematicalProgram()
        new = self._prog.NewContinuousVariables
        self._x, self._root = new(n + 1, "x"), new(n + 1, "root")
        self._inverse = new(n, "inverse")
        self._t = new(n * len(self._at), m, "tensions")
        self._rests = [0, *np.cumsum([len(places) - 1 for _, places in self._legs]).tolist()]
        self._prog.AddBoundingBoxConstraint(0.0, 0.0, self._x[self._rests])
        self._add_caps()
        self._add_time()
        self._add_limits()
        self._prog.AddLinearCost(2.0 * self._ways, 0.0, self._inverse)
        self._prog.SetInitialGuess(self._x, self._gentle())
        self._prog.SetInitialGuess(self._t, np.full(self._t.shape, 0.5 * (lim.lower + lim.upper)
                                                    * self._scale))  # fmt: skip
        self._seal()

    def prog(self) -> MathematicalProgram:
        """The program; what is added to it counts in `Solve`."""
        return self._prog

    def speeds_squared(self) -> np.ndarray:
        """Variables (ds/dt)^2 at the stations, shape (n + 1,) [m^2/s^2]."""
        return self._x

    def tensions(self) -> np.ndarray:
        """Variables of the tensions over their range, shape (n, len(at), m)."""
        return np.asarray(self._t.reshape(len(self._ways), len(self._at), -1))

    def values(self, of: str | Sequence[str] | None = None) -> ProgramValues:
        """Values of one kind of `KINDS`, by default squared speeds, or tensions of one cable.

        Raises:
            PlanningError: There is no such kind, and no such cable.
        """
        kind = SPEEDS if of is None else of
        n, m = len(self._ways), self.task.cables.count
        cables = [self.task.name(i) for i in range(m)]
        if kind == SPEEDS:
            names = tuple(f"x{i}" for i in range(n + 1))
            return ProgramValues(self._x, np.eye(n + 1), np.zeros(n + 1), names)
        if kind == ACCELERATIONS:
            by = (np.eye(n, n + 1, 1) - np.eye(n, n + 1)) / (2.0 * self._ways[:, None])
            return ProgramValues(self._x, by, np.zeros(n), tuple(f"u{i}" for i in range(n)))
        if not isinstance(kind, str) or (kind != TENSIONS and kind not in cables):
            raise PlanningError(f"of: found {kind!r}; {accepted_names(kind, (*KINDS, *cables))}")
        t = self._t.ravel() if kind == TENSIONS else self._t[:, cables.index(kind)]
        size = np.full(len(t), 1.0 / self._scale)
        names = tuple(str(one.get_name()) for one in t)
        return ProgramValues.scaled(t, size, np.zeros(len(t)), names)

    def Solve(self) -> PathPlan:
        """The best motion.

        Raises:
            PlanningError: There is none, as of `plan_along_path`; or own terms leave none, or no
                solver came to an end; or there are own terms and the platform is damped.
        """
        plan = plan_along_path(self.task, self.path, self._count, self._start_time)
        if not self.has_own_terms:
            return plan
        if self.task.dynamics.is_damped:
            raise PlanningError(
                f"own terms: found a platform with damping {self.task.dynamics.damping}, which is "
                "not convex in squared speeds; accepted: dynamics with damping (0, 0)"
            )
        found, solver, said = self._optimum(self._guess(plan))
        x = np.maximum(found[self._prog.FindDecisionVariableIndices(self._x)], 0.0)
        x[self._rests] = 0.0
        if np.any((x[1:] + x[:-1]) <= NO_SPEED * np.max(x)):
            raise PlanningError(
                "a law of time along the path: found one that rests where the path goes on; "
                "accepted: own terms with which the platform moves"
            )
        motion = TimedPath.make(self.path, self.places, x, self._start_time)
        return replace(plan, trajectory=motion, program=self._report(found, solver, said))

    def _add_caps(self) -> None:
        """Speeds of cables and of Po at all stations but rests."""
        lim, first = self.task.limits, 0
        for leg, places in self._legs:
            inner = self._asks(leg, places[1:-1])
            fastest = lim.cable_speed / np.max(np.abs(inner.rates), axis=1)
            most = np.minimum(fastest, lim.speed / np.maximum(inner.reach, 1e-300)) ** 2
            variables = self._x[first + 1 : first + len(places) - 1]
            self._prog.AddBoundingBoxConstraint(np.zeros(len(most)), most, variables)
            first += len(places) - 1

    def _add_time(self) -> None:
        """Roots at most those of x, and inverses at least those of their sums."""
        for x, root in zip(self._x, self._root, strict=True):
            self._prog.AddRotatedLorentzConeConstraint(np.array([x, 1.0, root]))
        for i, inverse in enumerate(self._inverse):
            both = self._root[i] + self._root[i + 1]
            self._prog.AddRotatedLorentzConeConstraint(np.array([inverse, both, 1.0]))

    def _add_limits(self) -> None:
        """Balance, tensions, torques and cable accelerations where limits are asked."""
        first = 0
        for leg, places in self._legs:
            count = len(places) - 1
            shares = np.tile(self._at, count)
            begin, end = (np.repeat(s, len(self._at)) for s in (places[:-1], places[1:]))
            there = (1.0 - shares) * begin + shares * end
            asked = self._asks(leg, there)
            for k, share in enumerate(shares):
                self._limit(asked, k, share, first + k // len(self._at))
            first += count

    def _limit(self, asked: PathAsks, k: int, share: float, stretch: int) -> None:
        program, lim, scale = self._prog, self.task.limits, self._scale
        m, way = self.task.cables.count, self._ways[stretch]
        t = self._t[stretch * len(self._at) + k % len(self._at)]
        # u = (x_i+1 - x_i) / (2 D) and x between its ends, as columns for (x_i, x_i+1).
        u, x = np.array([-1.0, 1.0]) / (2.0 * way), np.array([1.0 - share, share])
        both = self._x[stretch : stretch + 2]
        unknown = np.concatenate([t, both])
        needed = np.outer(asked.by_u[k], u) + np.outer(asked.by_x[k], x)
        balance = np.hstack([asked.balance[k] / scale, -needed])
        if self.task.dynamics.is_damped:
            roots = self._root[stretch : stretch + 2]
            program.AddLinearEqualityConstraint(
                np.hstack([balance, -np.outer(asked.by_root[k], x)]), asked.rest[k],
                np.concatenate([unknown, roots]),
            )  # fmt: skip
        else:
            program.AddLinearEqualityConstraint(balance, asked.rest[k], unknown)
        low, high = np.full(m, lim.lower * scale), np.full(m, lim.upper * scale)
        program.AddBoundingBoxConstraint(low, high, t)
        bent = np.outer(asked.rates[k], u) + np.outer(asked.bends[k], x)
        if np.isfinite(lim.cable_acceleration):
            most = np.full(m, lim.cable_acceleration)
            program.AddLinearConstraint(bent, -most, most, both)
        if np.isfinite(lim.torque):
            T = np.hstack([-lim.ratio * np.eye(m) / scale, lim.inertia / lim.ratio * bent])
            most = np.full(m, lim.torque)
            program.AddLinearConstraint(T, -most, most, unknown)

    def _gentle(self) -> Array:
        """A slow law of time, for functions to be tried at: squares of speeds of a parabola."""
        x = np.zeros(len(self.places))
        for a, b in zip(self._rests[:-1], self._rests[1:], strict=True):
            s = (self.places[a : b + 1] - self.places[a]) / (self.places[b] - self.places[a])
            x[a : b + 1] = 1e-2 * s * (1.0 - s)
        return x

    def _optimum(self, guess: Array) -> tuple[Array, str, str]:
        """All variables, the solver and what it said, as `_solve_whole`.

        Cones bend too much for solvers of nonlinear programs: these get the time as a function of
        the squared speeds, unless own terms are of the variables that make it a cone.
        """
        what, program = "a law of time along the path", self._prog
        cone = {v.get_id() for v in (*self._root, *self._inverse)}
        costs, constraints = self._own()
        own = [v.get_id() for b in (*costs, *constraints) for v in b.variables()]
        if is_convex(program) or not cone.isdisjoint(own):
            return self._solve_whole(guess, what)
        smooth = MathematicalProgram()
        smooth.AddDecisionVariables(program.decision_variables())
        for binding in program.GetAllConstraints():
            if not isinstance(binding.evaluator(), RotatedLorentzConeConstraint):
                smooth.AddConstraint(binding)
        for binding in costs:
            smooth.AddCost(binding)
        smooth.AddCost(TimeCost(self._ways), vars=self._x)
        places = program.FindDecisionVariableIndices(self._x)
        size = float(np.max(guess[places]))
        for x in self._x:
            smooth.SetVariableScaling(x, size)
        start = guess.copy()
        start[places] = np.maximum(guess[places], LEAST_SHARE * size)
        found, solver, said = self._solve_whole(start, what, smooth)
        root = np.sqrt(np.maximum(found[places], 0.0))
        found[program.FindDecisionVariableIndices(self._root)] = root
        inverse = 1.0 / np.maximum(root[1:] + root[:-1], 1e-300)
        found[program.FindDecisionVariableIndices(self._inverse)] = inverse
        return found, solver, said

    def _guess(self, plan: PathPlan) -> Array:
        """All variables of the fastest motion, with tensions in the middle of what is left."""
        x = np.interp(self.places, plan.trajectory.stations, plan.trajectory.squared_speeds)
        root = np.sqrt(x)
        values = [
            (self._x, x), (self._root, root),
            (self._inverse, 1.0 / np.maximum(root[1:] + root[:-1], 1e-6)),
        ]  # fmt: skip
        shares = np.array(self._at)
        s = (self.places[:-1, None] + shares * self._ways[:, None]).ravel()
        squares = (x[:-1, None] + shares * np.diff(x)[:, None]).ravel()
        u = np.repeat(np.diff(x) / (2.0 * self._ways), len(shares))
        points = self.path.points(s)
        held = samples_at(self.task, points, np.zeros(len(s)), s, u, np.sqrt(squares))
        values.append((self._t.ravel(), held.tensions.ravel() * self._scale))
        guess = np.zeros(self._prog.num_vars())
        for variables, numbers in values:
            guess[self._prog.FindDecisionVariableIndices(variables)] = numbers
        return guess

"""Where exit points should stand on rails for a task, as a Drake MathematicalProgram.

Coordinates of rails are variables, and so are the tensions at every pose under every wrench that is
to be resisted: W(c) t + w = 0, lower + d h <= t <= upper - d h, with h half of the range and d the
margin that all have in common. The columns of W are straight cables, whose derivatives by a rail
are exact: with u from exit point to anchor point, l the length and a the rail's direction,

    du/dc = -(I - u u') a / l.

Source: Gagliardini, Caro, Gouttefarde and Girin, Discrete reconfiguration planning for
cable-driven parallel robots, 2016, where exit points stand at given places; here they slide.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.autodiffutils import ExtractGradient, ExtractValue, InitializeAutoDiff
from pydrake.math import RigidTransform
from pydrake.solvers import Binding, MathematicalProgram
from scipy.optimize import linprog

from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError
from cdpr_drake.planning.free_path_solution import solve
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet, weight_wrenches
from cdpr_drake.workspaces.static_feasibility import StaticCase

STARTS = 5
"""Usual number of starts: where the rails are, their middles, and random ones."""

MOST_PROGRAMS = 4096
"""Poses times wrenches that one program may have."""

SMALL = 0.05
"""Loads count at least this share of the largest tension, where the balance is scaled."""

EXACT = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}


@dataclass(frozen=True, eq=False)
class Rails:
    """Straight rails on which exit points are put, one or several on each.

    Attributes:
        directions: By how much each coordinate moves the exit points, shape (r, 3, m) [-].
        lower: Smallest coordinates, counted from where `bases` are, shape (r,) [m].
        upper: Largest, shape (r,) [m].
        at: Where they are, shape (r,) [m].
        bases: p_WA with all coordinates 0, shape (3, m) [m].

    Raises:
        PlanningError: Shapes do not fit, or a rail has no length.
    """

    directions: Array
    lower: Array
    upper: Array
    at: Array
    bases: Array

    def __post_init__(self) -> None:
        """Checks the sizes."""
        r = len(self.directions)
        if self.directions.shape != (r, *self.bases.shape) or r == 0:
            raise PlanningError(
                f"rails: found directions of shape {self.directions.shape} for exit points of "
                f"shape {self.bases.shape}; accepted: at least one rail, (r, 3, m)"
            )
        if not (len(self.lower) == len(self.upper) == len(self.at) == r):
            raise PlanningError(f"rails: found other numbers of limits; accepted: {r} of each")
        if not np.all(self.lower < self.upper):
            raise PlanningError("rails: found one without length; accepted: lower < upper [m]")

    def exit_points(self, coordinates: Array) -> Array:
        """p_WA at coordinates, shape (3, m) [m]."""
        return np.asarray(self.bases + np.tensordot(coordinates, self.directions, 1))


@dataclass(frozen=True, eq=False)
class RailTask:
    """What is asked of exit points on rails.

    Attributes:
        case: Platform, load, tension limits and cables, which run straight.
        rails: The rails.
        poses: X_WP, at least one [m].
        required: Wrenches to resist at each, a polytope; None: none beside the load.
    """

    case: StaticCase
    rails: Rails
    poses: Sequence[RigidTransform]
    required: SpatialSet | None = None

    def loads(self) -> Array:
        """Wrenches on the platform at the poses, shape (n, k, rows) [N m, N].

        Raises:
            PlanningError: There is no pose, or there are too many.
            WrenchSetError: The wrenches are no polytope.
        """
        rows = list(self.case.rows)
        corners = np.zeros((1, len(rows)))
        if self.required is not None:
            corners = self.required.corners(self.case.rows)
        count = len(self.poses) * len(corners)
        if not 1 <= count <= MOST_PROGRAMS:
            raise PlanningError(
                f"rails: found {len(self.poses)} poses with {len(corners)} wrenches each; "
                f"accepted: 1 to {MOST_PROGRAMS} together"
            )
        R = np.array([X.rotation().matrix() for X in self.poses])
        return weight_wrenches(self.case, R)[:, np.newaxis, rows] + corners

    def matrices(self, coordinates: Array) -> tuple[Array, Array]:
        """W at the poses in the balanced rows, and its derivatives by the coordinates.

        Returns:
            Shapes (n, rows, m) and (n, r, rows, m).

        Raises:
            PlanningError: An exit point is where its anchor point is.
        """
        rows, D = list(self.case.rows), self.rails.directions
        p_WA, p_PB = self.rails.exit_points(coordinates), self.case.cables.p_PB
        n, m = len(self.poses), p_WA.shape[1]
        W, slopes = np.empty((n, 6, m)), np.empty((n, len(D), 6, m))
        for k, X in enumerate(self.poses):
            arm = X.rotation().matrix() @ p_PB
            way = X.translation()[:, np.newaxis] + arm - p_WA
            length = np.linalg.norm(way, axis=0)
            if not np.all(length > 0.0):
                raise PlanningError("rails: found a cable without length; accepted: other rails")
            u = way / length
            W[k] = -np.vstack([np.cross(arm, u, axis=0), u])
            for g, a in enumerate(D):
                du = -(a - u * np.sum(u * a, axis=0)) / length
                slopes[k, g] = -np.vstack([np.cross(arm, du, axis=0), du])
        return W[:, rows], slopes[:, :, rows]

    def margins(self, coordinates: Array) -> Array:
        """Largest margin of each pose under each wrench, by linear programs, shape (n, k).

        Shares of half the range of tensions; below 0: limits are missed by as much.

        Raises:
            PlanningError: W is singular at a pose.
        """
        return tension_margins(self.case, self.matrices(coordinates)[0], self.loads())

    def largest_tensions(self, coordinates: Array) -> Array:
        """Least largest tension within limits of each pose under each wrench, shape (n, k) [N].

        Raises:
            PlanningError: W is singular at a pose, or limits are missed.
        """
        lower, upper = self.case.bounds()
        m = len(lower)
        A_ub = np.hstack([np.eye(m), -np.ones((m, 1))])
        bounds = [*zip(lower, upper, strict=True), (None, None)]
        program = np.eye(m + 1)[m], A_ub, np.zeros(m), bounds
        return _least_costs(self.case, self.matrices(coordinates)[0], self.loads(), program)


def tension_margins(case: StaticCase, W: Array, loads: Array) -> Array:
    """Largest margin under each load by linear programs of HiGHS, shape (n, k), as `margins`.

    Args:
        case: Tension limits and balanced rows.
        W: Wrench matrices in these rows, shape (n, rows, m).
        loads: Wrenches on the platform, shape (n, k, rows) [N m, N].

    Raises:
        PlanningError: W is singular at a pose.
    """
    lower, upper = case.bounds()
    half, m = 0.5 * (upper - lower), len(lower)
    A_ub = np.block([[np.eye(m), half[:, None]], [-np.eye(m), half[:, None]]])
    bounds = [(None, None)] * m + [(None, 1.0)]
    cost = np.append(np.zeros(m), -1.0)
    program = cost, A_ub, np.concatenate([upper, -lower]), bounds
    return -_least_costs(case, W, loads, program)


def _least_costs(case: StaticCase, W: Array, loads: Array, program: tuple[Any, ...]) -> Array:
    """Least costs of linear programs of tensions and one more variable, one for each load."""
    cost, A_ub, b_ub, bounds = program
    found, scale = np.empty(loads.shape[:2]), case.row_scale()
    for k, of_pose in enumerate(loads):
        A_eq = np.hstack([W[k] / scale[:, None], np.zeros((len(scale), 1))])
        for c, load in enumerate(of_pose):
            result = linprog(cost, A_ub, b_ub, A_eq, -load / scale, bounds, options=EXACT)
            if result.status != 0:
                raise PlanningError(
                    f"rails: at pose {k + 1} of {len(loads)} no tensions give the wrench: "
                    f"{result.message}; accepted: poses that the cables can hold"
                )
            found[k, c] = result.fun
    return found


@dataclass(frozen=True, eq=False)
class RailsSolution:
    """Where exit points should stand.

    Attributes:
        success: Whether the solver says so.
        solver: Its name.
        status: What it says.
        coordinates: Of the rails, shape (r,) [m].
        value: Margin, or largest tension [N], of the program.
    """

    success: bool
    solver: str
    status: str
    coordinates: Array
    value: float


class ReconfigurationProgram:
    """Coordinates of rails, tensions at all poses under all wrenches, and their common margin.

    Variables are named c (shares of the rails), t (shares of the largest tension), and margin. It
    grows by `Add...`; what is missing may be added to `prog()`. Gradients are exact.
    """

    def __init__(self, task: RailTask) -> None:
        """With the balance of wrenches, the rails' ends, and the limits of tensions.

        Raises:
            PlanningError: As `RailTask`.
        """
        self.task = task
        lower, upper = task.case.bounds()
        self._loads, self._largest = task.loads(), float(np.max(upper))
        n, k, m = (*self._loads.shape[:2], len(lower))
        self._prog = MathematicalProgram()
        add = self._prog.NewContinuousVariables
        self._c, self._margin = add(len(task.rails.lower), "c"), add(1, "margin")
        self._t = np.array(add(n * k, m, "t")).reshape(n, k, m)
        self._most: Any = None
        self._prog.AddBoundingBoxConstraint(0.0, 1.0, self._c)
        self._prog.AddBoundingBoxConstraint(-np.inf, 1.0, self._margin)
        half = 0.5 * (upper - lower) / self._largest
        eye = np.eye(m)
        A = np.block([[eye, -half[:, None]], [eye, half[:, None]]])
        low = np.concatenate([lower / self._largest, np.full(m, -np.inf)])
        high = np.concatenate([np.full(m, np.inf), upper / self._largest])
        self._balances: list[Binding] = []
        for pose in range(n):
            for corner in range(k):
                t = self._t[pose, corner]
                self._prog.AddLinearConstraint(A, low, high, np.append(t, self._margin))
                self._balances.append(self._balance(pose, corner))

    def prog(self) -> MathematicalProgram:
        """The program."""
        return self._prog

    def coordinates(self) -> Any:
        """Variables of the rails, shares of the way from lower to upper, shape (r,)."""
        return self._c

    def tensions(self) -> Any:
        """Variables of tensions, shares of the largest one, shape (poses, wrenches, m)."""
        return self._t

    def margin(self) -> Any:
        """The variable of the common margin."""
        return self._margin[0]

    def balances(self) -> list[Binding]:
        """The constraints W(c) t + w = 0, pose by pose and wrench by wrench."""
        return self._balances

    def AddLargestMargin(self) -> None:
        """Cost: minus the margin that all tensions keep to their limits."""
        self._prog.AddLinearCost([-1.0], 0.0, self._margin)

    def AddLeastLargestTension(self) -> None:
        """Cost: the largest of all tensions, as a share of the limit; limits are kept."""
        self._most = self._prog.NewContinuousVariables(1, "most")
        self._prog.AddBoundingBoxConstraint(0.0, 1.0, self._margin)
        self._prog.AddLinearCost([1.0], 0.0, self._most)
        for t in self._t.reshape(-1, self._t.shape[-1]):
            A = np.hstack([np.eye(len(t)), -np.ones((len(t), 1))])
            low = np.full(len(t), -np.inf)
            self._prog.AddLinearConstraint(A, low, np.zeros(len(t)), np.append(t, self._most))

    def Solve(self, starts: int = STARTS, seed: int = 0) -> RailsSolution:
        """The best of several starts: rails as they are, in the middle, and at random places.

        The first solver that is there: SNOPT, IPOPT, NLopt. What is found is the best nearby.
        """
        rails = self.task.rails
        rng = np.random.default_rng(seed)
        shares = [(rails.at - rails.lower) / (rails.upper - rails.lower), 0.5 + 0.0 * rails.at]
        shares += [rng.uniform(size=len(rails.at)) for _ in range(max(starts - 2, 0))]
        best: RailsSolution | None = None
        for share in shares[:starts]:
            self._guess(share)
            result, name, words, _ = solve(self._prog)
            place = np.clip(np.asarray(result.GetSolution(self._c), float), 0.0, 1.0)
            value = float(result.GetSolution(self._margin if self._most is None else self._most)[0])
            found = RailsSolution(
                bool(result.is_success()), name, words,
                rails.lower + place * (rails.upper - rails.lower),
                value if self._most is None else value * self._largest,
            )  # fmt: skip
            if best is None or self._rank(found) > self._rank(best):
                best = found
        assert best is not None
        return best

    def _rank(self, found: RailsSolution) -> tuple[bool, float]:
        return found.success, found.value if self._most is None else -found.value

    def _guess(self, share: Array) -> None:
        rails, guess = self.task.rails, self._prog.SetInitialGuess
        W, _ = self.task.matrices(rails.lower + share * (rails.upper - rails.lower))
        lower, upper = self.task.case.bounds()
        t = np.empty(self._t.shape)
        for pose, matrix in enumerate(W):
            middle = 0.5 * (lower + upper)
            away = -self._loads[pose] - matrix @ middle
            t[pose] = (middle + away @ np.linalg.pinv(matrix).T) / self._largest
        share_of_range = (t * self._largest - lower) / (upper - lower)
        guess(self._c, share)
        guess(self._t.ravel(), t.ravel())
        guess(self._margin, [2.0 * min(np.min(share_of_range), np.min(1.0 - share_of_range))])
        if self._most is not None:
            guess(self._most, [np.max(t)])

    def _balance(self, pose: int, corner: int) -> Binding:
        """W(c) t + w = 0, rows of one unit over the largest load."""
        task, r = self.task, len(self.task.rails.lower)
        one = RailTask(task.case, task.rails, [task.poses[pose]])
        load, scale = self._loads[pose, corner], task.case.row_scale()
        heaviest = float(np.max(np.abs(self._loads[pose] / scale)))
        size = scale * max(heaviest, SMALL * self._largest)
        span = task.rails.upper - task.rails.lower

        def balance(x: Any) -> Any:
            exact = x.dtype == object
            values = ExtractValue(x).ravel() if exact else np.asarray(x, float)
            c, t = values[:r], self._largest * values[r:]
            W, slopes = one.matrices(task.rails.lower + c * span)
            found = (W[0] @ t + load) / size
            if not exact:
                return found
            by_c = (slopes[0] @ t).T * span
            J = np.hstack([by_c, self._largest * W[0]]) / size[:, np.newaxis]
            return InitializeAutoDiff(found, J @ ExtractGradient(x)).ravel()

        zero = np.zeros(len(load))
        variables = np.concatenate([self._c, self._t[pose, corner]])
        return self._prog.AddConstraint(balance, lb=zero, ub=zero, vars=variables)

"""The design of a robot as a program, with own terms of its points, its winch and its goals.

Source: see the room; Gill, Murray and Saunders, SNOPT, 2005, for the solver.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fnmatch import fnmatchcase
from functools import lru_cache

import numpy as np
from pydrake.solvers import Binding, MathematicalProgram

from cdpr_drake.analyses.design.candidates import make_candidates
from cdpr_drake.analyses.design.design_result import Design
from cdpr_drake.analyses.design.goals import GOALS, check_goals, goal_signs
from cdpr_drake.analyses.design.search import (
    SLOPES,
    Slopes,
    evaluate_design,
    goal_context,
    scores_of,
    search_design,
)
from cdpr_drake.analyses.design.settings import DesignSettings
from cdpr_drake.analyses.frame.follow import NOBODY, Follow
from cdpr_drake.analyses.workspaces.conditions import KINDS
from cdpr_drake.arrays import Array
from cdpr_drake.errors import DesignError, accepted_names
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.numerics.own_terms import OwnTerms, ProgramValues
from cdpr_drake.numerics.program_functions import ProgramFunction, ValueCost
from cdpr_drake.schema.yaml_files import load_yaml

STEPPED = (*KINDS, "csw", "cables", "survives", "breaks-survived")
"""Goals that are counts: they have no slope, and no program finds a better one by it."""

STEP = 1e-4
"""Of differences of goals, in boxes of width 1."""

MOST_KEPT = 1000
"""Goals of designs that are kept, since costs and constraints ask for the same ones."""

LOCAL = (
    "a design near the present robot: goals are not convex, and a search by evolution may find a "
    "better one elsewhere"
)


class DesignProgram(OwnTerms):
    """A robot that is better by the goals of a design, near the present one, with own terms.

    Variables of `prog()` are where in its range each design variable is, from 0 to 1. `values` are
    the numbers of the robot file: coordinates of points as C1.exit_point.x or C1.anchor_point.z
    [m], of points that are tied together those of the first, and drum_radius [m], gear_ratio [-] or
    motor_torque [N m]. Costs count beside the goals' weighted sum with the sign changed, in which
    every goal is relative to the robot as it is.

    A goal that is the least of smooth functions over the poses, of `search.SLOPES`, enters
    as such, with exact slopes; others by differences. With nothing added `Solve` is
    `search_design`. With own terms SNOPT seeks from the present robot.

    Attributes:
        robot: The robot, or its name or path.
        candidates: The designs that there may be.
        settings: What is wanted.
        judging: What designs are judged by.
        number: Which of the sets of cables.
    """

    problem_kind = DesignError

    def __init__(
        self, robot: Robot | str, settings: DesignSettings, *, source: str = "design",
        number: int = 0,
    ) -> None:  # fmt: skip
        """For a robot and what may change of it.

        Args:
            robot: Robot by name, or path of a robot file.
            settings: What may change, and what is wanted.
            source: Words for messages.
            number: Number of the set of cables, from 0.

        Raises:
            CdprError: As `make_candidates`, `check_goals` and `evaluate_design`; nothing may move;
                a goal is a count; there is no such set.
        """
        self.robot, self.settings, self.number = robot, settings, number
        name = robot.name if isinstance(robot, Robot) else robot
        self.candidates = make_candidates(name, settings, source)
        if self.candidates.size == 0:
            raise DesignError("design: found nothing that may move; accepted: a reach above 0")
        if not 0 <= number < len(self.candidates.cable_sets):
            raise DesignError(
                f"number: found {number}; accepted: 0 to {len(self.candidates.cable_sets) - 1}"
            )
        self._goals = settings.goal_names
        self._refuse_counts(self._goals)
        self.judging = goal_context(robot, settings)
        check_goals(self.candidates.present, self.judging, self._goals)
        self._original = evaluate_design(self.candidates, self.judging, self._goals)
        self._goal_at = lru_cache(MOST_KEPT)(self._goal_of_bytes)
        self._first = self.candidates.points.size
        self._lows, self._highs = np.array([*self.candidates.ranges.values()]).reshape(-1, 2).T
        self._values = self._read()
        self._prog = MathematicalProgram()
        self._z = self._prog.NewContinuousVariables(self.candidates.size, "design")
        self._prog.AddBoundingBoxConstraint(0.0, 1.0, self._z)
        self._prog.SetInitialGuess(self._z, self._present())
        self._leasts: list[tuple[object, Slopes]] = []
        weights = scores_of(np.eye(len(self._goals)), self._original, settings)
        for goal, weight in zip(self._goals, weights, strict=True):
            self._add_goal(goal, weight)
        self._seal()

    def prog(self) -> MathematicalProgram:
        """The program; what is added to it counts in `Solve`."""
        return self._prog

    def design_variables(self) -> np.ndarray:
        """Where in its range each design variable is, shape (size,)."""
        return self._z

    def values(self, of: str | Sequence[str] | None = None) -> ProgramValues:
        """Numbers of the robot file, all or by names with * and ?.

        Raises:
            DesignError: No design variable has the name.
        """
        scale, offset, names = self._values
        every = ProgramValues.scaled(self._z, scale, offset, names)
        if of is None:
            return every
        chosen: set[int] = set()
        for pattern in [of] if isinstance(of, str) else of:
            mine = [k for k, name in enumerate(names) if fnmatchcase(name, pattern)]
            if not mine:
                raise DesignError(f"of: found {pattern!r}; {accepted_names(pattern, names)}")
            chosen |= set(mine)
        return every.only(np.array(sorted(chosen)))

    def AddGoalConstraint(
        self, goal: str, lower: float = -np.inf, upper: float = np.inf, name: str = ""
    ) -> Binding:
        """Adds lower <= value <= upper of a goal, in its unit, wanted or not.

        Raises:
            DesignError: No such goal, or one that is a count; bounds that cross.
        """
        self._refuse_counts([goal])
        low, high = self._bounds(lower, upper, 1)
        size = max(abs(self._goal(goal, self._present())), 1e-9)
        rows = _ByDifferences(lambda z: np.array([self._goal(goal, z) / size]))
        binding = self._prog.AddConstraint(rows, low / size, high / size, vars=self._z)
        return self._named(binding, "constraint", name or goal)

    def AddGoalCost(
        self, function: Callable[[Array], float], goals: str | Sequence[str], name: str = ""
    ) -> Binding:
        """Adds a smooth cost, function(values), of goals' values in their units.

        Raises:
            DesignError: No such goal, or one that is a count.
        """
        names = [goals] if isinstance(goals, str) else list(goals)
        self._refuse_counts(names)

        def cost(z: Array) -> Array:
            return np.array([float(function(np.array([self._goal(g, z) for g in names])))])

        binding = self._prog.AddCost(_CostOf(_ByDifferences(cost)), vars=self._z)
        return self._named(binding, "cost", name or ", ".join(names))

    def Solve(self, follow: Follow = NOBODY) -> Design:
        """The design: two are in the result with own terms, the present robot and what was found.

        Args:
            follow: Who follows a search without own terms.

        Raises:
            CdprError: As `search_design`; no design keeps the own constraints.
        """
        if not self.has_own_terms:
            return search_design(self.candidates, self.settings, self.judging, follow=follow)
        start = np.zeros(self._prog.num_vars())
        places = self._prog.FindDecisionVariableIndices(self._z)
        start[places] = self._present()
        for least, slopes in self._leasts:
            margins, _ = self._margins(slopes, start[places])
            start[self._prog.FindDecisionVariableIndex(least)] = float(np.min(margins))
        x, solver, status = self._solve_whole(start, "a design")
        designs = np.array([self._shares(start[places]), self._shares(np.clip(x[places], 0, 1))])
        values = np.array([
            evaluate_design(self.candidates, self.judging, self._goals, (self.number, design))
            for design in designs
        ])  # fmt: skip
        return Design(
            self.candidates, self.settings, self.judging, self._original,
            np.full(2, self.number), designs, values,
            scores_of(values, self._original, self.settings),
            program=self._report(x, solver, status, (LOCAL,)),
        )  # fmt: skip

    def _add_goal(self, goal: str, weight: float) -> None:
        slopes = SLOPES.get(goal)
        if slopes is None:
            less = -weight * float(goal_signs([goal])[0])
            cost = _ByDifferences(lambda z: np.array([less * self._goal(goal, z)]))
            self._prog.AddCost(_CostOf(cost), vars=self._z)
            return
        (least,) = self._prog.NewContinuousVariables(1, f"least {goal}")
        rows = _Margins(lambda z: self._margins(slopes, z))
        count = self.judging.grid.size
        self._prog.AddConstraint(
            rows, np.zeros(count), np.full(count, np.inf), vars=np.append(self._z, least)
        )
        self._prog.AddLinearCost(np.array([-weight]), 0.0, np.array([least]))
        self._leasts.append((least, slopes))

    def _margins(self, slopes: Slopes, z: Array) -> tuple[Array, Array]:
        values, by = slopes(self.candidates, self.number, self.judging, self._shares(z))
        return values, by * self._share_slopes(z)

    def _goal(self, goal: str, z: Array) -> float:
        """The value of a goal, in its unit."""
        return self._goal_at(goal, z.tobytes())

    def _goal_of_bytes(self, goal: str, z: bytes) -> float:
        design = self.number, self._shares(np.frombuffer(z))
        values = evaluate_design(self.candidates, self.judging, [goal], design)
        return float((values * goal_signs([goal]))[0])

    def _refuse_counts(self, goals: Sequence[str]) -> None:
        smooth = [name for name in GOALS if name not in STEPPED]
        for goal in goals:
            if goal not in smooth:
                raise DesignError(
                    f"goal: found {goal!r}; accepted in a program: {', '.join(smooth)}"
                )

    def _read(self) -> tuple[Array, Array, tuple[str, ...]]:
        """Scale, offset and names of the values."""
        text = load_yaml(self.candidates.text)
        points, cables = self.candidates.points, text["cables"]
        m = len(cables)
        low, high = (points.displacements(np.full(points.size, end)) for end in (0.0, 1.0))
        scale, offset, names = [], [], []
        for k in range(points.size):
            moved = np.full(points.size, 0.5)
            moved[k] = 1.0
            axis, column = np.argwhere(points.displacements(moved).T != 0.0)[0][::-1]
            key = "exit_point" if column < m else "anchor_point"
            cable = cables[column % m]
            scale.append(high[axis, column] - low[axis, column])
            offset.append(float(cable[key][axis]) + low[axis, column])
            names.append(f"{cable['name']}.{key}.{'xyz'[axis]}")
        names += self.candidates.ranges
        return (
            np.array([*scale, *(self._highs - self._lows)]), np.array([*offset, *self._lows]),
            tuple(names),
        )  # fmt: skip

    def _present(self) -> Array:
        """The design variables of the robot as it is, within the ranges."""
        z = np.full(self.candidates.size, 0.5)
        winch = as_robot(self.robot).winch
        for k, name in enumerate(self.candidates.ranges):
            value, low, high = getattr(winch, name), self._lows[k], self._highs[k]
            if value is not None:
                z[self._first + k] = np.clip((value - low) / (high - low), 0, 1)
        return z

    def _shares(self, z: Array) -> Array:
        """Coordinates of `Candidates`, whose winches are in ratios."""
        shares, ratios = np.array(z, float), self._highs / self._lows
        shares[self._first :] = np.log(1.0 + (ratios - 1.0) * z[self._first :]) / np.log(ratios)
        return shares

    def _share_slopes(self, z: Array) -> Array:
        """How these grow with the variables, shape (size,)."""
        slopes, ratios = np.ones(len(z)), self._highs / self._lows
        more = ratios - 1.0
        slopes[self._first :] = more / (1.0 + more * z[self._first :]) / np.log(ratios)
        return slopes


class _ByDifferences(ProgramFunction):
    """Numbers of design variables, with derivatives by differences within their ranges."""

    def __init__(self, function: Callable[[Array], Array]) -> None:
        self._function = function

    def numbers(self, x: Array) -> Array:
        """The numbers alone."""
        return self._function(np.clip(x, 0.0, 1.0))

    def rows(self, x: Array) -> tuple[Array, Array]:
        """Numbers and derivatives."""
        slopes = []
        for k in range(len(x)):
            ends = np.clip(x[k] + np.array([-STEP, STEP]), 0.0, 1.0)
            less, more = (self.numbers(np.where(np.arange(len(x)) == k, e, x)) for e in ends)
            slopes.append((more - less) / (ends[1] - ends[0]))
        return self.numbers(x), np.array(slopes).T


class _CostOf(ValueCost):
    """One number as a cost."""

    def __init__(self, rows: ProgramFunction) -> None:
        self._rows = rows


class _Margins(ProgramFunction):
    """By how much values at all poses are above a variable, the last one."""

    def __init__(self, margins: Callable[[Array], tuple[Array, Array]]) -> None:
        self._margins = margins

    def rows(self, x: Array) -> tuple[Array, Array]:
        """Numbers and derivatives."""
        values, by = self._margins(np.clip(x[:-1], 0.0, 1.0))
        return values - x[-1], np.hstack([by, np.full((len(values), 1), -1.0)])

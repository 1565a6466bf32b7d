"""Maximin search for a design: the largest least value of many smooth functions in [0, 1]^d.

`SlopeSearch` seeks it by the slopes of the functions. `SLOPES` has those of goals by the
coordinates of a design, where a goal is the least of smooth functions.

Source: see `SlopeSearch`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import linprog

from cdpr_drake.analyses.design.candidates import Candidates
from cdpr_drake.analyses.design.goals import GoalContext
from cdpr_drake.analyses.workspaces.robot_conditions import pose_conditions
from cdpr_drake.arrays import Array
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet, resisting
from cdpr_drake.workspaces.wrench_capacity import margin_slopes

FIRST_STEP, LARGEST_STEP = 0.1, 0.5
"""Half widths of the box about the best design so far in which slopes are believed: at first, and
at most, of boxes of width 1."""

SMALLEST_STEP = 1e-4
"""Below it nothing more is sought."""

GOOD = 0.1
"""Share of the promised gain from which on a step is one; from half on the box grows."""


class SlopeSearch:
    """Asks for designs one by one, is told values and slopes there, and seeks the largest least.

    Each step is a linear program: the largest least value of the linearised functions within a box
    about the best design, whose size follows how well the last promise was kept. Where one function
    is the least alone that is an ascent along its slope; where several are, it goes between them,
    which an ascent could not.

    Source: Madsen, An algorithm for minimax solution of overdetermined systems of non-linear
    equations, 1975; Nocedal and Wright, Numerical Optimization, 4.
    """

    def __init__(self, size: int) -> None:
        """In so many coordinates, from the middle of the box."""
        self.best = np.full(size, 0.5)
        self.value = -np.inf
        self._asked, self._promised, self._step = self.best, np.inf, FIRST_STEP
        self._values: Array = np.empty(0)
        self._slopes: Array = np.empty((0, size))

    @property
    def ended(self) -> bool:
        """Whether there is nothing more to ask for."""
        return self._step < SMALLEST_STEP

    def ask(self) -> Array:
        """The next design, shape (size,)."""
        return self._asked

    def wants_slopes(self, value: float) -> bool:
        """Whether slopes are needed at the design that was asked for, given its least value."""
        return bool(value > self.value)

    def tell(self, value: float, values: Array, slopes: Array) -> None:
        """Takes the least value of the design that was asked for last.

        Args:
            value: It; NaN: refused.
            values: All values there, shape (n,); not read unless it is better than the best.
            slopes: Their derivatives by the coordinates, shape (n, size); likewise.
        """
        gain = value - self.value
        if np.isfinite(self.value):
            kept = gain / self._promised if np.isfinite(gain) else -np.inf
            if kept < GOOD:
                self._step *= 0.4
            elif kept > 0.5:
                self._step = min(1.5 * self._step, LARGEST_STEP)
        elif not np.isfinite(value):
            self._step = 0.0  # the first design is refused, and there are no slopes
        if gain > 0.0:
            self.best, self.value = self._asked, value
            self._values, self._slopes = values, slopes
        if not self.ended:
            self._plan()

    def _plan(self) -> None:
        n, d = self._slopes.shape
        low = np.maximum(-self._step, -self.best)
        high = np.minimum(self._step, 1.0 - self.best)
        # Largest t with values + slopes s >= t.
        found = linprog(
            np.append(np.zeros(d), -1.0),
            A_ub=np.hstack([-self._slopes, np.ones((n, 1))]), b_ub=self._values,
            bounds=[*zip(low, high, strict=True), (None, None)], method="highs",
        )  # fmt: skip
        self._promised = -np.inf if found.x is None else float(found.x[-1] - self.value)
        if self._promised <= 1e-9 * max(abs(self.value), 1e-9):
            self._step = 0.0
            return
        self._asked = np.clip(self.best + found.x[:-1], 0.0, 1.0)


Slopes = Callable[[Candidates, int, Array, GoalContext], tuple[Array, Array]]
"""Values at all poses of the grid, shape (n,), and their slopes by the coordinates, (n, size)."""


def _capacity_margin(
    candidates: Candidates, number: int, coordinates: Array, judging: GoalContext
) -> tuple[Array, Array]:
    robot, grid = candidates.robot(number, coordinates), judging.grid
    about = pose_conditions(robot, required=judging.required)
    positions, rotations = grid.positions(0, grid.size), grid.rotations(0, grid.size)
    demand = resisting(about.case, about.required or SpatialSet(), rotations)
    slopes = margin_slopes(about.case, positions, rotations, demand)
    kept = list(candidates.kept[number])
    m = candidates.points.reach.shape[1] // 2
    by_points = np.zeros((grid.size, 3, 2 * m))
    by_points[:, :, kept] = slopes.exits
    by_points[:, :, [m + k for k in kept]] = slopes.anchors
    found = candidates.points.slopes(by_points)
    # Of the winch, each on a scale of its own logarithm: the largest tension is what it pulls.
    pull, signs = robot.tension_limits(None)[1], {"drum_radius": -1.0}
    winch = [
        slopes.upper * pull * signs.get(name, 1.0) * np.log(high / low)
        for name, (low, high) in candidates.ranges.items()
    ]
    return slopes.found.margins, np.column_stack([found, *winch])


SLOPES: dict[str, Slopes] = {"capacity-margin": _capacity_margin}
"""By names of goals."""

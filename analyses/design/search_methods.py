"""Searches for a design in the box [0, 1]^d: by evolution, or by slopes; and Pareto fronts.

* `EvolutionSearch` is CMA-ES by the package cmaes, a generation at a time; it needs no gradients.
* `SlopeSearch` seeks the largest least value of many smooth functions by their slopes; `SLOPES` has
  those of goals by the coordinates of a design.
* `pareto_front` finds designs of several values that no other one dominates.

Source: Hansen and Ostermeier, Completely derandomized self-adaptation in evolution strategies,
2001; Deb, Multi-objective optimization using evolutionary algorithms, 2001; see `SlopeSearch`.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from scipy.optimize import linprog

from cdpr_drake.analyses.design.candidates import Candidates
from cdpr_drake.analyses.design.goals import GoalContext
from cdpr_drake.analyses.workspaces.robot_conditions import pose_conditions
from cdpr_drake.arrays import Array
from cdpr_drake.errors import DesignError
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet, resisting
from cdpr_drake.workspaces.wrench_capacity import margin_slopes

STEP = 0.2
"""Standard deviation of the first generation, of boxes of width 1."""

REFUSED = 1e9
"""Score, with the sign changed, of designs that cannot be judged."""

FIRST_STEP, LARGEST_STEP = 0.1, 0.5
"""Half widths of the box about the best design so far in which slopes are believed: at first, and
at most, of boxes of width 1."""

SMALLEST_STEP = 1e-4
"""Below it nothing more is sought."""

GOOD = 0.1
"""Share of the promised gain from which on a step is one; from half on the box grows."""


def default_population(size: int) -> int:
    """Designs of a generation for so many coordinates, as Hansen has it."""
    return 4 + math.floor(3 * math.log(max(size, 1)))


class EvolutionSearch:
    """Asks for designs, is told their scores, and seeks the largest."""

    def __init__(self, size: int, population: int, seed: int) -> None:
        """In so many coordinates, from the middle of the box.

        Raises:
            DesignError: The package cmaes is not installed, or there is nothing to search.
        """
        if size < 1:
            raise DesignError("design: found nothing that may move; accepted: a reach above 0")
        try:
            from cmaes import CMA
        except ImportError as problem:
            raise DesignError(
                "design: the package cmaes is not installed; pip install 'cdpr_drake[design]'"
            ) from problem
        # One coordinate is searched as two of which the other does nothing: CMA wants several.
        self.size, self._padded = size, max(size, 2)
        self._search = CMA(
            mean=np.full(self._padded, 0.5),
            sigma=STEP,
            bounds=np.tile([0.0, 1.0], (self._padded, 1)),
            seed=seed,
            population_size=population,
        )
        self._asked: list[Array] = []

    def ask(self) -> Array:
        """The designs of the next generation, shape (population, size)."""
        self._asked = [self._search.ask() for _ in range(self._search.population_size)]
        return np.array(self._asked)[:, : self.size]

    def tell(self, scores: Array) -> None:
        """Takes the scores of the designs asked for last, larger is better; NaN: refused."""
        losses = np.where(np.isfinite(scores), -np.asarray(scores, float), REFUSED)
        self._search.tell(list(zip(self._asked, losses.tolist(), strict=True)))


def pareto_front(values: Array) -> np.ndarray:
    """Which rows no other row equals or exceeds in everything and exceeds in something.

    Args:
        values: One design a row, larger is better, shape (n, k); rows with NaN never count.

    Returns:
        Shape (n,), bool. Of equal rows the first counts.
    """
    values = np.asarray(values, float)
    good = np.all(np.isfinite(values), axis=1)
    front = good.copy()
    for i in np.flatnonzero(good):
        others = values[good]
        better = np.all(others >= values[i], axis=1) & np.any(others > values[i], axis=1)
        equal = np.all(values[:i] == values[i], axis=1) & good[:i]
        front[i] = not np.any(better) and not np.any(equal)
    return front


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
            share = gain / self._promised if np.isfinite(gain) else -np.inf
            if share < GOOD:
                self._step *= 0.4
            elif share > 0.5:
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
        program = linprog(
            np.append(np.zeros(d), -1.0),
            A_ub=np.hstack([-self._slopes, np.ones((n, 1))]), b_ub=self._values,
            bounds=[*zip(low, high, strict=True), (None, None)], method="highs",
        )  # fmt: skip
        self._promised = -np.inf if program.x is None else float(program.x[-1] - self.value)
        if self._promised <= 1e-9 * max(abs(self.value), 1e-9):
            self._step = 0.0
            return
        self._asked = np.clip(self.best + program.x[:-1], 0.0, 1.0)


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
    cables = list(candidates.cable_sets[number])
    m = candidates.points.reach.shape[1] // 2
    by_points = np.zeros((grid.size, 3, 2 * m))
    by_points[:, :, cables] = slopes.exits
    by_points[:, :, [m + k for k in cables]] = slopes.anchors
    by_coordinates = candidates.points.slopes(by_points)
    # Of the winch, each on a scale of its own logarithm: the largest tension is what it pulls.
    pull, signs = robot.tension_limits(None)[1], {"drum_radius": -1.0}
    winch = [
        slopes.upper * pull * signs.get(name, 1.0) * np.log(high / low)
        for name, (low, high) in candidates.ranges.items()
    ]
    return slopes.found.margins, np.column_stack([by_coordinates, *winch])


SLOPES: dict[str, Slopes] = {"capacity-margin": _capacity_margin}
"""By names of goals."""

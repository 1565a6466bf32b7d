"""Evolutionary search for a design in the box [0, 1]^d, and which designs no other one dominates.

`EvolutionSearch` is CMA-ES by the package cmaes, a generation at a time; `pareto_front` finds the
Pareto front of designs that have several values.

Source: Hansen and Ostermeier, Completely derandomized self-adaptation in evolution strategies,
2001; Deb, Multi-objective optimization using evolutionary algorithms, 2001.
"""

from __future__ import annotations

import math

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import DesignError

STEP = 0.2
"""Standard deviation of the first generation, of boxes of width 1."""

REFUSED = 1e9
"""Score, with the sign changed, of designs that cannot be judged."""


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

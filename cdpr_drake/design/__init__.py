"""Searching a design: coordinates that symmetries tie together, evolution, what dominates what.

A design is a vector of numbers in [0, 1], one a free coordinate. `MovedPoints` makes displacements
of points of it; `EvolutionSearch` seeks the vector of the largest score by CMA-ES, which needs no
gradients: shares of poses are steps of the coordinates. `SlopeSearch` seeks the largest least of
smooth functions by their slopes, which takes far fewer designs where a goal is such a least. All
they know can be replayed from the scores, so that a search goes on where it was killed.

Source: Hansen and Ostermeier, Completely derandomized self-adaptation in evolution strategies,
2001, by the package cmaes; Deb, Multi-objective optimization using evolutionary algorithms, 2001.
"""

from cdpr_drake.design.ascent import SlopeSearch
from cdpr_drake.design.evolution import EvolutionSearch, default_population
from cdpr_drake.design.moved_points import AXES, Mirror, MovedPoints
from cdpr_drake.design.pareto import undominated

__all__ = [
    "AXES", "EvolutionSearch", "Mirror", "MovedPoints", "SlopeSearch", "default_population",
    "undominated",
]  # fmt: skip

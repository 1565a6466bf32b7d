"""Moves that symmetries tie together, the search, and what dominates what."""

import sys

import numpy as np
import pytest

from cdpr_drake.analyses.design.candidates import Mirror, MovedPoints
from cdpr_drake.analyses.design.search_methods import (
    EvolutionSearch,
    SlopeSearch,
    default_population,
    pareto_front,
)
from cdpr_drake.errors import DesignError

REACH = np.full((3, 4), 0.1)


def test_without_ties_every_coordinate_moves_by_itself():
    points = MovedPoints(REACH)
    assert points.size == 12
    assert np.all(points.displacements(np.full(12, 0.5)) == 0.0)
    x = np.full(12, 0.5)
    x[4] = 1.0  # y of the second point
    assert points.displacements(x)[1, 1] == pytest.approx(0.1)
    assert np.count_nonzero(points.displacements(x)) == 1


def test_two_mirrors_leave_the_moves_of_one_point_of_four():
    """C1 and C2 across x, C3 and C4 across x, C1 and C4 and C2 and C3 across y."""
    mirrors = [Mirror((0,), 0, 1), Mirror((0,), 3, 2), Mirror((1,), 0, 3), Mirror((1,), 1, 2)]
    points = MovedPoints(REACH, mirrors)
    assert points.size == 3
    moved = points.displacements(np.array([1.0, 0.75, 0.0]))
    first = moved[:, 0]
    assert np.abs(first) == pytest.approx([0.1, 0.05, 0.1])
    for column, signs in ((1, (-1, 1, 1)), (2, (-1, -1, 1)), (3, (1, -1, 1))):
        assert moved[:, column] == pytest.approx(first * signs)


def test_a_point_on_the_plane_stays_on_it():
    points = MovedPoints(REACH[:, :1], [Mirror((0,), 0, 0)])
    assert points.size == 2
    assert points.displacements(np.ones(2))[0, 0] == 0.0


def test_half_a_turn_changes_two_signs():
    points = MovedPoints(REACH[:, :2], [Mirror((0, 1), 0, 1)])
    assert points.size == 3
    moved = points.displacements(np.array([1.0, 0.75, 0.0]))
    assert moved[:, 1] == pytest.approx(moved[:, 0] * [-1, -1, 1])


def test_the_smallest_box_of_those_that_are_tied_counts():
    reach = REACH.copy()
    reach[:, 1] = 0.03
    points = MovedPoints(reach[:, :2], [Mirror((0,), 0, 1)])
    assert np.max(np.abs(points.displacements(np.ones(3)))) == pytest.approx(0.03)


def test_the_front():
    values = np.array([[1, 3], [2, 2], [3, 1], [1, 1], [2, 2], [np.nan, 9], [0, 3]], float)
    assert pareto_front(values).tolist() == [True, True, True, False, False, False, False]


def test_evolution_finds_the_top_and_replays():
    pytest.importorskip("cmaes")
    top = np.array([0.3, 0.8, 0.6])

    def run(rounds):
        search, asked = EvolutionSearch(3, default_population(3), seed=4), []
        for _ in range(rounds):
            X = search.ask()
            asked.append(X)
            scores = -np.sum((X - top) ** 2, axis=1)
            scores[0] = np.nan  # a design that cannot be
            search.tell(scores)
        return asked

    asked = run(40)
    assert np.all(np.concatenate(asked) >= 0.0)
    assert np.all(np.concatenate(asked) <= 1.0)
    assert np.mean(asked[-1], axis=0) == pytest.approx(top, abs=0.02)
    for one, two in zip(asked, run(5), strict=False):
        assert np.array_equal(one, two)


def test_what_cannot_be_searched_is_said(monkeypatch):
    with pytest.raises(DesignError, match="nothing that may move"):
        EvolutionSearch(0, 4, seed=0)
    monkeypatch.setitem(sys.modules, "cmaes", None)
    with pytest.raises(DesignError, match="pip install"):
        EvolutionSearch(2, 4, seed=0)


def test_slopes_lead_between_functions_to_the_largest_least():
    """Of planes and a bowl: the best is where three are the least, on no slope of any of them."""
    A = np.array([[1.0, 0.0], [-1.0, 0.5], [0.0, -1.0]])

    def values(x):
        return np.append(A @ x + [0.0, 0.6, 0.9], 0.5 - np.sum((x - 0.4) ** 2))

    def slopes(x):
        return np.vstack([A, -2.0 * (x - 0.4)])

    search, asked = SlopeSearch(2), 0
    while not search.ended:
        x = search.ask()
        asked += 1
        search.tell(float(np.min(values(x))), values(x), slopes(x))
    grid = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, 401)] * 2), axis=-1).reshape(-1, 2)
    best = max(float(np.min(values(x))) for x in grid)
    assert search.value >= best - 1e-9
    assert asked < 30


def test_a_first_design_that_is_refused_ends_the_search():
    search = SlopeSearch(3)
    search.tell(float("nan"), np.empty(0), np.empty((0, 3)))
    assert search.ended

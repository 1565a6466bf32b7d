"""Moves that symmetries tie together, the search, and what dominates what."""

import sys

import numpy as np
import pytest

from cdpr_drake.analyses.design.candidates import Mirror, MovedPoints
from cdpr_drake.analyses.design.design_result import pareto_front
from cdpr_drake.analyses.design.search import climb, evolve
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


@pytest.mark.parametrize(
    ("count", "mirrors", "signs"),
    [
        (2, [Mirror((0, 1), 0, 1)], [(-1, -1, 1)]),  # half a turn
        # C1 and C2 across x, C3 and C4 across x, C1 and C4 and C2 and C3 across y.
        (4, [Mirror((0,), 0, 1), Mirror((0,), 3, 2), Mirror((1,), 0, 3), Mirror((1,), 1, 2)],
         [(-1, 1, 1), (-1, -1, 1), (1, -1, 1)]),
    ],
)  # fmt: skip
def test_mirrors_leave_the_moves_of_one_point(count, mirrors, signs):
    points = MovedPoints(REACH[:, :count], mirrors)
    assert points.size == 3
    first, *others = points.displacements(np.array([1.0, 0.75, 0.0])).T
    assert np.abs(first) == pytest.approx([0.1, 0.05, 0.1])
    for moved, sign in zip(others, signs, strict=True):
        assert moved == pytest.approx(first * sign)


def test_a_point_on_the_plane_stays_on_it():
    points = MovedPoints(REACH[:, :1], [Mirror((0,), 0, 0)])
    assert points.size == 2
    assert points.displacements(np.ones(2))[0, 0] == 0.0


def test_the_smallest_box_of_those_that_are_tied_counts():
    reach = REACH.copy()
    reach[:, 1] = 0.03
    points = MovedPoints(reach[:, :2], [Mirror((0,), 0, 1)])
    assert np.max(np.abs(points.displacements(np.ones(3)))) == pytest.approx(0.03)


def test_the_front():
    values = np.array([[1, 3], [2, 2], [3, 1], [1, 1], [2, 2], [np.nan, 9], [0, 3]], float)
    assert pareto_front(values).tolist() == [True, True, True, False, False, False, False]


def answered(search, values):
    """All designs that a search asks for, with the goals that a function gives them."""
    designs = [next(search)]
    try:
        while True:
            designs.append(search.send(values(designs[-1])))
    except StopIteration:
        return designs


def test_evolution_finds_the_top_and_replays():
    pytest.importorskip("cmaes")
    top = np.array([0.3, 0.8, 0.6])

    def values(X):
        goals = -np.sum((X - top) ** 2, axis=1)
        goals[0] = np.nan  # a design that cannot be
        return goals[:, np.newaxis]

    def run(generations):
        return answered(evolve(3, 7, generations, 4, lambda goals: goals[:, 0]), values)

    designs = run(40)
    assert len(designs) == 40
    assert np.all(np.concatenate(designs) >= 0.0)
    assert np.all(np.concatenate(designs) <= 1.0)
    assert np.mean(designs[-1], axis=0) == pytest.approx(top, abs=0.02)
    for first, second in zip(designs, run(5), strict=False):
        assert np.array_equal(first, second)


def test_a_package_that_is_not_installed_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "cmaes", None)
    with pytest.raises(DesignError, match="pip install"):
        next(evolve(2, 4, 1, 0, np.ravel))


def test_slopes_lead_between_functions_to_the_largest_least():
    """Of planes and a bowl: the best is where three are the least, on no slope of any of them."""
    A = np.array([[1.0, 0.0], [-1.0, 0.5], [0.0, -1.0]])

    def values(x):
        return np.append(A @ x + [0.0, 0.6, 0.9], 0.5 - np.sum((x - 0.4) ** 2))

    def slopes_at(x):
        return values(x), np.vstack([A, -2.0 * (x - 0.4)])

    designs = answered(climb(2, 30, slopes_at), lambda x: np.array([[np.min(values(x[0]))]]))
    grid = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, 401)] * 2), axis=-1).reshape(-1, 2)
    best = max(float(np.min(values(x))) for x in grid)
    assert max(float(np.min(values(x[0]))) for x in designs) >= best - 1e-9
    assert len(designs) < 30


def test_steps_shrink_where_slopes_promise_too_much():
    def slopes_at(x):
        return -((x - 0.37) ** 2), -2.0 * (x - 0.37)[:, np.newaxis]

    designs = answered(climb(1, 60, slopes_at), lambda X: -((X - 0.37) ** 2))
    assert min(abs(X[0, 0] - 0.37) for X in designs) < 1e-3


def test_a_first_design_that_is_refused_ends_the_search():
    assert len(answered(climb(3, 9, None), lambda x: np.array([[np.nan]]))) == 1

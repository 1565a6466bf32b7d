"""The pose farthest from the limits is that of all programs, of which few are solved."""

import numpy as np
import pytest

from cdpr_drake.formats import home_search
from cdpr_drake.formats.home_search import (
    farthest_pose,
    margin_and_multipliers,
    margin_bounds,
)

ROUNDING = 1e-7
"""By which a margin may exceed a bound of it [N]: the solver takes that for zero."""


def frame(m, rise):
    """Wrench matrices of a body in a box of m exit points, level, at 75 places; its weight."""
    random = np.random.default_rng(m)
    ends = np.array([[x, y, z] for z in (1.0, -rise) for x in (-1, 1) for y in (-1, 1)], float)
    exits = ends[:m] + random.uniform(-0.1, 0.1, (m, 3))
    anchors = 0.2 * np.roll(ends[:m], 1, axis=0) + random.uniform(-0.02, 0.02, (m, 3))
    places = [
        np.array([x, y, z])
        for z in (-0.5, 0.0, 0.5)
        for x in np.linspace(-0.6, 0.6, 5)
        for y in np.linspace(-0.6, 0.6, 5)
    ]
    matrices = []
    for place in places:
        along = exits - place - anchors
        u = along / np.linalg.norm(along, axis=1)[:, None]
        matrices.append(np.vstack([np.cross(anchors, u).T, u.T]))
    return np.array(matrices), np.array([0.0, 0.0, 0.0, 0.0, 0.0, -10.0])


@pytest.mark.parametrize(("m", "rise", "limits"), [(8, 1.0, (1.0, 60.0)), (8, -0.8, (1.0, 30.0))])
def test_it_is_the_best_of_all_and_few_are_solved(m, rise, limits, monkeypatch):
    """A box of cables all round, and one whose cables come from above: it holds few places."""
    W, w = frame(m, rise)
    every = [margin_and_multipliers(one, w, limits)[0] for one in W]
    asked = []

    def solved(one, *more):
        asked.append(one)
        return margin_and_multipliers(one, *more)

    monkeypatch.setattr(home_search, "margin_and_multipliers", solved)
    best = int(np.argmax(every))
    assert farthest_pose(W, w, limits) == (best, every[best])
    assert every[best] > 0.0
    assert 0 < len(asked) < len(W) / 2


def test_of_equal_ones_it_is_the_first():
    W, w = frame(8, 1.0)
    every = [margin_and_multipliers(one, w, (1.0, 60.0))[0] for one in W]
    twice = np.concatenate([W, W[::-1]])
    assert farthest_pose(twice, w, (1.0, 60.0)) == (int(np.argmax(every)), max(every))


def test_no_multipliers_bound_a_margin_too_low():
    W, w = frame(8, 1.0)
    every = np.array([margin_and_multipliers(one, w, (1.0, 60.0))[0] for one in W])
    held, best = every >= 0.0, int(np.argmax(every))
    random, tight = np.random.default_rng(0), margin_and_multipliers(W[best], w, (1.0, 60.0))[1]
    for y in [tight, *random.standard_normal((20, 6))]:
        assert np.all((every <= margin_bounds(W, w, (1.0, 60.0), y) + ROUNDING)[held])
    assert margin_bounds(W, w, (1.0, 60.0), tight)[best] == pytest.approx(every[best])


def test_where_nothing_holds_the_load_nothing_is_solved(monkeypatch):
    """Four cables cannot balance a moment about the line of the weight."""
    W, w = frame(4, 1.0)
    monkeypatch.delattr(home_search, "margin_and_multipliers")
    assert farthest_pose(W, w + np.array([0.0, 0.0, 3.0, 0.0, 0.0, 0.0]), (1.0, 60.0)) == (0, -1.0)


def test_limits_that_no_pose_keeps_are_told():
    W, w = frame(8, 1.0)
    assert farthest_pose(W[:3], w, (1.0, 1.5)) == (0, -1.0)

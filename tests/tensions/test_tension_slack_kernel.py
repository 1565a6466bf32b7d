"""Tensions of least slack: optimality, units, bounds that fix, wrenches that are dependent."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from cdpr_drake.tensions.slack_kernel import least_slack

GRADIENT = 1e-11
"""Change of |s|^2 / 2 per newton of a cable that could still lessen it, relative to the forces."""

ORACLE = 1e-5
"""SciPy's interior method comes this near to the least slack, relative to the wrench."""

ROUNDING = 1e-12
"""Relative; the same sums in other units."""


def least(W, w, lower, upper, row_scale=None):
    W = np.ascontiguousarray(W, float)
    t = np.full(W.shape[1], np.nan)
    scale = np.ones(len(W)) if row_scale is None else np.asarray(row_scale, float)
    reached = least_slack(
        W, np.asarray(w, float), np.asarray(lower, float), np.asarray(upper, float), scale, t
    )
    assert reached
    return t


@st.composite
def problems(draw):
    """Any wrenches; bounds that fix some cables, cables that pull alike, rows of any size."""
    n, m = draw(st.integers(1, 6)), draw(st.integers(1, 12))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    whole = draw(st.booleans())
    W = rng.integers(-2, 3, (n, m)).astype(float) if whole else rng.normal(size=(n, m))
    if draw(st.booleans()):
        W[:, -1] = 2.0 * W[:, 0]
    lower = rng.integers(0, 3, m).astype(float)
    upper = lower + rng.integers(0, 6, m)
    w = 10.0 * (rng.integers(-3, 4, n) if whole else rng.normal(size=n))
    return W, w, lower, upper, 10.0 ** rng.uniform(-1.5, 0.0, n)


@settings(max_examples=300)
@given(problems())
def test_no_cable_can_lessen_the_slack(problem):
    W, w, lower, upper, row_scale = problem
    t = least(*problem)
    assert np.all((t >= lower) & (t <= upper))
    A, b = W / row_scale[:, None], w / row_scale
    gradient = A.T @ (A @ t + b)
    sizes = np.linalg.norm(A, axis=0) * (np.abs(b).sum() + np.sum(np.abs(A) @ t))
    assert np.all(gradient[t < upper] >= -GRADIENT * sizes[t < upper])
    assert np.all(gradient[t > lower] <= GRADIENT * sizes[t > lower])
    # Convex, so that this is the optimum; SciPy wants bounds apart.
    oracle = lsq_linear(A, -b, (lower, np.maximum(upper, lower + 1e-9)), method="trf", tol=1e-13)
    assert np.linalg.norm(A @ t + b) <= np.sqrt(2.0 * oracle.cost) + ORACLE * np.linalg.norm(b)


@given(problems(), st.sampled_from([1e-3, 1e3]))
def test_units_of_length_make_no_difference(problem, factor):
    """Moments in N mm with a length scale in mm are the same problem."""
    W, w, lower, upper, row_scale = problem
    units = np.where(np.arange(len(w)) < len(w) // 2, factor, 1.0)
    A = W / row_scale[:, None]
    slack = A @ least(*problem) + w / row_scale
    other = least(W * units[:, None], w * units, lower, upper, row_scale * units)
    size = np.abs(w / row_scale).sum() + np.sum(np.abs(A) @ upper)
    np.testing.assert_allclose(A @ other + w / row_scale, slack, rtol=0.0, atol=1e-9 * size)


def test_the_scale_decides_between_moment_and_force():
    """A cable at a lever of 2 m against 10 N m and 30 N: the slack (2 t - 10, t - 30).

    Its least is at (20 / L^2 + 30) / (4 / L^2 + 1), near 5 N for moments and 30 N for forces.
    """
    for L, wanted in ((1e-3, 5.0), (1.0, 10.0), (1e3, 30.0)):
        t = least([[2.0], [1.0]], [-10.0, -30.0], [0.0], [100.0], [L, 1.0])
        exact = (20.0 / L**2 + 30.0) / (4.0 / L**2 + 1.0)
        assert t[0] == pytest.approx(exact, rel=ROUNDING)
        assert t[0] == pytest.approx(wanted, rel=1e-4)


def test_cables_that_cannot_help_stay_at_their_lower_bounds():
    t = least([[0.0, 1.0, -1.0]], [-100.0], [3.0, 0.0, 2.0], [9.0, 40.0, 8.0])
    np.testing.assert_array_equal(t, [3.0, 40.0, 2.0])


def test_what_balances_is_found():
    t = least([[1.0, 0.0], [0.0, 1.0]], [-3.0, -4.0], [0.0, 0.0], [9.0, 9.0])
    np.testing.assert_allclose(t, [3.0, 4.0], rtol=ROUNDING)

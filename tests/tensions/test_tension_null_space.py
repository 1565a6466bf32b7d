"""Factors of the wrench matrix: null space, least-norm tensions, rank, against NumPy."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from cdpr_drake.tensions.null_space_kernel import balance, factor, null_basis, null_space

ORTHOGONALITY = 1e-14  # reflections are orthogonal to a few roundings, however bad W is
SOLUTION_ROUNDING = 1e-14  # relative; times the condition number of W, as for any solver
CONDITION_LIMIT = 1e8  # beyond, NumPy's pseudo-inverse is no oracle any more

MOTIONS = {"1T": 1, "2T": 2, "3T": 3, "1R2T": 3, "2R3T": 5, "3R3T": 6}


@st.composite
def balances(draw, well_conditioned=True):
    n = draw(st.integers(1, 6))
    m = n + draw(st.integers(0, 5))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    shape = draw(st.sampled_from(["normal", "whole", "levers"]))
    W = rng.integers(-2, 3, (n, m)).astype(float) if shape == "whole" else rng.normal(size=(n, m))
    if shape == "levers":  # moments of a small platform are small against the forces
        W[: n // 2] *= 10.0 ** rng.uniform(-4.0, 0.0)
    w = rng.normal(size=n) * 10.0 ** rng.uniform(-2.0, 4.0)
    if well_conditioned:
        assume(np.linalg.cond(W) < CONDITION_LIMIT)
    return W, w


def split(W, w):
    n, m = W.shape
    t, N = np.full(m, np.nan), np.full((m - n, m), np.nan)
    return null_space(W, w, t, N), t, N


@given(balances())
def test_the_null_space_is_orthonormal_and_does_nothing(problem):
    W, w = problem
    full, _, N = split(W, w)
    assert full
    m = W.shape[1]
    np.testing.assert_allclose(N @ N.T, np.eye(len(N)), rtol=0.0, atol=m * ORTHOGONALITY)
    row_sizes = np.linalg.norm(W, axis=1)[:, np.newaxis]
    largest = np.linalg.norm(W)
    assert np.all(np.abs(W @ N.T) <= m * ORTHOGONALITY * np.maximum(row_sizes, largest))


@given(balances())
def test_the_tensions_are_those_of_the_pseudo_inverse(problem):
    W, w = problem
    full, t, N = split(W, w)
    assert full
    expected = -np.linalg.pinv(W, rcond=1e-15) @ w
    allowed = SOLUTION_ROUNDING * W.shape[1] * np.linalg.cond(W) * np.linalg.norm(expected)
    assert np.linalg.norm(t - expected) <= allowed
    assert np.linalg.norm(N @ t) <= W.shape[1] * ORTHOGONALITY * np.linalg.norm(t)


@given(balances())
def test_the_tensions_balance_the_wrench(problem):
    """Backward stable: the residual knows nothing of the condition number."""
    W, w = problem
    _, t, _ = split(W, w)
    size = np.linalg.norm(W) * np.linalg.norm(t) + np.linalg.norm(w)
    assert np.linalg.norm(W @ t + w) <= W.shape[1] * SOLUTION_ROUNDING * size


@given(balances(), st.floats(-1e3, 1e3))
def test_balance_finds_the_tensions_nearest_to_wanted_ones(problem, shift):
    W, w = problem
    n, m = W.shape
    wanted = shift * np.cos(np.arange(m))
    A, t = np.empty((n, m + 2)), np.empty(m)
    assert factor(W, A)
    balance(A, w, wanted, W, t)
    expected = wanted - np.linalg.pinv(W, rcond=1e-15) @ (w + W @ wanted)
    size = np.linalg.norm(expected) + np.linalg.norm(wanted)
    allowed = SOLUTION_ROUNDING * m * np.linalg.cond(W) * size
    np.testing.assert_allclose(t, expected, rtol=0.0, atol=allowed)


@pytest.mark.parametrize("n", MOTIONS.values(), ids=MOTIONS.keys())
def test_every_motion_with_no_cable_to_spare_is_solved_directly(n):
    rng = np.random.default_rng(n)
    W, w = rng.normal(size=(n, n)), rng.normal(size=n)
    full, t, N = split(W, w)
    assert full
    assert N.shape == (0, n)
    allowed = SOLUTION_ROUNDING * n * np.linalg.cond(W) * np.linalg.norm(t)
    np.testing.assert_allclose(t, np.linalg.solve(W, -w), rtol=0.0, atol=allowed)


@given(balances(), st.sampled_from([1e-9, 1e-3, 1e5]))
def test_the_unit_of_length_does_not_matter(problem, factor_of_all):
    W, w = problem
    _, t, N = split(W, w)
    full, scaled, same = split(factor_of_all * W, factor_of_all * w)
    assert full
    allowed = SOLUTION_ROUNDING * W.shape[1] * np.linalg.cond(W) * np.linalg.norm(t)
    np.testing.assert_allclose(scaled, t, rtol=0.0, atol=allowed)
    # The same reflections, to rounding, so even the same basis.
    np.testing.assert_allclose(same, N, rtol=0.0, atol=ORTHOGONALITY * 10 * np.linalg.cond(W))


RANK_DEFICIENT = {
    "zero": np.zeros((2, 4)),
    "zero row": np.array([[1.0, 2.0, 3.0], [0.0, 0.0, 0.0]]),
    "same row twice": np.array([[1.0, 2.0, 3.0], [4.0, -1.0, 2.0], [1.0, 2.0, 3.0]]),
    "sum of rows": np.array([[1.0, 2.0, 3.0, 1.0], [4.0, -1.0, 2.0, 0.0], [5.0, 1.0, 5.0, 1.0]]),
    "all cables alike": np.outer([1.0, 2.0], np.ones(5)),
    "one motion, no lever": np.zeros((1, 3)),
}


@pytest.mark.parametrize("W", RANK_DEFICIENT.values(), ids=RANK_DEFICIENT.keys())
def test_a_singular_wrench_matrix_is_told(W):
    assert not split(W, np.ones(len(W)))[0]


def test_cables_in_one_plane_do_not_span_space():
    angles = np.arange(8) * np.pi / 4
    u = np.stack([np.cos(angles), np.sin(angles), 0.0 * angles])
    arms = 0.1 * np.stack([np.sin(3 * angles), np.cos(angles), 0.0 * angles])
    W = np.vstack([np.cross(arms.T, u.T).T, u])
    assert not split(W, np.zeros(6))[0]


@pytest.mark.parametrize(("smallest", "full"), [(1e-6, True), (1e-9, True), (1e-11, False)])
def test_full_rank_ends_at_the_documented_tolerance(smallest, full):
    rng = np.random.default_rng(3)
    U = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    V = np.linalg.qr(rng.normal(size=(5, 3)))[0]
    W = U @ np.diag([1.0, 0.5, smallest]) @ V.T
    assert split(W, np.ones(3))[0] == full


def test_factors_leave_the_wrench_matrix_alone_and_fill_a_roomier_basis():
    rng = np.random.default_rng(0)
    W = rng.normal(size=(3, 6))
    before = W.copy()
    A, N = np.empty((3, 8)), np.full((3, 8), 7.0)
    assert factor(W, A)
    null_basis(A, 6, N)
    np.testing.assert_array_equal(W, before)
    np.testing.assert_allclose(W @ N[:, :6].T, 0.0, rtol=0.0, atol=10 * ORTHOGONALITY)
    np.testing.assert_array_equal(N[:, 6:], 7.0)

"""The smallest eigenvalue and its vector, against LAPACK."""

from __future__ import annotations

import numpy as np
import pytest

from cdpr_drake.arrays import Array
from cdpr_drake.numerics.linear_algebra_kernel import (
    factor,
    smallest_eigenpair,
    smallest_eigenvalue,
)

ROUNDING = 1e-13
"""Relative to the largest eigenvalue: both ways are backward stable."""


def matrices() -> list[Array]:
    random = np.random.default_rng(4)
    made = [np.eye(6), np.zeros((6, 6)), np.diag([3.0, 1.0, 2.0, 1.0, 5.0, -1.0]), np.ones((3, 3))]
    for n in (1, 2, 3, 6):
        for size in (1e-8, 1.0, 1e8):
            X = random.normal(size=(n, n)) * size
            made += [X + X.T, X @ X.T]
    X = random.normal(size=(6, 2))
    for tiny in (1e-155, 1e-157, 1e-160, 1e-200):  # whose squares are subnormal or zero
        Y = np.diag([1.0, 2.0, -0.5, 3.0, 4.0, 5.0])
        Y[0, 1:3] = Y[1:3, 0] = tiny, 0.7 * tiny
        made.append(Y)
    return [*made, X @ X.T, np.eye(6) + 1e-9 * (X @ X.T)]


@pytest.mark.parametrize("S", matrices())
def test_eigenpair_is_that_of_lapack(S: Array) -> None:
    T, F, v = np.empty_like(S), np.zeros_like(S), np.empty(len(S))
    values = np.linalg.eigvalsh(S)
    size = max(np.max(np.abs(values)), 1e-300)
    found = smallest_eigenpair(S, T, F, v)
    assert found == pytest.approx(values[0], abs=ROUNDING * size)
    assert np.linalg.norm(v) == pytest.approx(1.0, abs=1e-12)
    # The vector's quotient is what a search needs; it is second order in the vector's error.
    assert v @ S @ v == pytest.approx(values[0], abs=1e-7 * max(size, 1.0))


def test_numbers_that_are_not_finite_give_minus_infinity() -> None:
    S = np.eye(3)
    S[1, 2] = S[2, 1] = np.nan
    assert smallest_eigenvalue(S, np.empty((3, 3))) == -np.inf


def test_factor_tells_positive_from_not() -> None:
    S, F = np.diag([2.0, 3.0, 1.0]), np.zeros((3, 3))
    assert factor(S, 0.99, F)
    np.testing.assert_allclose(F @ F.T, S - 0.99 * np.eye(3), atol=1e-15)
    assert not factor(S, 1.0, F)

"""Gauss' elimination: NumPy is the oracle."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cdpr_drake.numerics.linear_algebra_kernel import eliminate, substitute

BACKWARD = 1e-9
"""Residual relative to the right hand side of well conditioned systems."""


@given(st.integers(0, 2**32 - 1), st.integers(1, 14))
def test_solves_as_numpy_does(seed, n):
    random = np.random.default_rng(seed)
    A = random.normal(size=(n, n)) + np.diag(random.choice([0.0, 3.0], n))
    b = random.normal(size=n)
    factors, x, pivots = A.copy(), b.copy(), np.zeros(n)
    eliminate(factors, n, pivots)
    substitute(factors, n, pivots, x)
    assert np.linalg.norm(A @ x - b) < BACKWARD * np.linalg.cond(A)

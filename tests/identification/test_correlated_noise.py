"""Factors of covariances: those of NumPy, once for each vector, in blocks of a long log."""

import numpy as np
import pytest
from scipy.linalg import cho_solve_banded

from cdpr_drake.errors import IdentificationError
from cdpr_drake.identification import correlated_noise
from cdpr_drake.identification.correlated_noise import CorrelatedNoise
from cdpr_drake.identification.program import IdentificationProgram
from cdpr_drake.identification.samples import sample_motion
from cdpr_drake.identification.smoothing import Smoother
from tests.identification import free_motions
from tests.identification.free_motions import NOISE, G, body, cables, log

DENSE = 1e-11
"""Of the factors and solutions of NumPy, over the largest."""

BANDWIDTH = 8.0


def covariance(size, seed=0):
    root = np.random.default_rng(seed).standard_normal((size, 2 * size))
    return root @ root.T


def near(found, expected):
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=DENSE * np.max(np.abs(expected)))


@pytest.mark.parametrize("size", [1, 3, 4, 6, 23, 144])
def test_factors_and_solutions_are_those_of_numpy(size):
    K, x = covariance(size), np.random.default_rng(1).standard_normal((size, 11))
    noise, L, back = CorrelatedNoise.of(K), np.linalg.cholesky(K), np.linalg.inv(K)
    near(noise.U, L.T)
    near(noise.whitened(x), np.linalg.solve(L, x))
    near(noise.whitened(x[:, 0]), np.linalg.solve(L, x[:, 0]))
    near(noise.over_covariance(x), back @ x)
    near(noise.over_others(x[:, 0]), back @ x[:, 0] / np.sqrt(np.diag(back)))
    np.testing.assert_array_equal(x, np.random.default_rng(1).standard_normal((size, 11)))


@pytest.mark.parametrize("K", [np.ones((2, 2)), -np.eye(3), np.full((5, 5), np.nan)])
def test_equations_without_noise_are_refused(K):
    with pytest.raises(IdentificationError, match="noise: found equations without any"):
        CorrelatedNoise.of(K)


def test_a_vector_is_settled_and_factored_once(monkeypatch):
    """Residuals are asked for where rows were; another vector has weights of its own."""
    factored, own = [], correlated_noise.factor
    monkeypatch.setattr(correlated_noise, "factor", lambda *K: factored.append(1) or own(*K))
    samples = sample_motion(*log(6, **NOISE), cables(6), BANDWIDTH)
    program = IdentificationProgram(body(6), ("mass", "stiffness"), gravity=G, size=0.3)
    theta = body(6).vector()
    for term in (program.AddMotion(samples), program.AddCableLengths(samples, samples.lengths)):
        first, once = term.rows(theta), len(factored)
        term.largest(theta)
        assert term.rows(theta.copy()).A.tobytes() == first.A.tobytes()
        assert len(factored) == once
        assert not np.array_equal(term.rows(1.01 * theta).A, first.A)
        assert len(factored) > once


def test_noise_at_some_times_is_that_of_the_whole_log():
    """Only splines about these times are asked, wherever they are."""
    time, poses, _ = free_motions.motion(4)
    smoothed = Smoother.over(time, BANDWIDTH).fit(poses)
    at = smoothed.smoother.sample_times()
    basis = type(smoothed)(
        smoothed.smoother, np.eye(len(smoothed.coefficients)), smoothed.sigma, smoothed.factor,
        smoothed.dropped,
    )  # fmt: skip
    for some in (at[:5], at[40:64], at[-7:], at, time[[0, -1]], smoothed.smoother.knots[5:9]):
        B = np.vstack([basis.at(some, derivative) for derivative in (0, 1, 2)])
        near(smoothed.noise(some, 0, 1, 2), B @ cho_solve_banded((smoothed.factor, False), B.T))

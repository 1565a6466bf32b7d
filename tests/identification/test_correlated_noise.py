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


def test_a_right_hand_side_is_left_as_it_is():
    x = np.ones((6, 2))
    CorrelatedNoise.of(covariance(6)).over_covariance(x)
    assert np.all(x == 1.0)


@pytest.mark.parametrize("K", [np.ones((2, 2)), -np.eye(3), np.full((5, 5), np.nan)])
def test_equations_without_noise_are_refused(K):
    with pytest.raises(IdentificationError, match="noise: found equations without any"):
        CorrelatedNoise.of(K)


@pytest.fixture
def factored(monkeypatch):
    """Sizes of the covariances that were factored."""
    sizes, own = [], correlated_noise.factor

    def counting(K, U):
        sizes.append(len(K))
        return own(K, U)

    monkeypatch.setattr(correlated_noise, "factor", counting)
    return sizes


def made(case=6):
    samples = sample_motion(*log(case, **NOISE), cables(case), BANDWIDTH)
    program = IdentificationProgram(body(case), ("mass", "stiffness"), gravity=G, size=0.3)
    program.AddMotion(samples)
    program.AddCableLengths(samples, samples.lengths)
    return program


def test_a_vector_is_settled_and_factored_once(factored):
    """Residuals are asked for where rows were; another vector has weights of its own."""
    for term in made().terms:
        theta = body(6).vector()
        first = term.rows(theta)
        once = len(factored)
        term.largest(theta)
        again = term.rows(theta.copy())
        assert len(factored) == once
        assert again.A.tobytes() == first.A.tobytes()
        other = term.rows(1.01 * theta)
        assert len(factored) > once
        assert not np.array_equal(other.A, first.A)
        factored.clear()


def test_the_last_pass_to_the_likely_poses_is_the_one_that_weighs(factored):
    """As many factors as passes and blocks, the most of them of whole blocks."""
    term = made().terms[0]
    passes, own = [], type(term)._corrected
    watched = lambda *about: passes.append(1) or own(*about)  # noqa: E731
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(type(term), "_corrected", watched)
        term.rows(body(6).vector())
    assert len(passes) > 1
    assert len(factored) == len(passes) * len(term.samples.blocks())
    assert sum(factored) == len(passes) * 6 * term.samples.count


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

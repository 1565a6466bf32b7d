"""Weights of the platform's equations, fits that miss them, and the cost of outliers."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw
from scipy.stats import chi2

from cdpr_drake.errors import IdentificationError
from cdpr_drake.geometry.cable_paths import cable_jacobian
from cdpr_drake.geometry.poses import pose_row, rotation_from_vector
from cdpr_drake.identification.equations import (
    HUBER,
    Equations,
    huber_cost,
    huber_limit,
    huber_weights,
)
from cdpr_drake.identification.program import IdentificationProgram
from cdpr_drake.identification.regressor import inertia_regressor, regressor_slopes
from cdpr_drake.identification.result import MISFIT, MISFIT_FACTOR
from cdpr_drake.identification.samples import sample_motion, wrench_matrix_slopes
from tests.identification.free_motions import CASES, NOISE, G, believed, body, cables, log, moved

BANDWIDTH = 8.0
SEEDS = 4
WITHIN = 0.1
"""Of chi-square per equation from 1; of four logs it scatters by 0.03."""


def program(log_rows, case, model, unknown, bandwidth=BANDWIDTH):
    """Of rows of a log, or of samples."""
    made = IdentificationProgram(model, unknown, gravity=G, size=0.3)
    if isinstance(log_rows, tuple):
        log_rows = sample_motion(*log_rows, cables(case), bandwidth)
    made.AddMotion(log_rows)
    return made


@pytest.mark.parametrize("case", CASES)
def test_residuals_of_the_true_body_are_as_large_as_weights_say(case):
    total, count = 0.0, 0
    for seed in range(SEEDS):
        made = program(log(case, seed, **NOISE), case, body(case), ("mass",))
        A, b = made.terms[0].rows(body(case).vector())
        rest = A @ body(case).vector() - b
        total, count = total + rest @ rest, count + len(rest)
    assert total / count == pytest.approx(1.0, abs=WITHIN)


def test_errors_are_as_large_as_the_covariance_says():
    """At twice the bandwidth, which leaves less of what smoothing takes than there is noise."""
    total, count, unknown = 0.0, 0, ("mass", "center_of_mass", "inertia")
    for case, seed in ((3, 0), (4, 1), (8, 2), (8, 3)):
        rows = log(case, seed, **NOISE)
        made = program(rows, case, believed(case), unknown, 2.0 * BANDWIDTH)
        found = made.Solve()
        e = found.values - made.layout.values(body(case).vector())
        total, count = total + e @ np.linalg.solve(found.covariance, e), count + len(e)
        assert found.status == "optimal"
        assert found.last_step < 1e-3
    low, high = chi2.ppf([1e-4, 1 - 1e-4], count)
    assert low < total < high


@pytest.fixture(scope="module")
def off():
    """Four cables; poses 5 mm and 0.6 deg off in slow waves, 250 times as much as they jitter."""
    time, poses, tensions = log(4, **{**NOISE, "place": 2e-5, "angle": 2e-5})
    wave = 0.005 * np.sin(np.outer(time, [0.5, 0.8, 1.1]) + np.arange(3))
    return time, moved(poses, 2.0 * wave, wave[:, ::-1]), tensions


@pytest.mark.parametrize("unknown", [("mass",), ("mass", "center_of_mass")])
def test_poses_that_are_off_do_not_take_the_mass_away(off, unknown):
    """Four cables cannot balance the body at such poses; no body at all is no answer to that."""
    found = program(off, 4, believed(4, center_of_mass=body(4).center_of_mass), unknown).Solve()
    assert found.model.mass == pytest.approx(13.0, rel=0.02)
    assert found.status == MISFIT
    assert found.spread > MISFIT_FACTOR
    most = found.largest[0]
    assert most.sigmas == max(one.sigmas for one in found.largest) > MISFIT_FACTOR
    assert most.equation.partition(" ")[0] in ("force", "moment")
    assert most.unit == ("N" if most.equation.startswith("force") else "N m")


NO_WORSE = 1.2
"""Times the error of equal weights, or the standard error, whichever is larger, that chance
may make of weights that are as good."""

LOST = 0.3
"""The same at most where poses are lost for a tenth of the time, which equal weights believe."""


def with_equal_weights(samples, case):
    """Mass and mass times centre by least squares of the wrenches as they are, shape (4,)."""
    Y = inertia_regressor(samples.R_WP, samples.V_WP, samples.A_WP, G)
    rest = samples.wrench - Y[:, :, 4:] @ body(case).inertial()[4:]
    return np.linalg.lstsq(Y[:, :, :4].reshape(-1, 4), rest.ravel(), rcond=None)[0]


def badly_tracked(poses, time, kind, seed):
    """Poses that are off by as much as real ones, some mm and half a degree."""
    random = np.random.default_rng([seed, 11])
    e = np.zeros((len(time), 6))
    if kind == "constant":
        e += random.standard_normal(6)
    elif kind == "stretches":
        for first in (400, 1100, 1600):
            e[first : first + 75] = 5.0 * random.standard_normal(6)
    else:
        low, high = {"slow": (0.03, 0.3), "quicker": (0.3, 1.0)}[kind]
        f, phase = random.uniform(low, high, (4, 6)), random.uniform(0.0, 2.0 * np.pi, (4, 6))
        e = 0.7 * np.sum(np.sin(2.0 * np.pi * f * time[:, None, None] + phase), axis=1)
    return moved(poses, 0.01 * e[:, :3], 0.005 * e[:, 3:])


@pytest.mark.parametrize(
    ("case", "mass", "kind"),
    [
        (4, 12.992, "slow"), (4, 12.992, "constant"), (4, 12.992, "stretches"),
        (6, 3.0, "quicker"), (8, 12.992, "slow"), (8, 12.992, "stretches"),
    ],
)  # fmt: skip
def test_weights_are_no_worse_than_equal_ones_where_poses_are_off(case, mass, kind):
    time, poses, tensions = log(case, 0, **{**NOISE, "place": 2e-5, "angle": 4e-5})
    poses = badly_tracked(poses, time, kind, 0)
    true = replace(body(case), mass=mass, inertia=body(case).inertia * mass / 13.0)
    samples = sample_motion(time, poses, tensions * mass / 13.0, cables(case), BANDWIDTH)
    made = program(samples, case, replace(true, mass=0.8 * mass), ("mass", "center_of_mass"))
    found, (m, *mc) = made.Solve(), with_equal_weights(samples, case)
    off, center = found.values[1:4] - true.center_of_mass, np.array(mc) / m
    masses = np.abs([found.model.mass - mass, m - mass, found.std[0]])
    centres = [*map(np.linalg.norm, (off, center - true.center_of_mass, found.std[1:4]))]
    for weighted, equal, told in (masses, centres):
        assert weighted < NO_WORSE * max(equal, told)
        assert weighted < LOST * equal or kind != "stretches"


def test_tensions_of_the_tracked_poses_tell_the_mass_that_they_were_made_with():
    """By least squares, as four cables cannot balance the body at poses that are off."""
    time, poses, tensions = log(4, **{**NOISE, "place": 2e-5, "angle": 4e-5})
    poses = badly_tracked(poses, time, "slow", 0)
    samples = sample_motion(time, poses, tensions, cables(4), BANDWIDTH)
    wrench = inertia_regressor(samples.R_WP, samples.V_WP, samples.A_WP, G) @ body(4).inertial()
    fitted = np.array(
        [np.linalg.lstsq(*each, rcond=None)[0] for each in zip(samples.W, wrench, strict=True)]
    )
    samples = replace(samples, tensions=fitted)
    model = believed(4, center_of_mass=body(4).center_of_mass)
    found = program(samples, 4, model, ("mass",)).Solve()
    equal = with_equal_weights(samples, 4)[0]
    assert abs(found.model.mass - 13.0) < abs(equal - 13.0) + found.std[0]
    assert found.std[0] < 0.001 * found.model.mass
    assert found.pose_error == pytest.approx(0.005, rel=0.7)


def test_the_residual_that_is_off_is_named():
    """A push along y that no cable makes, about 3 s."""
    time, poses, tensions = log(8, **NOISE)
    samples = sample_motion(time, poses, tensions, cables(8), BANDWIDTH)
    near = int(np.argmin(np.abs(samples.time - 3.0)))
    W = samples.W[near]
    pushed = np.linalg.pinv(W) @ np.array([0.0, 0.0, 0.0, 0.0, 20.0, 0.0])
    bell = np.exp(-(((time - samples.time[near]) / 0.1) ** 2))
    made = program((time, poses, tensions + bell[:, None] * pushed), 8, body(8), ("mass",))
    first = made.Solve().largest[0]
    assert first.equation == "force along y"
    assert first.time == pytest.approx(samples.time[near], abs=0.15)
    at = np.exp(-(((first.time - samples.time[near]) / 0.1) ** 2))
    assert first.value == pytest.approx(20.0 * at, rel=0.2)
    assert first.sigmas > 20.0


def test_an_end_that_is_worse_than_its_start_is_refused(monkeypatch):
    made = program(log(4, **NOISE), 4, believed(4), ("mass",))
    ended = Equations.least_squares

    def light(self, terms, *how):
        fit = ended(self, terms, *how)
        return replace(fit, point=self.at(1e-3 * fit.point.theta, terms))

    monkeypatch.setattr(Equations, "least_squares", light)
    with pytest.raises(IdentificationError, match=r"found parameters with chi-square .*no worse"):
        made.Solve()


def test_slopes_of_wrench_matrices_are_their_derivatives():
    """By W = -J' of poses that are turned about, and moved along, the axes of W."""
    X, h = RigidTransform(RollPitchYaw(0.2, -0.4, 0.3), [0.1, -0.2, 0.3]), 1e-5
    found = wrench_matrix_slopes(np.append(pose_row(X), np.zeros(6))[None], cables(6))[0]

    def at(turn, way):
        moved = RigidTransform(rotation_from_vector(turn) @ X.rotation(), X.translation() + way)
        return -cable_jacobian(moved, cables(6)).T

    for k, step in enumerate(h * np.eye(6)):
        slope = (at(step[:3], step[3:]) - at(-step[:3], -step[3:])) / (2.0 * h)
        np.testing.assert_allclose(found[:, :, k], slope, atol=1e-8)


def test_slopes_of_the_regressor_are_its_derivatives():
    """By finite differences in time of a turn exp([e(t)]) R(t) and a way d(t)."""
    random = np.random.default_rng(3)
    R = rotation_from_vector(np.array([0.3, -0.5, 0.2])).matrix()
    w, alpha, a = random.standard_normal((3, 3))
    noise = 1e-5 * random.standard_normal((3, 6))  # (e, d), their rates, their second rates
    slopes = regressor_slopes(R[None], np.r_[w, 0, 0, 0][None], np.r_[alpha, a][None], G)[0]
    first = np.einsum("ikoq,oq->ik", slopes, noise)

    def regressor(size):
        """With so much of the noise, by differences in time, whose own errors are the same."""
        h, rows = 1e-3, []
        for t in (-h, 0.0, h):
            r = rotation_from_vector(w * t + 0.5 * alpha * t * t).matrix()
            e = noise[0, :3] + noise[1, :3] * t + 0.5 * noise[2, :3] * t * t
            rows.append(rotation_from_vector(size * e).matrix() @ r @ R)
        before, at, after = rows
        spin = (after - before) / (2.0 * h) @ at.T
        turn = (after - 2.0 * at + before) / h**2 @ at.T
        of = [0.5 * np.array([S[2, 1] - S[1, 2], S[0, 2] - S[2, 0], S[1, 0] - S[0, 1]])
              for S in (spin, turn)]  # fmt: skip
        V, A = np.r_[of[0], 0, 0, 0], np.r_[of[1], a + size * noise[2, 3:]]
        return inertia_regressor(at[None], V[None], A[None], G)[0]

    moved, plain = regressor(1.0), regressor(0.0)
    np.testing.assert_allclose(moved - plain, first, atol=1e-8)
    assert np.max(np.abs(first)) > 4e-5


def test_a_prior_that_contradicts_the_log_is_said():
    made = program(log(8, **NOISE), 8, believed(8, mass=10.0), ("mass", "center_of_mass"))
    agreed = made.Solve()
    made.AddPrior("mass", 0.01)
    found = made.Solve()
    assert agreed.remarks == ()
    sigmas = (found.model.mass - 10.0) / 0.01
    assert any(f"up to {sigmas:.3g} of their" in words for words in found.remarks)
    assert (found.last_step > 0.1) == any("still moved" in words for words in found.remarks)


@pytest.mark.parametrize(
    ("x", "cost", "weight"),
    [(0.0, 0.0, 1.0), (-3.0, 9.0, 1.0), (4.0, 16.0, 1.0), (5.0, 24.0, 0.8), (-20.0, 144.0, 0.2)],
)
def test_the_cost_is_square_up_to_the_limit_and_linear_beyond(x, cost, weight):
    """Its slope is that of weighted squares, 2 w x."""
    rest = np.array([x, 2.0])
    assert huber_cost(rest, 4.0) == pytest.approx(cost + 4.0)
    np.testing.assert_allclose(huber_weights(rest, 4.0), [weight, 1.0])


def test_the_limit_is_four_of_the_spread_that_is_there():
    rest = np.array([-30.0, -3.0, 0.0, 2.0, 9.0])
    assert huber_limit(rest) == pytest.approx(4.0 * 1.4826 * 3.0)  # by the median
    # Sigmas that were given too large, or nothing to judge them by, make none smaller.
    assert huber_limit(0.1 * rest) == HUBER == huber_limit(np.zeros(0)) == 4.0

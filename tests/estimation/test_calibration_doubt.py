"""Doubted calibrations: beliefs under each answer are those of a filter told so, and probable as
often as they are right; their mixture is as uncertain as it is wrong."""

from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.estimation.camera_miscalibration import (
    Calibration,
    answers,
    calibration_verdicts,
    explained_variance,
    mixture,
    surprise_of,
)
from cdpr_drake.estimation.sensor_filter import (
    EXTERNAL,
    ON_BOARD,
    POSE,
    Prior,
    apart,
    correct,
    know_object,
    moved_by,
    start_fusion,
)
from cdpr_drake.estimation.sensor_models import sight_external, sight_on_board
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import exponential, logarithm
from tests.estimation.fused_beliefs import (
    CABLES,
    X_PC,
    X_PQ,
    X_WE,
    X_WO,
    X_WP,
    M,
    belief,
    pose_innovation,
    spread,
    wrong_by,
)

LINEAR = 1e-4
"""Of the size of all errors, so small that what is not linear in them is below `ROUND_OFF`."""
ROUND_OFF = 2e-3
"""Of numbers about 1, against errors of `LINEAR` and covariances of their squares."""

TOLD, WRONG = spread(0.005, 0.003), spread(0.03, 0.02)
SHARE = 0.3
SEEDS = 60

WAY = [
    exponential(np.array(twist))
    for twist in (
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.2, 0.0, 0.0, 0.05, 0.0, 0.0],
        [0.0, 0.2, 0.0, 0.0, 0.1, 0.0],
        [0.0, 0.1, 0.2, -0.05, 0.0, 0.1],
    )
]
"""Motions of the platform from its start."""

NOISE = np.diag(spread(2e-3, 5e-4) ** 2), np.diag(spread(5e-3, 2e-3) ** 2)
LOOKS = (
    lambda made: sight_on_board(made, 0.0),
    lambda made: sight_external(made, X_PQ, 0.0),
)


def cameras(scale=1.0, share=SHARE):
    return (
        Calibration(ON_BOARD, X_PC, scale * TOLD, scale * WRONG, share),
        Calibration(EXTERNAL, X_WE, scale * TOLD, scale * WRONG, share),
    )


def start(on_board, external, scale=1.0):
    """The belief at the start with these standard deviations of the two calibrations."""
    prior = Prior(
        pose=scale * spread(0.01, 0.005), on_board=on_board, external=external,
        offsets=scale * np.full(M, 1e-3), biases=np.zeros(6),
    )  # fmt: skip
    made = start_fusion(X_WP, X_PC, X_WE, prior, cable_paths(X_WP, CABLES).J, 0)
    return know_object(made, X_WO, np.diag((scale * spread(0.02, 0.01)) ** 2))


def readings(seed, wrong, scale=1.0):
    """What both cameras see on the way, of a truth whose cameras are wrong or not, and the truth's
    errors."""
    random = np.random.default_rng([17, seed])
    made = start(*(scale * (WRONG if bad else TOLD) for bad in wrong), scale)
    size = len(made.covariance)
    shares = np.linalg.cholesky(made.covariance + 1e-18 * np.eye(size))
    errors = shares @ random.standard_normal(size)
    true, seen = wrong_by(made, errors), []
    for step in WAY:
        at = replace(true, X_WP=true.X_WP @ step)
        for look, R in zip(LOOKS, NOISE, strict=True):
            noise = scale * np.sqrt(np.diagonal(R)) * random.standard_normal(6)
            seen.append(look(at).Z @ exponential(noise))
    return seen, errors


def filtered(made, seen, scale=1.0):
    """The belief after all readings, and the logarithm of their likelihood."""
    log = 0.0
    before = WAY[0]
    for k, Z in enumerate(seen):
        if k % 2 == 0:
            step = WAY[k // 2]
            made = replace(made, X_WP=made.X_WP @ before.inverse() @ step)
            before = step
        sight, R = LOOKS[k % 2](made), scale**2 * NOISE[k % 2]
        innovation = pose_innovation(sight, Z)
        S = sight.H @ made.covariance @ sight.H.T + R
        log -= 0.5 * (innovation @ np.linalg.solve(S, innovation) + np.linalg.slogdet(S)[1])
        made = correct(made, sight.H, innovation, R)
    return replace(made, X_WP=made.X_WP @ before.inverse()), log


def test_each_answer_is_what_a_filter_told_so_believes():
    """Means, covariances, and probabilities by the likelihoods of four other filters, after so few
    readings that all answers are still open."""
    seen = readings(3, (False, False), LINEAR)[0][:3]
    base, _ = filtered(start(LINEAR * WRONG, LINEAR * WRONG, LINEAR), seen, LINEAR)
    found = answers(base, cameras(LINEAR))
    assert len(found) == 4
    logs = {}
    for one in found:
        told = start(*(LINEAR * (WRONG if bad else TOLD) for bad in one.wrong), LINEAR)
        direct, log = filtered(told, seen, LINEAR)
        logs[one.wrong] = log + sum(np.log(SHARE if bad else 1.0 - SHARE) for bad in one.wrong)
        np.testing.assert_allclose(apart(one.belief, direct) / LINEAR, 0.0, atol=ROUND_OFF)
        np.testing.assert_allclose(
            (one.belief.covariance - direct.covariance) / LINEAR**2, 0.0, atol=ROUND_OFF
        )
    expected = np.exp([logs[one.wrong] - max(logs.values()) for one in found])
    expected /= np.sum(expected)
    np.testing.assert_allclose([one.probability for one in found], expected, atol=ROUND_OFF)


def test_a_mixture_has_the_moments_of_its_parts():
    made = belief(past=1)
    size = len(made.covariance)
    d = 1e-6 * np.linspace(-1.0, 1.0, size)
    other = replace(moved_by(made, d), covariance=2.0 * made.covariance)
    np.testing.assert_allclose(apart(other, made), d, atol=1e-14)
    first, second = answers(made, ())[0], answers(other, ())[0]
    whole = mixture([replace(first, probability=0.75), replace(second, probability=0.25)])
    np.testing.assert_allclose(apart(whole, made), 0.25 * d, atol=1e-14)
    expected = 1.25 * made.covariance + 0.75 * 0.25 * np.outer(d, d)
    np.testing.assert_allclose(whole.covariance, expected, atol=1e-18)


@pytest.mark.parametrize(("share", "answer"), [(0.0, (False, False)), (1.0, (True, True))])
def test_no_doubt_leaves_one_answer(share, answer):
    made = start(WRONG, WRONG)
    assert [one.wrong for one in answers(made, cameras(share=share))] == [answer]


@pytest.fixture(scope="module")
def runs():
    """Of truths drawn as the filter is told: which cameras are wrong, how probable that is found,
    and normalized errors squared: of the pose, of both calibrations, of the pose by a filter that
    takes both to be as told; and surprises at cameras that are."""
    rows = []
    for seed in range(SEEDS):
        wrong = tuple(np.random.default_rng([19, seed]).random(2) < SHARE)
        seen, errors = readings(seed, wrong)
        base, _ = filtered(start(WRONG, WRONG), seen)
        found = answers(base, cameras())
        whole = mixture(found)
        sure, _ = filtered(start(TOLD, TOLD), seen)
        true = wrong_by(start(TOLD, TOLD), errors)
        results = [one.probability for one in calibration_verdicts(found, cameras())]
        for made, columns in ((whole, POSE), (whole, slice(15, 27)), (sure, POSE)):
            x = apart(true, made)[columns]
            results.append(x @ np.linalg.solve(made.covariance[columns, columns], x))
        surprise = [surprise_of(sure, camera) for camera in cameras()]
        rows.append((wrong, results, surprise))
    return rows


def test_a_mixture_is_as_uncertain_as_it_is_wrong(runs):
    """Means of the normalized errors are their degrees of freedom, whatever the distribution, by
    the moments of the mixture; the spread is estimated from the runs themselves."""
    numbers = np.array([results[2:4] for _, results, _ in runs])
    deviations = np.std(numbers, axis=0) / np.sqrt(SEEDS)
    assert np.all(np.abs(np.mean(numbers, axis=0) - [6.0, 12.0]) < 4.0 * deviations)
    assert np.all(deviations < [1.0, 2.0])


def test_a_filter_without_doubt_is_surer_than_it_is_right(runs):
    assert np.mean([results[4] for wrong, results, _ in runs if any(wrong)]) > 12.0


def test_probabilities_are_as_often_right(runs):
    found = np.array([results[:2] for _, results, _ in runs]).ravel()
    truth = np.array([wrong for wrong, *_ in runs], float).ravel()
    spread_of_sum = np.sqrt(np.sum(found * (1.0 - found)))
    assert abs(np.sum(found - truth)) < 4.0 * spread_of_sum + 1.0
    # They tell wrong ones from right ones much better than their share does.
    assert np.mean((found - truth) ** 2) < 0.5 * SHARE * (1.0 - SHARE)


def test_surprise_is_chi_square_where_all_is_as_told(runs):
    right = [surprise for wrong, _, surprise in runs if not any(wrong)]
    values, freedom = np.array(right).reshape(-1, 2).T
    assert abs(np.sum(values) - np.sum(freedom)) < 5.0 * np.sqrt(2.0 * np.sum(freedom))
    wrong = np.array([surprise[1] for bad, _, surprise in runs if bad[1]])
    assert np.mean(wrong[:, 0] / wrong[:, 1]) > 2.0


def test_nothing_is_learnt_where_nothing_is_seen():
    made = start(TOLD, TOLD)
    np.testing.assert_allclose(explained_variance(made, EXTERNAL, TOLD), 0.0, atol=1e-12)
    assert surprise_of(made, cameras()[1]) == (0.0, 0)
    exact = Calibration(EXTERNAL, X_WE, np.zeros(6))
    assert surprise_of(start(TOLD, np.zeros(6)), exact) == (0.0, 0)
    seen, _ = readings(0, (False, False))
    after, _ = filtered(made, seen)
    assert np.max(explained_variance(after, ON_BOARD, TOLD)) > 0.5


def test_a_found_error_is_in_the_camera_frame_as_told():
    seen, errors = readings(5, (False, True))
    base, _ = filtered(start(TOLD, WRONG), seen)
    sure = (replace(cameras()[0], wrong=None), cameras()[1])
    one = calibration_verdicts(answers(base, sure), sure)[1]
    left = one.error - errors[EXTERNAL]
    assert np.all(np.abs(left) < 4.0 * one.deviation)
    true = wrong_by(start(TOLD, WRONG), errors)
    np.testing.assert_allclose(logarithm(X_WE.inverse() @ true.X_WE), errors[EXTERNAL], atol=1e-12)
    assert one.row().shape == (15,)

"""Doubted calibrations: beliefs under each answer are those of a filter told so, and probable as
often as they are right; their mixture is as uncertain as it is wrong."""

from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.estimation.camera_miscalibration import (
    Calibration,
    answers,
    calibration_verdicts,
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
from tests.estimation.estimation_cases import (
    CABLES,
    X_PC,
    X_PQ,
    X_WE,
    X_WO,
    X_WP,
    M,
    belief,
    normalized_error,
    pose_innovation,
    spread,
    wrong_by,
)

LINEAR = 1e-4  # size of all errors: what is not linear in them is below `ROUND_OFF`
ROUND_OFF = 2e-3  # of numbers about 1, against errors of `LINEAR` and covariances of their squares
TOLD, WRONG = spread(0.005, 0.003), spread(0.03, 0.02)
SHARE = 0.3
SEEDS = 60

TWISTS = np.array([
    [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [0.2, 0.0, 0.0, 0.05, 0.0, 0.0],
    [0.0, 0.2, 0.0, 0.0, 0.1, 0.0],
    [0.0, 0.1, 0.2, -0.05, 0.0, 0.1],
])  # fmt: skip
WAY = [exponential(twist) for twist in TWISTS]  # motions of the platform from its start
CAMERAS = (
    (lambda made: sight_on_board(made, 0.0), spread(2e-3, 5e-4)),
    (lambda made: sight_external(made, X_PQ, 0.0), spread(5e-3, 2e-3)),
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


def told(wrong, scale=1.0):
    return start(*(scale * (WRONG if bad else TOLD) for bad in wrong), scale)


def readings(seed, wrong, scale=1.0):
    """What both cameras see on the way, of a truth whose cameras are wrong or not, and the truth's
    errors."""
    random, made = np.random.default_rng([17, seed]), told(wrong, scale)
    size = len(made.covariance)
    shares = np.linalg.cholesky(made.covariance + 1e-18 * np.eye(size))
    errors = shares @ random.standard_normal(size)
    true, seen = wrong_by(made, errors), []
    for step in WAY:
        at = replace(true, X_WP=true.X_WP @ step)
        for sight_of, deviations in CAMERAS:
            noise = scale * deviations * random.standard_normal(6)
            seen.append(sight_of(at).Z @ exponential(noise))
    return seen, errors


def filtered(made, seen, scale=1.0):
    """The belief after all readings, and the logarithm of their likelihood."""
    log, before = 0.0, WAY[0]
    for k, Z in enumerate(seen):
        if k % 2 == 0:
            step = WAY[k // 2]
            made, before = replace(made, X_WP=made.X_WP @ before.inverse() @ step), step
        sight_of, deviations = CAMERAS[k % 2]
        sight, R = sight_of(made), np.diag((scale * deviations) ** 2)
        innovation = pose_innovation(sight, Z)
        S = sight.H @ made.covariance @ sight.H.T + R
        log -= 0.5 * (normalized_error(innovation, S) + np.linalg.slogdet(S)[1])
        made = correct(made, sight.H, innovation, R)
    return replace(made, X_WP=made.X_WP @ before.inverse()), log


def test_each_answer_is_what_a_filter_told_so_believes():
    """Means, covariances, and probabilities by the likelihoods of four other filters, after so few
    readings that all answers are still open."""
    seen = readings(3, (False, False), LINEAR)[0][:3]
    found = answers(filtered(told((True, True), LINEAR), seen, LINEAR)[0], cameras(LINEAR))
    assert len(found) == 4
    logs = []
    for answer in found:
        direct, log = filtered(told(answer.wrong, LINEAR), seen, LINEAR)
        logs.append(log + sum(np.log(SHARE if bad else 1.0 - SHARE) for bad in answer.wrong))
        np.testing.assert_allclose(apart(answer.belief, direct) / LINEAR, 0.0, atol=ROUND_OFF)
        excess = answer.belief.covariance - direct.covariance
        np.testing.assert_allclose(excess / LINEAR**2, 0.0, atol=ROUND_OFF)
    expected = np.exp(np.array(logs) - max(logs))
    probabilities = [answer.probability for answer in found]
    np.testing.assert_allclose(probabilities, expected / np.sum(expected), atol=ROUND_OFF)


def test_a_mixture_has_the_moments_of_its_parts():
    made = belief(past=1)
    d = 1e-6 * np.linspace(-1.0, 1.0, len(made.covariance))
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
    assert [each.wrong for each in answers(made, cameras(share=share))] == [answer]


@pytest.fixture(scope="module")
def runs():
    """Of truths drawn as the filter is told: which cameras are wrong, how probable that is found,
    normalized errors (pose, both calibrations, pose by a filter that takes both to be as told),
    and surprises at cameras that are."""
    columns = {"wrong": [], "probable": [], "errors": [], "surprise": []}
    for seed in range(SEEDS):
        wrong = tuple(np.random.default_rng([19, seed]).random(2) < SHARE)
        seen, errors = readings(seed, wrong)
        found = answers(filtered(told((True, True)), seen)[0], cameras())
        sure, true = filtered(told((False, False)), seen)[0], wrong_by(start(TOLD, TOLD), errors)
        parts = ((mixture(found), POSE), (mixture(found), slice(15, 27)), (sure, POSE))
        verdicts = calibration_verdicts(found, cameras())
        columns["wrong"].append(wrong)
        columns["probable"].append([verdict.probability for verdict in verdicts])
        columns["errors"].append(
            [normalized_error(apart(true, made)[c], made.covariance[c, c]) for made, c in parts]
        )
        columns["surprise"].append([surprise_of(sure, camera) for camera in cameras()])
    return {name: np.array(rows) for name, rows in columns.items()}


def test_a_mixture_is_as_uncertain_as_it_is_wrong(runs):
    """Means of the normalized errors are their degrees of freedom, whatever the distribution, by
    the moments of the mixture; the spread is estimated from the runs themselves. A filter without
    doubt is surer than it is right."""
    numbers = runs["errors"][:, :2]
    deviations = np.std(numbers, axis=0) / np.sqrt(SEEDS)
    assert np.all(np.abs(np.mean(numbers, axis=0) - [6.0, 12.0]) < 4.0 * deviations)
    assert np.all(deviations < [1.0, 2.0])
    assert np.mean(runs["errors"][np.any(runs["wrong"], axis=1), 2]) > 12.0


def test_probabilities_are_as_often_right(runs):
    probable, wrong = runs["probable"], runs["wrong"].astype(float)
    spread_of_sum = np.sqrt(np.sum(probable * (1.0 - probable)))
    assert abs(np.sum(probable - wrong)) < 4.0 * spread_of_sum + 1.0
    # They tell wrong ones from right ones much better than their share does.
    assert np.mean((probable - wrong) ** 2) < 0.5 * SHARE * (1.0 - SHARE)


def test_surprise_is_chi_square_where_all_is_as_told(runs):
    values, freedom = runs["surprise"][~np.any(runs["wrong"], axis=1)].reshape(-1, 2).T
    assert abs(np.sum(values) - np.sum(freedom)) < 5.0 * np.sqrt(2.0 * np.sum(freedom))
    wrong = runs["surprise"][runs["wrong"][:, 1], 1]
    assert np.mean(wrong[:, 0] / wrong[:, 1]) > 2.0


def learnt_shares(belief, columns):
    """Shares of the variance of an error that readings have taken away."""
    P = belief.covariance[columns, columns] / np.outer(TOLD, TOLD)
    return np.linalg.eigvalsh(np.eye(len(TOLD)) - P)


def test_nothing_is_learnt_where_nothing_is_seen():
    made = start(TOLD, TOLD)
    np.testing.assert_allclose(learnt_shares(made, EXTERNAL), 0.0, atol=1e-12)
    assert surprise_of(made, cameras()[1]) == (0.0, 0)
    exact = Calibration(EXTERNAL, X_WE, np.zeros(6))
    assert surprise_of(start(TOLD, np.zeros(6)), exact) == (0.0, 0)
    after, _ = filtered(made, readings(0, (False, False))[0])
    assert np.max(learnt_shares(after, ON_BOARD)) > 0.5


def test_a_found_error_is_in_the_camera_frame_as_told():
    seen, errors = readings(5, (False, True))
    sure = (replace(cameras()[0], wrong=None), cameras()[1])
    verdict = calibration_verdicts(answers(filtered(start(TOLD, WRONG), seen)[0], sure), sure)[1]
    assert np.all(np.abs(verdict.error - errors[EXTERNAL]) < 4.0 * verdict.deviation)
    true = wrong_by(start(TOLD, WRONG), errors)
    np.testing.assert_allclose(logarithm(X_WE.inverse() @ true.X_WE), errors[EXTERNAL], atol=1e-12)
    assert verdict.row().shape == (15,)

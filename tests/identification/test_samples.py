"""What a log is read as: motions, noise, clocks, winches; each against something independent."""

from itertools import groupby

import numpy as np
import pytest

from cdpr_drake.errors import IdentificationError
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.identification.samples import (
    BLOCK,
    one_side,
    pose_shift,
    sample_motion,
    sample_winches,
)
from tests.identification.logs import BANDWIDTH, CABLES, G, log, motion

NOISE = {"tension": 0.3, "place": 1e-4, "angle": 2e-4}


@pytest.fixture(scope="module")
def exact():
    return sample_motion(*log(span=4.0), CABLES, BANDWIDTH)


@pytest.fixture(scope="module")
def noisy():
    return sample_motion(*log(span=4.0, **NOISE), CABLES, BANDWIDTH)


def test_a_motion_is_that_of_the_log(exact):
    """Away from the ends, where splines follow less well."""
    R, p, V, A = motion(exact.time)
    inner = slice(6, -6)
    np.testing.assert_allclose(exact.R_WP[inner], R[inner], atol=1e-6)
    np.testing.assert_allclose(exact.p_WP[inner], p[inner], atol=1e-6)
    np.testing.assert_allclose(exact.V_WP[inner], V[inner], atol=2e-5)
    np.testing.assert_allclose(exact.A_WP[inner], A[inner], atol=5e-3)


def test_samples_stand_in_the_middle_between_knots_in_blocks(exact):
    apart = np.diff(exact.time)
    np.testing.assert_allclose(apart, apart[0], rtol=1e-9)
    assert apart[0] == pytest.approx(0.5 / BANDWIDTH, rel=0.01)
    blocks = exact.blocks()
    assert [n for b in blocks for n in range(b.start, b.stop)] == list(range(len(exact.time)))
    assert {b.stop - b.start for b in blocks[:-1]} == {BLOCK}


def test_tensions_lengths_and_wrenches_are_those_at_the_samples(exact):
    time, _, tensions = log(span=4.0)
    at = np.column_stack([np.interp(exact.time, time, one) for one in tensions.T])
    np.testing.assert_allclose(exact.tensions, at, atol=5e-3)
    first, second = exact.tension_rates
    step = exact.time[1] - exact.time[0]
    bend = np.gradient(exact.tensions, step, axis=0)
    np.testing.assert_allclose(first[4:-4], bend[4:-4], atol=3.0)
    np.testing.assert_allclose(second[4:-4], np.gradient(first, step, axis=0)[4:-4], atol=30.0)
    assert np.max(np.abs(first)) > 12.0
    assert np.max(np.abs(second)) > 60.0
    n = 20
    arms = exact.R_WP[n] @ CABLES.p_PB
    way = CABLES.p_WA - exact.p_WP[n][:, None] - arms
    apart = np.linalg.norm(way, axis=0)
    np.testing.assert_allclose(exact.lengths[n], apart, atol=1e-9)
    W = np.vstack([np.cross(arms.T, (way / apart).T).T, way / apart])
    np.testing.assert_allclose(exact.W[n], W, atol=1e-9)
    np.testing.assert_allclose(exact.wrench[n], W @ exact.tensions[n], atol=1e-9)


def test_noise_is_what_the_log_has(noisy):
    assert noisy.sigma_place == pytest.approx(1e-4, rel=0.06)
    assert noisy.sigma_turn == pytest.approx(2e-4, rel=0.06)
    np.testing.assert_allclose(noisy.sigma_tensions, 0.3, rtol=0.12)
    np.testing.assert_allclose(
        noisy.pose_spread, [noisy.sigma_turn] * 3 + [noisy.sigma_place] * 3, rtol=0.0
    )
    assert not noisy.raised


@pytest.mark.parametrize("less", ["tension", "place", "angle"])
def test_noise_less_than_any_sensor_has_is_raised(less):
    of = sample_motion(*log(span=2.0, **{**NOISE, less: 0.0}), CABLES, BANDWIDTH)
    assert of.raised
    assert (of.sigma_place == 1e-5) == (less == "place")
    assert (of.sigma_turn == 1e-5) == (less == "angle")
    least = np.all(of.sigma_tensions == 1e-4 * np.max(np.abs(of.tensions)))
    assert least == (less == "tension")


def test_outliers_of_poses_and_tensions_are_counted():
    time, poses, tensions = log(span=3.0, **NOISE)
    poses[200, 4] += 0.1
    tensions[[100, 300, 500], 2] += 50.0
    assert sample_motion(time, poses, tensions, CABLES, BANDWIDTH).dropped == 4


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t, X, f: (t, X[:, :6], f), r"poses: found shape \(500, 6\); accepted: \(500, 7\)"),
        (lambda t, X, f: (t, X[1:], f), r"poses: found shape \(499, 7\)"),
        (lambda t, X, f: (t, X, f[:, 1:]), r"tensions: found shape \(500, 7\); .*: \(500, 8\)"),
        (lambda t, X, f: (t[:10], X[:10], f[:10]), "found 10 rows"),
        (lambda t, X, f: (t, X, np.full_like(f, np.nan)), "signal without a row"),
        (lambda t, X, f: (np.where(t > 1.0, t + 2.0, t), X, f), "no rows from"),
        (lambda t, X, f: (10.0 * t, X, f), "bandwidth: found 8 Hz; accepted: above 0 to 6.25 Hz"),
    ],
)
def test_bad_logs_are_refused(change, words):
    with pytest.raises(IdentificationError, match=words):
        sample_motion(*change(*log(span=2.0)), CABLES, BANDWIDTH)


def test_a_pose_that_no_cable_can_have_is_named_by_its_time():
    """The anchor point of the first cable goes through its exit point, about 1 s."""
    time, poses, tensions = log(span=2.0, turn=0.0)
    exits = CABLES.p_WA.copy()
    middle = sample_motion(time, poses, tensions, CABLES, BANDWIDTH)
    n = int(np.argmin(np.abs(middle.time - 1.0)))
    exits[:, 0] = middle.p_WP[n] + middle.R_WP[n] @ CABLES.p_PB[:, 0]
    through = CableSet.make(exits, CABLES.p_PB, CABLES.stiffness)
    words = rf"a pose at {middle.time[n]:.4g} s at which a cable cannot run"
    with pytest.raises(IdentificationError, match=words):
        sample_motion(time, poses, tensions, through, BANDWIDTH)


def test_quaternions_that_jump_to_the_other_side_are_the_same_motion(exact):
    time, poses, tensions = log(span=4.0)
    poses[300:700:2, :4] *= -1.0
    poses[50] = np.nan
    of = sample_motion(time, poses, tensions, CABLES, BANDWIDTH)
    np.testing.assert_allclose(of.A_WP, exact.A_WP, atol=5e-3)
    rows = one_side(poses)
    assert np.all(np.sum(rows[1:49, :4] * rows[:48, :4], axis=1) > 0.9)
    np.testing.assert_array_equal(rows[51, :4], log(span=4.0)[1][51, :4])
    np.testing.assert_array_equal(rows[:, 4:], poses[:, 4:])


def late_by(rows, span=6.0, **how):
    """Samples of a log whose poses are late, which stand still at its ends, and `pose_shift`."""
    time, poses, tensions = log(span=span, **how, **NOISE)
    n = np.clip(np.arange(len(time)) - rows, 0, len(time) - 1)
    return pose_shift(sample_motion(time, poses[n], tensions, CABLES, BANDWIDTH), CABLES, G)


@pytest.mark.parametrize(
    ("rows", "span", "how", "late"),
    [
        (30, 6.0, {}, 0.12), (-20, 6.0, {}, -0.08), (0, 6.0, {}, 0.0),
        (112, 6.0, {}, 0.448),  # up to half a second
        (60, 2.0, {}, 0.24),  # 0.15 of a log of two seconds: 0.3 s, which leaves 22 samples
        (25, 6.0, {"move": 0.0}, 0.1),  # on the spot: all but the weight are moments
    ],
)  # fmt: skip
def test_poses_that_are_late_are_told_by_how_much(rows, span, how, late):
    """By rows of 4 ms."""
    shift, better = late_by(rows, span, **how)
    assert shift == pytest.approx(late, abs=5e-3)
    assert 1.0 <= better < 1.1 if late == 0.0 else better > 1.5


def test_shifts_are_looked_for_up_to_half_a_second():
    """A log of a second has too few samples."""
    assert abs(late_by(200)[0]) <= 0.5 + 0.03
    assert late_by(0, 1.0) == (0.0, 1.0)


RATIO, INERTIA, BAND, LEAST, FADES = np.array([0.02, 0.05]), 3e-4, 6.0, 0.805, 2.0


def turning():
    """Two winches under constant acceleration, of which the second turns back; friction is given.

    Polynomials of degree two, which splines keep exactly.
    """
    time = 3.0 + np.arange(0.0, 4.0, 0.004)
    s = time - 3.0
    rate = np.column_stack([0.05 + 0.02 * s, -0.1 + 0.05 * s])
    lengths = 1.0 + np.column_stack([0.05 * s + 0.01 * s**2, -0.1 * s + 0.025 * s**2])
    tensions = 30.0 + np.column_stack([2.0 * s, np.sin(s)])
    lost = np.column_stack([0.3 + 0.1 * s, -0.2 + 0.05 * s])
    torques = lost - RATIO * tensions + INERTIA * np.array([0.02, 0.05]) / RATIO
    return time, lengths, tensions, torques, rate / RATIO, lost


def winches(time, lengths, tensions, torques, **how):
    given = {"inertia": INERTIA, "bandwidth": BAND, "least_speed": LEAST, "stribeck_speed": FADES}
    return sample_winches(time, lengths, tensions, torques, ratio=RATIO, **{**given, **how})


def test_winches_are_means_over_stretches_in_one_direction():
    time, lengths, tensions, torques, w, lost = turning()
    torques[5, 0] = np.nan
    of = winches(time, lengths, tensions, torques)
    expected = []
    for i in range(2):
        rows = [
            (int((t - time[0]) * 2.0 * BAND + 1e-9), k) for k, t in enumerate(time)
            if abs(w[k, i]) > LEAST and np.isfinite(torques[k, i])
        ]  # fmt: skip
        for _, group in groupby(rows, key=lambda row: row[0]):
            mine = [k for _, k in group]
            if len({np.sign(w[k, i]) for k in mine}) == 1:
                excess = np.mean(np.exp(-np.abs(w[mine, i]) / FADES))
                expected.append(
                    (np.mean(time[mine]), i, np.mean(w[mine, i]), np.mean(lost[mine, i]),
                     len(mine), excess)
                )  # fmt: skip
    found = np.column_stack([of.time, of.cable, of.speed, of.friction, of.rows, of.excess])
    np.testing.assert_allclose(found, np.array(expected), atol=1e-8)
    assert {1.0, -1.0} <= set(np.sign(of.speed[of.cable == 1]))
    assert of.rows[0] == of.rows[1] - 1  # the one without a torque


def test_winches_that_turn_too_slowly_tell_nothing():
    time, lengths, tensions, torques, w, _ = turning()
    words = rf"found none that turns faster than {2.0 * np.max(w):g} rad/s"
    with pytest.raises(IdentificationError, match=words):
        winches(time, lengths, tensions, torques, least_speed=2.0 * np.max(w))
    assert {*winches(time, lengths, tensions, torques, least_speed=3.0).cable} == {0}


def test_a_stretch_with_both_directions_is_left_out():
    """Where winches may be slow, that in which the second one turns back holds both."""
    time, lengths, tensions, torques, w, _ = turning()
    of = winches(time, lengths, tensions, torques, least_speed=1e-3, bandwidth=1.7)
    second = np.sort(of.time[of.cable == 1])
    turns = time[np.argmin(np.abs(w[:, 1]))]
    gap = np.diff(second)
    assert np.max(gap) == pytest.approx(2.0 * np.median(gap), rel=0.05)
    assert second[np.argmax(gap)] < turns < second[np.argmax(gap) + 1]
    assert len(of.time[of.cable == 0]) == len(second) + 1

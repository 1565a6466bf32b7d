"""Shift and drift of two clocks, on motions whose clocks are known."""

import numpy as np
import pytest

from cdpr_drake.errors import ClockError
from cdpr_drake.numerics.clock_alignment import align_clocks, interpolate_rows
from cdpr_drake.numerics.time_shift import WORSE, tracker_shift

SHIFT, DRIFT = 1.37, 2e-4
EXITS = np.array([[-1.4, -1.1], [1.4, -1.1], [1.4, 1.1], [-1.4, 1.1]])
SEEDS = 16  # of one motion each
CHI_SQUARE = (0.55, 1.6)
"""Bounds of the mean of chi-square over 2: for many seeds 1, and 6 % more, as 40 stretches of a
motion know their own variance to some degree only. These seeds give 0.9."""


def pair(seed, words=4, rate=25.0):
    """Lengths with a wrong scale by one clock, positions by another one."""
    rng = np.random.default_rng(seed)
    w = 2.0 * np.pi * np.array([0.13, 0.31, 0.47, 0.71])[:words]
    phase = rng.uniform(0.0, 2.0 * np.pi, (words, 2))

    def position(t):
        return sum(0.5 / (1 + k) * np.sin(w[k] * t[:, None] + phase[k]) for k in range(words))

    t, t_other = np.arange(0.0, 30.0, 1.0 / rate), np.arange(-2.0, 33.0, 1.0 / (1.2 * rate))
    true = t_other + SHIFT + DRIFT * (t_other - 0.5 * (t_other[0] + t_other[-1]))
    x = np.column_stack([position(true), np.zeros(len(t_other))])
    y = 0.94 * np.linalg.norm(position(t)[:, None] - EXITS, axis=2) + 0.1
    y, x = y + rng.normal(0.0, 1e-3, y.shape), x + rng.normal(0.0, 2e-4, x.shape)
    return t, y, t_other, x


def test_standard_deviations_are_what_errors_have():
    chi_squares = []
    for seed in range(SEEDS):
        alignment = align_clocks(*pair(seed))
        error = np.array([alignment.shift - SHIFT, alignment.drift - DRIFT])
        assert abs(error[0]) < 3e-3  # what logs of machines ask
        chi_squares.append(error @ np.linalg.solve(alignment.covariance, error) / 2.0)
    assert CHI_SQUARE[0] < np.mean(chi_squares) < CHI_SQUARE[1]


def test_either_recorder_may_be_the_first_and_instants_go_there_and_back():
    t, y, t_other, x = pair(3, rate=50.0)
    first, second = align_clocks(t, y, t_other, x), align_clocks(t_other, x[:, :2], t, y)
    instants = np.linspace(-3.0, 40.0, 7)
    back = first.on_other_clock(first.on_first_clock(instants))
    np.testing.assert_allclose(back, instants, atol=1e-12)
    away = second.on_first_clock(first.on_first_clock(np.array([15.0]))) - 15.0
    assert abs(float(away[0])) < 6.0 * (first.sigmas[0] + second.sigmas[0])


PAIR = pair(0)


def other_motion(t, y, u, x):
    return t, y, *pair(2)[2:]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t, y, u, x: pair(1, words=1), "that explain the motion alike"),
        (other_motion, r"found (no shift|.*unexplained)"),
        (lambda t, y, u, x: (t[:20], y[:20], u, x), "20 whole rows in the first"),
        (lambda t, y, u, x: (t, y, u, 0.0 * x), "nothing that moves in the second"),
        (lambda t, y, u, x: (t[::-1], y, u, x), "times in the first recording that do not grow"),
        (lambda t, y, u, x: (t, np.full_like(y, np.nan), u, x), "0 whole rows in the first"),
    ],
    ids=["repeats", "two motions", "short", "still", "backwards", "NaN"],
)
def test_refusal(change, words):
    with pytest.raises(ClockError, match=words):
        align_clocks(*change(*PAIR))


def test_rows_are_not_made_up_in_gaps():
    t = np.array([0.0, 0.1, 0.2, 1.0, 1.1])
    rows = interpolate_rows(t, t[:, None], np.array([-0.1, 0.05, 0.6, 1.05, 1.2]))
    np.testing.assert_allclose(rows[:, 0], [np.nan, 0.05, np.nan, 1.05, np.nan])


TIME = np.linspace(0.0, 10.0, 201)
NOISE = np.random.default_rng(0).standard_normal((201, 2))


def lengths(time):
    return 1.0 + 0.1 * np.stack([np.sin(1.3 * time), np.cos(0.7 * time + 0.3)], axis=1)


@pytest.mark.parametrize("late", [-0.4, -0.03, 0.12, 0.9])
def test_a_late_tracker_is_found(late):
    counted = 0.3 + 1.01 * lengths(TIME) + 1e-4 * NOISE  # offsets and drums may be off
    shift, better = tracker_shift(TIME, counted, lengths(TIME - late))
    assert shift == pytest.approx(late, abs=5e-3)
    assert better > WORSE


def test_a_tracker_in_time_is_left_alone():
    assert tracker_shift(TIME, lengths(TIME) + 1e-3 * NOISE, lengths(TIME))[1] < 1.1


@pytest.mark.parametrize("count", [3, 201])
def test_logs_that_cannot_tell_say_so(count):
    still = 1.0 + 1e-4 * NOISE[:count]
    assert tracker_shift(TIME[:count], still, still) == (0.0, 1.0)

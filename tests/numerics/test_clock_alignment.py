"""Shift and drift of two clocks, on motions whose clocks are known."""

import numpy as np
import pytest

from cdpr_drake.errors import ClockError
from cdpr_drake.numerics.clock_alignment import align_clocks, interpolate_rows

SHIFT, DRIFT = 1.37, 2e-4

EXITS = np.array([[-1.4, -1.1], [1.4, -1.1], [1.4, 1.1], [-1.4, 1.1]])

SEEDS = 40
"""Of these, the mean of chi-square over 2 is normal with sigma 1 / sqrt(40), about 0.16; 40
stretches of a motion raise it by 6 % (they know their own variance to some degree only)."""

CHI_SQUARE = (0.55, 1.6)
"""Three of these sigmas below, and as much and those 6 % above."""


def pair(seed, noise=(1e-3, 2e-4), words=4):
    """Lengths with a wrong scale by one clock, positions by another one."""
    rng = np.random.default_rng(seed)
    w = 2.0 * np.pi * np.array([0.13, 0.31, 0.47, 0.71])[:words]
    phase = rng.uniform(0.0, 2.0 * np.pi, (words, 2))

    def position(t):
        return sum(0.5 / (1 + k) * np.sin(w[k] * t[:, None] + phase[k]) for k in range(words))

    t = np.arange(0.0, 30.0, 0.01)
    t_other = np.arange(-2.0, 33.0, 1.0 / 120.0)
    true = t_other + SHIFT + DRIFT * (t_other - 0.5 * (t_other[0] + t_other[-1]))
    x = np.column_stack([position(true), np.zeros(len(t_other))])
    y = 0.94 * np.linalg.norm(position(t)[:, None] - EXITS, axis=2) + 0.1
    return (
        t, y + rng.normal(0.0, noise[0], y.shape), t_other, x + rng.normal(0.0, noise[1], x.shape)
    )  # fmt: skip


def errors_and_chi_square(seed, **more):
    found = align_clocks(*pair(seed, **more))
    away = np.array([found.shift - SHIFT, found.drift - DRIFT])
    return away, float(away @ np.linalg.solve(found.covariance, away)) / 2.0


def test_standard_deviations_are_what_errors_have():
    found = [errors_and_chi_square(seed) for seed in range(SEEDS)]
    assert CHI_SQUARE[0] < np.mean([chi for _, chi in found]) < CHI_SQUARE[1]
    assert np.max(np.abs([away[0] for away, _ in found])) < 3e-3  # what logs of machines ask


def test_instants_go_to_the_other_clock_and_back():
    found = align_clocks(*pair(0))
    t = np.linspace(-3.0, 40.0, 7)
    np.testing.assert_allclose(found.on_other_clock(found.on_first_clock(t)), t, atol=1e-12)


def test_either_recorder_may_be_the_first():
    one = align_clocks(*pair(3))
    t, y, t_other, x = pair(3)
    other = align_clocks(t_other, x[:, :2], t, y)
    middle = np.array([15.0])
    away = other.on_first_clock(one.on_first_clock(middle)) - middle
    assert abs(float(away[0])) < 6.0 * (one.sigmas[0] + other.sigmas[0])


def test_a_motion_that_repeats_itself_is_refused():
    with pytest.raises(ClockError, match="that explain the motion alike"):
        align_clocks(*pair(1, words=1))


def test_two_motions_are_refused():
    t, y, _, _ = pair(1)
    _, _, t_other, x = pair(2)
    with pytest.raises(ClockError, match=r"found (no shift|.*unexplained)"):
        align_clocks(t, y, t_other, x)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t, y, u, x: (t[:20], y[:20], u, x), "20 whole rows in the first"),
        (lambda t, y, u, x: (t, y, u, 0.0 * x), "nothing that moves in the second"),
        (lambda t, y, u, x: (t[::-1], y, u, x), "times in the first recording that do not grow"),
        (lambda t, y, u, x: (t, np.full_like(y, np.nan), u, x), "0 whole rows in the first"),
    ],
)
def test_what_tells_no_clock_is_refused(change, words):
    with pytest.raises(ClockError, match=words):
        align_clocks(*change(*pair(0)))


def test_rows_are_not_made_up_in_gaps():
    t = np.array([0.0, 0.1, 0.2, 1.0, 1.1])
    rows = interpolate_rows(t, t[:, None], np.array([-0.1, 0.05, 0.6, 1.05, 1.2]))
    np.testing.assert_allclose(rows[:, 0], [np.nan, 0.05, np.nan, 1.05, np.nan])

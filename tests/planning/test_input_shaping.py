"""Shapers against an oscillator that is integrated in closed form."""

import numpy as np
import pytest

from cdpr_drake.errors import PlanningError
from cdpr_drake.planning.input_shaping import SHAPERS, make_shaper, shaped_share

W = 7.0  # rad/s


def vibration(shaper, frequency, damping):
    """Amplitude after the last impulse over that after a single one: by superposition."""
    root = np.sqrt(1.0 - damping**2)
    decay = complex(-damping * frequency, frequency * root)
    end = shaper.times[-1]
    return abs(np.sum(shaper.amplitudes * np.exp(decay * (end - shaper.times))))


@pytest.mark.parametrize("kind", SHAPERS)
@pytest.mark.parametrize("damping", [0.0, 0.08])
def test_what_is_left_is_what_the_formula_says(kind, damping):
    shaper = make_shaper(kind, W, damping)
    assert np.sum(shaper.amplitudes) == pytest.approx(1.0)
    assert np.all(shaper.amplitudes > 0.0)
    for frequency in (0.8 * W, W, 1.15 * W):
        np.testing.assert_allclose(
            shaper.left(frequency, damping), vibration(shaper, frequency, damping), atol=1e-12
        )


def test_each_does_what_its_name_says():
    zv, zvd, ei = (make_shaper(kind, W) for kind in SHAPERS)
    assert zv.left(W) < 1e-12
    assert zvd.left(W) < 1e-12
    assert ei.left(W) == pytest.approx(0.05)
    h = 1e-4
    assert abs(zv.left(W + h) - zv.left(W - h)) < 1e-9  # even, with a kink
    assert zv.left(W + h) / h > 0.1
    assert zvd.left(W + h) / h < 1e-3
    # EI stays below its share over a wider range than ZVD.
    around = np.linspace(0.7 * W, 1.3 * W, 601)
    wide = [np.sum([s.left(w) <= 0.05 + 1e-12 for w in around]) for s in (zv, zvd, ei)]
    assert wide[0] < wide[1] < wide[2]
    assert make_shaper("ZV", W, 0.1).left(W, 0.1) < 1e-12
    assert make_shaper("ZVD", W, 0.1).left(W, 0.1) < 1e-12


def test_two_in_turn_take_both_away():
    both = make_shaper("ZV", W).then(make_shaper("ZV", 2.3 * W))
    assert both.left(W) < 1e-12
    assert both.left(2.3 * W) < 1e-12
    assert both.duration == pytest.approx(np.pi / W * (1.0 + 1.0 / 2.3))


def test_a_shaped_law_of_time_goes_from_0_to_1():
    shaper = make_shaper("ZVD", W)
    times = np.linspace(0.0, 0.5 + shaper.duration, 4001)
    s, rate, growth = shaped_share(shaper, 0.5, times)
    assert s[0] == 0.0
    assert s[-1] == pytest.approx(1.0)
    assert np.all(np.diff(s) >= 0.0)
    np.testing.assert_allclose(np.gradient(s, times)[1:-1], rate[1:-1], atol=2e-4)
    np.testing.assert_allclose(np.gradient(rate, times)[1:-1], growth[1:-1], atol=3e-2)


@pytest.mark.parametrize(
    ("kind", "frequency", "damping"),
    [("XY", W, 0.0), ("ZV", 0.0, 0.0), ("ZV", np.nan, 0.0), ("ZVD", W, 0.95), ("EI", W, -0.1)],
)
def test_wrong_numbers_are_refused(kind, frequency, damping):
    with pytest.raises(PlanningError, match="shaper: "):
        make_shaper(kind, frequency, damping)

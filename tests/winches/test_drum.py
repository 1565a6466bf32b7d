"""Drums: the length is the integral of the radius, closed forms of the limits, inverses."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydrake.autodiffutils import ExtractGradient, InitializeAutoDiff
from scipy.integrate import quad

from cdpr_drake.winches.drum import TURN, Drum, drum_angle, drum_radius, wound_length

INVERSE = 1e-10
"""Of an angle of up to 300 rad through length and back [rad]."""

QUADRATURE = 1e-9
"""Of scipy's quadrature of the radius over up to 40 turns, against metres of cable [m]."""

drums = st.builds(
    Drum,
    radius=st.floats(0.01, 0.2),
    gear_ratio=st.floats(1.0, 50.0),
    layer_turns=st.sampled_from([1.0, 1.5, 2.0, 7.0, 20.0, np.inf]),
    layer_height=st.floats(0.0, 0.01),
    wound=st.floats(0.0, 5.0),
)


@given(drum=drums, turns=st.floats(-2.0, 40.0))
def test_the_length_is_the_integral_of_the_radius_and_the_angle_its_inverse(drum, turns):
    phi, kinks = turns * TURN, []
    if np.isfinite(drum.layer_turns):
        whole = np.arange(1, 42) * drum.layer_turns * TURN
        kinks = [x for x in np.sort(np.concatenate([whole, whole - TURN])) if 0.0 < x < phi]
    parts = pairwise([0.0, *kinks, phi])
    total = sum(quad(lambda x: float(drum_radius(drum, np.array(x))), *ends)[0] for ends in parts)
    length = wound_length(drum, np.array(phi))
    assert float(length) == pytest.approx(total, abs=QUADRATURE)
    assert float(drum_angle(drum, length)) == pytest.approx(phi, abs=INVERSE)


@given(drum=drums, angle=st.floats(-300.0, 300.0))
def test_motor_angles_are_the_inverse_of_what_is_paid_out_and_rates_its_derivatives(drum, angle):
    q, step = np.array([angle]), 1e-3
    assert drum.motor_angles(drum.paid_out(q)) == pytest.approx(q, abs=50.0 * INVERSE)
    dual = InitializeAutoDiff(q)[:, 0]
    slope = ExtractGradient(np.atleast_2d(drum.paid_out(dual)).T)[0, 0]
    assert slope == pytest.approx(drum.length_per_angle(q)[0], rel=1e-12)
    first, second = drum.turning(drum.paid_out(q))
    assert first[0] == pytest.approx(slope, rel=1e-9)
    # By forward differences, but where the drum begins or ends to climb in between.
    both = drum.length_per_angle(np.array([angle, angle + step]))
    if drum.turning(drum.paid_out(q + step))[1][0] == second[0]:
        assert second[0] == pytest.approx((both[1] - both[0]) / step, abs=1e-9)


def test_one_layer_is_the_law_of_a_constant_radius():
    drum, q = Drum(radius=0.041, gear_ratio=10.0), np.array([0.0, 1.0, -30.0])
    np.testing.assert_allclose(drum.paid_out(q), 0.0041 * q, rtol=1e-14)
    first, second = drum.turning(np.array([-0.7, 0.0, 2.0]))
    np.testing.assert_allclose(first, 0.0041, rtol=1e-14)
    np.testing.assert_array_equal(second, 0.0)


def test_layers_of_one_turn_are_a_spiral():
    """w = r phi + h phi^2 / (4 pi)."""
    drum = Drum(radius=0.05, gear_ratio=1.0, layer_turns=1.0, layer_height=0.006)
    phi = np.linspace(0.0, 60.0, 7)
    expected = 0.05 * phi + 0.006 * phi**2 / (4.0 * np.pi)
    np.testing.assert_allclose(wound_length(drum, phi), expected, rtol=1e-13)


def test_full_layers_hold_what_circles_and_climbs_hold():
    """Layer j of N turns: N - 1 circles of r + j h and one turn of mean radius r + (j + 1/2) h."""
    r, h, N = 0.04, 0.002, 5
    drum = Drum(radius=r, gear_ratio=1.0, layer_turns=N, layer_height=h)
    per_layer = [TURN * ((N - 1) * (r + j * h) + r + (j + 0.5) * h) for j in range(4)]
    held = wound_length(drum, np.arange(5) * N * TURN)
    np.testing.assert_allclose(held, np.concatenate([[0.0], np.cumsum(per_layer)]), rtol=1e-13)
    np.testing.assert_allclose(drum_radius(drum, np.arange(5) * N * TURN), r + h * np.arange(5))
    # Paying out from an upper layer comes from the larger radius first.
    drum = Drum(radius=0.04, gear_ratio=10.0, layer_turns=3.0, layer_height=0.002, wound=2.0)
    near, far = drum.length_per_angle(np.array([0.0, 200.0]))
    assert near > far >= 0.004


@pytest.mark.parametrize(
    ("layers", "expected"),
    [
        ({}, False), ({"layer_turns": 3.0}, False), ({"layer_height": 0.002}, False),
        ({"layer_turns": 3.0, "layer_height": 0.002}, True),
    ],
)  # fmt: skip
def test_a_drum_without_layers_is_the_default(layers, expected):
    drum = Drum(0.04, 10.0)
    assert (drum.layer_turns, drum.layer_height, drum.wound) == (np.inf, 0.0, 0.0)
    assert Drum(0.04, 10.0, **layers).has_layers() == expected

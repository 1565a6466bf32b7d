"""Winches that fail: kernels and the law on arrays say the same, and stand still or let go."""

import numpy as np
import pytest

from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.winches.failed_winches import (
    fail_winches,
    failed_law,
    held_brakes,
    pack_failing_winches,
)
from cdpr_drake.winches.motor import MODES, winch_motion
from cdpr_drake.winches.motor_kernel import pack_winch, winch_rates

LAW, M = load_robot("acrobot_small").winch_law(), 4
HOME, TENSIONS = np.ones(M), np.array([5.0, 8.0, 3.0, 6.0])
RATES = np.array([0.02, -0.05, 0.03, -0.01])
NONE, JAMMED, POWERLESS = np.zeros(M), np.array([0.0, 1, 0, 0]), np.array([0.0, 0, 1, 0])


def accelerations(mode, jammed, powerless):
    """Of the lengths, by the kernel."""
    whole = pack_failing_winches(LAW, M)
    constants = np.empty_like(whole)
    brakes = fail_winches(whole, NONE, jammed, powerless, constants)
    state = np.concatenate([HOME, RATES, np.full(M, -0.1)][: 2 if mode == "torque" else 3])
    out = np.empty_like(state)
    winch_rates(state, TENSIONS, -0.1 * HOME, brakes, HOME, MODES[mode], constants, out)
    return out[M : 2 * M]


@pytest.mark.parametrize("mode", MODES)
def test_the_kernel_does_what_the_law_says(mode):
    motion = winch_motion(
        failed_law(LAW, JAMMED, POWERLESS), MODES[mode], (HOME, RATES, np.full(M, -0.1)), TENSIONS,
        -0.1 * HOME, held_brakes(NONE, JAMMED), home=HOME,
    )  # fmt: skip
    found = accelerations(mode, JAMMED, POWERLESS)
    # Of what is jammed, rounding of what holds it.
    np.testing.assert_allclose(found, motion.length_acceleration, rtol=1e-9)
    assert motion.torque[2] == 0.0
    assert found[1] == pytest.approx(-RATES[1] / LAW.friction.settling_time, rel=1e-6)


@pytest.mark.parametrize("mode", MODES)
def test_where_nothing_failed_bits_are_those_of_winches_that_cannot(mode):
    state = np.concatenate([HOME, RATES, np.full(M, -0.1)][: 2 if mode == "torque" else 3])
    out = np.empty_like(state)
    winch_rates(state, TENSIONS, -0.1 * HOME, NONE, HOME, MODES[mode], pack_winch(LAW), out)
    assert np.array_equal(accelerations(mode, NONE, NONE), out[M : 2 * M])

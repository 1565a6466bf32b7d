"""Residuals of what failed, and their thresholds beside the tail of the normal distribution."""

import numpy as np
import pytest
from scipy.stats import norm

from cdpr_drake.errors import SensorError
from cdpr_drake.estimation.failure_detection import (
    AlarmRule,
    length_residuals,
    tension_residuals,
    threshold,
    torque_residuals,
)
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.winches.motor import TORQUE, winch_motion


def test_lengths_tell_taut_slack_and_broken_cables_apart():
    stiffness, l0 = np.full(3, 1000.0), np.array([1.0, 1.0, 1.0])
    tensions = np.array([20.0, 0.0, 0.0])
    lengths = np.array([1.02, 0.9, 1.03])  # taut by its law, slack, and longer without a pull
    found = length_residuals(lengths, l0, tensions, stiffness)
    assert found == pytest.approx([0.0, -0.1, 0.03], abs=1e-15)


def test_a_motor_by_its_law_leaves_its_dry_friction():
    law = load_robot("acrobot_small").winch_law()
    zeros, home = np.zeros(2), np.ones(2)
    rates, tensions, torques = np.array([0.02, -0.05]), np.array([5.0, 8.0]), np.array([-0.1, -0.3])
    motion = winch_motion(law, TORQUE, (home, rates, zeros), tensions, torques, zeros, home=home)
    radius, _ = law.drum.turning(zeros)
    left = torque_residuals(
        torques, tensions, motion.speed, motion.acceleration, radius=radius,
        viscous=law.friction.viscous, inertia=law.inertia,
    )  # fmt: skip
    assert left == pytest.approx(np.sign(rates) * law.friction.dry(motion.speed), rel=1e-9)
    without_power = winch_motion(
        law, TORQUE, (home, rates, zeros), tensions, zeros, zeros, home=home
    )
    left = torque_residuals(
        torques, tensions, without_power.speed, without_power.acceleration, radius=radius,
        viscous=law.friction.viscous, inertia=law.inertia,
    )  # fmt: skip
    dry = np.sign(rates) * law.friction.dry(without_power.speed)
    assert left - dry == pytest.approx(torques, rel=1e-9)


def test_wanted_less_measured():
    assert np.array_equal(tension_residuals(np.array([3.0, 2.0]), np.array([3.0, 0.0])), [0.0, 2.0])


def test_the_threshold_gives_as_many_false_alarms_as_it_says():
    """Of normal noise; single samples, so that they can be counted."""
    samples, residuals, accepted = 20_000, 8, 100.0
    limit = threshold(0.3, samples=samples, residuals=residuals, in_a_row=1, false_alarms=accepted)
    noise = 0.3 * np.random.default_rng(1).standard_normal((samples, residuals))
    FOUR_SIGMA = 4.0 * np.sqrt(accepted)  # of a count
    assert np.sum(noise > limit) == pytest.approx(accepted, abs=FOUR_SIGMA)
    three = threshold(0.3, bias=2.0, samples=1e6, residuals=8, in_a_row=3, false_alarms=1e-3)
    assert 8e6 * norm.sf((three - 2.0) / 0.3) ** 3 == pytest.approx(1e-3)


@pytest.mark.parametrize("wrong", ["sigma", "bias", "samples", "in_a_row", "false_alarms"])
def test_numbers_that_make_no_sense(wrong):
    good = {"sigma": 1.0, "samples": 10.0, "residuals": 8, "in_a_row": 2, "false_alarms": 0.1}
    with pytest.raises(SensorError, match=f"{wrong}: found -1"):
        threshold(**(good | {wrong: -1}))


def test_an_alarm_needs_some_in_a_row_and_stays():
    rule, counts, alarms = AlarmRule(1.0, 3), np.zeros(2), []
    for one, other in ((2, 2), (2, 0), (2, 2), (0, 2), (0, 0)):
        counts, now = rule.step(counts, np.array([one, other], float))
        alarms.append(now)
    assert np.array_equal(alarms, [[0, 0], [0, 0], [1, 0], [1, 0], [1, 0]])

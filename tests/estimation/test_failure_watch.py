"""Watches of motors, tension sensors and encoders, beside the laws that they watch."""

import numpy as np
import pytest
from scipy.stats import norm

from cdpr_drake.errors import SensorError
from cdpr_drake.estimation.failure_watch import (
    EncoderWatch,
    MotorWatch,
    count_repeats,
    repeats_in_a_row,
)
from cdpr_drake.models.robot_loader import load_robot

LAW = load_robot("acrobot_large").winch_law()
PERIOD, BANDWIDTH = 2e-3, 60.0
RADIUS = LAW.drum.radii(2)


def watched(power=1.0, blocked=False):
    """Residuals of two motors over 0.4 s, which turn out and in by their law in small steps."""
    watch = MotorWatch(RADIUS, LAW.friction, LAW.inertia, BANDWIDTH, PERIOD)
    memory, torques, tensions = watch.fresh(), np.array([0.08, -0.09]), np.array([12.0, 14.0])
    speeds, inner = np.array([5.0, -5.0]), 20
    found = []
    for _ in range(200):
        memory = watch.step(memory, torques, tensions, RADIUS * speeds)
        found.append(memory[1])
        for _ in range(inner):
            free = power * torques + RADIUS * tensions - LAW.friction.viscous * speeds
            dry = np.sign(speeds) * LAW.friction.dry(speeds)
            speeds = speeds + PERIOD / inner * (free - dry) / LAW.inertia
        if blocked:
            speeds = np.zeros(2)
    return np.array(found), torques, watch


def test_a_motor_that_does_what_it_is_asked_leaves_nothing():
    found, torques, _ = watched()
    OF_STEPS = 0.02  # of the torque: speeds grow within a sample
    assert np.max(np.abs(found)) < OF_STEPS * np.max(np.abs(torques))


def test_without_power_its_torque_is_what_is_missing():
    found, torques, _ = watched(power=0.0)
    fades = np.exp(-BANDWIDTH * 25 * PERIOD)
    assert found[25] == pytest.approx(-torques, rel=2.0 * fades, abs=1e-4)


def test_a_drum_that_is_blocked_takes_what_friction_does_not():
    found, torques, watch = watched(blocked=True)
    free = torques + RADIUS * np.array([12.0, 14.0])
    held = np.clip(free, -LAW.friction.static, LAW.friction.static)
    assert found[-1] == pytest.approx(-(free - held), rel=1e-3)
    assert np.all(watch.stands(np.zeros(2)))


def test_a_bandwidth_that_the_samples_do_not_hold_is_refused():
    with pytest.raises(SensorError, match="bandwidth of a motor's watch: found 600"):
        MotorWatch(RADIUS, LAW.friction, LAW.inertia, 600.0, PERIOD)


def test_readings_that_round_to_the_same_are_no_alarm():
    """Of noise of half a step, in the middle of a step: as many runs as accepted, counted."""
    readings, accepted = 200_000, 20.0
    count = repeats_in_a_row(0.5, 1.0, readings=readings, accepted=accepted)
    noise = np.round(0.5 * np.random.default_rng(3).standard_normal((readings, 1)))
    memory, alarms = np.array([[0.0], [np.nan]]), 0
    for reading in noise:
        memory = count_repeats(memory, reading)
        alarms += int(memory[0, 0] == count - 1)
    assert 2 < count < 30
    assert alarms <= accepted + 4.0 * np.sqrt(accepted)
    assert repeats_in_a_row(0.5, 0.0, readings=readings, accepted=accepted) == 2


@pytest.mark.parametrize(("noise", "step"), [(0.0, 0.0), (0.001, 1.0)])
def test_sensors_whose_readings_say_nothing_are_refused(noise, step):
    with pytest.raises(SensorError, match="watch of frozen sensors: found"):
        repeats_in_a_row(noise, step, readings=1e6, accepted=1e-3)


def test_an_encoder_that_stands_lags_behind_its_drive():
    watch = EncoderWatch(PERIOD, 1.0)
    good, frozen, rate = watch.fresh(1), watch.fresh(1), 0.1
    for k in range(50):
        good = watch.step(good, np.array([1.0 + rate * k * PERIOD]), np.array([rate]))
        frozen = watch.step(frozen, np.array([1.0]), np.array([rate]))
    assert abs(good[0, 0]) < 1e-12
    way = rate * 49 * PERIOD
    assert way * np.exp(-49 * PERIOD) < frozen[0, 0] < way


def test_the_limit_of_torque_is_friction_and_what_sensors_make():
    """Noise of tensions behind the observer has the deviation that the limit counts with."""
    watch = MotorWatch(RADIUS, LAW.friction, LAW.inertia, BANDWIDTH, PERIOD)
    asked = {"samples": 1e6, "in_a_row": 1, "false_alarms": 1e-3}
    exact = watch.limit(0.0, 0.0, **asked)
    assert exact == pytest.approx(LAW.friction.static)
    assert watch.limit(0.24, 0.0, **asked) - exact == pytest.approx(0.24 * RADIUS[0])
    noise, samples, draws = 0.5, 20_000, np.random.default_rng(2)
    tail = norm.isf(1e-3 / (1e6 * 2 * len(RADIUS)))
    sigma = (watch.limit(0.0, noise, **asked) - exact) / tail
    memory, found = watch.fresh(), np.empty((samples, len(RADIUS)))
    for k in range(samples):  # tensions below what friction holds would be hidden by it
        tensions = 5.0 + noise * draws.standard_normal(len(RADIUS))
        memory = watch.step(memory, np.zeros(len(RADIUS)), tensions, RADIUS * 20.0)
        found[k] = memory[1]
    SEEDS = 0.05  # of a standard deviation from so many samples that follow each other
    assert np.std(found[1000:]) == pytest.approx(sigma, rel=SEEDS)

"""Detection of failures: residuals by the laws they watch, limits by the normal distribution."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from pydrake.math import RigidTransform
from scipy.stats import norm

from cdpr_drake.errors import SensorError
from cdpr_drake.estimation.break_detection import (
    BreakRule,
    detectable_tension,
    fresh_memory,
    residual_noise,
    silent_reading,
)
from cdpr_drake.estimation.break_detection_kernel import LIMITS, NAMED, RESIDUALS, break_step
from cdpr_drake.estimation.failure_detection import (
    AlarmRule,
    length_residuals,
    threshold,
)
from cdpr_drake.estimation.failure_watch import (
    EncoderWatch,
    MotorWatch,
    count_repeats,
    repeats_in_a_row,
)
from cdpr_drake.geometry.cable_paths import cable_paths, motion_of
from cdpr_drake.models.robot_loader import load_robot

ROBOT = load_robot("acrobot_large")
CABLES, LAW = ROBOT.cable_set().without_pulleys(), ROBOT.winch_law()
HOME = ROBOT.home.transform()
M = CABLES.count
PERIOD, BANDWIDTH = 2e-3, 60.0
RADIUS = LAW.drum.radii(2)
ACCEPTED = 100.0  # false alarms of a count
FOUR_SIGMA = 4.0 * np.sqrt(ACCEPTED)

limits = partial(threshold, sigma=1.0, samples=10.0, residuals=8, in_a_row=2, false_alarms=0.1)
REFUSALS = {
    **{
        name: (lambda name=name: limits(**{name: -1}), f"{name}: found -1; accepted: a number > 0")
        for name in ("sigma", "samples", "in_a_row", "false_alarms")
    },
    "bias": (lambda: limits(bias=-1), "bias: found -1"),
    "within": (
        lambda: detectable_tension(6e-3, silent=0.3, winding_per_newton=0.02, within=0.0),
        r"detectable_tension: within: found 0\.0",
    ),
    "bandwidth": (
        lambda: MotorWatch(RADIUS, LAW.friction, LAW.inertia, 600.0, PERIOD),
        "bandwidth of a motor's watch: found 600",
    ),
    **{
        f"noise {noise}": (
            lambda noise=noise, step=step: repeats_in_a_row(
                noise, step, readings=1e6, accepted=1e-3
            ),
            "watch of frozen sensors: found",
        )
        for noise, step in ((0.0, 0.0), (0.001, 1.0))
    },
}


@pytest.mark.parametrize(("call", "message"), REFUSALS.values(), ids=REFUSALS.keys())
def test_refusal(call, message):
    with pytest.raises(SensorError, match=message) as caught:
        call()
    assert len(str(caught.value).splitlines()) == 1


# Thresholds.


def test_thresholds_give_as_many_false_alarms_as_they_say():
    """Of normal noise; single samples, so that they can be counted, and the tail of several."""
    draws = np.random.default_rng(1)
    accepted = {"samples": 20_000, "false_alarms": ACCEPTED}
    limit = threshold(0.3, residuals=M, in_a_row=1, **accepted)
    noise = 0.3 * draws.standard_normal((20_000, M))
    assert np.sum(noise > limit) == pytest.approx(ACCEPTED, abs=FOUR_SIGMA)
    three = threshold(0.3, bias=2.0, samples=1e6, residuals=8, in_a_row=3, false_alarms=1e-3)
    assert 8e6 * norm.sf((three - 2.0) / 0.3) ** 3 == pytest.approx(1e-3)
    # The residual of a break is the difference of two lengths, each with noise.
    limit = residual_noise(2e-4, cables=M, **accepted)
    now, then = 2e-4 * draws.standard_normal((2, 20_000, M))
    assert np.sum(now - then > limit) == pytest.approx(ACCEPTED, abs=FOUR_SIGMA)
    silent = silent_reading(0.24, 0.01, samples=1e6, cables=8, false_alarms=1e-3)
    assert 8e6 * norm.sf((silent - 0.24) / 0.01) == pytest.approx(1e-3)
    assert silent_reading(0.0, 0.0, samples=1e6, cables=8, false_alarms=1e-3) == 0.0


def test_an_alarm_needs_some_in_a_row_and_stays():
    rule, counts, alarms = AlarmRule(1.0, 3), np.zeros(2), []
    for residuals in ((2, 2), (2, 0), (2, 2), (0, 2), (0, 0)):
        counts, now = rule.step(counts, np.array(residuals, float))
        alarms.append(now)
    assert np.array_equal(alarms, [[0, 0], [0, 0], [1, 0], [1, 0], [1, 0]])


def test_from_which_tension_on_a_winch_winds_up_enough_in_time():
    """A winch that winds with 1/60 m/s per newton that is missing, while the sensor shows most."""
    least = detectable_tension(6e-3, silent=0.3, winding_per_newton=1.0 / 60.0, within=0.6)
    assert (least - 0.3) / 60.0 * 0.6 == pytest.approx(6e-3)


def test_readings_that_round_to_the_same_are_no_alarm():
    """Of noise of half a step, in the middle of a step: as many runs as accepted, counted."""
    sensors, readings, accepted = 50, 4_000, 20.0
    count = repeats_in_a_row(0.5, 1.0, readings=sensors * readings, accepted=accepted)
    noise = np.round(0.5 * np.random.default_rng(3).standard_normal((readings, sensors)))
    memory, alarms = np.array([np.zeros(sensors), np.full(sensors, np.nan)]), 0
    for row in noise:
        memory = count_repeats(memory, row)
        alarms += int(np.sum(memory[0] == count - 1))
    assert 2 < count < 30
    assert alarms <= accepted + 4.0 * np.sqrt(accepted)
    assert repeats_in_a_row(0.5, 0.0, readings=readings, accepted=accepted) == 2


# Residuals.


def test_lengths_tell_taut_slack_and_broken_cables_apart():
    tensions = np.array([20.0, 0.0, 0.0])
    lengths = np.array([1.02, 0.9, 1.03])  # taut by its law, slack, and longer without a pull
    residuals = length_residuals(lengths, np.ones(3), tensions, np.full(3, 1000.0))
    assert residuals == pytest.approx([0.0, -0.1, 0.03], abs=1e-15)


# Motors and encoders.


def watched(power=1.0, blocked=False):
    """Residuals of two motors over 0.4 s, which turn out and in by their law in small steps."""
    watch = MotorWatch(RADIUS, LAW.friction, LAW.inertia, BANDWIDTH, PERIOD)
    memory, torques, tensions = watch.fresh(), np.array([0.08, -0.09]), np.array([12.0, 14.0])
    speeds, inner, residuals = np.array([5.0, -5.0]), 20, []
    for _ in range(200):
        memory = watch.step(memory, torques, tensions, RADIUS * speeds)
        residuals.append(memory[1])
        for _ in range(inner):
            free = power * torques + RADIUS * tensions - LAW.friction.viscous * speeds
            dry = np.sign(speeds) * LAW.friction.dry(speeds)
            speeds = speeds + PERIOD / inner * (free - dry) / LAW.inertia
        if blocked:
            speeds = np.zeros(2)
    return np.array(residuals), torques, watch


def test_residuals_of_a_motor_are_what_it_lacks_or_what_holds_it():
    """Nothing where it does what it is asked; without power its torque; where it is blocked what
    friction does not take."""
    residuals, torques, watch = watched()
    OF_STEPS = 0.02  # of the torque: speeds grow within a sample
    assert np.max(np.abs(residuals)) < OF_STEPS * np.max(np.abs(torques))
    fades = np.exp(-BANDWIDTH * 25 * PERIOD)
    assert watched(power=0.0)[0][25] == pytest.approx(-torques, rel=2.0 * fades, abs=1e-4)
    free = torques + RADIUS * np.array([12.0, 14.0])
    held = np.clip(free, -LAW.friction.static, LAW.friction.static)
    assert watched(blocked=True)[0][-1] == pytest.approx(-(free - held), rel=1e-3)
    assert np.all(watch.stands(np.zeros(2)))


def test_the_limit_of_torque_is_friction_and_what_sensors_make():
    """Noise of tensions behind the observer has the deviation that the limit counts with."""
    radius = LAW.drum.radii(20)
    watch = MotorWatch(radius, LAW.friction, LAW.inertia, BANDWIDTH, PERIOD)
    rule = {"samples": 1e6, "in_a_row": 1, "false_alarms": 1e-3}
    exact = watch.limit(0.0, 0.0, **rule)
    assert exact == pytest.approx(LAW.friction.static)
    assert watch.limit(0.24, 0.0, **rule) - exact == pytest.approx(0.24 * radius[0])
    noise, samples, draws = 0.5, 2_100, np.random.default_rng(2)
    tail = norm.isf(1e-3 / (1e6 * 2 * len(radius)))
    sigma = (watch.limit(0.0, noise, **rule) - exact) / tail
    memory, residuals = watch.fresh(), np.empty((samples, len(radius)))
    for k in range(samples):  # tensions below what friction holds would be hidden by it
        tensions = 5.0 + noise * draws.standard_normal(len(radius))
        memory = watch.step(memory, np.zeros(len(radius)), tensions, radius * 20.0)
        residuals[k] = memory[1]
    SEEDS = 0.05  # of a standard deviation from so many samples that follow each other
    assert np.std(residuals[100:]) == pytest.approx(sigma, rel=SEEDS)


def test_an_encoder_that_stands_lags_behind_its_drive():
    watch, rate = EncoderWatch(PERIOD, 1.0), 0.1
    good, frozen = watch.fresh(1), watch.fresh(1)
    for k in range(50):
        good = watch.step(good, np.array([1.0 + rate * k * PERIOD]), np.array([rate]))
        frozen = watch.step(frozen, np.array([1.0]), np.array([rate]))
    assert abs(good[0, 0]) < 1e-12
    way = rate * 49 * PERIOD
    assert way * np.exp(-49 * PERIOD) < frozen[0, 0] < way


# Broken cables.


def pose(k):
    """A platform that moves by steps."""
    return RigidTransform(
        HOME.rotation(), HOME.translation() + 1e-3 * k * np.array([1.0, 0.5, 0.3])
    )


def memories(lengths_at, tensions_at, rule):
    """Memories after each of 60 samples, shape (60, rows, m)."""
    memory, rows = fresh_memory(M), []
    for k in range(60):
        bad = break_step(
            motion_of(pose(k)), CABLES.packed(), lengths_at(k), tensions_at(k), np.full(M, 0.3),
            rule.packed(), memory,
        )  # fmt: skip
        assert bad < 0
        rows.append(memory.copy())
    return np.array(rows)


def unstrained(k, tensions, cables=CABLES):
    """Lengths of cables that pull so."""
    return cable_paths(pose(k), cables).lengths / (1.0 + tensions / CABLES.stiffness)


def silent(cable, start, pull):
    return lambda k: np.where((np.arange(M) == cable) & (k >= start), 0.0, pull)


def test_an_exit_point_that_is_wrong_is_no_break_and_its_share_follows_the_turn():
    """Believed points are 3 mm off, and one cable pulls with nothing after a while: its residual
    stays within the limit, which is the bound times |u - u_b|, whatever way it goes. The silent
    cable is just straight: it could pull at any moment."""
    off = np.random.default_rng(3).standard_normal((3, M))
    off *= 3e-3 / np.linalg.norm(off, axis=0)
    true = replace(CABLES, p_WA=CABLES.p_WA + off)
    start, pulls = 5, silent(2, 5, 5.0)
    rule = BreakRule(0.0, 3e-3, 0.0, 3)
    rows = memories(lambda k: unstrained(k, pulls(k), true), pulls, rule)[start:, :, 2]
    u = np.array([cable_paths(pose(k), CABLES).u_W[:, 2] for k in range(60)])
    turned = np.linalg.norm(u - u[start - 1], axis=1)[start:]
    np.testing.assert_allclose(rows[:, LIMITS], 3e-3 * turned, rtol=1e-9)
    # To first order in the error; the rest is its square over the length, and what was stretched.
    SECOND = 2.0 * (3e-3) ** 2 / 0.5 + 5.0 / CABLES.stiffness[2]
    assert np.max(np.abs(rows[:, RESIDUALS]) - 3e-3 * turned) < SECOND
    assert turned[-1] > 0.02


@pytest.mark.parametrize("pull", [1.0, 8.0])
def test_a_broken_one_is_named_when_its_winch_has_wound_up_the_limit(pull):
    speed, begins = 1e-4, 10  # metres a sample

    def lengths(k):
        wound = np.where(np.arange(M) == 6, speed * max(k - begins, 0), 0.0)
        return unstrained(k, np.full(M, pull)) - wound

    named = memories(lengths, silent(6, begins, pull), BreakRule(1e-3, 0.0, 2e-3, 3))[:, NAMED]
    released = unstrained(begins, np.full(M, pull))[6] * pull / CABLES.stiffness[6]
    first = np.argmax(named[:, 6] > 0.0)
    assert first == pytest.approx(begins + (3e-3 - released) / speed + 3, abs=1.5)
    assert np.array_equal(np.flatnonzero(named[-1]), [6])


def test_a_cable_without_length_is_named_in_the_answer():
    X_WP = RigidTransform(HOME.rotation(), CABLES.p_WA[:, 3] - HOME.rotation() @ CABLES.p_PB[:, 3])
    bad = break_step(
        motion_of(X_WP), CABLES.packed(), np.ones(M), np.full(M, 5.0), np.zeros(M),
        BreakRule(1e-3, 0.0, 0.0, 3).packed(), fresh_memory(M),
    )  # fmt: skip
    assert bad == 3

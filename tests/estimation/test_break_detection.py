"""Limits of broken cables beside the tail of the normal distribution, and what is detectable."""

from dataclasses import replace

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
from cdpr_drake.estimation.break_detection_kernel import (
    LIMITS,
    NAMED,
    RESIDUALS,
    break_step,
)
from cdpr_drake.geometry.cable_paths import cable_paths, motion_of
from cdpr_drake.models.robot_loader import load_robot

CABLES = load_robot("acrobot_large").cable_set().without_pulleys()
HOME = load_robot("acrobot_large").home.transform()
M = CABLES.count


def test_a_residual_is_the_difference_of_two_lengths():
    """As many are above by chance as is said, of pairs with the noise of one length each."""
    sigma, samples, accepted = 2e-4, 20_000, 100.0
    limit = residual_noise(sigma, samples=samples, cables=M, false_alarms=accepted)
    now, then = sigma * np.random.default_rng(1).standard_normal((2, samples, M))
    FOUR_SIGMA = 4.0 * np.sqrt(accepted)  # of a count
    assert np.sum(now - then > limit) == pytest.approx(accepted, abs=FOUR_SIGMA)


def test_what_a_sensor_reads_of_nothing():
    found = silent_reading(0.24, 0.01, samples=1e6, cables=8, false_alarms=1e-3)
    assert 8e6 * norm.sf((found - 0.24) / 0.01) == pytest.approx(1e-3)
    assert silent_reading(0.0, 0.0, samples=1e6, cables=8, false_alarms=1e-3) == 0.0


def test_from_which_tension_on_a_winch_winds_up_enough_in_time():
    """A winch that winds with 1/60 m/s per newton that is missing, while the sensor shows most."""
    least = detectable_tension(6e-3, silent=0.3, winding_per_newton=1.0 / 60.0, within=0.6)
    assert (least - 0.3) / 60.0 * 0.6 == pytest.approx(6e-3)
    with pytest.raises(SensorError, match=r"detectable_tension: within: found 0\.0"):
        detectable_tension(6e-3, silent=0.3, winding_per_newton=0.02, within=0.0)


def looks(pose_at, lengths_at, tensions_at, count, rule, silent=0.3):
    """Memories after each of so many samples, shape (count, rows, m)."""
    memory, found = fresh_memory(M), []
    for k in range(count):
        bad = break_step(
            motion_of(pose_at(k)), CABLES.packed(), lengths_at(k), tensions_at(k),
            np.full(M, silent), rule.packed(), memory,
        )  # fmt: skip
        assert bad < 0
        found.append(memory.copy())
    return np.array(found)


def pose(k):
    """A motion of a platform that turns, too."""
    return RigidTransform(
        HOME.rotation(), HOME.translation() + 1e-3 * k * np.array([1.0, 0.5, 0.3])
    )


def taut(k, tensions):
    """Unstrained lengths of cables that pull so."""
    return cable_paths(pose(k), CABLES).lengths / (1.0 + tensions / CABLES.stiffness)


def test_an_exit_point_that_is_wrong_is_no_break_and_its_share_follows_the_turn():
    """Believed points are 3 mm off, and one cable pulls with nothing after a while: its residual
    stays within the limit, which is the bound times |u - u_b|, whatever way it goes."""
    rng = np.random.default_rng(3)
    off = rng.standard_normal((3, M))
    off *= 3e-3 / np.linalg.norm(off, axis=0)
    true = replace(CABLES, p_WA=CABLES.p_WA + off)
    rule, tensions = BreakRule(0.0, 3e-3, 0.0, 3), np.full(M, 5.0)
    silent_from, worst = 5, 0.0

    def pulls(k):
        return np.where((np.arange(M) == 2) & (k >= silent_from), 0.0, tensions)

    def lengths(k):
        """The silent one is just straight: it could pull at any moment."""
        return cable_paths(pose(k), true).lengths / (1.0 + pulls(k) / CABLES.stiffness)

    found = looks(pose, lengths, pulls, 60, rule)
    u = np.array([cable_paths(pose(k), CABLES).u_W[:, 2] for k in range(60)])
    turned = np.linalg.norm(u - u[silent_from - 1], axis=1)[silent_from:]
    np.testing.assert_allclose(found[silent_from:, LIMITS, 2], 3e-3 * turned, rtol=1e-9)
    # To first order in the error; the rest is its square over the length, and what was stretched.
    SECOND = 2.0 * (3e-3) ** 2 / 0.5 + 5.0 / CABLES.stiffness[2]
    worst = np.max(np.abs(found[silent_from:, RESIDUALS, 2]) - 3e-3 * turned)
    assert worst < SECOND
    assert turned[-1] > 0.02


@pytest.mark.parametrize("pull", [1.0, 8.0])
def test_a_broken_one_is_named_when_its_winch_has_wound_up_the_limit(pull):
    rule, speed, begins = BreakRule(1e-3, 0.0, 2e-3, 3), 1e-4, 10  # metres a sample

    def tensions(k):
        return np.where((np.arange(M) == 6) & (k >= begins), 0.0, pull)

    def lengths(k):
        whole = taut(k, np.full(M, pull))
        return whole - np.where(np.arange(M) == 6, speed * max(k - begins, 0), 0.0)

    found = looks(pose, lengths, tensions, 60, rule)
    released = taut(begins, np.full(M, pull))[6] * pull / CABLES.stiffness[6]
    first = np.argmax(found[:, NAMED, 6] > 0.0)
    assert first == pytest.approx(begins + (3e-3 - released) / speed + 3, abs=1.5)
    assert np.array_equal(np.flatnonzero(found[-1, NAMED]), [6])


def test_a_cable_without_length_is_named_in_the_answer():
    packed = CABLES.packed()
    at = RigidTransform(CABLES.p_WA[:, 3] - HOME.rotation() @ CABLES.p_PB[:, 3])
    bad = break_step(
        motion_of(RigidTransform(HOME.rotation(), at.translation())), packed, np.ones(M),
        np.full(M, 5.0), np.zeros(M), BreakRule(1e-3, 0.0, 0.0, 3).packed(), fresh_memory(M),
    )  # fmt: skip
    assert bad == 3

"""Ways of features: where they start and end, how fast they are, and past which corners."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdpr_drake.servoing.feature_plan import PROFILES, FeaturePlan

ROUND_OFF = 1e-12
DIFFERENCE = 1e-6
"""Central differences with a step of 1e-6 of features of order one."""

STEP = 1e-6
START = np.array([0.4, -0.2, 0.1])
FINAL = np.array([0.0, 0.3, 0.1])
CORNERS = np.array([[0.4, 0.3, 0.0], [0.1, 0.3, 0.5]])


@given(st.floats(0.0, 12.0))
def test_the_straight_way_has_constant_speed(time):
    """Servoing thesis (4.5)-(4.7)."""
    plan = FeaturePlan(FINAL, duration=10.0)
    s, rate, _ = plan.at(START, plan.time_needed(START), time)
    share = min(time / 10.0, 1.0)
    np.testing.assert_allclose(s, START + share * (FINAL - START), atol=ROUND_OFF)
    np.testing.assert_allclose(rate, 0.1 * (FINAL - START) * (time < 10.0), atol=ROUND_OFF)


def test_the_slowest_feature_sets_the_time():
    """Servoing thesis (4.4): 0.4 / 0.2 and 0.5 / 0.1."""
    plan = FeaturePlan(FINAL, speeds=np.array([0.2, 0.1, 0.01]))
    assert plan.time_needed(START) == pytest.approx(5.0)
    assert FeaturePlan(START, speeds=np.ones(3)).time_needed(START) == 0.0


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("waypoints", [None, CORNERS])
def test_the_rate_is_the_derivative_of_the_way(profile, waypoints):
    plan = FeaturePlan(FINAL, 4.0, waypoints=waypoints, profile=profile)
    for time in np.linspace(0.07, 3.9, 23):
        rate = plan.at(START, 4.0, time)[1]
        ahead, back = (plan.at(START, 4.0, time + step)[0] for step in (STEP, -STEP))
        np.testing.assert_allclose(rate, (ahead - back) / (2.0 * STEP), atol=DIFFERENCE)


@pytest.mark.parametrize("profile", PROFILES)
def test_a_way_passes_its_waypoints_in_order(profile):
    plan = FeaturePlan(FINAL, 4.0, waypoints=CORNERS, profile=profile)
    way = np.array([plan.at(START, 4.0, time)[0] for time in np.linspace(0.0, 4.0, 4001)])
    nearest = [int(np.argmin(np.linalg.norm(way - corner, axis=1))) for corner in CORNERS]
    assert 0 < nearest[0] < nearest[1] < 4000
    for k, corner in zip(nearest, CORNERS, strict=True):
        assert np.linalg.norm(way[k] - corner) < 2e-3  # two steps at the largest speed
    np.testing.assert_array_equal(way[0], START)
    np.testing.assert_array_equal(way[-1], FINAL)
    assert plan.at(START, 4.0, 5.0)[2] == 2


def test_a_smooth_way_starts_and_ends_at_rest():
    plan = FeaturePlan(FINAL, 4.0, profile="smooth")
    assert not np.any(plan.at(START, 4.0, 0.0)[1])
    assert np.linalg.norm(plan.at(START, 4.0, 4.0 - 1e-6)[1]) < 1e-9


def test_a_second_plan_leaves_out_what_is_passed():
    plan = FeaturePlan(FINAL, 4.0, waypoints=CORNERS)
    np.testing.assert_array_equal(plan.corners(START, 1), np.stack([START, CORNERS[1], FINAL]))
    np.testing.assert_array_equal(plan.corners(START, 2), np.stack([START, FINAL]))
    assert plan.way(START, 2) == pytest.approx(np.linalg.norm(FINAL - START))


def test_a_way_of_no_length_is_at_its_end():
    s, rate, _ = FeaturePlan(FINAL, 4.0).at(FINAL, 4.0, 1.0)
    np.testing.assert_array_equal(s, FINAL)
    assert not np.any(rate)


def test_profiles_have_names():
    assert PROFILES == ("constant", "smooth")


def test_a_way_begins_with_all_of_its_waypoints():
    """Legs of (0, 0.5, 0.1), (0.3, 0, 0.5), (0.1, 0, 0.4) at speeds of (0.1, 0.2, 0.25)."""
    plan = FeaturePlan(FINAL, speeds=np.array([0.1, 0.2, 0.25]), waypoints=CORNERS)
    np.testing.assert_array_equal(plan.corners(START), [START, *CORNERS, FINAL])
    assert plan.time_needed(START) == pytest.approx(0.5 / 0.2 + 0.3 / 0.1 + 0.4 / 0.25)
    assert plan.time_needed(START, 1) == pytest.approx(0.3 / 0.1 + 0.4 / 0.25)
    assert plan.way(START) == pytest.approx(np.sqrt(0.26) + np.sqrt(0.34) + np.sqrt(0.17))
    assert plan.at(START, 4.0, 0.0)[2] == 0


@pytest.mark.parametrize("profile", PROFILES)
def test_a_way_that_takes_no_time_is_at_its_end_at_once(profile):
    s, rate, passed = FeaturePlan(FINAL, 0.0, waypoints=CORNERS, profile=profile).at(
        START, 0.0, 0.0
    )
    np.testing.assert_array_equal(s, FINAL)
    assert not np.any(rate)
    assert passed == 2


def test_a_way_of_half_a_second_is_half_done_after_a_quarter():
    s, rate, _ = FeaturePlan(FINAL, 0.5).at(START, 0.5, 0.25)
    np.testing.assert_allclose(s, 0.5 * (START + FINAL), atol=ROUND_OFF)
    np.testing.assert_allclose(rate, 2.0 * (FINAL - START), atol=ROUND_OFF)


def test_the_middle_of_the_second_leg_is_between_its_corners():
    """At constant speed after all of the first leg and half of the second one."""
    plan = FeaturePlan(FINAL, 4.0, waypoints=CORNERS)
    first, second, third = np.sqrt([0.26, 0.34, 0.17])
    time = 4.0 * (first + 0.5 * second) / (first + second + third)
    s, _, passed = plan.at(START, 4.0, time)
    np.testing.assert_allclose(s, CORNERS.mean(axis=0), atol=ROUND_OFF)
    assert passed == 1
    # A plan from the first corner on has passed one when it starts, and two in its last leg.
    assert plan.at(CORNERS[0], 4.0, 0.1, passed=1)[2] == 1
    assert plan.at(CORNERS[0], 4.0, 3.9, passed=1)[2] == 2

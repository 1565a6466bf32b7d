"""Ways of features, drift of targets against textbook filters, and a camera on two joints."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.sections.perception.head import head_pose
from cdpr_drake.servoing.feature_plan import PROFILES, FeaturePlan
from cdpr_drake.servoing.target_motion import MotionFilter, feature_drift
from cdpr_drake.servoing.turned_view import (
    centre_jacobian,
    centring_rates,
    encoder_turn,
    pointing_angles,
    spiral,
    steady_view,
)
from tests.servoing.servo_cases import PERIOD

ROUND_OFF = 1e-12
STEP = 1e-6
START, FINAL = np.array([0.4, -0.2, 0.1]), np.array([0.0, 0.3, 0.1])
CORNERS = np.array([[0.4, 0.3, 0.0], [0.1, 0.3, 0.5]])
LEGS = np.sqrt([0.26, 0.34, 0.17])


# Ways of features.


@given(st.sampled_from([10.0, 0.5]), st.floats(0.0, 1.2) | st.just(0.5))
def test_the_straight_way_has_constant_speed(duration, share):
    """Servoing thesis (4.5)-(4.7)."""
    plan = FeaturePlan(FINAL, duration)
    s, rate, _ = plan.at(START, plan.time_needed(START), share * duration)
    np.testing.assert_allclose(s, START + min(share, 1.0) * (FINAL - START), atol=ROUND_OFF)
    speed = (FINAL - START) / duration * (share < 1.0)
    np.testing.assert_allclose(rate, speed, atol=ROUND_OFF)


def test_the_slowest_feature_sets_the_time_of_each_leg():
    """Servoing thesis (4.4): 0.4 / 0.2 and 0.5 / 0.1; with waypoints, legs of (0, 0.5, 0.1),
    (0.3, 0, 0.5), (0.1, 0, 0.4) at speeds of (0.1, 0.2, 0.25)."""
    straight = FeaturePlan(FINAL, speeds=np.array([0.2, 0.1, 0.01]))
    assert straight.time_needed(START) == pytest.approx(5.0)
    assert FeaturePlan(START, speeds=np.ones(3)).time_needed(START) == 0.0
    plan = FeaturePlan(FINAL, speeds=np.array([0.1, 0.2, 0.25]), waypoints=CORNERS)
    for passed, corners in enumerate(([*CORNERS], [CORNERS[1]], [])):
        np.testing.assert_array_equal(plan.corners(START, passed), [START, *corners, FINAL])
    np.testing.assert_array_equal(plan.corners(START), [START, *CORNERS, FINAL])
    times = 0.5 / 0.2, 0.3 / 0.1, 0.4 / 0.25
    assert plan.time_needed(START) == pytest.approx(sum(times))
    assert plan.time_needed(START, 1) == pytest.approx(sum(times[1:]))
    assert plan.way(START) == pytest.approx(np.sum(LEGS))
    assert plan.way(START, 2) == pytest.approx(np.linalg.norm(FINAL - START))


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("waypoints", [None, CORNERS])
def test_the_rate_is_the_derivative_of_the_way(profile, waypoints):
    plan = FeaturePlan(FINAL, 4.0, waypoints=waypoints, profile=profile)
    for time in np.linspace(0.07, 3.9, 23):
        ahead, back = (plan.at(START, 4.0, time + step)[0] for step in (STEP, -STEP))
        rate = plan.at(START, 4.0, time)[1]
        np.testing.assert_allclose(rate, (ahead - back) / (2.0 * STEP), atol=1e-6)


@pytest.mark.parametrize("profile", ["constant", "smooth"])
def test_a_way_passes_its_waypoints_in_order(profile):
    plan = FeaturePlan(FINAL, 4.0, waypoints=CORNERS, profile=profile)
    way = np.array([plan.at(START, 4.0, time)[0] for time in np.linspace(0.0, 4.0, 2001)])
    distances = np.linalg.norm(way[:, None] - CORNERS, axis=2)
    nearest = np.argmin(distances, axis=0)
    assert 0 < nearest[0] < nearest[1] < 2000
    assert np.all(np.min(distances, axis=0) < 2e-3)  # two steps at the largest speed
    np.testing.assert_array_equal(way[[0, -1]], [START, FINAL])
    assert (plan.at(START, 4.0, 0.0)[2], plan.at(START, 4.0, 5.0)[2]) == (0, 2)
    # A way that takes no time, or has no length, is at its end at once.
    for start, duration in ((START, 0.0), (FINAL, 4.0)):
        waypoints = CORNERS if duration == 0.0 else None
        none = FeaturePlan(FINAL, duration, waypoints=waypoints, profile=profile)
        s, rate, passed = none.at(start, duration, duration / 4.0)
        np.testing.assert_array_equal(s, FINAL)
        assert not np.any(rate)
        assert passed == (2 if duration == 0.0 else 0)


def test_a_smooth_way_starts_and_ends_at_rest():
    plan = FeaturePlan(FINAL, 4.0, profile="smooth")
    assert not np.any(plan.at(START, 4.0, 0.0)[1])
    assert np.linalg.norm(plan.at(START, 4.0, 4.0 - 1e-6)[1]) < 1e-9


def test_the_middle_of_the_second_leg_is_between_its_corners():
    """At constant speed after all of the first leg and half of the second one."""
    plan = FeaturePlan(FINAL, 4.0, waypoints=CORNERS)
    s, _, passed = plan.at(START, 4.0, 4.0 * (LEGS[0] + 0.5 * LEGS[1]) / np.sum(LEGS))
    np.testing.assert_allclose(s, CORNERS.mean(axis=0), atol=ROUND_OFF)
    assert passed == 1
    # A plan from the first corner on has passed one when it starts, and two in its last leg.
    assert plan.at(CORNERS[0], 4.0, 0.1, passed=1)[2] == 1
    assert plan.at(CORNERS[0], 4.0, 3.9, passed=1)[2] == 2


# Motion of targets.


def textbook(kind, ratio, measured):
    """The same filter with matrices, for one feature."""
    q, T = ratio**2, PERIOD
    if kind == "constant_velocity":
        F, Q, H = np.eye(1), np.array([[q * T]]), np.eye(1)
    else:
        F = np.array([[1.0, T], [0.0, 1.0]])
        Q = q * np.array([[T**3 / 3.0, T**2 / 2.0], [T**2 / 2.0, T]])
        H = np.array([[1.0, 0.0]])
    x, P, rows = np.zeros(len(F)), 1e6 * np.eye(len(F)), []
    for z in measured:
        x, P = F @ x, F @ P @ F.T + Q
        K = P @ H.T / (H @ P @ H.T + 1.0)
        x = x + K[:, 0] * (z - (H @ x)[0])
        P = (np.eye(len(F)) - K @ H) @ P
        rows.append(x[0])
    return np.array(rows)


def estimates(kind, ratio, measured):
    motion = MotionFilter(kind, ratio, PERIOD)
    state, rows = MotionFilter.start(measured.shape[1]), []
    for z in measured:
        b, state = motion.step(state, z)
        rows.append(b)
    return np.array(rows)


VELOCITY, ACCELERATION = "constant_velocity", "constant_acceleration"


@pytest.mark.parametrize("kind", [VELOCITY, ACCELERATION])
@pytest.mark.parametrize("ratio", [0.2, 2.0, 50.0])
def test_filters_are_the_textbook_s(kind, ratio):
    measured = np.random.default_rng(1).standard_normal((200, 3)) + np.linspace(0, 3, 200)[:, None]
    expected = np.array([textbook(kind, ratio, column) for column in measured.T]).T
    np.testing.assert_allclose(estimates(kind, ratio, measured), expected, atol=1e-6)


def test_velocity_is_found_and_an_accelerated_one_needs_the_other_model():
    steady, growing = np.full((300, 1), 0.7), 0.3 * PERIOD * np.arange(300)[:, np.newaxis]
    for kind in (VELOCITY, ACCELERATION):
        assert estimates(kind, 2.0, steady)[-1] == pytest.approx(0.7, abs=1e-6)
    assert growing[-1] - estimates(VELOCITY, 2.0, growing)[-1] > 0.01
    accelerated = estimates(ACCELERATION, 2.0, growing)[-1]
    assert accelerated == pytest.approx(growing[-1], abs=1e-5)


def test_a_difference_is_taken_as_it_is_and_filters_smooth_what_it_does_not():
    noise = np.random.default_rng(3).standard_normal((2000, 1))
    np.testing.assert_array_equal(estimates("difference", 2.0, noise), noise)
    for kind, share in ((VELOCITY, 0.5), (ACCELERATION, 0.6)):
        assert np.std(estimates(kind, 2.0, noise)[200:]) < share * np.std(noise[200:])


def test_the_drift_is_what_the_camera_s_motion_does_not_explain():
    before, own, drift = np.array([0.1, -0.2]), np.array([0.5, 0.25]), np.array([0.3, -0.7])
    now = before + PERIOD * (own + drift)
    np.testing.assert_allclose(feature_drift(now, before, own, PERIOD), drift, atol=1e-12)


# A camera on two joints.

POINT = np.array([0.3, -0.2, 1.4])


def head(angles, X_BM=None, arm=(0.0, 0.0, 0.0)):
    return head_pose(X_BM or RigidTransform(), np.array(arm), np.array(angles))


def image(angles):
    p = head(angles).inverse() @ POINT
    return p[:2] / p[2]


@pytest.mark.parametrize("angles", [(0.0, 0.0), (0.4, -0.3), (-0.7, 0.6)])
def test_jacobian_of_the_middle_by_finite_differences(angles):
    """Central differences of a smooth function: errors of STEP^2 and round-off / STEP."""
    slopes = [
        (image(angles + d) - image(angles - d)) / (2.0 * STEP) for d in STEP * np.eye(2)
    ]  # fmt: skip
    J = centre_jacobian(image(angles), angles[1])
    np.testing.assert_allclose(J, np.transpose(slopes), atol=1e-8)


def test_the_law_takes_the_middle_there_exponentially():
    """As exp(-gain t), but for the damping, of 1e-6 of the rates."""
    angles, period = np.array([0.3, 0.1]), 1e-3
    start = np.linalg.norm(image(angles))
    for _ in range(1000):  # by Heun's method
        first = centring_rates(image(angles), angles[1], 2.0)
        ahead = angles + period * first
        angles = angles + period * (first + centring_rates(image(ahead), ahead[1], 2.0)) / 2.0
    assert np.linalg.norm(image(angles)) == pytest.approx(start * np.exp(-2.0), rel=1e-3)


def test_along_the_axis_of_pan_rates_stay_finite():
    assert np.all(np.isfinite(centring_rates(np.zeros(2), np.pi / 2, 4.0)))
    assert np.max(np.abs(centring_rates(np.array([1e-3, 0.0]), np.pi / 2, 4.0))) < 10.0


@pytest.mark.parametrize("arm", [(0.0, 0.0, 0.0), (0.02, -0.01, 0.05)])
def test_steady_view_is_what_a_camera_at_rest_sees(arm):
    """Whatever the joints are at, and with an arm by the depths of the pose."""
    p_OK = np.array([[-0.03, 0.03, 0.03, -0.03], [-0.03, -0.03, 0.03, 0.03], np.zeros(4)])
    X_C0O = pose_from_angles(np.array([0.3, -0.2, 0.5]), np.array([2.9, 0.1, 0.4]))
    X_C0C = head([0.5, 0.35], RigidTransform(-np.array(arm)), arm)  # C0 is B then
    X_CO = X_C0C.inverse() @ X_C0O
    p_CK, p_C0K = X_CO @ p_OK, X_C0O @ p_OK
    view = steady_view(X_C0C, X_CO, p_CK[:2] / p_CK[2], p_OK)
    assert view[0].IsNearlyEqualTo(X_C0O, 1e-12)
    np.testing.assert_allclose(view[1], p_C0K[:2] / p_C0K[2], atol=1e-12)


@pytest.mark.parametrize("z", [-0.2, 0.001])
def test_no_steady_view_of_what_is_beside_or_behind(z):
    X_C0C = RigidTransform(RotationMatrix.MakeYRotation(1.6))
    X_CO = X_C0C.inverse() @ RigidTransform([0.3, 0.0, z])
    marks = (X_CO.translation()[:2] / X_CO.translation()[2])[:, np.newaxis]
    assert steady_view(X_C0C, X_CO, marks, np.zeros((3, 1))) is None


def test_errors_of_encoders_turn_the_camera_by_no_more():
    """At any angles; of both errors in full it is met."""
    random, turns = np.random.default_rng(3), []
    for at in random.uniform(-1.5, 1.5, (200, 2)):
        wrong = at + random.choice([-1.0, 1.0], 2) * [0.05, 0.08]
        turn = head(at).rotation().inverse() @ head(wrong).rotation()
        turns.append(turn.ToAngleAxis().angle())
    np.testing.assert_allclose(turns, encoder_turn(0.05, 0.08), rtol=1e-9)
    assert encoder_turn(0.05, 0.0) == pytest.approx(0.05)


@pytest.mark.parametrize("point", [POINT, (-0.4, 0.7, 0.3), (0.2, 0.1, -0.5)])
def test_pointing_angles_look_at_a_point(point):
    p = head(pointing_angles(np.array(point))).inverse() @ np.array(point)
    np.testing.assert_allclose(p, [0.0, 0.0, np.linalg.norm(point)], atol=1e-12)


def test_the_search_leaves_nothing_out():
    """Every point within its reach is nearer than half a pitch to the spiral."""
    pitch, reach = 0.3, 1.0
    way = np.array([spiral(t, pitch, 1.0, reach) for t in np.arange(0.0, 10.4, 0.01)])
    assert np.max(np.linalg.norm(way, axis=1)) <= reach
    for point in np.random.default_rng(1).uniform(-0.55, 0.55, (200, 2)):
        assert np.min(np.linalg.norm(way - point, axis=1)) < 0.5 * pitch + 0.02, point

"""Least-norm tensions: balance, bounds, refusal, an independent optimum, published numbers."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from pydrake.math import RigidTransform
from scipy.optimize import linprog, minimize

from cdpr_drake.cable_geometry import gravity_wrench, wrench_matrix
from cdpr_drake.errors import InfeasibleTensionError
from cdpr_drake.poses import rotation_from_angles
from cdpr_drake.tension_program import BALANCE_TOLERANCE, least_norm_tensions

# Servoing thesis, section 1.3.4: the suspended robot of Rennes with its large platform.
EXIT_POINTS = np.array(
    [
        (-0.47, -0.525, 1.165),
        (-0.52, -0.465, 1.165),
        (-0.52, 0.475, 1.165),
        (-0.47, 0.53, 1.165),
        (0.47, 0.53, 1.165),
        (0.52, 0.475, 1.165),
        (0.525, -0.47, 1.165),
        (0.47, -0.52, 1.165),
    ]
).T
ANCHOR_POINTS = np.array(
    [
        (0.0895, -0.087, 0.072),
        (-0.0895, 0.087, 0.0065),
        (-0.0895, -0.087, 0.072),
        (0.0895, 0.087, 0.0065),
        (-0.0895, 0.087, 0.072),
        (0.0895, -0.087, 0.0065),
        (0.0895, 0.087, 0.072),
        (-0.0895, -0.087, 0.0065),
    ]
).T
MASS, GRAVITY = 3.5, 9.81
PUBLISHED_POSE = RigidTransform([0.35, -0.27, 0.45])
PUBLISHED_TENSIONS = np.array([2.08, 2.08, 2.43, 2.58, 3.74, 4.30, 12.76, 13.31])
PRINTED_ROUNDING = 0.005  # [N]; tensions are printed with two decimals

BALANCE = BALANCE_TOLERANCE * MASS * GRAVITY  # [N m, N]; what the function promises
OPTIMUM_TOLERANCE = 1e-5  # [N]; both solvers stop at about 1e-12 of the cost: its root counts
FEASIBILITY_MARGIN = 1e-4  # [N]; two solvers may differ about bounds met to their tolerances
MULTIPLIER_TOLERANCE = 1e-3  # [N]; that, times the condition number of W
CLOSED_FORM_TOLERANCE = 1e-8  # [N]; the pseudo-inverse is exact, the program solved to 1e-9

# An over-constrained robot, cables from above and below, for tensions off their bounds.
BOX_EXITS = np.array([(x, y, z) for x in (-1.0, 1.1) for y in (-0.9, 1.0) for z in (0.0, 1.9)]).T
BOX_ANCHORS = np.array([(x, y, z) for x in (0.1, -0.11) for y in (-0.1, 0.12) for z in (0.08, 0)]).T

poses = st.builds(
    lambda a, p: RigidTransform(rotation_from_angles(np.array(a)), p),
    st.tuples(*[st.floats(-0.05, 0.05)] * 3),
    st.tuples(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1), st.floats(0.2, 0.5)),
)


def suspended(X_WP, p_PCo=(0.0, 0.0, 0.0)):
    W = wrench_matrix(X_WP, EXIT_POINTS, ANCHOR_POINTS)
    return W, gravity_wrench(X_WP, MASS, np.array(p_PCo), GRAVITY)


def bounds(lower, upper, m=8):
    return np.full(m, lower), np.full(m, upper)


def slsqp(W, wrench, lower, upper):
    result = minimize(
        lambda t: t @ t,
        np.full(W.shape[1], 5.0),
        jac=lambda t: 2.0 * t,
        bounds=list(zip(lower, upper, strict=True)),
        constraints={"type": "eq", "fun": lambda t: W @ t + wrench, "jac": lambda t: W},
        method="SLSQP",
        options={"ftol": 1e-13, "maxiter": 500},
    )
    assert result.success
    return result.x


@given(poses)
def test_tensions_balance_the_weight_within_bounds(X_WP):
    W, wrench = suspended(X_WP)
    t = least_norm_tensions(W, wrench, *bounds(0.0, 60.0))
    assert np.linalg.norm(W @ t + wrench) <= BALANCE
    assert np.all(t >= 0.0)
    assert np.all(t <= 60.0)


@settings(max_examples=20)
@given(poses)
def test_tensions_are_the_optimum_that_scipy_finds(X_WP):
    W, wrench = suspended(X_WP)
    lower, upper = bounds(1.0, 60.0)
    t = least_norm_tensions(W, wrench, lower, upper)
    expected = slsqp(W, wrench, lower, upper)
    np.testing.assert_allclose(t, expected, rtol=0.0, atol=OPTIMUM_TOLERANCE)


def test_active_lower_bounds_are_reached_and_never_crossed():
    W, wrench = suspended(PUBLISHED_POSE)
    lower, upper = bounds(2.0, 60.0)
    t = least_norm_tensions(W, wrench, lower, upper)
    assert np.min(t) == pytest.approx(2.0, abs=OPTIMUM_TOLERANCE)
    assert np.all(t >= lower)
    expected = slsqp(W, wrench, lower, upper)
    np.testing.assert_allclose(t, expected, rtol=0.0, atol=OPTIMUM_TOLERANCE)


def test_without_active_bounds_the_optimum_is_the_pseudo_inverse():
    W = wrench_matrix(RigidTransform([0.0, 0.0, 0.9]), BOX_EXITS, BOX_ANCHORS)
    wanted = -W @ np.array([30.0, 31.0, 29.0, 33.0, 30.0, 28.0, 32.0, 30.0])
    t = least_norm_tensions(W, wanted, *bounds(-100.0, 100.0))
    closed_form = -np.linalg.pinv(W) @ wanted
    np.testing.assert_allclose(t, closed_form, rtol=0.0, atol=CLOSED_FORM_TOLERANCE)


def test_the_optimum_satisfies_the_kuhn_tucker_conditions():
    """2 t = W' y + p with p >= 0 only on lower bounds."""
    W, wrench = suspended(PUBLISHED_POSE)
    lower, upper = bounds(1.0, 60.0)
    t = least_norm_tensions(W, wrench, lower, upper)
    on_bound = t <= lower + OPTIMUM_TOLERANCE
    y = np.linalg.lstsq(W[:, ~on_bound].T, 2.0 * t[~on_bound], rcond=None)[0]
    multipliers = 2.0 * t - W.T @ y
    np.testing.assert_allclose(multipliers[~on_bound], 0.0, atol=MULTIPLIER_TOLERANCE)
    # With two more cables than motions, at most two bounds leave y determined.
    assert 0 < np.sum(on_bound) <= 2
    assert np.all(multipliers[on_bound] >= -MULTIPLIER_TOLERANCE)


def test_tensions_scale_with_the_weight():
    W, wrench = suspended(PUBLISHED_POSE)
    t = least_norm_tensions(W, wrench, *bounds(0.0, 60.0))
    for factor in (1e-3, 1e3):
        scaled = least_norm_tensions(W, factor * wrench, *bounds(0.0, 60.0 * factor))
        tolerance = OPTIMUM_TOLERANCE * max(factor, 1.0)
        np.testing.assert_allclose(scaled, factor * t, rtol=0.0, atol=tolerance)


def test_the_published_tensions_balance_the_weight():
    """They do, to the rounding of the print, for a centre of mass anywhere on the z axis of P.

    The platform is not rotated, so the height of its centre of mass makes no moment; the residual
    about Po shows that the thesis has the centre of mass above Po, not off to a side.
    """
    for height in (0.0, 0.035, 0.1):
        W, wrench = suspended(PUBLISHED_POSE, (0.0, 0.0, height))
        allowed = np.sum(np.abs(W), axis=1) * PRINTED_ROUNDING
        assert np.all(np.abs(W @ PUBLISHED_TENSIONS + wrench) <= allowed)


def test_the_published_tensions_would_not_balance_a_centre_of_mass_5_mm_aside():
    for p_PCo in ((0.005, 0.0, 0.0), (0.0, 0.005, 0.0)):
        W, wrench = suspended(PUBLISHED_POSE, p_PCo)
        allowed = np.sum(np.abs(W), axis=1) * PRINTED_ROUNDING
        assert np.any(np.abs(W @ PUBLISHED_TENSIONS + wrench) > allowed)


def test_the_least_norm_is_not_larger_than_that_of_the_published_tensions():
    W, wrench = suspended(PUBLISHED_POSE)
    t = least_norm_tensions(W, wrench, *bounds(0.0, 60.0))
    slack = np.linalg.norm(np.full(8, PRINTED_ROUNDING))
    assert np.linalg.norm(t) <= np.linalg.norm(PUBLISHED_TENSIONS) + slack


wide_poses = st.builds(
    lambda a, p: RigidTransform(rotation_from_angles(np.array(a)), p),
    st.tuples(*[st.floats(-0.4, 0.4)] * 3),
    st.tuples(st.floats(-0.45, 0.45), st.floats(-0.45, 0.45), st.floats(0.0, 0.9)),
)


@given(wide_poses, st.sampled_from([0.0, 0.5, 3.0]), st.sampled_from([10.0, 20.0, 60.0]))
def test_refused_is_what_a_linear_program_cannot_solve(X_WP, lowest, highest):
    W, wrench = suspended(X_WP)
    # The reach beyond (positive) or short of (negative) both bounds that balance needs at least.
    reach = np.ones((8, 1))
    needed = linprog(
        np.append(np.zeros(8), 1.0),
        A_ub=np.block([[-np.eye(8), -reach], [np.eye(8), -reach]]),
        b_ub=np.concatenate([np.full(8, -lowest), np.full(8, highest)]),
        A_eq=np.hstack([W, np.zeros((6, 1))]),
        b_eq=-wrench,
        bounds=[(None, None)] * 9,
    )
    assert needed.success
    assume(abs(needed.fun) > FEASIBILITY_MARGIN)
    if needed.fun < 0.0:
        t = least_norm_tensions(W, wrench, *bounds(lowest, highest))
        assert np.linalg.norm(W @ t + wrench) <= BALANCE
    else:
        with pytest.raises(InfeasibleTensionError):
            least_norm_tensions(W, wrench, *bounds(lowest, highest))


def test_a_pose_outside_the_frame_is_refused():
    W, wrench = suspended(RigidTransform([2.0, 0.0, 0.3]))
    with pytest.raises(InfeasibleTensionError, match=r"0\.\.60 N") as caught:
        least_norm_tensions(W, wrench, *bounds(0.0, 60.0))
    assert "-34.335" in str(caught.value)


@pytest.mark.parametrize(
    ("lower", "upper"),
    [
        (0.0, 5.0),  # too weak for the weight
        (20.0, 60.0),  # cables that pull so much from above lift the platform
        (8.0, 4.0),  # no tension at all
    ],
)
def test_bounds_that_cannot_be_met_are_refused(lower, upper):
    W, wrench = suspended(RigidTransform([0.0, 0.0, 0.3]))
    with pytest.raises(InfeasibleTensionError):
        least_norm_tensions(W, wrench, *bounds(lower, upper))


def test_the_refusal_is_one_line():
    W, wrench = suspended(RigidTransform([2.0, 0.0, 0.3]))
    with pytest.raises(InfeasibleTensionError) as caught:
        least_norm_tensions(W, wrench, *bounds(0.0, 60.0))
    assert len(str(caught.value).splitlines()) == 1


def test_one_cable_that_cannot_pull_aside_is_refused():
    W = np.array([[0.0], [1.0]])
    assert least_norm_tensions(W, np.array([0.0, -3.0]), *bounds(0.0, 5.0, 1)) == pytest.approx(3.0)
    with pytest.raises(InfeasibleTensionError):
        least_norm_tensions(W, np.array([0.1, -3.0]), *bounds(0.0, 5.0, 1))

"""Closed loops and interaction matrices of servo and analysis: plain NumPy, closed forms, bits."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.math import RigidTransform, RollPitchYaw

from cdpr_drake.geometry.poses import exponential, pose_row, rotation_from_vector, rotation_vector
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.servoing.interaction_matrix_kernel import theta_u_into
from cdpr_drake.servoing.pose_features import theta_u_interaction
from cdpr_drake.servoing.visual_features import (
    CameraPoseFeatures,
    HybridFeatures,
    ObjectPoseFeatures,
    PointFeatures,
    sighting,
)
from cdpr_drake.stability.closed_loop_kernel import (
    CONVERGED,
    LEFT_BOX,
    STEP,
    TIMEOUT,
    closed_loops,
)
from cdpr_drake.stability.criterion import ModelAtPose
from cdpr_drake.stability.criterion_kernel import interaction_into
from cdpr_drake.stability.desired_view import FixedObject
from cdpr_drake.stability.perturbation_bounds import BASELINE, PerturbationBounds
from cdpr_drake.stability.perturbation_samples_kernel import draw_perturbations
from cdpr_drake.stability.stability_case import SCHEMES, StabilityCase
from cdpr_drake.stability.verdict import VerdictOptions, judge_stability, worst_perturbations
from tests.stability.stability_cases import (
    ROUNDING,
    moved,
    moved_points,
    pose_of,
    random_poses,
    reference_interaction,
)

EVERYWHERE = (np.full(3, -10.0), np.full(3, 10.0))
TILT = 5e-3  # the midpoint's axes instead of the exponential map, over a whole way, of the start


def spatial_loop_case():
    X_PC = RigidTransform(RollPitchYaw(np.pi, 0.1, -0.2), [-0.06, 0.01, 0.02])
    goal = RigidTransform(RollPitchYaw(0.05, -0.1, 0.1), [0.0, 0.05, 0.4])
    X_CdO = RigidTransform(RollPitchYaw(0.2, 0.1, 0.3), [0.02, -0.03, 0.4])
    cables = load_robot("acrobot_large").cable_set().without_pulleys()
    target = FixedObject(goal @ X_PC @ X_CdO, X_CdO)
    return StabilityCase(cables, "pbvs", X_PC=X_PC, target=target, lever="object")


def planar_loop_case():
    cables = load_robot("planar").cable_set().without_pulleys()
    target = FixedObject(RigidTransform(), RigidTransform())
    return StabilityCase(cables, planar=True, lever="object", target=target)


def turned_camera(degrees, box=EVERYWHERE):
    """A planar loop without a turn to make, whose camera is turned about its axis."""
    case, pose = planar_loop_case(), np.array([[1.0, 0, 0, 0, 0.1, -0.2, 0]])
    d = np.zeros((1, 1, 18 + 6 * case.m))
    d[0, 0, 8] = np.radians(degrees)
    return closed_loops(case, PerturbationBounds(d_theta_pc=d[0, 0, 8]), pose, d, box)


def followed(case, pose, d, steps):
    """|e| over |e| at the start after some steps, and -e' de/dt / |e|^2 at the start."""
    X_WO, X_CdO, X = case.target.X_WO, case.target.X_CdO, pose_of(pose)
    wrong, X_PC_hat = moved_points(case.cables, d), moved(case.X_PC, d[6:9], d[9:12])
    sizes, quotients = [], []
    for _ in range(steps + 1):
        X_CO = (X @ case.X_PC).inverse() @ X_WO
        theta_u = rotation_vector(X_CdO.rotation() @ X_CO.rotation().inverse())
        e = np.concatenate([theta_u, X_CO.translation() - X_CdO.translation()])
        L = reference_interaction(case, theta_u, e[3:], X_CO.translation(), np.eye(3))
        J = ModelAtPose(X, case.cables, case.X_PC, L).camera_jacobian()
        J_hat = ModelAtPose(moved(X, d[:3], d[3:6]), wrong, X_PC_hat, L).camera_jacobian()
        V = -np.linalg.pinv(J) @ J_hat @ np.linalg.solve(L, e)
        sizes.append(np.linalg.norm(e))
        quotients.append(-(e @ L @ V) / (e @ e))
        X = X @ case.X_PC @ exponential(STEP * V) @ case.X_PC.inverse()
    return sizes[-1] / sizes[0], quotients[0]


def test_a_loop_is_that_of_plain_numpy():
    case, poses, bounds = spatial_loop_case(), random_poses(3), BASELINE.scaled(2.0)
    d = np.array([draw_perturbations(pose, bounds, case.m, 2, 5) for pose in poses])
    loops = closed_loops(case, bounds, poses, d, EVERYWHERE, threads=1)
    for n, pose in enumerate(poses):
        for k in range(2):
            share, quotient = followed(case, pose, d[n, k], 300)
            assert loops.falls[n, k] == pytest.approx(quotient, abs=ROUNDING)
            assert (loops.ends[n, k] == CONVERGED) == (share < 1e-3 + TILT)


@pytest.mark.parametrize("case", [spatial_loop_case(), planar_loop_case()], ids=["6", "3"])
def test_a_perfect_model_falls_at_unit_rate(case):
    nothing = np.zeros((4, 1, 18 + 6 * case.m))
    poses = random_poses(4, case.planar)
    loops = closed_loops(case, PerturbationBounds(), poses, nothing, EVERYWHERE)
    assert np.all(loops.ends == CONVERGED)
    assert loops.falls == pytest.approx(np.ones((4, 1)), abs=ROUNDING)
    assert not np.any(loops.rises)


@pytest.mark.parametrize("degrees", [30.0, 80.0, 100.0, 170.0])
def test_a_camera_turned_about_its_axis_has_the_closed_form(degrees):
    """The error's rate is cos G: it converges below 90 deg and no more."""
    loops = turned_camera(degrees)
    assert loops.falls[0, 0] == pytest.approx(np.cos(np.radians(degrees)), abs=ROUNDING)
    assert (loops.ends[0, 0] == CONVERGED) == (degrees < 90.0)


def test_where_it_rises_is_told_and_why_it_ends():
    loops = turned_camera(100.0)
    assert loops.rises[0, 0]
    assert loops.rise_poses[0, 0] == pytest.approx([1.0, 0, 0, 0, 0.1, -0.2, 0])
    near = (np.array([-0.15, -0.25, -1.0]), np.array([0.15, 0.25, 1.0]))
    assert turned_camera(100.0, near).ends[0, 0] == LEFT_BOX
    assert turned_camera(90.0).ends[0, 0] == TIMEOUT


def test_no_loop_rises_at_the_start_where_the_servo_is_certified():
    case, poses, options = spatial_loop_case(), random_poses(6), VerdictOptions(threads=1)
    certified = judge_stability(case, BASELINE, poses, "certified", options)
    assert np.any(certified.stable)
    _, worst = worst_perturbations(case, BASELINE, poses, options)
    loops = closed_loops(case, BASELINE, poses, worst[:, None], EVERYWHERE)
    assert np.all(loops.falls[certified.stable, 0] >= certified.margin[certified.stable])


def test_a_loop_that_starts_at_its_goal_is_there():
    """A thousandth of an error that is rounding is never reached."""
    case = spatial_loop_case()
    X_WP = case.target.X_WO @ case.target.X_CdO.inverse() @ case.X_PC.inverse()
    pose = pose_row(X_WP) + 1e-16
    d = draw_perturbations(pose, BASELINE, case.m, 3, 5)
    loops = closed_loops(case, BASELINE, pose[None], d[None], EVERYWHERE)
    assert np.all(loops.ends == CONVERGED)
    assert np.all(loops.falls == 1.0)


def test_poses_are_rows_of_their_own():
    case, poses = spatial_loop_case(), random_poses(5)
    d = np.array([draw_perturbations(pose, BASELINE, case.m, 1, 5) for pose in poses])
    whole = closed_loops(case, BASELINE, poses, d, EVERYWHERE, threads=2)
    part = closed_loops(case, BASELINE, poses[3:], d[3:], EVERYWHERE, threads=1)
    np.testing.assert_array_equal(whole.falls[3:], part.falls)
    np.testing.assert_array_equal(whole.ends[3:], part.ends)


# Interaction matrices.

PRODUCT = 4e-15  # of a rotation that control has as a product, the analysis as exp(theta u)
POINTS = np.array([[0.1, 0.0, -0.1, 0.0], [0.0, 0.1, 0.0, -0.1], [0.0, 0.0, 0.0, 0.0]])
"""On axes of O, so that no sum for a point's place depends on its order."""
X_CdO = RigidTransform(rotation_from_vector(np.array([3.0, 0.1, -0.2])), [0.02, -0.03, 0.5])
FEATURES = dict(zip(SCHEMES, [
    ObjectPoseFeatures(X_CdO), CameraPoseFeatures(X_CdO), HybridFeatures(X_CdO),
    PointFeatures(POINTS, X_CdO),
], strict=True))  # fmt: skip

vector = st.tuples(*[st.floats(-1.0, 1.0)] * 3).map(np.array)
turns = st.builds(lambda v, size: size * v, vector, st.sampled_from([0.0, 1e-9, 1e-5, 5e-4, 1.5]))


@pytest.mark.parametrize("scheme", SCHEMES)
@given(turn=turns, shift=vector)
@settings(max_examples=40)
def test_control_and_its_analysis_have_the_same_interaction_matrix(scheme, turn, shift):
    R_CO = rotation_from_vector(turn) @ X_CdO.rotation()
    X_CO = RigidTransform(R_CO, X_CdO.translation() + 0.1 * shift)
    R, p = np.ascontiguousarray(R_CO.matrix()), X_CO.translation()
    p_CK = R @ POINTS + p[:, np.newaxis]
    view = sighting(X_CO, p_CK[:2] / p_CK[2])
    _, L = FEATURES[scheme].evaluate(view)
    theta_u = ObjectPoseFeatures(X_CdO).evaluate(view)[0][:3]
    analysis = np.empty_like(L)
    interaction_into(SCHEMES.index(scheme), np.array([theta_u, p, p]), R, POINTS, analysis)
    if scheme in ("pbvs-line", "2.5d"):
        np.testing.assert_allclose(analysis[3:, 3:], L[3:, 3:], rtol=0.0, atol=PRODUCT)
        analysis[3:, 3:] = L[3:, 3:]
    assert analysis.tobytes() == L.tobytes()


@given(turns)
@settings(max_examples=40)
def test_the_inverse_of_theta_u_is_its_inverse(theta_u):
    inverse = np.empty((3, 3))
    theta_u_into(theta_u, inverse, -1.0)
    np.testing.assert_allclose(inverse @ theta_u_interaction(theta_u), np.eye(3), atol=1e-12)

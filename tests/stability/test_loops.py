"""The servo in plain NumPy beside its verdicts; its interaction matrices beside the analysis."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.math import RigidTransform, RollPitchYaw

from cdpr_drake.geometry.poses import rotation_from_vector, rotation_vector
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
from cdpr_drake.stability.criterion import ModelAtPose
from cdpr_drake.stability.criterion_kernel import interaction_into
from cdpr_drake.stability.desired_view import FixedObject
from cdpr_drake.stability.perturbation_bounds import BASELINE
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


def falls(case, pose, d):
    """-e' de/dt / |e|^2 of the servo in plain NumPy, (1.40) and (3.1) of the servoing thesis."""
    X = pose_of(pose)
    X_CO = (X @ case.X_PC).inverse() @ case.target.X_WO
    X_CdO = case.target.X_CdO
    theta_u = rotation_vector(X_CdO.rotation() @ X_CO.rotation().inverse())
    e = np.concatenate([theta_u, X_CO.translation() - X_CdO.translation()])
    L = reference_interaction(case, theta_u, e[3:], X_CO.translation(), np.eye(3))
    wrong, X_PC_hat = moved_points(case.cables, d), moved(case.X_PC, d[6:9], d[9:12])
    J = ModelAtPose(X, case.cables, case.X_PC, L).camera_jacobian()
    J_hat = ModelAtPose(moved(X, d[:3], d[3:6]), wrong, X_PC_hat, L).camera_jacobian()
    return e @ L @ np.linalg.pinv(J) @ J_hat @ np.linalg.solve(L, e) / (e @ e)


def test_errors_fall_at_least_at_the_margin_where_the_servo_is_certified():
    X_PC = RigidTransform(RollPitchYaw(np.pi, 0.1, -0.2), [-0.06, 0.01, 0.02])
    goal = RigidTransform(RollPitchYaw(0.05, -0.1, 0.1), [0.0, 0.05, 0.4])
    X_CdO = RigidTransform(RollPitchYaw(0.2, 0.1, 0.3), [0.02, -0.03, 0.4])
    cables = load_robot("acrobot_large").cable_set().without_pulleys()
    target = FixedObject(goal @ X_PC @ X_CdO, X_CdO)
    case = StabilityCase(cables, "pbvs", X_PC=X_PC, target=target, lever="object")
    poses, options = random_poses(6), VerdictOptions(threads=1)
    certified = judge_stability(case, BASELINE, poses, "certified", options)
    assert np.any(certified.stable)
    _, worst = worst_perturbations(case, BASELINE, poses, options)
    for pose, d, margin in zip(poses, worst, certified.margin, strict=True):
        drawn = draw_perturbations(pose, BASELINE, case.m, 4, 5)
        for perturbation in (d, *drawn):
            assert not margin > 0.0 or falls(case, pose, perturbation) >= margin - ROUNDING


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

"""Control and the analysis of its stability work with the same interaction matrices."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydrake.math import RigidTransform

from cdpr_drake.geometry.poses import rotation_from_vector
from cdpr_drake.servoing.interaction_matrix_kernel import theta_u_into
from cdpr_drake.servoing.pose_features import theta_u_interaction
from cdpr_drake.servoing.visual_features import (
    CameraPoseFeatures,
    HybridFeatures,
    ObjectPoseFeatures,
    PointFeatures,
    sighting,
)
from cdpr_drake.stability.criterion_kernel import interaction_into
from cdpr_drake.stability.stability_case import SCHEMES

ROUNDING = 4e-15
"""Of a rotation matrix that control has as a product, the analysis as exp(theta u)."""

POINTS = np.array([[0.1, 0.0, -0.1, 0.0], [0.0, 0.1, 0.0, -0.1], [0.0, 0.0, 0.0, 0.0]])
"""On axes of O, so that no sum for a point's place depends on its order."""

X_CdO = RigidTransform(rotation_from_vector(np.array([3.0, 0.1, -0.2])), [0.02, -0.03, 0.5])
FEATURES = dict(
    zip(
        SCHEMES,
        [
            ObjectPoseFeatures(X_CdO),
            CameraPoseFeatures(X_CdO),
            HybridFeatures(X_CdO),
            PointFeatures(POINTS, X_CdO),
        ],
        strict=True,
    )
)

coordinate = st.floats(-1.0, 1.0)
vector = st.tuples(coordinate, coordinate, coordinate).map(np.array)
turns = st.builds(lambda v, size: size * v, vector, st.sampled_from([0.0, 1e-9, 1e-5, 5e-4, 1.5]))


@pytest.mark.parametrize("scheme", SCHEMES)
@given(turn=turns, shift=vector)
def test_control_and_its_analysis_have_the_same_interaction_matrix(scheme, turn, shift):
    X_CO = RigidTransform(
        rotation_from_vector(turn) @ X_CdO.rotation(), X_CdO.translation() + 0.1 * shift
    )
    R, p = np.ascontiguousarray(X_CO.rotation().matrix()), X_CO.translation()
    p_CK = R @ POINTS + p[:, np.newaxis]
    marks = p_CK[:2] / p_CK[2]
    _, L = FEATURES[scheme].evaluate(sighting(X_CO, marks))
    theta_u = ObjectPoseFeatures(X_CdO).evaluate(sighting(X_CO, marks))[0][:3]
    found = np.empty_like(L)
    state = np.array([theta_u, p, p])
    interaction_into(SCHEMES.index(scheme), state, R, POINTS, found)
    if scheme in ("pbvs-line", "2.5d"):
        np.testing.assert_allclose(found[3:, 3:], L[3:, 3:], rtol=0.0, atol=ROUNDING)
        found[3:, 3:] = L[3:, 3:]
    assert found.tobytes() == L.tobytes()


@given(turns)
def test_the_inverse_of_theta_u_is_its_inverse(theta_u):
    inverse = np.empty((3, 3))
    theta_u_into(theta_u, inverse, -1.0)
    np.testing.assert_allclose(inverse @ theta_u_interaction(theta_u), np.eye(3), atol=1e-12)

"""Types of motion: their bases, projections, rows, words and equations agree."""

import numpy as np
import pytest

from cdpr_drake.geometry.cable_paths import motion_of
from cdpr_drake.geometry.motion_type import (
    FREE,
    LEVEL,
    MOTION_TYPES,
    MotionType,
    keep_free,
    write_projection,
)
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.geometry.straight_cables import ALL_ROWS, PLANAR_ROWS

X_WP = pose_from_angles([0.1, 0.2, 0.3], [0.4, -0.3, 0.7])
R = X_WP.rotation().matrix()
AXES = [(0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (-2.0, 0.0, 0.0), (0.3, -0.4, 1.0)]
ROUNDING = 1e-14
FREEDOM = {"1T": 1, "2T": 2, "3T": 3, "2T1R": 3, "1R2T": 3, "2R3T": 5, "3R3T": 6}


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("name", MOTION_TYPES)
def test_basis_projection_rows_words_and_equations_say_the_same(name, axis):
    motion = MotionType(name, axis)
    assert motion.freedom == FREEDOM[name]
    B, P = motion.basis(R), np.empty((6, 6))
    assert B.shape == (6, FREEDOM[name])
    np.testing.assert_allclose(B.T @ B, np.eye(motion.freedom), atol=ROUNDING)
    write_projection(motion.packed(), motion_of(X_WP), P)
    np.testing.assert_allclose(P, B @ B.T, atol=ROUNDING)
    if motion.rows is not None:
        np.testing.assert_array_equal(B, np.eye(6)[:, list(motion.rows)])
    assert len(motion.words()) == motion.freedom
    random = np.random.default_rng(0)
    J, w, K = random.normal(size=(4, 6)), random.normal(size=6), random.normal(size=(6, 6))
    np.testing.assert_allclose(motion.columns(J, R), J @ B, atol=ROUNDING)
    np.testing.assert_allclose(motion.components(w, R), B.T @ w, atol=ROUNDING)
    np.testing.assert_allclose(motion.part(K, R), B.T @ K @ B, atol=1e-13)
    x = random.normal(size=motion.freedom)
    np.testing.assert_allclose(motion.twist(x, R), B @ x, atol=ROUNDING)
    H, g = K @ K.T + np.eye(6), random.normal(size=6)
    kept_H, kept_g = H.copy() if motion.is_free else np.tril(H), g.copy()
    keep_free(motion.packed(), motion_of(X_WP), kept_g, kept_H)
    expected = B @ np.linalg.solve(B.T @ H @ B, B.T @ g)  # equations of the free motions
    np.testing.assert_allclose(np.linalg.solve(kept_H, kept_g), expected, atol=1e-12)


def test_a_beam_does_not_turn_about_itself():
    B = MotionType("2R3T", (0.0, 3.0, 0.0)).basis(R)
    np.testing.assert_allclose(R[:, 1] @ B[:3], 0.0, atol=ROUNDING)


def test_bodies_in_space_and_in_a_level_plane_are_what_they_were():
    assert FREE.rows == ALL_ROWS
    assert LEVEL.rows == PLANAR_ROWS
    assert LEVEL.is_horizontal_body
    assert not MotionType("2T1R", (0.0, 1.0, 0.0)).is_horizontal_body
    assert MotionType("1R2T", (0.0, 1.0, 0.0)).rows == (1, 3, 5)
    assert LEVEL.words() == ("moment about z", "force along x", "force along y")
    assert MotionType("2T", (0.0, 1.0, 0.0)).words() == ("force along x", "force along z")

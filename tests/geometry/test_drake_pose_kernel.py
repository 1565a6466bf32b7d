"""The kernels of poses give Drake's numbers, to the last bit."""

import math

import numpy as np
import pytest
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.geometry.drake_pose_kernel import (
    compose,
    invert,
    pack_rows,
    pose_of_floating,
    project,
    square_sum,
    unpack_rows,
)
from cdpr_drake.geometry.poses import euclidean_length
from tests.processors import needs_fused_products

COUNT = 500

pytestmark = needs_fused_products


def columns(X):
    return np.asarray(X.GetAsMatrix34().ravel("F"))


def poses(random):
    for state in random.standard_normal((COUNT, 7)):
        q = state[:4] / euclidean_length(state[:4])
        yield state, RigidTransform(quaternion=Quaternion(q), p=state[4:])


def test_poses_of_states_products_and_inverses():
    random, out = np.random.default_rng(1), np.zeros(12)
    before = RigidTransform()
    for state, X in poses(random):
        pose_of_floating(state, out)
        np.testing.assert_array_equal(out, columns(X))
        compose(columns(before), columns(X), out)
        np.testing.assert_array_equal(out, columns(before @ X))
        invert(columns(X), out)
        np.testing.assert_array_equal(out, columns(X.inverse()))
        assert math.sqrt(square_sum(state, 4, 7)) == euclidean_length(state[4:])
        before = X


@pytest.mark.parametrize("exponent", [-17, -16, -12, -6, -2])
def test_nearest_rotations(exponent):
    """Near one, where states round, and farther, where sweeps are many."""
    random, out = np.random.default_rng(2), np.zeros(12)
    for _, X in poses(random):
        rough = X.rotation().matrix() + 10.0**exponent * random.standard_normal((3, 3))
        nearest = RotationMatrix.ProjectToRotationMatrix(rough).matrix()
        project(np.ascontiguousarray(rough).ravel(), 0, True, out)
        np.testing.assert_array_equal(out[:9], nearest.ravel("F"))
        project(rough.ravel("F"), 0, False, out)
        np.testing.assert_array_equal(out[:9], nearest.ravel("F"))


def test_nearest_rotations_of_quarter_turns():
    """Zeros, where sweeps leave out turns and equal sizes are sorted."""
    out = np.zeros(12)
    for k in range(64):
        R = RotationMatrix.MakeXRotation(k % 4 * math.pi / 2)
        R = R @ RotationMatrix.MakeYRotation(k // 4 % 4 * math.pi / 2)
        R = R @ RotationMatrix.MakeZRotation(k // 16 * math.pi / 2)
        for M in (R.matrix(), np.round(R.matrix())):
            project(np.ascontiguousarray(M).ravel(), 0, True, out)
            nearest = RotationMatrix.ProjectToRotationMatrix(M).matrix()
            np.testing.assert_array_equal(out[:9], nearest.ravel("F"))


def test_packed_poses_come_back():
    random, packed, out = np.random.default_rng(3), np.zeros(20), np.zeros(12)
    for _, X in poses(random):
        pack_rows(columns(X), packed, 5)
        np.testing.assert_array_equal(packed[5:14].reshape(3, 3), X.rotation().matrix())
        unpack_rows(packed, 5, out)
        again = RotationMatrix.ProjectToRotationMatrix(X.rotation().matrix())
        np.testing.assert_array_equal(out, columns(RigidTransform(again, X.translation())))

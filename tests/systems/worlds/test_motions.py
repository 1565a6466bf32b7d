"""Motions of bodies: velocities and accelerations against finite differences of their poses."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

from cdpr_drake.geometry.poses import rotation_vector
from cdpr_drake.systems.worlds.motions import JointedBody, PathBody, SteadyBody
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory

STEP = 1e-4
"""Of central differences [s]; their error is its square times third derivatives of order 100."""

DIFFERENCES = 1e-5
"""What that and rounding leave [m/s, rad/s and per s^2]."""

START = RigidTransform(RollPitchYaw(0.3, -0.2, 0.5), [1.0, -0.5, 0.7])
END = RigidTransform(RollPitchYaw(-0.4, 0.6, 0.1), [0.2, 0.4, 1.1])

MOTIONS = {
    "steady": SteadyBody(START, np.array([0.3, -0.1, 0.2]), np.array([0.5, 0.2, -0.4])),
    "waypoints": PathBody(PoseTrajectory((START, END), (1.5,))),
    "repeated": PathBody(PoseTrajectory((START, END, START), (0.4, 0.3)), repeat=True),
    "joint": JointedBody(
        START, np.array([0.5, 0.5, 2.0]), np.array([0.0, 3.0, 1.0]),
        rate=0.7, amplitude=0.4, period=1.3,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", MOTIONS)
def test_velocity_and_acceleration_are_derivatives_of_the_pose(name):
    motion, time, h = MOTIONS[name], 0.83, STEP
    before, now, after = (motion.at(time + k * h) for k in (-1, 0, 1))
    row = motion.motion(time)
    np.testing.assert_allclose(row[4:7], now.translation(), atol=1e-12)
    v = (after.translation() - before.translation()) / (2.0 * h)
    turned = rotation_vector(after.rotation() @ before.rotation().inverse())
    np.testing.assert_allclose(row[7:10], turned / (2.0 * h), atol=DIFFERENCES)
    np.testing.assert_allclose(row[10:13], v, atol=DIFFERENCES)
    rates = (motion.motion(time + h)[7:13] - motion.motion(time - h)[7:13]) / (2.0 * h)
    np.testing.assert_allclose(row[13:], rates, atol=DIFFERENCES * 10.0)
    assert motion.is_moving()


def test_what_rests_does_not_move():
    still = SteadyBody(START, np.zeros(3), np.zeros(3))
    assert not still.is_moving()
    assert not JointedBody(
        START, np.zeros(3), np.ones(3), rate=0.0, amplitude=0.0, period=1.0
    ).is_moving()
    np.testing.assert_array_equal(still.motion(3.0)[7:], np.zeros(12))


def test_a_joint_keeps_the_distance_from_its_axis():
    motion, point, axis = MOTIONS["joint"], np.array([0.5, 0.5, 2.0]), np.array([0.0, 3.0, 1.0])
    axis /= np.linalg.norm(axis)
    for time in (0.0, 0.4, 2.7):
        arm = motion.at(time).translation() - point
        start = START.translation() - point
        assert arm @ axis == pytest.approx(start @ axis, abs=1e-12)
        assert np.linalg.norm(arm) == pytest.approx(np.linalg.norm(start), abs=1e-12)

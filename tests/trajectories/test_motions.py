"""Motions from pose to pose, of plants, from samples: boundary values, differences, files."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RevoluteJoint, SpatialInertia
from scipy.interpolate import BPoly

from cdpr_drake.geometry.poses import pose_from_angles, rotation_from_vector, rotation_vector
from cdpr_drake.trajectories.plant_motion import PlantMotion
from cdpr_drake.trajectories.pose_trajectory import MOTION_SIZE, PoseTrajectory, motion_row
from cdpr_drake.trajectories.sampled_motion import (
    MOTION_COLUMNS,
    TIME_COLUMN,
    read_motion,
    sampled_motion,
)

ROUNDING = 1e-13  # a dozen products of numbers of order one
DIFFERENCE = 1e-7
"""Central differences with a step of 1e-4 s of motions that last seconds and have derivatives of
order one leave h^2 / 6 times the third derivative, some 1e-8, and round-off 1e-16 / h."""
STEP = 1e-4

# From pose to pose.

HOME = pose_from_angles(np.array([0.1, -0.2, 0.4]), np.array([0.3, -0.2, 0.5]))
AWAY = pose_from_angles(np.array([-0.3, 0.5, 0.9]), np.array([-0.4, 0.6, -0.1]))
LAST = pose_from_angles(np.array([0.0, 0.4, 0.6]), np.array([0.1, 0.1, 1.2]))
TRAJECTORY = PoseTrajectory((HOME, AWAY, AWAY, LAST), (3.0, 1.0, 2.0), start_time=0.5)

vector = st.tuples(*[st.floats(-3.0, 3.0)] * 3).map(np.array)
poses = st.builds(
    lambda turn, p: RigidTransform(rotation_from_vector(turn * (3.0 / 5.2)), p), vector, vector
)


def test_rest_to_rest_law_is_the_quintic_with_nothing_at_its_ends():
    """The trajectory's s(t) = 10 x^3 - 15 x^4 + 6 x^5, x = t / T."""
    T = 4.0
    law = BPoly.from_derivatives([0.0, T], [np.zeros(3), [1.0, 0.0, 0.0]])
    line = PoseTrajectory((RigidTransform(), RigidTransform([1.0, 0.0, 0.0])), (T,))
    for time in np.linspace(0.0, T, 17):
        row = line.motion(time)
        expected = [law(time, nu=k) for k in range(3)]
        np.testing.assert_allclose(row[[4, 10, 16]], expected, atol=ROUNDING)


@pytest.mark.parametrize(
    ("time", "X"), [(-1.0, HOME), (0.5, HOME), (3.5, AWAY), (4.1, AWAY), (6.5, LAST), (99.0, LAST)]
)
def test_rests_in_its_poses_and_outside_its_time(time, X):
    assert TRAJECTORY.end_time == 6.5
    assert TRAJECTORY.pose(time).IsNearlyEqualTo(X, ROUNDING)
    np.testing.assert_allclose(TRAJECTORY.velocity(time), np.zeros(6), atol=ROUNDING)
    np.testing.assert_allclose(TRAJECTORY.acceleration(time), np.zeros(6), atol=ROUNDING)


@given(poses, poses, st.floats(0.01, 0.99))
@settings(max_examples=40)
def test_derivatives_are_those_of_the_pose_the_way_is_straight_and_the_axis_fixed(
    X_WS, X_WE, share
):
    T = 5.0
    trajectory, time = PoseTrajectory((X_WS, X_WE), (T,)), share * T
    before, after = trajectory.pose(time - STEP), trajectory.pose(time + STEP)
    turn = rotation_vector(after.rotation() @ before.rotation().inverse())
    rate = np.concatenate([turn, after.translation() - before.translation()]) / (2.0 * STEP)
    np.testing.assert_allclose(trajectory.velocity(time), rate, atol=DIFFERENCE)
    change = trajectory.velocity(time + STEP) - trajectory.velocity(time - STEP)
    found = trajectory.acceleration(time)
    np.testing.assert_allclose(found, change / (2.0 * STEP), atol=DIFFERENCE)
    X, s = trajectory.pose(time), share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    line = X_WS.translation() + s * (X_WE.translation() - X_WS.translation())
    np.testing.assert_allclose(X.translation(), line, atol=ROUNDING)
    turn_P = s * rotation_vector(X_WS.rotation().inverse() @ X_WE.rotation())
    turned = X_WS.rotation() @ rotation_from_vector(turn_P)  # (A.18), (A.19)
    assert np.max(np.abs(X.rotation().matrix() - turned.matrix())) < ROUNDING


def test_axis_of_a_turned_start_is_expressed_in_the_world():
    """(A.20) taken literally would turn about the axis in the first pose of P."""
    start = rotation_from_vector([np.pi / 2.0, 0.0, 0.0])
    end = start @ rotation_from_vector([0.0, 0.0, 1.0])  # z of P is -y of W
    trajectory = PoseTrajectory((RigidTransform(start), RigidTransform(end)), (1.0,))
    w = trajectory.velocity(0.5)[:3]
    np.testing.assert_allclose(w / np.linalg.norm(w), [0.0, -1.0, 0.0], atol=ROUNDING)


def test_half_a_turn_arrives():
    X_WE = RigidTransform(rotation_from_vector([0.0, np.pi, 0.0]))
    trajectory = PoseTrajectory((RigidTransform(), X_WE), (1.0,))
    assert trajectory.pose(1.0).IsNearlyEqualTo(X_WE, ROUNDING)


def test_motion_row_has_pose_velocity_and_acceleration():
    row = TRAJECTORY.motion(1.7)
    assert row.shape == (MOTION_SIZE,)
    again = motion_row(TRAJECTORY.pose(1.7), TRAJECTORY.velocity(1.7), TRAJECTORY.acceleration(1.7))
    again[:4] *= np.sign(again[:4] @ row[:4])
    np.testing.assert_allclose(again, row, atol=ROUNDING)


# Of a plant.


@pytest.fixture(scope="module")
def plant_motion():
    """A free body with an arm, and its motion through three waypoints."""
    plant = MultibodyPlant(0.0)
    inertia = SpatialInertia.SolidSphereWithMass(1.0, 0.2)
    body, arm = plant.AddRigidBody("body", inertia), plant.AddRigidBody("arm", inertia)
    frames = body.body_frame(), arm.body_frame()
    plant.AddJoint(RevoluteJoint("hinge", *frames, [0.0, 1.0, 0.0], 0.0))
    plant.Finalize()
    assert plant.GetJointByName("hinge").velocity_start() == 6
    waypoints = (
        ([0, 0, 0], [0, 0, 1], 0.1), ([0.4, -0.3, 1.0], [0.2, -0.1, 1.3], -0.7),
        ([-0.2, 0.9, 2.5], [0, 0.5, 1], 0.4),
    )  # fmt: skip
    rows = [[*RollPitchYaw(a).ToQuaternion().wxyz(), *p, angle] for a, p, angle in waypoints]
    rows_of_v = np.array([-1, -1, -1, -1, 3, 4, 5, 6])
    return plant, PlantMotion(np.array([0.0, 1.0, 2.5]), np.array(rows), rows_of_v, [(0, 0)])


@pytest.mark.parametrize("time", [0.3, 0.77, 1.4, 2.2])
def test_rates_are_the_derivatives_of_positions(plant_motion, time):
    plant, motion = plant_motion
    context, step = plant.CreateDefaultContext(), 1e-5
    (q0, v0, _), (q, v, a), (q1, v1, _) = (motion.at(time + d) for d in (-step, 0.0, step))
    plant.SetPositions(context, q)
    rates = plant.MapQDotToVelocity(context, (q1 - q0) / (2.0 * step))
    np.testing.assert_allclose(v, rates, atol=DIFFERENCE)
    np.testing.assert_allclose(a, (v1 - v0) / (2.0 * step), atol=DIFFERENCE)
    plant.SetVelocities(context, v)
    V = plant.EvalBodySpatialVelocityInWorld(context, plant.GetBodyByName("body"))
    np.testing.assert_allclose([*V.rotational(), *V.translational()], v[:6], atol=1e-12)


def test_it_rests_at_waypoints_before_and_after_and_turns_about_one_axis(plant_motion):
    """Spherical linear interpolation: half of the way is half of the turn."""
    _, motion = plant_motion
    assert motion.end_time == 2.5
    for k, time in ((0, -1.0), (0, 0.0), (1, 1.0), (2, 2.5), (2, 9.0)):
        q, v, a = motion.at(time)
        q[:4] *= np.sign(q[:4] @ motion.positions[k][:4])
        np.testing.assert_allclose(q, motion.positions[k], atol=1e-14)
        assert not np.any(v)
        assert not np.any(a)
    half = motion.at(0.5)[0][:4]  # the quintic law is at 1/2 there
    ends = motion.positions[0][:4], motion.positions[1][:4]
    middle = ends[0] + ends[1] * np.sign(ends[0] @ ends[1])
    np.testing.assert_allclose(abs(half @ middle / np.linalg.norm(middle)), 1.0, atol=1e-14)


# From samples, and files of them.

SHORT = PoseTrajectory(
    (
        pose_from_angles(np.array([0.0, 0.0, 0.2]), np.zeros(3)),
        pose_from_angles(np.array([0.3, -0.2, 0.5]), np.radians([40.0, -30.0, 170.0])),
    ),
    (1.2,), 0.1,
)  # fmt: skip
TIMES = np.append(np.arange(100, 1300) / 1000.0, 1.3)
ROWS = np.array([SHORT.motion(t) for t in TIMES])


def table(path, columns=MOTION_COLUMNS):
    lines = [",".join(("extra", *columns, TIME_COLUMN))]
    for t, row in zip(TIMES[::100], ROWS[::100], strict=True):
        lines.append(",".join(["7", *map(repr, row.tolist()), repr(float(t))]))
    path.write_text("\n".join(lines) + "\n")
    return path


def test_samples_are_met_with_both_derivatives():
    motion = sampled_motion(TIMES, ROWS)
    assert (motion.start_time, motion.end_time) == (TIMES[0], pytest.approx(TIMES[-1]))
    # At every instant of control, whichever side of a sample rounding puts it.
    for t, row in zip(TIMES[1:-1:5], ROWS[1:-1:5], strict=True):
        for instant in (np.nextafter(t, 0.0), t, np.nextafter(t, 2.0)):
            found = motion.motion(instant)
            found[:4] *= np.sign(found[:4] @ row[:4])
            np.testing.assert_allclose(found, row, rtol=0.0, atol=1e-9 * np.max(np.abs(ROWS)))
    between = TIMES[:-1] + 0.4e-3
    found, expected = (np.array([one.motion(t)[4:13] for t in between]) for one in (motion, SHORT))
    np.testing.assert_allclose(found, expected, atol=1e-8)
    np.testing.assert_allclose(motion.motion(5.0)[7:], 0.0)


def test_coarse_samples_make_a_smooth_motion_and_a_file_says_the_same(tmp_path):
    coarse = sampled_motion(TIMES[::100], ROWS[::100])
    far = [np.linalg.norm(coarse.motion(t)[4:7] - SHORT.motion(t)[4:7]) for t in TIMES]
    assert max(far) < 1e-6
    file = table(tmp_path / "m.csv")
    np.testing.assert_array_equal(coarse.motion(0.7321), read_motion(file).motion(0.7321))
    later = read_motion(file, 0.5)
    np.testing.assert_allclose(later.motion(1.2321), coarse.motion(0.7321), atol=1e-12)

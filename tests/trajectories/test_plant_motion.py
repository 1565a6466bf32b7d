"""The motion of a plant through waypoints: derivatives, rests, turns, refusals."""

import numpy as np
import pytest
from pydrake.math import RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RevoluteJoint, SpatialInertia

from cdpr_drake.errors import TrajectoryError
from cdpr_drake.trajectories.plant_motion import PlantMotion

STEP = 1e-5
"""Of central differences [s]."""

DIFFERENCES = 1e-7
"""Of rates up to 10 by these differences: third derivatives times the step squared, and rounding
over the step; found 1e-9."""


@pytest.fixture(scope="module")
def moved():
    """A free body with an arm, and its motion through three waypoints."""
    plant = MultibodyPlant(0.0)
    inertia = SpatialInertia.SolidSphereWithMass(1.0, 0.2)
    body, arm = plant.AddRigidBody("body", inertia), plant.AddRigidBody("arm", inertia)
    plant.AddJoint(
        RevoluteJoint("hinge", body.body_frame(), arm.body_frame(), [0.0, 1.0, 0.0], 0.0)
    )
    plant.Finalize()
    quaternions = [RollPitchYaw(a).ToQuaternion().wxyz() for a in
                   ([0, 0, 0], [0.4, -0.3, 1.0], [-0.2, 0.9, 2.5])]  # fmt: skip
    rows = [
        np.concatenate([quaternion, position, [angle]])
        for quaternion, position, angle in zip(
            quaternions, ([0, 0, 1], [0.2, -0.1, 1.3], [0, 0.5, 1]), (0.1, -0.7, 0.4), strict=True
        )
    ]
    assert plant.GetJointByName("hinge").velocity_start() == 6
    rows_of_v = np.array([-1, -1, -1, -1, 3, 4, 5, 6])
    return plant, PlantMotion(np.array([0.0, 1.0, 2.5]), np.array(rows), rows_of_v, [(0, 0)])


@pytest.mark.parametrize("time", [0.3, 0.77, 1.4, 2.2])
def test_rates_are_the_derivatives_of_positions(moved, time):
    plant, motion = moved
    context = plant.CreateDefaultContext()
    (q0, v0, _), (q, v, a), (q1, v1, _) = (motion.at(time + d) for d in (-STEP, 0.0, STEP))
    plant.SetPositions(context, q)
    rates = plant.MapQDotToVelocity(context, (q1 - q0) / (2.0 * STEP))
    np.testing.assert_allclose(v, rates, atol=DIFFERENCES)
    np.testing.assert_allclose(a, (v1 - v0) / (2.0 * STEP), atol=DIFFERENCES)
    plant.SetVelocities(context, v)
    body = plant.GetBodyByName("body")
    found = plant.EvalBodySpatialVelocityInWorld(context, body)
    np.testing.assert_allclose(found.rotational(), v[:3], atol=1e-12)
    np.testing.assert_allclose(found.translational(), v[3:6], atol=1e-12)


def test_it_rests_at_waypoints_before_and_after(moved):
    _, motion = moved
    assert motion.end_time == 2.5
    for k, time in ((0, -1.0), (0, 0.0), (1, 1.0), (2, 2.5), (2, 9.0)):
        q, v, a = motion.at(time)
        sign = np.sign(q[:4] @ motion.positions[k][:4])
        np.testing.assert_allclose(sign * q[:4], motion.positions[k][:4], atol=1e-14)
        np.testing.assert_allclose(q[4:], motion.positions[k][4:], atol=1e-14)
        assert not np.any(v)
        assert not np.any(a)


def test_a_body_turns_about_one_axis(moved):
    """Spherical linear interpolation: half of the way is half of the turn."""
    _, motion = moved
    half = motion.at(0.5)[0][:4]  # the quintic law is at 1/2 there
    ends = motion.positions[0][:4], motion.positions[1][:4]
    middle = ends[0] + ends[1] * np.sign(ends[0] @ ends[1])
    np.testing.assert_allclose(abs(half @ middle / np.linalg.norm(middle)), 1.0, atol=1e-14)


@pytest.mark.parametrize("times", [[0.0], [0.0, 0.0], [0.0, 2.0, 1.0]])
def test_times_must_grow(times):
    with pytest.raises(TrajectoryError, match="two or more that grow"):
        PlantMotion(np.array(times), np.zeros((len(times), 1)), np.array([0]))

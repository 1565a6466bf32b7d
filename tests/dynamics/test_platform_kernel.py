"""One rigid body by Newton and Euler: MultibodyPlant is the oracle."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import PlanarJoint, RotationalInertia, SpatialInertia, UnitInertia

from cdpr_drake.dynamics.platform_kernel import floating_rates, mass_in_world, planar_rates
from cdpr_drake.dynamics.robot_arrays import Drive, pack_robot
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.motion_type import FREE, LEVEL
from cdpr_drake.geometry.platform_joint import PlatformJoint
from cdpr_drake.models.robot_in_plant import pose_on_joint
from cdpr_drake.statics.rigid_platform import RigidPlatform

ROUNDING = 1e-10
"""Relative difference of accelerations; both solve the same 6 x 6 system, not in the same order."""

CABLES = CableSet.make(np.eye(3), np.zeros((3, 3)), 1.0)


def random_platform(random, planar):
    """Mass, centre and inertia of a body of five random points: any that can exist."""
    points = random.uniform(-0.3, 0.3, (5, 3))
    masses = random.uniform(0.1, 2.0, 5)
    if planar:
        points[:, 2] *= 0.1
    mass = masses.sum()
    com = masses @ points / mass
    I_PPo = sum(
        m * (p @ p * np.eye(3) - np.outer(p, p)) for m, p in zip(masses, points, strict=True)
    )
    return RigidPlatform(mass, com, I_PPo, random.uniform(0.0, 12.0), LEVEL if planar else FREE)


def spatial_inertia(platform):
    I = platform.I_PPo  # noqa: E741
    unit = UnitInertia()
    unit.SetFromRotationalInertia(
        RotationalInertia(I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2]), platform.mass
    )
    return SpatialInertia(platform.mass, platform.p_PCo, unit)


def plant_rates(platform, state, force):
    plant = MultibodyPlant(0.0)
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, -platform.gravity])
    body = plant.AddRigidBody("platform", spatial_inertia(platform))
    if platform.motion.is_plane:
        joint = PlanarJoint("plane", plant.world_frame(), body.body_frame(), np.zeros(3))
        plant.AddJoint(joint)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    plant.SetPositionsAndVelocities(context, state)
    plant.get_applied_generalized_force_input_port().FixValue(context, force)
    return plant.EvalTimeDerivatives(context).CopyToVector()


def packed(platform, damping=(0.0, 0.0)):
    return pack_robot(platform, CABLES, "elastic", Drive(), home=np.ones(3), damping=damping).body


@given(st.integers(0, 2**32 - 1), st.booleans())
def test_accelerations_are_those_of_multibody_plant(seed, planar):
    random = np.random.default_rng(seed)
    platform = random_platform(random, planar)
    state = random.normal(size=6 if planar else 13)
    if not planar:
        state[:4] *= random.uniform(0.9, 1.1) / np.linalg.norm(state[:4])
    force = random.normal(size=3 if planar else 6) * 10.0
    expected = plant_rates(platform, state, force)
    found = np.zeros(len(state))
    (planar_rates if planar else floating_rates)(state, force, packed(platform), found)
    np.testing.assert_allclose(
        found, expected, rtol=ROUNDING, atol=ROUNDING * np.max(np.abs(expected))
    )


@given(st.integers(0, 2**32 - 1), st.booleans())
def test_damping_is_a_force_against_the_velocities(seed, planar):
    random = np.random.default_rng(seed)
    platform = random_platform(random, planar)
    n, nv = (6, 3) if planar else (13, 6)
    state, force = random.normal(size=n), random.normal(size=nv)
    t, r = random.uniform(0.0, 5.0, 2)
    damping = np.array([t, t, r] if planar else [r, r, r, t, t, t])
    rates = planar_rates if planar else floating_rates
    braked, free = np.zeros(n), np.zeros(n)
    rates(state, force, packed(platform, (t, r)), braked)
    rates(state, force - damping * state[n - nv :], packed(platform), free)
    np.testing.assert_allclose(braked, free, rtol=ROUNDING, atol=ROUNDING)


@given(st.integers(0, 2**32 - 1), st.booleans())
def test_mass_matrix_in_world_is_that_of_statics(seed, planar):
    random = np.random.default_rng(seed)
    platform = random_platform(random, planar)
    state = random.normal(size=6 if planar else 13)
    joint = PlatformJoint.of(platform.motion, RigidTransform())
    X_WP: RigidTransform = pose_on_joint(joint, state)
    expected = platform.mass_matrix(X_WP)
    if planar:
        rows = [3, 4, 2]
        expected = expected[np.ix_(rows, rows)]
    M = np.zeros(expected.shape)
    mass_in_world(state, packed(platform), M)
    np.testing.assert_allclose(M, expected, atol=ROUNDING * platform.mass)

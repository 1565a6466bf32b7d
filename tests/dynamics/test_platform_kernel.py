"""One rigid body by Newton and Euler: MultibodyPlant is the oracle."""

import numpy as np
import pytest
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

ROUNDING = 1e-10  # relative; both solve the same 6 x 6 system, not in the same order
CABLES = CableSet.make(np.eye(3), np.zeros((3, 3)), 1.0)


def random_platform(random, planar):
    """Mass, centre and inertia of a body of five random points: any that can exist."""
    points, masses = random.uniform(-0.3, 0.3, (5, 3)), random.uniform(0.1, 2.0, 5)
    if planar:
        points[:, 2] *= 0.1
    mass = masses.sum()
    parts = zip(masses, points, strict=True)
    I_PPo = sum(m * (p @ p * np.eye(3) - np.outer(p, p)) for m, p in parts)
    motion = LEVEL if planar else FREE
    return RigidPlatform(mass, masses @ points / mass, I_PPo, random.uniform(0.0, 12.0), motion)


def plant_rates(platform, state, force):
    plant, moments = MultibodyPlant(0.0), platform.I_PPo
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, -platform.gravity])
    inertia = RotationalInertia(*np.diag(moments), moments[0, 1], moments[0, 2], moments[1, 2])
    unit = UnitInertia()
    unit.SetFromRotationalInertia(inertia, platform.mass)
    body = plant.AddRigidBody("body", SpatialInertia(platform.mass, platform.p_PCo, unit))
    if platform.motion.is_plane:
        frames = plant.world_frame(), body.body_frame()
        plant.AddJoint(PlanarJoint("plane", *frames, np.zeros(3)))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    plant.SetPositionsAndVelocities(context, state)
    plant.get_applied_generalized_force_input_port().FixValue(context, force)
    return plant.EvalTimeDerivatives(context).CopyToVector()


def packed(platform, damping=(0.0, 0.0)):
    return pack_robot(platform, CABLES, "elastic", Drive(), home=np.ones(3), damping=damping).body


@pytest.mark.parametrize("planar", [False, True])
def test_accelerations_damping_and_mass_matrix(planar):
    """Of MultibodyPlant; damping is a force against the velocities; the mass is that of statics."""
    random, rates = np.random.default_rng(0), planar_rates if planar else floating_rates
    n, nv = (6, 3) if planar else (13, 6)
    for _ in range(40):
        platform, state = random_platform(random, planar), random.normal(size=n)
        if not planar:
            state[:4] *= random.uniform(0.9, 1.1) / np.linalg.norm(state[:4])
        force = 10.0 * random.normal(size=nv)
        expected, found = plant_rates(platform, state, force), np.zeros(n)
        rates(state, force, packed(platform), found)
        size = ROUNDING * np.max(np.abs(expected))
        np.testing.assert_allclose(found, expected, rtol=ROUNDING, atol=size)
        t, r = random.uniform(0.0, 5.0, 2)
        damping = np.array([t, t, r] if planar else [r, r, r, t, t, t])
        braked, free = np.zeros(n), np.zeros(n)
        rates(state, force, packed(platform, (t, r)), braked)
        rates(state, force - damping * state[n - nv :], packed(platform), free)
        np.testing.assert_allclose(braked, free, rtol=ROUNDING, atol=10 * ROUNDING)
        joint = PlatformJoint.of(platform.motion, RigidTransform())
        expected = platform.mass_matrix(pose_on_joint(joint, state))
        if planar:
            expected = expected[np.ix_([3, 4, 2], [3, 4, 2])]
        M = np.zeros(expected.shape)
        mass_in_world(state, packed(platform), M)
        np.testing.assert_allclose(M, expected, atol=ROUNDING * platform.mass)

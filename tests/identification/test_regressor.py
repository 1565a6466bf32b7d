import numpy as np
import pytest
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import MultibodyForces, SpatialInertia, UnitInertia

from cdpr_drake.identification.regressor import (
    central_parameters,
    inertia_regressor,
    inertial_parameters,
    pseudo_inertia,
    six_of,
    symmetric,
)

G = np.array([0.0, 0.0, -9.81])
PI = inertial_parameters(
    3.2, np.array([0.03, -0.02, 0.05]), np.array([0.03, 0.04, 0.05, 0.002, -0.003, 0.004])
)
ROUNDING = 1e-11
"""Of sums of some dozen products of order 10."""


def drake_wrench(X_WP, V, A):
    """F_P_W about Po by MultibodyPlant's inverse dynamics of a free body."""
    mass, c, _ = central_parameters(PI)
    plant = MultibodyPlant(0.0)
    I_o = symmetric(PI[4:])
    unit = UnitInertia(
        *(np.diag(I_o) / mass), *(np.array([I_o[0, 1], I_o[0, 2], I_o[1, 2]]) / mass)
    )
    body = plant.AddRigidBody("P", SpatialInertia(mass, c, unit))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    plant.SetFreeBodyPose(context, body, X_WP)
    plant.SetVelocities(context, V)
    forces = MultibodyForces(plant)
    plant.CalcForceElementsContribution(context, forces)
    return plant.CalcInverseDynamics(context, A, forces)


@pytest.fixture(scope="module")
def motions():
    random = np.random.default_rng(3)
    found = []
    for _ in range(12):
        q = random.standard_normal(4)
        X = RigidTransform(RotationMatrix(Quaternion(q / np.linalg.norm(q))), random.random(3))
        found.append((X, random.standard_normal(6), 3.0 * random.standard_normal(6)))
    return found


def test_the_wrench_is_that_of_drakes_inverse_dynamics(motions):
    """Of a floating body, whose forces are F_P_W about Po."""
    X, V, A = zip(*motions, strict=True)
    R = np.array([each.rotation().matrix() for each in X])
    wrenches = inertia_regressor(R, np.array(V), np.array(A), G) @ PI
    np.testing.assert_allclose(wrenches, [drake_wrench(*each) for each in motions], atol=ROUNDING)


def test_parameters_go_there_and_back():
    mass, c, inertia = central_parameters(PI)
    np.testing.assert_allclose(inertial_parameters(mass, c, inertia), PI, atol=1e-15)


def test_the_pseudo_inertia_is_that_of_the_mass():
    """Of point masses: the sum of m (x, 1)(x, 1)'."""
    random = np.random.default_rng(0)
    points, masses = random.standard_normal((7, 3)), random.random(7)
    total = np.sum(masses)
    c = masses @ points / total
    I_o = sum(m * (x @ x * np.eye(3) - np.outer(x, x)) for m, x in zip(masses, points, strict=True))
    pi = np.concatenate([[total], total * c, six_of(I_o)])
    wide = np.column_stack([points, np.ones(7)])
    np.testing.assert_allclose(pseudo_inertia(pi), (wide.T * masses) @ wide, atol=1e-14)

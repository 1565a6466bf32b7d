import numpy as np
import pytest
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import MultibodyForces, SpatialInertia, UnitInertia

from cdpr_drake.geometry.poses import rotation_from_vector
from cdpr_drake.identification import regressor as room
from cdpr_drake.identification.regressor import (
    central_parameters,
    inertia_regressor,
    inertial_parameters,
    pseudo_inertia,
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
    I_o = room.symmetric(PI[4:])
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


def regressors(motions):
    R = np.array([X.rotation().matrix() for X, _, _ in motions])
    V, A = np.array([V for _, V, _ in motions]), np.array([A for _, _, A in motions])
    return inertia_regressor(R, V, A, G)


def largest_error(motions):
    """Against Drake's inverse dynamics of a floating body, whose forces are F_P_W about Po."""
    return max(
        np.max(np.abs(Y @ PI - drake_wrench(*each)))
        for Y, each in zip(regressors(motions), motions, strict=True)
    )


def test_the_wrench_is_that_of_drakes_inverse_dynamics(motions):
    assert largest_error(motions) < ROUNDING


def test_columns_are_the_derivatives_of_drakes_inverse_dynamics(motions):
    """By each parameter: Drake's wrench of a body that has a little more of it."""
    global PI
    X, V, A = motions[0]
    Y, kept = regressors(motions)[0], PI
    try:
        for k in range(10):
            step = np.eye(10)[k] * 1e-4
            PI = kept + step
            after = drake_wrench(X, V, A)
            PI = kept - step
            np.testing.assert_allclose(Y[:, k], (after - drake_wrench(X, V, A)) / 2e-4, atol=1e-8)
    finally:
        PI = kept


@pytest.mark.parametrize("part", ["_cross", "_inertia_times"])
def test_a_wrong_sign_is_seen(motions, monkeypatch, part):
    right = getattr(room, part)
    monkeypatch.setattr(room, part, lambda x: -right(x))
    assert largest_error(motions) > 0.1


def test_a_pendulum_on_one_cable():
    """A body that swings about a point over its centre of mass: tension in closed form."""
    L, mass, angle, rate = 0.8, 2.0, 0.4, 1.7
    c, I_c = np.array([0.0, 0.0, -0.1]), 0.02
    pi = inertial_parameters(mass, c, np.array([I_c, I_c, 0.01, 0.0, 0.0, 0.0]))
    r = L + 0.1  # the cable goes on straight to the centre of mass
    alpha = -mass * 9.81 * r * np.sin(angle) / (mass * r * r + I_c)
    R = rotation_from_vector(np.array([angle, 0.0, 0.0])).matrix()
    p = R @ np.array([0.0, 0.0, -L])
    w, w_dot = np.array([rate, 0, 0]), np.array([alpha, 0, 0])
    V = np.concatenate([w, np.cross(w, p)])
    A = np.concatenate([w_dot, np.cross(w_dot, p) + np.cross(w, np.cross(w, p))])
    F = inertia_regressor(R[None], V[None], A[None], G)[0] @ pi
    tension = mass * (9.81 * np.cos(angle) + r * rate**2)
    along = -p / L
    assert F[3:] @ along == pytest.approx(tension, rel=1e-12)
    # A straight pull at Po cannot turn the body about its centre of mass as a rigid rod does.
    assert F[0] == pytest.approx(I_c * alpha + 0.1 * F[3:] @ (R @ [0, 1, 0]), abs=1e-12)


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
    pi = np.concatenate([[total], total * c, room.six_of(I_o)])
    wide = np.column_stack([points, np.ones(7)])
    np.testing.assert_allclose(pseudo_inertia(pi), (wide.T * masses) @ wide, atol=1e-14)

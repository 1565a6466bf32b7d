"""Sensitivities against poses of rest found anew with a changed constant."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.cables.elastic_law import unstrained_lengths
from cdpr_drake.errors import CableModelError, EquilibriumError
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import pose_from_angles, rotation_vector
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.statics.equilibrium import equilibrium_near
from cdpr_drake.statics.forward_kinematics import ForwardKinematics
from cdpr_drake.statics.rigid_platform import RigidPlatform
from cdpr_drake.statics.sensitivity import pose_sensitivity
from cdpr_drake.systems.robots.cable_robot import holding_tensions

AGREE = 2e-4
"""Differences of poses of rest, relative to the largest entry: steps small enough to keep cables
taut leave four digits."""


SETTLED = 1e-12
"""How exact a pose of rest is [m, rad]: forces of 1e-10 of the weight over 1e5 N/m."""


def rest_of(name, model, pulleys=True):
    robot = load_robot(name)
    cables = robot.cable_set() if pulleys else robot.cable_set().without_pulleys()
    platform = rigid_platform(robot)
    home = robot.home.transform()
    lift = 0.0 if robot.is_planar() else 0.1
    X = pose_from_angles(home.translation() + np.array([0.05, -0.03, lift]), [0.0, 0.0, 0.03])
    tensions = holding_tensions(robot, X) + (5.0 if robot.is_planar() else 0.0)
    lengths = ForwardKinematics(cables, robot.motion_type()).lengths(X)
    l0 = unstrained_lengths(lengths, tensions, cables.stiffness)
    return cables, platform, l0, equilibrium_near(cables, model, platform, l0, X).X_WP


def displacement(X, reference):
    return np.concatenate(
        [
            rotation_vector(X.rotation() @ reference.rotation().inverse()),
            X.translation() - reference.translation(),
        ]
    )


def difference(change, model, X, step):
    """Change maps a step to (cables, platform, l0)."""
    moved = []
    for s in (step, -step):
        cables, platform, l0 = change(s)
        moved.append(displacement(equilibrium_near(cables, model, platform, l0, X).X_WP, X))
    return (moved[0] - moved[1]) / (2.0 * step)


def one(shape, index):
    unit = np.zeros(shape)
    unit[index] = 1.0
    return unit


@pytest.mark.parametrize(
    ("name", "model"), [("caroca", "elastic"), ("caroca", "catenary"), ("planar", "elastic")]
)
def test_against_differences(name, model):
    cables, platform, l0, X = rest_of(name, model)
    found = pose_sensitivity(cables, model, platform, X, l0)
    m = cables.count

    def cable_change(field, index, shape):
        unit = one(shape, index)
        return lambda s: (
            replace(cables, **{field: getattr(cables, field) + s * unit}), platform, l0,
        )  # fmt: skip

    cases = []
    for i in (0, m - 1):
        for axis in range(3):
            cases += [
                (found.exit_points[:, axis, i], cable_change("p_WA", (axis, i), (3, m)), 1e-7),
                (found.anchor_points[:, axis, i], cable_change("p_PB", (axis, i), (3, m)), 1e-7),
            ]
        length = one(m, i)
        cases += [
            (found.lengths[:, i], lambda s, d=length: (cables, platform, l0 + s * d), 1e-7),
            (found.pulley_radius[:, i], cable_change("pulley_radius", i, m), 1e-7),
            (found.stiffness[:, i], cable_change("stiffness", i, m), 1e-4 * cables.stiffness[i]),
        ]
        if model == "catenary":
            cases.append((found.linear_weight[:, i], cable_change("linear_weight", i, m), 1e-3))
    if platform.motion.is_free:
        heavier = lambda s: (cables, replace(platform, mass=platform.mass + s), l0)  # noqa: E731
        cases.append((found.mass, heavier, 1e-3))
        for axis in range(3):
            shift = one(3, axis)
            cases.append(
                (
                    found.center_of_mass[:, axis],
                    lambda s, d=shift: (
                        cables, replace(platform, p_PCo=platform.p_PCo + s * d), l0,
                    ),
                    1e-5,
                )
            )  # fmt: skip
    for derivative, change, step in cases:
        expected = difference(change, model, X, step)
        tolerance = AGREE * np.max(np.abs(expected)) + SETTLED / step
        np.testing.assert_allclose(derivative, expected, atol=tolerance)


def test_straight_cables_have_no_weight():
    cables, platform, l0, X = rest_of("caroca", "elastic", pulleys=False)
    found = pose_sensitivity(cables, "elastic", platform, X, l0)
    np.testing.assert_array_equal(found.linear_weight, 0.0)
    # All exit points moved together move the platform with them.
    np.testing.assert_allclose(
        np.sum(found.exit_points, axis=2), np.vstack([np.zeros((3, 3)), np.eye(3)]), atol=1e-9
    )


def test_a_pulley_that_is_not_there_yet():
    cables, platform, l0, X = rest_of("acrobot_large", "elastic", pulleys=False)
    slope = pose_sensitivity(cables, "elastic", platform, X, l0).pulley_radius
    tiny = replace(cables, pulley_radius=np.full(8, 2e-8))
    X_tiny = equilibrium_near(tiny, "elastic", platform, l0, X).X_WP
    expected = displacement(X_tiny, X) / 2e-8
    np.testing.assert_allclose(
        np.sum(slope, axis=1), expected, atol=1e-2 * np.max(np.abs(expected))
    )


def test_refuses_what_has_no_sensitivity():
    cables, platform, l0, X = rest_of("caroca", "elastic")
    with pytest.raises(CableModelError, match="inextensible"):
        pose_sensitivity(cables, "inextensible", platform, X, l0)
    one_cable = CableSet.make(np.array([[0.0], [0.0], [2.0]]), np.zeros((3, 1)), 1e5)
    ball = RigidPlatform(2.0, np.zeros(3), np.eye(3))
    with pytest.raises(EquilibriumError, match="nothing holds"):
        pose_sensitivity(one_cable, "elastic", ball, RigidTransform(), np.array([1.99]))

"""Control of position alone: the centre of mass accelerates as asked, whatever turns it."""

import numpy as np
import pytest
from hypothesis import given
from pydrake.math import RigidTransform

from cdpr_drake.control.force_balance import (
    BALANCES,
    FORCE,
    WRENCH,
    balanced_rows,
    force_problem,
    point_mass_force,
)
from cdpr_drake.control.task_space import (
    PlatformDynamics,
    computed_torque,
    planar_wrench,
)
from cdpr_drake.geometry.poses import rotation_from_vector
from cdpr_drake.geometry.straight_cables import ALL_ROWS, PLANAR_ROWS
from cdpr_drake.models.robot_in_plant import platform_inertia
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.trajectories.pose_trajectory import motion_row
from tests.control.awkward_robots import GAINS, awkward_robot, plant_of, spatial, triple, turn

ROUNDING = 1e-11
"""Some hundred products in another order, of terms that partly cancel, relative to the largest."""

ROBOT = awkward_robot("acrobot_large")
C = np.array(ROBOT.platform.center_of_mass)


PLANT = plant_of(ROBOT)
DAMPING = 7.0, 0.9


def force_law(X_WP, V_WP, X_WD, V_WD, A_WD, robot=ROBOT, *, point_mass=True):
    dynamics = PlatformDynamics(
        platform_inertia(robot), robot.gravity, point_mass=point_mass, damping=DAMPING
    )
    return computed_torque(X_WP, V_WP, X_WD, V_WD, A_WD, dynamics=dynamics, gains=GAINS)


def carried(X_WP, V_WP, A_WP):
    """Position, velocity and acceleration in W of C, which P carries."""
    arm, turned = X_WP.rotation() @ C, np.cross(V_WP[:3], X_WP.rotation() @ C)
    inwards = np.cross(V_WP[:3], turned)
    return X_WP @ C, V_WP[3:] + turned, A_WP[3:] + np.cross(A_WP[:3], arm) + inwards


def close(found, expected):
    scale = max(1.0, float(np.max(np.abs(expected))))
    return np.max(np.abs(found - expected)) <= ROUNDING * scale


@given(turn, triple, spatial, turn, triple, spatial, spatial)
def test_the_centre_of_mass_accelerates_as_asked(r, p, V_WP, off, p_WD, V_WD, A_WD):
    """By the closed form of a point mass, and by Drake's dynamics with any moment besides."""
    plant, in_plant, context = PLANT
    X_WP = RigidTransform(rotation_from_vector(r), p)
    X_WD = RigidTransform(rotation_from_vector(off) @ X_WP.rotation(), p_WD)
    plant.SetFreeBodyPose(context, in_plant.body, X_WP)
    plant.SetVelocities(context, V_WP)
    wrench = force_law(X_WP, V_WP, X_WD, V_WD, A_WD)
    desired = carried(X_WD, V_WD, A_WD)
    p_WC, v_WC, _ = carried(X_WP, V_WP, np.zeros(6))
    force = point_mass_force(
        p_WC, v_WC, *desired, mass=ROBOT.platform.mass, gravity=ROBOT.gravity,
        gains=(120.0, 25.0), damping=DAMPING[0] * V_WP[3:],
    )  # fmt: skip
    assert close(wrench[3:], force)
    assert close(wrench[:3], np.cross(p_WC - p, force))  # through the centre of mass
    wrench[:3] += [0.3, -0.2, 0.1]
    A_WP = np.linalg.solve(
        plant.CalcMassMatrix(context),
        wrench
        - np.repeat(DAMPING[::-1], 3) * V_WP
        - plant.CalcBiasTerm(context)
        + plant.CalcGravityGeneralizedForces(context),
    )
    _, _, a_WC = carried(X_WP, V_WP, A_WP)
    goal, speed, asked = desired
    assert close(a_WC, asked + 120.0 * (goal - p_WC) + 25.0 * (speed - v_WC))


def test_the_closed_form_in_numbers():
    """1 kg that hangs 0.5 m beside its goal, at gain 100: the weight, and 50 N."""
    force = point_mass_force(
        np.zeros(3), np.zeros(3), np.array([0.0, 0.5, 0.0]), np.zeros(3), np.zeros(3),
        mass=1.0, gravity=9.81, gains=(100.0, 100.0),
    )  # fmt: skip
    np.testing.assert_allclose(force, [0.0, 50.0, 9.81])


@given(turn, triple, spatial, turn, triple, spatial, spatial)
def test_force_is_that_of_the_whole_wrench_where_po_is_the_centre_of_mass(
    r, p, V_WP, off, p_WD, V_WD, A_WD
):
    robot = load_robot("acrobot_large")
    robot.platform.center_of_mass = np.zeros(3)
    X_WP = RigidTransform(rotation_from_vector(r), p)
    X_WD = RigidTransform(rotation_from_vector(off) @ X_WP.rotation(), p_WD)
    alone, whole = (
        force_law(X_WP, V_WP, X_WD, V_WD, A_WD, robot, point_mass=one) for one in (True, False)
    )
    assert close(alone[3:], whole[3:])
    np.testing.assert_array_equal(alone[:3], np.zeros(3))


def test_a_planar_platform_is_pulled_in_its_plane_only():
    robot = awkward_robot("planar")
    dynamics = PlatformDynamics(platform_inertia(robot), robot.gravity, PLANAR_ROWS, True)
    X_WD = RigidTransform([0.3, 0.1, 5.0])
    found = np.empty(6)
    planar_wrench(
        np.zeros(6), motion_row(X_WD, np.zeros(6), np.zeros(6)), dynamics.packed(), GAINS.packed(),
        robot.plane_height, found,
    )  # fmt: skip
    mass, c = robot.platform.mass, np.array(robot.platform.center_of_mass)
    np.testing.assert_allclose(found[3:5], mass * 120.0 * np.array([0.3, 0.1]))
    np.testing.assert_array_equal(found[[0, 1, 5]], np.zeros(3))
    assert found[2] == pytest.approx(c[0] * found[4] - c[1] * found[3])


def test_rows_that_are_balanced():
    assert balanced_rows(ALL_ROWS, WRENCH) == ALL_ROWS
    assert balanced_rows(ALL_ROWS, FORCE) == (3, 4, 5)
    assert balanced_rows(PLANAR_ROWS, FORCE) == (3, 4)
    assert tuple(BALANCES) == (WRENCH, FORCE)


def test_the_problem_of_forces_has_the_rows_of_forces():
    robot = load_robot("acrobot_large")
    whole = tension_problem(robot, robot.home.transform(), limits=(1.0, 50.0))
    alone = force_problem(whole, 3)
    np.testing.assert_array_equal(alone.W, whole.W[3:])
    np.testing.assert_array_equal(alone.wrench, whole.wrench[3:])
    np.testing.assert_array_equal(alone.scale_of_rows, np.ones(3))
    assert (whole.redundancy, alone.redundancy) == (2, 5)

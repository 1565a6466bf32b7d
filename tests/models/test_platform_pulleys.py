"""A robot with pulleys at its platform, through statics, kinematics and both engines."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.cables.curves import cable_curves
from cdpr_drake.cables.states import cable_state
from cdpr_drake.calibration.parameters import CalibrationModel
from cdpr_drake.errors import CableModelError, CalibrationError, StabilityError
from cdpr_drake.formats.robot_exports import export_omissions
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.cable_rates import cable_rates_from_base_twist
from cdpr_drake.geometry.poses import rotation_from_vector
from cdpr_drake.models.robot_holding import hold_robot
from cdpr_drake.models.robot_statics import rigid_platform, tension_problem
from cdpr_drake.stability.stability_case import StabilityCase
from cdpr_drake.statics.equilibrium import equilibrium_near
from cdpr_drake.statics.forward_kinematics import ForwardKinematics
from cdpr_drake.statics.inextensible_equilibrium import tension_stiffness
from cdpr_drake.statics.sensitivity import pose_sensitivity
from cdpr_drake.statics.stiffness import platform_stiffness
from cdpr_drake.tensions.methods import exact_tensions
from tests.models.robots import content_of, robot_of

POSE = RigidTransform(rotation_from_vector(np.array([0.1, -0.05, 0.15])), [0.05, -0.06, 0.3])
STIFF = 1e-6
"""Of central differences of forces, relative to the largest stiffness."""

SAME_STEPS = 1e-9
"""Of states after the same steps by both engines: rounding."""


def robot_content(radius=0.015):
    content = content_of()
    for cable in content["cables"]:
        # The cable comes from the middle of the platform.
        x, y, _ = cable["anchor_point"]
        cable["anchor_swivel_axis"] = [x, y, 0.01]
    content["cables"][3]["anchor_pulley_radius"] = 0.5 * radius
    content["cables"][4]["pulley_radius"] = 0.0
    content["platform_pulley"] = {"radius": radius}
    content["tension_bounds"] = {"lower": 1.0, "upper": 200.0}
    content["platform"]["mass"] = 12.0  # so that no cable goes slack when it swings
    return content


ROBOT = robot_of(robot_content())
CABLES = ROBOT.cable_set()


def turned(X, V):
    return RigidTransform(rotation_from_vector(V[:3]) @ X.rotation(), X.translation() + V[3:])


def test_the_file_says_where_they_are():
    assert CABLES.has_platform_pulleys()
    np.testing.assert_array_equal(CABLES.anchor_pulley_radius[[0, 3]], [0.015, 0.0075])
    np.testing.assert_allclose(np.linalg.norm(CABLES.anchor_swivel_axis, axis=0), 1.0)
    assert not CABLES.without_pulleys().has_pulleys()
    assert not robot_of(content_of()).cable_set().has_platform_pulleys()


def test_tensions_balance_the_weight_over_both_pulleys():
    problem = tension_problem(ROBOT, POSE, cables=CABLES)
    tensions = exact_tensions(problem)
    state = cable_state(CABLES, "elastic", POSE, unstrained(tensions))
    np.testing.assert_allclose(state.tensions, tensions, rtol=1e-9)
    weight = ROBOT.platform.mass * ROBOT.gravity
    np.testing.assert_allclose(state.wrench + problem.wrench, 0.0, atol=1e-9 * weight)


def unstrained(tensions):
    return cable_paths(POSE, CABLES).lengths / (1.0 + tensions / CABLES.stiffness)


def test_stiffness_is_the_derivative_of_the_wrench():
    holding = hold_robot(ROBOT, POSE, CABLES, "elastic")
    l0, h = holding.unstrained_lengths, 1e-6
    K = platform_stiffness(CABLES, "elastic", rigid_platform(ROBOT), POSE, l0)
    slopes = []
    for V in h * np.eye(6):
        ahead, behind = (
            cable_state(CABLES, "elastic", turned(POSE, s * V), l0).wrench for s in (1.0, -1.0)
        )
        slopes.append(-(ahead - behind) / (2.0 * h))
    scale = STIFF * np.max(np.abs(K.cables))
    np.testing.assert_allclose(K.cables, np.array(slopes).T, atol=scale)
    np.testing.assert_allclose(K.elastic + K.tension, K.cables, atol=1e-6 * scale / STIFF)
    by_tensions = tension_stiffness(POSE, CABLES, holding.tensions)
    np.testing.assert_allclose(by_tensions, K.tension, atol=1e-9 * np.max(np.abs(K.tension)))


def test_it_comes_to_rest_where_forces_balance_and_moves_as_its_constants_say():
    platform = rigid_platform(ROBOT)
    holding = hold_robot(ROBOT, POSE, CABLES, "elastic")
    l0 = holding.unstrained_lengths + 2e-4 * np.array([1, -1, 1, 0, -1, 1, 0, 1])
    rest = equilibrium_near(CABLES, "elastic", platform, l0, POSE)
    slopes = pose_sensitivity(CABLES, "elastic", platform, rest.X_WP, l0)
    h = 1e-6
    for name, derivative in (("p_WA", slopes.exit_points), ("p_PB", slopes.anchor_points)):
        for axis, i in ((0, 1), (2, 6)):
            change = np.zeros((3, 8))
            change[axis, i] = h
            poses = [
                equilibrium_near(
                    replace(CABLES, **{name: getattr(CABLES, name) + s * change}), "elastic",
                    platform, l0, rest.X_WP,
                ).X_WP
                for s in (1.0, -1.0)
            ]  # fmt: skip
            moved = (poses[0].translation() - poses[1].translation()) / (2.0 * h)
            np.testing.assert_allclose(derivative[3:, axis, i], moved, atol=1e-4)


def test_lengths_tell_the_pose():
    solver = ForwardKinematics(CABLES)
    lengths = cable_paths(POSE, CABLES).lengths
    found = solver.pose(lengths, ROBOT.home.transform())
    np.testing.assert_allclose(found.X_WP.GetAsMatrix4(), POSE.GetAsMatrix4(), atol=1e-9)


def test_winches_know_how_fast():
    V = np.array([0.1, -0.2, 0.3, 0.2, -0.1, 0.05])
    R, p = np.ascontiguousarray(POSE.rotation().matrix()), np.array(POSE.translation())
    rates = cable_rates_from_base_twist(R, p, CABLES.packed(), V)
    np.testing.assert_allclose(rates, cable_paths(POSE, CABLES).J @ V, atol=1e-14)


def test_curves_end_at_the_anchor_points():
    l0 = cable_paths(POSE, CABLES).lengths / 1.001
    curves = cable_curves(CABLES, "elastic", POSE, l0)
    for i, curve in enumerate(curves):
        np.testing.assert_allclose(curve[:, 0], CABLES.p_WA[:, i], atol=1e-12)
        np.testing.assert_allclose(curve[:, -1], POSE.multiply(CABLES.p_PB[:, i]), atol=1e-12)
        steps = np.linalg.norm(np.diff(curve, axis=1), axis=0)
        length = cable_paths(POSE, CABLES).lengths[i]
        assert 0.995 * length < np.sum(steps) <= length * (1.0 + 1e-12)


def test_what_cannot_take_them_says_so():
    with pytest.raises(CableModelError, match=r"anchor_pulley_radius of cable 1: .*catenary: 0"):
        cable_state(CABLES, "catenary", POSE, np.ones(8))
    with pytest.raises(StabilityError, match=r"found pulleys; accepted: straight cables"):
        StabilityCase(CABLES)
    with pytest.raises(CalibrationError, match=r"found a pulley at the platform; accepted"):
        CalibrationModel(tuple(cable.name for cable in ROBOT.cables), CABLES)
    assert "fixed anchor points" in export_omissions(ROBOT, "wcrfx")["platform_pulley.radius"]


def test_they_change_which_poses_tensions_can_hold():
    """Not that of a pulley at the frame: the arm of the pull is another one."""
    content = content_of()
    content["pulley"]["radius"] = 0.03
    frame = robot_of(content).cable_set()
    far = tension_problem(ROBOT, POSE, cables=frame).W
    near = tension_problem(ROBOT, POSE, cables=CABLES).W
    assert np.max(np.abs((near - far)[:3])) > 1e-3

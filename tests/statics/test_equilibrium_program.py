"""The program of least potential energy, and that Newton's method finds the same poses."""

import numpy as np
import pytest
from pydrake.autodiffutils import ExtractGradient, InitializeAutoDiff
from pydrake.math import RigidTransform

from cdpr_drake.cables.elastic_law import unstrained_lengths
from cdpr_drake.cables.models import cable_state
from cdpr_drake.errors import EquilibriumError
from cdpr_drake.geometry.poses import pose_error, pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.statics.equilibrium import equilibrium_near
from cdpr_drake.statics.equilibrium_program import (
    displaced,
    make_equilibrium_program,
    solve_equilibrium_program,
)
from cdpr_drake.statics.forward_kinematics import ForwardKinematics
from cdpr_drake.statics.rigid_platform import RigidPlatform
from cdpr_drake.systems.robots.cable_robot import holding_tensions

AGREE = {"inextensible": 1e-6, "elastic": 1e-5, "catenary": 1e-4}
"""How near SNOPT comes [m, rad]: its tolerance over the stiffness in weights per metre; a gradient
of 1e-9 of stiff energies is lost in rounding earlier."""


@pytest.mark.parametrize(
    ("model", "name"),
    [(model, "acrobot_large") for model in sorted(AGREE)]
    + [("elastic", "planar"), ("catenary", "planar")],  # in its plane, rigid cables are loose
)
def test_agrees_with_newtons_method(model, name):
    robot = load_robot(name)
    at = [0.1, 0.05, 0.3] if name == "planar" else [0.1, 0.05, 0.25]
    X = pose_from_angles(at, [0.0, 0.0, 0.05])
    cables, platform = robot.cable_set(), rigid_platform(robot)
    lengths = ForwardKinematics(cables, platform.motion).lengths(X)
    l0 = unstrained_lengths(lengths, holding_tensions(robot, X), cables.stiffness)
    l0 = l0 + np.linspace(-2e-3, 0.0, len(l0)) * (0.1 if name == "planar" else 1.0)
    rest = equilibrium_near(cables, model, platform, l0, X)
    start = displaced(rest.X_WP, platform, np.full(platform.motion.freedom, 0.004))
    made = make_equilibrium_program(cables, model, platform, l0, start)
    distance, angle = pose_error(solve_equilibrium_program(made), rest.X_WP)
    assert distance < AGREE[model]
    assert angle < 10.0 * AGREE[model]


def test_slopes_that_the_solver_sees():
    robot = load_robot("acrobot_large")
    cables, platform = robot.cable_set(), rigid_platform(robot)
    X = robot.home.transform()
    l0 = 0.999 * ForwardKinematics(cables).lengths(X)
    for model in AGREE:
        made = make_equilibrium_program(cables, model, platform, l0, X)
        program, step = made.program, 1e-6
        x = np.full(program.num_vars(), 0.05)
        bindings = [*program.GetAllCosts(), *program.generic_constraints()]
        for binding in bindings:
            evaluator, at = (
                binding.evaluator(),
                program.FindDecisionVariableIndices(binding.variables()),
            )
            slope = ExtractGradient(evaluator.Eval(InitializeAutoDiff(x[at]).ravel()))
            for k in range(len(at)):
                d = step * np.eye(len(at))[k]
                difference = (evaluator.Eval(x[at] + d) - evaluator.Eval(x[at] - d)) / (2.0 * step)
                np.testing.assert_allclose(
                    slope[:, k], difference, atol=1e-6 * max(1.0, np.max(np.abs(slope)))
                )


def test_constraints_of_ones_own():
    """A stop that keeps the platform from hanging lower."""
    robot = load_robot("acrobot_large")
    cables, platform = robot.cable_set().without_pulleys(), rigid_platform(robot)
    X = robot.home.transform()
    l0 = ForwardKinematics(cables).lengths(X) + 0.05
    made = make_equilibrium_program(cables, "elastic", platform, l0, X)
    made.program.AddBoundingBoxConstraint(0.0, np.inf, made.displacement[5])
    found = solve_equilibrium_program(made)
    assert found.translation()[2] == pytest.approx(X.translation()[2], abs=1e-6)
    assert np.all(cable_state(cables, "elastic", found, l0).tensions == 0.0)


def test_no_weight_no_scale():
    robot = load_robot("acrobot_large")
    nothing = RigidPlatform(1.0, np.zeros(3), np.eye(3), gravity=0.0)
    with pytest.raises(EquilibriumError, match="no weight"):
        make_equilibrium_program(
            robot.cable_set(), "elastic", nothing, np.ones(8), RigidTransform()
        )

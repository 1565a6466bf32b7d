"""The tension problem of a robot, what holds it, and the named errors where a pose cannot be."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator

from cdpr_drake.analyses.statics.modelling_errors import poses_in, usual_beliefs
from cdpr_drake.cables.states import cable_state
from cdpr_drake.errors import (
    CableGeometryError,
    CdprError,
    InfeasibleTensionError,
    TensionProblemError,
)
from cdpr_drake.geometry.straight_cables import PLANAR_ROWS, gravity_wrench, wrench_matrix
from cdpr_drake.models.robot_holding import check_pulleys, hold_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.systems.robots.cable_robot import CableRobot, holding_tensions
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.settings import CableRobotSettings, CableSettings
from tests.models.representative_robots import REPRESENTATIVE_ROBOTS


@pytest.mark.parametrize("name", REPRESENTATIVE_ROBOTS)
def test_problem_is_that_of_the_weight(name):
    robot = load_robot(name)
    X_WP = robot.home.transform()
    problem = tension_problem(robot, X_WP, cables=robot.cable_set(pulleys=False))
    rows = list(PLANAR_ROWS) if robot.is_planar() else list(range(6))
    W = wrench_matrix(X_WP, robot.exit_points(), robot.anchor_points())
    np.testing.assert_array_equal(problem.W, W[rows])
    weight = gravity_wrench(X_WP, robot.platform.mass, robot.center_of_mass(), robot.gravity)
    np.testing.assert_array_equal(problem.wrench, weight[rows])
    assert np.all(problem.lower == robot.tension_bounds.lower)
    assert np.all(problem.upper == robot.tension_bounds.upper)


def test_everything_can_be_replaced():
    robot = load_robot("acrobot_large")
    X_WP = robot.home.transform()
    push = np.array([0.1, 0.2, 0.3, 1.0, 2.0, 3.0])
    problem = tension_problem(
        robot, X_WP, push, limits=(2.0, 30.0), mass=0.0, reference=np.full(8, 5.0)
    )
    np.testing.assert_array_equal(problem.wrench, push)
    assert set(problem.lower) == {2.0}
    assert set(problem.upper) == {30.0}
    assert set(problem.reference) == {5.0}


@pytest.mark.parametrize(("name", "moments"), [("acrobot_large", 3), ("planar", 1)])
def test_moments_are_compared_to_forces_at_the_size_of_the_platform(name, moments):
    robot = load_robot(name)
    X_WP = robot.home.transform()
    by_hand = np.sqrt(np.mean([np.dot(c.anchor_point, c.anchor_point) for c in robot.cables]))
    scale = tension_problem(robot, X_WP).row_scale
    np.testing.assert_allclose(scale[:moments], by_hand, rtol=1e-14)
    np.testing.assert_array_equal(scale[moments:], 1.0)
    given = tension_problem(robot, X_WP, length_scale=0.5).row_scale
    np.testing.assert_array_equal(given[:moments], 0.5)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"X_WP": RigidTransform([0, 0, 5])}, "outside the frame of acrobot_large"),
        ({"mass": -1.0}, "mass: found -1"),
        ({"mass": np.nan}, "mass: found nan"),
        ({"wrench": np.zeros(3)}, "wrench: found 3 numbers"),
        ({"limits": (5.0, 2.0)}, "lower <= upper"),
        ({"length_scale": 0.0}, r"length_scale: found 0; accepted: above 0 \[m\]"),
        ({"length_scale": np.inf}, "length_scale: found inf"),
    ],
)
def test_refusals(arguments, words):
    robot = load_robot("acrobot_large")
    with pytest.raises(TensionProblemError, match=words):
        tension_problem(robot, **{"X_WP": robot.home.transform(), **arguments})


def test_a_cable_without_length_is_refused_with_and_without_pulleys():
    robot = load_robot("acrobot_large")
    cables = robot.cable_set().without_pulleys()
    X_WP = robot.home.transform()
    A = cables.p_WA.copy()
    A[:, 2] = X_WP.multiply(cables.p_PB[:, 2])
    with pytest.raises(CableGeometryError, match=r"cable 3: .* on its exit point"):
        tension_problem(robot, X_WP, cables=replace(cables, p_WA=A))


def test_given_limits_stand_in_the_place_of_the_robots():
    robot = load_robot("caroca")
    assert robot.tension_limits() == (robot.tension_bounds.lower, robot.tension_bounds.upper)
    assert robot.tension_limits((2.0, 30.0)) == (2.0, 30.0)


# What holds.

STILL = 1e-6
"""Acceleration that is left [m/s^2, rad/s^2]: 1e-9 N on platforms of 1.5 kg and 2 g m^2."""


BALANCED = 1e-8
"""Share of the weight that a catenary's own iteration, which stops at some nanonewtons, leaves."""


@pytest.mark.parametrize("name", REPRESENTATIVE_ROBOTS)
@pytest.mark.parametrize("model", ["kelvin_voigt", "catenary"])
def test_a_hanging_robot_stands_still(name, model):
    robot = load_robot(name)
    block = CableRobot(robot, CableRobotSettings(cables=CableSettings(model=model, pulleys=True)))
    context = block.CreateDefaultContext()
    if (name, model) == ("caroca_gazebo", "catenary"):  # 1 kg on eight steel cables of 1 kg each
        with pytest.raises(InfeasibleTensionError, match=r"with at least 1\.5 times its own"):
            block.set_at_equilibrium(context, robot.home.transform())
        return
    tensions = block.set_at_equilibrium(context, robot.home.transform())
    block.GetInputPort("cable_velocities").FixValue(context, np.zeros(len(robot.cables)))
    rates = block.EvalTimeDerivatives(context).CopyToVector()
    assert np.max(np.abs(rates)) < STILL
    np.testing.assert_allclose(block.GetOutputPort("tensions").Eval(context), tensions, atol=1e-6)


def test_sagging_cables_settle_up_to_rounding():
    """High in the frame rounding of 1e-12 goes round in a cycle; the forces are in balance."""
    robot = load_robot("acrobot_large")
    X_WP = poses_in(robot, 12)[4]
    rigid = next(each for each in usual_beliefs(robot) if each.name == "no stretch").cables
    held = hold_robot(robot, X_WP, rigid, "catenary")
    state = cable_state(rigid, "catenary", X_WP, held.unstrained_lengths)
    weight = robot.platform.mass * 9.81
    np.testing.assert_allclose(state.forces.sum(axis=1), [0.0, 0.0, weight], atol=BALANCED * weight)


def test_straight_cables_are_held_as_by_holding_tensions():
    robot = load_robot("acrobot_large")
    X_WP = robot.home.transform()
    for cables in (robot.cable_set(), robot.cable_set(pulleys=False)):
        held = hold_robot(robot, X_WP, cables, "elastic")
        wanted = holding_tensions(robot, X_WP, cables)
        np.testing.assert_allclose(held.tensions, wanted, atol=1e-9)


def test_pulleys_and_exit_points_stay_outside_of_the_platform():
    robot = load_robot("acrobot_small")
    robot.cables[4].exit_point = np.array([0.0, 0.0, 0.62])
    X_WP = RigidTransform([0.0, 0.0, 0.6])
    with pytest.raises(CableGeometryError, match=r"cable 5 of acrobot_small: its pulley of radius"):
        check_pulleys(robot, X_WP, robot.cable_set())
    with pytest.raises(CableGeometryError, match="cable 5 of acrobot_small"):
        hold_robot(robot, X_WP, robot.cable_set().without_pulleys(), "elastic")
    check_pulleys(robot, RigidTransform([0.0, 0.0, 0.4]), robot.cable_set())


def test_a_pose_that_breaks_a_cable_is_refused():
    robot = load_robot("caroca")
    robot.cable.breaking_load = 100.0
    with pytest.raises(CableGeometryError, match="its breaking load, 100 N"):
        hold_robot(robot, robot.home.transform(), robot.cable_set(), "catenary")


def test_a_pose_that_nothing_holds_is_refused():
    robot = load_robot("caroca")
    with pytest.raises(InfeasibleTensionError, match="caroca cannot hold the platform at"):
        hold_robot(robot, RigidTransform([1.9, 3.4, 1.0]), robot.cable_set(), "elastic")


PAID_OUT = np.array([0.0, 0.05, 0.0, 0.0, 0.0, 0.0, 0.05, 0.0])
"""Slack of two cables of CAROCA, of which one stays slack [m]."""


@pytest.mark.parametrize("kind", [CableRobot, CompiledCableRobot])
def test_a_platform_with_slack_cables_can_start_at_rest(kind):
    robot = load_robot("caroca")
    block = kind(
        robot, CableRobotSettings(cables=CableSettings(model="kelvin_voigt", stiffness_ratio=0.1))
    )
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    block.GetInputPort("cable_velocities").FixValue(context, np.zeros(8))
    start = robot.home.transform()
    held = block.set_at_equilibrium(context, start)
    lengths = block.GetOutputPort("unstrained_lengths").Eval(context).copy()
    tensions = block.set_at_equilibrium(context, start, PAID_OUT, at_rest=True)
    np.testing.assert_allclose(
        block.GetOutputPort("unstrained_lengths").Eval(context), lengths + PAID_OUT, atol=1e-12
    )
    np.testing.assert_allclose(block.GetOutputPort("tensions").Eval(context), tensions, atol=1e-3)
    assert np.sum(tensions <= 0.0) >= 1
    assert not np.allclose(tensions, held, atol=10.0)
    moved = block.GetOutputPort("X_WP").Eval(context)
    assert np.linalg.norm(moved.translation() - start.translation()) > 1e-3
    if kind is CableRobot:
        assert np.max(np.abs(block.EvalTimeDerivatives(context).CopyToVector())) < 1e-3
        return
    block.integrate_by(StepRule(max_step=1e-3))
    simulator.AdvanceTo(0.2)  # it hangs still
    later = block.GetOutputPort("X_WP").Eval(context)
    np.testing.assert_allclose(later.translation(), moved.translation(), atol=1e-6)


def test_without_slack_at_rest_changes_nothing():
    robot = load_robot("acrobot_small")
    block = CableRobot(robot)
    contexts = [block.CreateDefaultContext() for _ in range(2)]
    one, other = (
        block.set_at_equilibrium(context, robot.home.transform(), at_rest=at_rest)
        for context, at_rest in zip(contexts, (False, True), strict=True)
    )
    np.testing.assert_array_equal(one, other)


def test_slack_that_lets_the_platform_fall_out_of_the_frame_is_refused():
    robot = load_robot("acrobot_small")
    block = CableRobot(robot)
    with pytest.raises(CdprError):
        block.set_at_equilibrium(
            block.CreateDefaultContext(), robot.home.transform(), np.full(8, 2.0), at_rest=True
        )

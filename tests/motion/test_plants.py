"""Each motion type in a MultibodyPlant and in compiled steps: the same coordinates and motion."""

import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator

from cdpr_drake.geometry import cable_paths
from cdpr_drake.models import add_robot, pose_from_state, rigid_platform
from cdpr_drake.spatial import pose_error
from cdpr_drake.statics import equilibrium_near
from cdpr_drake.systems.robots import (
    CableRobot,
    CableRobotSettings,
    CableSettings,
    CompiledCableRobot,
    StepRule,
)
from tests.motion.small_robots import MOTIONS, small_robot

ROUNDING = 1e-12
ENGINES_AGREE = 1e-8
"""Of two integrations by the same method and step [m, rad]."""

DT = 2e-4
ELASTIC = CableRobotSettings(cables=CableSettings(model="elastic"))


def start_of(robot, random):
    """A pose that the robot can have, off its home, and lengths that let it swing."""
    X_WP, joint = robot.home.transform(), robot.joint()
    cables = robot.cable_set().without_pulleys()
    l0 = cable_paths(X_WP, cables).lengths * (1.0 - 2e-4)
    return joint.nearest(X_WP), l0, cables


@pytest.mark.parametrize("name", MOTIONS)
def test_state_and_pose_agree_with_the_plant(name):
    robot = small_robot(name)
    plant = MultibodyPlant(0.0)
    handle = add_robot(plant, robot)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    home = robot.home.transform()
    assert max(pose_error(handle.pose(context), home)) < ROUNDING
    joint = robot.joint()
    assert plant.num_multibody_states() == joint.num_states
    assert plant.num_velocities() == joint.num_velocities
    random = np.random.default_rng(0)
    for _ in range(3):
        state = random.uniform(-1.0, 1.0, joint.num_states)
        plant.SetPositionsAndVelocities(context, state)
        assert max(pose_error(handle.pose(context), pose_from_state(robot, state))) < ROUNDING
        X_WP = handle.pose(context)
        handle.set_pose(context, X_WP)
        assert max(pose_error(handle.pose(context), X_WP)) < ROUNDING
        v = random.normal(size=joint.num_velocities)
        plant.SetVelocities(context, v)
        V = plant.EvalBodySpatialVelocityInWorld(context, handle.body).get_coeffs()
        M = plant.CalcMassMatrix(context)
        expected = 0.5 * V @ rigid_platform(robot).mass_matrix(X_WP) @ V
        assert 0.5 * v @ M @ v == pytest.approx(expected, rel=1e-9)


def run(diagram, X_WP, l0, duration):
    context = diagram.CreateDefaultContext()
    diagram.GetInputPort("cable_velocities").FixValue(context, np.zeros(len(l0)))
    if isinstance(diagram, CableRobot):
        plant = diagram.GetMutableSubsystemContext(diagram.plant, context)
        diagram.in_plant.set_pose(plant, X_WP)
        winches = diagram.GetMutableSubsystemContext(diagram.winches, context)
        diagram.winches.set_unstrained_lengths(winches, l0)
    else:
        motion = diagram.motion
        motion.hold(motion.GetMyMutableContextFromRoot(context), X_WP, l0, np.zeros(len(l0)))
    simulator = Simulator(diagram, context)
    if isinstance(diagram, CableRobot):
        from pydrake.systems.analysis import ResetIntegratorFromFlags

        ResetIntegratorFromFlags(simulator, "runge_kutta3", DT)
        simulator.get_mutable_integrator().set_fixed_step_mode(True)
    simulator.Initialize()
    simulator.AdvanceTo(duration)
    state = diagram.GetOutputPort("platform_state").Eval(context)
    return context, diagram.GetOutputPort("X_WP").Eval(context), state


@pytest.mark.parametrize("name", MOTIONS)
def test_both_engines_move_it_alike_and_keep_its_energy(name):
    robot = small_robot(name)
    X_WP, l0, _ = start_of(robot, np.random.default_rng(0))
    compiled = CompiledCableRobot(robot, ELASTIC, rule=StepRule(max_step=DT))
    context = compiled.CreateDefaultContext()
    motion = compiled.motion
    motion.hold(motion.GetMyMutableContextFromRoot(context), X_WP, l0, np.zeros(len(l0)))
    before = motion.energy(motion.GetMyContextFromRoot(context))
    context, fast, state = run(compiled, X_WP, l0, 0.1)
    after = motion.energy(motion.GetMyContextFromRoot(context))
    _, slow, plant_state = run(CableRobot(robot, ELASTIC), X_WP, l0, 0.1)
    assert max(pose_error(fast, slow)) < ENGINES_AGREE
    np.testing.assert_allclose(state, plant_state, atol=1e-6)
    assert max(pose_error(fast, X_WP)) > 1e-5  # it moves
    stirred = 0.5 * np.sum(state[-robot.joint().num_velocities :] ** 2)
    assert abs(after - before) < 1e-5 * max(abs(before), stirred, 1.0)


@pytest.mark.parametrize("name", MOTIONS)
def test_it_stays_where_statics_rest_it(name):
    robot = small_robot(name)
    X_WP, l0, cables = start_of(robot, np.random.default_rng(0))
    rest = equilibrium_near(cables, "elastic", rigid_platform(robot), l0, X_WP)
    assert max(pose_error(robot.joint().nearest(rest.X_WP), rest.X_WP)) < 1e-9
    compiled = CompiledCableRobot(robot, ELASTIC, rule=StepRule(max_step=DT))
    _, reached, _ = run(compiled, rest.X_WP, l0, 0.05)
    assert max(pose_error(reached, rest.X_WP)) < 1e-6

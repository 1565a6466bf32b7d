"""Each motion type in a MultibodyPlant and in compiled steps: the same coordinates and motion."""

import numpy as np
import pytest
from pydrake.autodiffutils import AutoDiffXd
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator

from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import pose_error
from cdpr_drake.models.robot_in_plant import add_robot, pose_from_state
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.statics.equilibrium import equilibrium_near
from cdpr_drake.systems.robots.cable_forces import CableForces
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.settings import CableRobotSettings, CableSettings
from cdpr_drake.systems.robots.tension_driven_cables import TensionDrivenCables
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


@pytest.mark.parametrize("name", MOTIONS)
def test_generalized_forces_do_the_work_of_the_cables(name):
    robot = small_robot(name)
    plant = MultibodyPlant(0.0)
    handle = add_robot(plant, robot)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    X_WP, l0, cables = start_of(robot, np.random.default_rng(0))
    handle.set_pose(context, X_WP)
    random = np.random.default_rng(1)
    v = random.normal(size=plant.num_velocities())
    plant.SetVelocities(context, v)
    V = plant.EvalBodySpatialVelocityInWorld(context, handle.body).get_coeffs()
    paths = cable_paths(X_WP, cables)
    state = plant.get_state_output_port(handle.model_instance).Eval(context)

    def work(block, port, **inputs):
        asked = block.CreateDefaultContext()
        for key, value in {"platform_state": state, **inputs}.items():
            block.GetInputPort(key).FixValue(asked, value)
        return block.GetOutputPort(port).Eval(asked)

    m = cables.count
    tensions = random.uniform(1.0, 5.0, m)
    driven = TensionDrivenCables(handle)
    force = work(driven, "generalized_force", tensions=tensions)
    assert v @ force == pytest.approx(-(paths.J @ V) @ tensions)
    rates = work(driven, "length_rates", tensions=tensions)
    np.testing.assert_allclose(rates, paths.J @ V, atol=ROUNDING)
    block = CableForces(handle, cables, "elastic")
    lengths = {"unstrained_lengths": l0, "unstrained_length_rates": np.zeros(m)}
    force = work(block, "generalized_force", **lengths)
    pulled = work(block, "tensions", **lengths)
    stretched = cables.stiffness * np.maximum(paths.lengths / l0 - 1.0, 0.0)
    np.testing.assert_allclose(pulled, stretched, rtol=1e-9)
    assert v @ force == pytest.approx(-(paths.J @ V) @ stretched)
    both = work(block, "force_and_drums", **lengths)
    np.testing.assert_allclose(both, [*force, *pulled], rtol=1e-9, atol=1e-9)
    state = np.array([AutoDiffXd(x) for x in state])
    lengths = {key: np.array([AutoDiffXd(x) for x in value]) for key, value in lengths.items()}
    other = work(block.ToAutoDiffXd(), "generalized_force", **lengths)
    np.testing.assert_allclose([x.value() for x in other], force, rtol=1e-9, atol=1e-9)
    found = pose_from_state(robot, state).GetAsMatrix4()
    found = np.array([[x.value() for x in row] for row in found])
    np.testing.assert_allclose(found, X_WP.GetAsMatrix4(), atol=ROUNDING)


@pytest.mark.parametrize("name", ["slope", "upright_point", "oblique_body", "beam"])
def test_the_semi_implicit_method_follows_the_same_motion(name):
    robot = small_robot(name)
    X_WP, l0, _ = start_of(robot, np.random.default_rng(0))
    ends = [
        run(CompiledCableRobot(robot, rule=StepRule(method=method, max_step=5e-5)), X_WP, l0, 0.02)
        for method in ("runge_kutta3", "semi_implicit")
    ]
    moved = pose_error(ends[0][1], X_WP)
    assert max(moved) > 1e-4
    assert max(pose_error(ends[0][1], ends[1][1])) < 2e-3 * max(moved)  # of second order


@pytest.mark.parametrize("name", ["slope", "upright_point", "oblique_body", "tilted_gravity"])
def test_the_compiled_engine_says_how_bodies_move_in_the_world(name):
    robot = small_robot(name)
    X_WP, l0, cables = start_of(robot, np.random.default_rng(0))
    diagram = CompiledCableRobot(robot, ELASTIC)
    context = diagram.CreateDefaultContext()
    m = cables.count
    diagram.GetInputPort("cable_velocities").FixValue(context, np.zeros(m))
    random, joint, motion = np.random.default_rng(2), robot.joint(), diagram.motion
    own = motion.GetMyMutableContextFromRoot(context)
    motion.hold(own, X_WP, l0, np.zeros(m))
    state = motion.state(own).copy()
    n, nv = joint.num_states, joint.num_velocities
    state[n - nv : n] = random.normal(size=nv)
    motion.set_state(own, state)
    plant = MultibodyPlant(0.0)
    handle = add_robot(plant, robot)
    plant.Finalize()
    there = plant.CreateDefaultContext()
    plant.SetPositionsAndVelocities(there, state[:n])
    forces = CableForces(handle, cables, "elastic")
    asked = forces.CreateDefaultContext()
    inputs = {"platform_state": state[:n], "unstrained_lengths": l0,
              "unstrained_length_rates": np.zeros(m)}  # fmt: skip
    for key, value in inputs.items():
        forces.GetInputPort(key).FixValue(asked, value)
    pulls = forces.GetOutputPort("generalized_force").Eval(asked)
    plant.get_applied_generalized_force_input_port().FixValue(there, pulls)
    index = int(handle.body_index)
    V = diagram.GetOutputPort("body_velocities").Eval(context)[1]
    expected = plant.EvalBodySpatialVelocityInWorld(there, handle.body)
    np.testing.assert_allclose(V.get_coeffs(), expected.get_coeffs(), atol=1e-9)
    A = diagram.GetOutputPort("body_accelerations").Eval(context)[1]
    accelerations = plant.get_body_spatial_accelerations_output_port().Eval(there)
    np.testing.assert_allclose(A.get_coeffs(), accelerations[index].get_coeffs(), atol=1e-7)

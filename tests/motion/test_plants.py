"""Each motion type in a MultibodyPlant and in compiled steps: the same coordinates and motion."""

import numpy as np
import pytest
from pydrake.autodiffutils import AutoDiffXd
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import LinearSpringDamper
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import MatrixGain

from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import pose_error, rotation_from_vector
from cdpr_drake.models.robot_holding import rest_as_long
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
ENGINES_AGREE = 1e-8  # of two integrations by the same method and step [m, rad]
DT = 2e-4
ELASTIC = CableRobotSettings(cables=CableSettings(model="elastic"))

motions = pytest.mark.parametrize("name", MOTIONS)


def situation(name):
    """A robot, a pose that it can have, lengths that let it swing from there, its cables."""
    robot = small_robot(name)
    X_WP, cables = robot.home.transform(), robot.cable_set().without_pulleys()
    l0 = cable_paths(X_WP, cables).lengths * (1.0 - 2e-4)
    return robot, robot.joint().nearest(X_WP), l0, cables


def in_plant(robot):
    plant = MultibodyPlant(0.0)
    handle = add_robot(plant, robot)
    plant.Finalize()
    return plant, handle, plant.CreateDefaultContext()


def output(block, port, **inputs):
    context = block.CreateDefaultContext()
    for name, value in inputs.items():
        block.GetInputPort(name).FixValue(context, value)
    return block.GetOutputPort(port).Eval(context)


@motions
def test_state_and_pose_agree_with_the_plant(name):
    robot = small_robot(name)
    plant, handle, context = in_plant(robot)
    joint, random = robot.joint(), np.random.default_rng(0)
    assert max(pose_error(handle.pose(context), robot.home.transform())) < ROUNDING
    assert plant.num_multibody_states() == joint.num_states
    assert plant.num_velocities() == joint.num_velocities
    for _ in range(3):
        state = random.uniform(-1.0, 1.0, joint.num_states)
        plant.SetPositionsAndVelocities(context, state)
        X_WP = handle.pose(context)
        assert max(pose_error(X_WP, pose_from_state(robot, state))) < ROUNDING
        handle.set_pose(context, X_WP)
        assert max(pose_error(handle.pose(context), X_WP)) < ROUNDING
        v = random.normal(size=joint.num_velocities)
        plant.SetVelocities(context, v)
        V = plant.EvalBodySpatialVelocityInWorld(context, handle.body).get_coeffs()
        energy = 0.5 * V @ rigid_platform(robot).mass_matrix(X_WP) @ V
        assert 0.5 * v @ plant.CalcMassMatrix(context) @ v == pytest.approx(energy, rel=1e-9)


class Run:
    """A diagram of either kind that moves from rest at a pose."""

    def __init__(self, kind, robot, settings=ELASTIC, method="runge_kutta3", step=DT):
        rule = (
            {"rule": StepRule(method=method, max_step=step)} if kind is CompiledCableRobot else {}
        )
        self.diagram = kind(robot, settings, **rule)
        self.simulator = Simulator(self.diagram)
        self.context, m = self.simulator.get_mutable_context(), len(robot.cables)
        self.diagram.GetInputPort("cable_velocities").FixValue(self.context, np.zeros(m))
        if kind is CableRobot:
            ResetIntegratorFromFlags(self.simulator, "runge_kutta3", step)
            self.simulator.get_mutable_integrator().set_fixed_step_mode(True)

    def hold(self, X_WP, l0):
        if isinstance(self.diagram, CableRobot):
            plant = self.diagram.GetMutableSubsystemContext(self.diagram.plant, self.context)
            self.diagram.in_plant.set_pose(plant, X_WP)
            winches = self.diagram.GetMutableSubsystemContext(self.diagram.winches, self.context)
            self.diagram.winches.set_unstrained_lengths(winches, l0)
        else:
            motion = self.diagram.motion
            own = motion.GetMyMutableContextFromRoot(self.context)
            motion.hold(own, X_WP, l0, np.zeros(len(l0)))
        return self

    def advance(self, duration):
        self.simulator.Initialize()
        self.simulator.AdvanceTo(duration)
        return self

    def output(self, port):
        return self.diagram.GetOutputPort(port).Eval(self.context)

    def pose(self):
        return self.output("X_WP")

    def energy(self):
        motion = self.diagram.motion
        return motion.energy(motion.GetMyContextFromRoot(self.context))


@motions
def test_both_engines_move_it_alike_and_keep_its_energy_and_rest_stays(name):
    robot, X_WP, l0, cables = situation(name)
    compiled = Run(CompiledCableRobot, robot).hold(X_WP, l0)
    before = compiled.energy()
    state = compiled.advance(0.1).output("platform_state")
    plant = Run(CableRobot, robot).hold(X_WP, l0).advance(0.1)
    assert max(pose_error(compiled.pose(), plant.pose())) < ENGINES_AGREE
    np.testing.assert_allclose(state, plant.output("platform_state"), atol=1e-6)
    assert max(pose_error(compiled.pose(), X_WP)) > 1e-5  # it moves
    stirred = 0.5 * np.sum(state[-robot.joint().num_velocities :] ** 2)
    assert abs(compiled.energy() - before) < 1e-5 * max(abs(before), stirred, 1.0)
    rest = equilibrium_near(cables, "elastic", rigid_platform(robot), l0, X_WP).X_WP
    assert max(pose_error(robot.joint().nearest(rest), rest)) < 1e-9
    still = Run(CompiledCableRobot, robot).hold(rest, l0).advance(0.05)
    assert max(pose_error(still.pose(), rest)) < 1e-6


@motions
def test_generalized_forces_do_the_work_of_the_cables(name):
    robot, X_WP, l0, cables = situation(name)
    plant, handle, context = in_plant(robot)
    random, m = np.random.default_rng(1), cables.count
    handle.set_pose(context, X_WP)
    v = random.normal(size=plant.num_velocities())
    plant.SetVelocities(context, v)
    V = plant.EvalBodySpatialVelocityInWorld(context, handle.body).get_coeffs()
    paths = cable_paths(X_WP, cables)
    rates = paths.J @ V
    state = plant.get_state_output_port(handle.model_instance).Eval(context)
    driven = TensionDrivenCables(handle)
    inputs = {"platform_state": state, "tensions": random.uniform(1.0, 5.0, m)}
    power = v @ output(driven, "generalized_force", **inputs)
    assert power == pytest.approx(-rates @ inputs["tensions"])
    found = output(driven, "length_rates", **inputs)
    np.testing.assert_allclose(found, rates, atol=ROUNDING)
    block = CableForces(handle, cables, "elastic")
    inputs = {
        "platform_state": state, "unstrained_lengths": l0, "unstrained_length_rates": np.zeros(m)
    }  # fmt: skip
    force, pulls = (output(block, port, **inputs) for port in ("generalized_force", "tensions"))
    stretched = cables.stiffness * np.maximum(paths.lengths / l0 - 1.0, 0.0)
    np.testing.assert_allclose(pulls, stretched, rtol=1e-9)
    assert v @ force == pytest.approx(-rates @ stretched)
    both = output(block, "force_and_drums", **inputs)
    np.testing.assert_allclose(both, [*force, *pulls], rtol=1e-9, atol=1e-9)
    lifted = {key: np.array([AutoDiffXd(x) for x in value]) for key, value in inputs.items()}
    again = output(block.ToAutoDiffXd(), "generalized_force", **lifted)
    np.testing.assert_allclose([x.value() for x in again], force, rtol=1e-9, atol=1e-9)
    X = pose_from_state(robot, lifted["platform_state"]).GetAsMatrix4().ravel()
    values = [x.value() for x in X]
    np.testing.assert_allclose(values, X_WP.GetAsMatrix4().ravel(), atol=ROUNDING)


@pytest.mark.parametrize("name", ["slope", "upright_point", "oblique_body", "beam"])
def test_the_semi_implicit_method_follows_the_same_motion(name):
    robot, X_WP, l0, _ = situation(name)
    explicit, implicit = (
        Run(CompiledCableRobot, robot, None, method, 5e-5).hold(X_WP, l0).advance(0.02).pose()
        for method in ("runge_kutta3", "semi_implicit")
    )
    moved = pose_error(explicit, X_WP)
    assert max(moved) > 1e-4
    assert max(pose_error(explicit, implicit)) < 2e-3 * max(moved)  # of second order


@pytest.mark.parametrize("name", ["slope", "upright_point", "oblique_body", "tilted_gravity"])
def test_the_compiled_engine_says_how_bodies_move_in_the_world(name):
    robot, X_WP, l0, cables = situation(name)
    run, joint = Run(CompiledCableRobot, robot).hold(X_WP, l0), robot.joint()
    motion = run.diagram.motion
    own = motion.GetMyMutableContextFromRoot(run.context)
    n, nv = joint.num_states, joint.num_velocities
    state = motion.state(own).copy()
    state[n - nv : n] = np.random.default_rng(2).normal(size=nv)
    motion.set_state(own, state)
    plant, handle, there = in_plant(robot)
    plant.SetPositionsAndVelocities(there, state[:n])
    pulls = output(
        CableForces(handle, cables, "elastic"), "generalized_force", platform_state=state[:n],
        unstrained_lengths=l0, unstrained_length_rates=np.zeros(cables.count),
    )  # fmt: skip
    plant.get_applied_generalized_force_input_port().FixValue(there, pulls)
    V = plant.EvalBodySpatialVelocityInWorld(there, handle.body).get_coeffs()
    np.testing.assert_allclose(run.output("body_velocities")[1].get_coeffs(), V, atol=1e-9)
    accelerations = plant.get_body_spatial_accelerations_output_port().Eval(there)
    A = accelerations[int(handle.body_index)].get_coeffs()
    np.testing.assert_allclose(run.output("body_accelerations")[1].get_coeffs(), A, atol=1e-7)


@pytest.mark.parametrize("name", ["pendulum", "tripod", "hanging_four", "tilted_gravity"])
def test_pose_of_rest_is_where_drakes_springs_settle(name):
    """The platform on Drake's springs of the cables' stiffness, braked."""
    robot = small_robot(name)
    cables, home = robot.cable_set(), robot.home.transform()
    l0 = cable_paths(home, cables).lengths
    rest = equilibrium_near(cables, "elastic", rigid_platform(robot), l0, home)
    assert np.all(rest.tensions > 0.0)  # springs also push, cables do not
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    handle = add_robot(plant, robot)
    rows = zip(cables.p_WA.T, cables.p_PB.T, l0, cables.stiffness / l0, strict=True)
    for A, B, length, stiffness in rows:
        ends = plant.world_body(), A, handle.body, B
        plant.AddForceElement(LinearSpringDamper(*ends, length, stiffness, 2.0))
    plant.Finalize()
    D = np.hstack([np.zeros((6, 7)), -np.diag([0.5, 0.5, 0.5, 8.0, 8.0, 8.0])])
    brake = builder.AddSystem(MatrixGain(D))
    builder.Connect(plant.get_state_output_port(), brake.get_input_port())
    builder.Connect(brake.get_output_port(), plant.get_applied_generalized_force_input_port())
    simulator = Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    turn = np.zeros(3) if robot.motion_type().is_point else np.array([0.02, -0.03, 0.02])
    start = rest.X_WP.translation() + np.array([0.03, -0.02, 0.02])
    R = rotation_from_vector(turn) @ rest.X_WP.rotation()
    handle.set_pose(context, RigidTransform(R, start))
    ResetIntegratorFromFlags(simulator, "runge_kutta3", 2e-3)
    simulator.get_mutable_integrator().set_fixed_step_mode(True)
    simulator.AdvanceTo(12.0)
    assert max(pose_error(handle.pose(context), rest.X_WP)) < 1e-7


@pytest.mark.parametrize("kind", [CableRobot, CompiledCableRobot])
@pytest.mark.parametrize("name", ["pendulum", "tripod", "hanging_four"])
def test_it_hangs_swings_and_keeps_its_energy(name, kind):
    robot = small_robot(name)
    home, cables = robot.home.transform(), robot.cable_set().without_pulleys()
    platform, run = rigid_platform(robot), Run(kind, robot, step=1e-4)
    run.diagram.set_at_equilibrium(run.context, home)
    X_WP, l0 = run.pose(), cable_paths(home, cables).lengths
    if robot.is_underactuated():
        rest, holding = rest_as_long(robot, home, cables, "elastic")
        assert max(pose_error(X_WP, rest)) < 1e-12
        np.testing.assert_allclose(run.output("tensions"), holding.tensions, rtol=1e-6)
    else:
        l0 = run.output("unstrained_lengths").copy()

    def energy():
        X, V = run.pose(), run.output("platform_state")[7:]
        stretch = np.maximum(cable_paths(X, cables).lengths - l0, 0.0)
        kinetic = 0.5 * V @ platform.mass_matrix(X) @ V
        springs = 0.5 * np.sum(cables.stiffness / l0 * stretch**2)
        return kinetic, kinetic + springs + platform.potential_energy(X)

    lowest = energy()[1]
    p = X_WP.translation() + np.array([0.01, 0.02, 0.0])
    run.hold(RigidTransform(X_WP.rotation(), p), l0)
    before = energy()[1]
    run.advance(0.3)
    kinetic, after = energy()
    assert kinetic > 0.0
    assert abs(after - before) < 1e-7 * (before - lowest)

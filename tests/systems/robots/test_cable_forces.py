"""Forces of cables and wrenches on a platform: balance, virtual work, slackness, Newton, rest."""

from functools import cache

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from cdpr_drake.errors import CableGeometryError
from cdpr_drake.geometry.poses import pose_error
from cdpr_drake.models.robot_in_plant import add_robot, platform_inertia
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.systems.robots.cable_robot import CableRobot, automatic_step, holding_tensions
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.tension_driven_cables import TensionDrivenCables
from cdpr_drake.tensions.methods import exact_tensions
from tests.models.representative_robots import REPRESENTATIVE_ROBOTS
from tests.systems.robots.engines import (
    BY_ENGINE,
    POSE,
    fix_commands,
    pose,
    read,
    settings_of,
    started,
)

BALANCE = 1e-6
"""Force [N] and moment [N m] left at equilibrium; round-off of lengths (1e-16 m) times the
stiffness of the cables (up to 3 MN/m) stays a thousand times below."""

ROUND_OFF = 1e-12
"""Of a pose with entries of order one."""

FALL_SPEED = 1e-9
"""Round-off of a velocity after 0.1 s of free fall [m/s]; the integrators are exact on it."""

SETTLED = 2e-5
"""The platform settles by the change of the cables' stretch, within a fifth of a second [m]."""

AS_NEWTON = 1e-9
"""Relative error of accelerations: those of the cables are rounded to 1e-16 of forces that are a
thousand times the wrench, and of the mass matrix's condition."""

COMMANDED = 1e-9
"""Acceleration [m/s^2, rad/s^2] left by tensions that hold: the round-off of tensions, 1e-15."""

WRENCH = np.array([0.3, -0.2, 0.5, 4.0, -3.0, 2.0])


@cache
def shared(name):
    """A plant that every test gives a context of its own."""
    return CableRobot(load_robot(name))


def acrobot(retardation_time=None):
    robot = load_robot("acrobot_small")
    if retardation_time is not None:
        robot.cable.retardation_time = retardation_time
    return robot


def accelerations(block, context):
    derivatives = block.EvalTimeDerivatives(context).CopyToVector()
    return derivatives[block.plant.num_positions() :][: block.plant.num_velocities()]


@pytest.mark.parametrize("name", REPRESENTATIVE_ROBOTS)
def test_a_default_context_hangs_at_home_in_balance(name):
    """By the sums of forces and moments of straight cables, and by the plant's accelerations."""
    robot = load_robot(name)
    robot.cable_model = None
    X_WP, block = robot.home.transform(), CableRobot(robot)
    context = block.CreateDefaultContext()
    fix_commands(block, context)
    assert pose(block, context).IsNearlyEqualTo(X_WP, ROUND_OFF)
    bodies = block.GetOutputPort("body_poses").Eval(context)
    assert bodies[int(block.in_plant.body_index)].IsNearlyEqualTo(X_WP, ROUND_OFF)
    l0, tensions = read(block, context, "unstrained_lengths"), read(block, context, "tensions")
    held = block.set_at_equilibrium(context, X_WP)
    np.testing.assert_allclose(held, tensions, rtol=1e-6)
    np.testing.assert_allclose(held, read(block, context, "tensions"), atol=BALANCE)
    np.testing.assert_array_equal(read(block, context, "unstrained_lengths"), l0)

    anchors = X_WP.multiply(robot.anchor_points())
    pulls = robot.exit_points() - anchors
    forces = held * pulls / np.linalg.norm(pulls, axis=0)
    middle = X_WP.multiply(robot.center_of_mass())
    weight = np.array([0.0, 0.0, -robot.platform.mass * robot.gravity])
    force = np.sum(forces, axis=1) + weight
    moment = np.sum(np.cross((anchors.T - middle), forces.T), axis=0)
    if robot.is_planar():  # the joint carries what leaves the plane
        force, moment = force[:2], moment[2:]
    assert np.all(np.abs(force) < BALANCE)
    assert np.all(np.abs(moment) < BALANCE)
    M = block.plant.CalcMassMatrix(block.plant.GetMyContextFromRoot(context))
    assert np.all(np.abs(M @ accelerations(block, context)) < BALANCE)
    Simulator(block, context).AdvanceTo(0.002)


def lengthen(block, context, change):
    winches = block.GetSubsystemByName("winches")
    l0 = read(block, context, "unstrained_lengths") + change
    winches.set_unstrained_lengths(winches.GetMyMutableContextFromRoot(context), l0)


def test_a_cable_that_is_too_long_transmits_exactly_nothing():
    block, _, context = started(shared("acrobot_small"), load_robot("acrobot_small"), X_WP=POSE)
    tensions = read(block, context, "tensions")
    lengthen(block, context, 0.01 * (np.arange(8) == 3))
    found = read(block, context, "tensions")
    assert found[3] == 0.0
    np.testing.assert_array_equal(read(block, context, "slack"), np.arange(8) == 3)
    np.testing.assert_allclose(np.delete(found, 3), np.delete(tensions, 3), atol=BALANCE)


def test_a_taut_cable_that_shortens_fast_does_not_push():
    """Damping alone would make the tension negative; a cable cannot push."""
    block, _, context = started(CableRobot, acrobot(0.1), X_WP=POSE)
    plant_context = block.plant.GetMyMutableContextFromRoot(context)
    block.plant.SetVelocities(plant_context, np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.5]))
    np.testing.assert_array_equal(read(block, context, "tensions"), np.zeros(8))
    np.testing.assert_array_equal(read(block, context, "slack"), np.ones(8))


def test_with_slack_cables_the_platform_falls_freely():
    """Momentum grows by m g t, and the turn stays as it is."""
    robot, block = load_robot("acrobot_large"), shared("acrobot_large")
    _, simulator, context = started(block, robot)
    lengthen(block, context, 0.5)
    plant_context = block.plant.GetMyMutableContextFromRoot(context)
    block.plant.SetVelocities(plant_context, np.array([0.0, 0.0, 0.0, 0.1, -0.2, 0.3]))
    simulator.AdvanceTo(0.1)
    momentum = block.plant.CalcSpatialMomentumInWorldAboutPoint(plant_context, np.zeros(3))
    expected = 3.5 * np.array([0.1, -0.2, 0.3 - 9.81 * 0.1])
    np.testing.assert_allclose(momentum.translational(), expected, atol=3.5 * FALL_SPEED)
    velocity = block.in_plant.body.EvalSpatialVelocityInWorld(plant_context)
    np.testing.assert_allclose(velocity.rotational(), np.zeros(3), atol=FALL_SPEED)
    np.testing.assert_array_equal(read(block, context, "tensions"), np.zeros(8))
    np.testing.assert_array_equal(read(block, context, "slack"), np.ones(8))


@BY_ENGINE
@pytest.mark.parametrize("name", ["acrobot_large", "caroca", "planar", "nist_robocrane"])
def test_a_wrench_accelerates_as_newton_and_euler_say(kind, name):
    """At rest without it, so that what it adds is M^-1 w."""
    robot = load_robot(name)
    block, _, context = started(kind, robot)

    def acceleration():
        A = block.GetOutputPort("body_accelerations").Eval(context)[int(block.in_plant.body_index)]
        return np.concatenate([A.rotational(), A.translational()])

    before = acceleration()
    block.GetInputPort("applied_wrench").FixValue(context, WRENCH)
    added = acceleration() - before
    turned = robot.home.transform().rotation().matrix()
    R = np.kron(np.eye(2), turned)
    M = R @ platform_inertia(robot).CopyToFullMatrix6() @ R.T
    S = robot.motion_type().basis(turned)
    expected = S @ np.linalg.solve(S.T @ M @ S, S.T @ WRENCH)
    np.testing.assert_allclose(added, expected, atol=AS_NEWTON * np.abs(expected).max())


def test_no_wrench_is_one_of_zeros_to_the_bit():
    robot, states = load_robot("acrobot_large"), []
    for wrench in (None, np.zeros(6)):
        block, simulator, context = started(CompiledCableRobot, robot, wrench=wrench)
        simulator.AdvanceTo(0.05)
        states.append(read(block, context, "platform_state"))
    assert np.array_equal(*states)


def test_steps_get_shorter_as_the_platform_climbs_and_with_light_motors():
    robot = load_robot("acrobot_small")
    home, motors = robot.home.transform(), settings_of("velocity")
    steps = [automatic_step(robot, RigidTransform([0, 0, z]), "runge_kutta3") for z in (0.1, 0.8)]
    assert 0.0 < steps[1] < steps[0]
    ideal = automatic_step(robot, home, "runge_kutta3")
    assert automatic_step(robot, home, "runge_kutta3", motors) < ideal
    robot.winch.inertia = 3e-7
    assert automatic_step(robot, home, "runge_kutta3", motors) < 0.5 * ideal


DRIVEN = {
    "within friction": ("acrobot_small", "torque", True, 0.0, SETTLED),
    "without friction": ("acrobot_small", "torque", False, 20.0 * SETTLED, 1.0),
    "by position": ("caroca", "position", True, 0.0, SETTLED),
}


@pytest.mark.parametrize("case", DRIVEN)
def test_motors_hold_a_robot_by_friction_or_position_and_torques_alone_do_not(case):
    """Torques off balance, alternately; within friction motors do not turn at all."""
    name, mode, friction, least, most = DRIVEN[case]
    robot, how = load_robot(name), settings_of(mode)
    uneven = 0.5 * robot.winch_law().friction.static * np.array([1, -1] * 4)
    if not friction:
        robot.winch.friction = None
    step = automatic_step(robot, robot.home.transform(), "runge_kutta3", how)
    block, simulator, context = started(CableRobot, robot, how, step)
    if mode == "torque":
        rho = robot.winch_law().drum.length_per_angle(np.zeros(8))
        torques = -rho * read(block, context, "drum_tensions") + uneven
        block.GetInputPort("motor_torques").FixValue(context, torques)
    angles = read(block, context, "motor_angles")
    simulator.AdvanceTo(0.2)
    distance = pose_error(robot.home.transform(), pose(block, context))[0]
    assert least <= distance < most
    if case == "within friction":
        np.testing.assert_array_equal(read(block, context, "motor_angles"), angles)


class Bench:
    """A robot at its home pose with commanded tensions."""

    def __init__(self, name, tensions, push=False, cables=None):
        builder = DiagramBuilder()
        self.plant = builder.AddSystem(MultibodyPlant(0.0))
        self.in_plant = add_robot(self.plant, load_robot(name))
        self.plant.Finalize()
        self.cables = builder.AddSystem(TensionDrivenCables(self.in_plant, push, cables))
        command = builder.AddSystem(ConstantVectorSource(tensions))
        builder.Connect(command.get_output_port(), self.cables.GetInputPort("tensions"))
        builder.Connect(
            self.plant.get_state_output_port(self.in_plant.model_instance),
            self.cables.GetInputPort("platform_state"),
        )
        builder.Connect(
            self.cables.GetOutputPort("generalized_force"),
            self.plant.get_applied_generalized_force_input_port(),
        )
        self.simulator = Simulator(builder.Build())
        ResetIntegratorFromFlags(self.simulator, "runge_kutta3", 1e-3).set_fixed_step_mode(True)
        self.context = self.simulator.get_mutable_context()
        self.plant_context = self.plant.GetMyMutableContextFromRoot(self.context)

    def out(self, name):
        return read(self.cables, self.cables.GetMyContextFromRoot(self.context), name)

    def accelerations(self):
        derivatives = self.plant.EvalTimeDerivatives(self.plant_context).CopyToVector()
        return derivatives[self.plant.num_positions() :]

    def energy(self):
        return self.plant.CalcKineticEnergy(self.plant_context) + self.plant.CalcPotentialEnergy(
            self.plant_context
        )


def home_tensions(name):
    robot = load_robot(name)
    return holding_tensions(robot, robot.home.transform(), robot.cable_set(pulleys=False))


def test_lengths_do_not_wait_for_tensions():
    """Otherwise a controller that reads lengths and sets tensions were an algebraic loop."""
    cables = Bench("caroca", np.zeros(8)).cables
    tensions = int(cables.GetInputPort("tensions").get_index())
    waits = {"generalized_force": True, "lengths": False, "length_rates": False, "slack": True}
    assert waits == {
        name: cables.HasDirectFeedthrough(tensions, int(cables.GetOutputPort(name).get_index()))
        for name in waits
    }


@pytest.mark.parametrize("pulleys", [True, False])
@pytest.mark.parametrize("name", REPRESENTATIVE_ROBOTS)
def test_commanded_tensions_that_hold_leave_it_at_rest(name, pulleys):
    robot = load_robot(name)
    cables = robot.cable_set() if pulleys else None
    tensions = home_tensions(name)
    if pulleys:
        tensions = exact_tensions(tension_problem(robot, robot.home.transform(), cables=cables))
    found = Bench(name, tensions, cables=cables).accelerations()
    np.testing.assert_allclose(found, np.zeros_like(found), atol=COMMANDED)


@pytest.mark.parametrize(
    ("name", "pulleys"), [("acrobot_large", True), ("planar", True), ("acrobot_large", False)]
)
def test_commanded_tensions_do_the_work_that_the_platform_gains(name, pulleys):
    """Constant tensions do the work -t' (l(end) - l(start)); rates are derivatives of lengths."""
    robot = load_robot(name)
    tensions = home_tensions(name) * np.linspace(1.0, 1.3, len(robot.cables))
    bench = Bench(name, tensions, cables=robot.cable_set() if pulleys else None)
    before, lengths, step = bench.energy(), [bench.out("lengths")], 1e-4
    for time in (0.1 - step, 0.1, 0.1 + step):
        bench.simulator.AdvanceTo(time)
        lengths.append(bench.out("lengths"))
        if time == 0.1:
            rates = bench.out("length_rates")
    assert bench.plant.CalcKineticEnergy(bench.plant_context) > 0.0
    work = -tensions @ (lengths[3] - lengths[0])
    assert bench.energy() - before == pytest.approx(work, rel=1e-8)
    # Differences over 1e-4 s, with accelerations' rates of order ten.
    np.testing.assert_allclose(rates, (lengths[3] - lengths[1]) / (2.0 * step), atol=1e-7)


def test_a_cable_does_not_push_and_without_tensions_the_platform_falls():
    tensions = home_tensions("caroca")
    tensions[2], tensions[5] = -50.0, 0.0
    pushed, slack = Bench("caroca", tensions), Bench("caroca", np.maximum(tensions, 0.0))
    np.testing.assert_array_equal(pushed.out("generalized_force"), slack.out("generalized_force"))
    np.testing.assert_array_equal(pushed.out("slack"), [0, 0, 1, 0, 0, 1, 0, 0])
    falling = Bench("caroca", np.full(8, -1.0)).accelerations()
    np.testing.assert_allclose(falling, [0.0, 0.0, 0.0, 0.0, 0.0, -9.81], atol=COMMANDED)


@pytest.mark.parametrize("name", ["caroca", "planar"])
def test_rods_push(name):
    """The same force with both signs is nothing, where cables would give that of half of them."""
    tensions = home_tensions(name)
    pulled, pushed = (Bench(name, sign * tensions, push=True) for sign in (1.0, -1.0))
    force = pulled.out("generalized_force")
    np.testing.assert_array_equal(pushed.out("generalized_force"), -force)
    np.testing.assert_array_equal(force, Bench(name, tensions).out("generalized_force"))
    np.testing.assert_array_equal(pushed.out("slack"), np.ones(len(tensions)))


def test_an_anchor_point_in_a_groove_is_refused():
    cables = load_robot("caroca").cable_set()
    bench = Bench("caroca", home_tensions("caroca"), cables=cables)
    touching = RigidTransform(cables.p_WA[:, 0] - cables.p_PB[:, 0])
    bench.in_plant.set_pose(bench.plant_context, touching)
    with pytest.raises(CableGeometryError, match=r"at 0 s: cable 1: its anchor .* swivel axis"):
        bench.out("generalized_force")

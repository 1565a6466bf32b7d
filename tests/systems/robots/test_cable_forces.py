"""Forces of cables and wrenches on a platform: balance, slackness, Newton, energy, derivatives."""

from functools import cache

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from cdpr_drake.cables.catenary_kernel import free_part, stored_energy
from cdpr_drake.cables.elastic_law import elastic_energy
from cdpr_drake.cables.hanging_kernel import solve_catenary
from cdpr_drake.errors import CableGeometryError
from cdpr_drake.geometry.poses import pose_error
from cdpr_drake.models.robot_in_plant import add_robot, platform_inertia
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform, tension_problem
from cdpr_drake.statics.stiffness import natural_modes, platform_stiffness
from cdpr_drake.systems.robots.cable_forces import CableForces
from cdpr_drake.systems.robots.cable_robot import CableRobot, automatic_step, holding_tensions
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.tension_driven_cables import TensionDrivenCables
from cdpr_drake.tensions.methods import exact_tensions
from tests.models.representative_robots import REPRESENTATIVE_ROBOTS
from tests.models.robots import robot_of
from tests.models.test_platform_pulleys import robot_content
from tests.systems.robots.engines import (
    ALL_BEHAVIOUR,
    BY_ENGINE,
    POSE,
    behaving,
    fix_commands,
    integrate,
    linearized,
    moved,
    pose,
    put,
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


# Energy is kept where nothing takes it, else it is what winches put in.

ENERGY_DRIFT = 1e-6
"""Change of the total energy without damping, relative to the energy of the motion: what the motion
has above the equilibrium that it swings about. Steps are 1/200 of the fastest period."""

SWING = np.array([0.02, -0.015, 0.03, 0.002, 0.003, -0.003])
"""Cables a thousand times softer stay taut; tensions swing by nearly what they are at rest."""


def undamped(softer=1.0, heavier=1.0, robot=None):
    """ACROBOT with the small platform, without damping, on softer cables, or heavier ones."""
    robot = robot or load_robot("acrobot_small")
    robot.cable.retardation_time = 0.0
    robot.cable.youngs_modulus /= softer
    robot.cable.linear_density *= heavier
    return robot


def energy(block, context):
    """Kinetic, potential, and that of the cables: elastic, and their own weight where they sag."""
    plant_context = block.plant.GetMyContextFromRoot(context)
    total = block.plant.CalcKineticEnergy(plant_context)
    total += block.plant.CalcPotentialEnergy(plant_context)
    l0 = read(block, context, "unstrained_lengths")
    cables = block.forces.cable_set()
    if block.forces.model() != "catenary":
        return total + elastic_energy(read(block, context, "lengths"), l0, cables.stiffness)
    along = pose(block, context).multiply(cables.p_PB) - cables.p_WA
    for i in range(8):
        x, z = np.hypot(along[0, i], along[1, i]), along[2, i]
        ES, w = cables.stiffness[i], cables.linear_weight[i]
        H, V_A, good = solve_catenary(x, z, 0.0, 1.0, l0[i], ES, w, 0.0, 0.0)
        assert good
        *_, V, S, phi = free_part(H, V_A, l0[i], ES, w)
        total += stored_energy(x, z, l0[i], ES, w, H, V, S, phi)
    return total


SOFT, HEAVY = undamped(1e3), undamped(1e3, heavier=20.0)
SWINGS = {
    "straight": (SOFT, "elastic", False, 5e-4, 0.5),
    "pulleys": (SOFT, "elastic", True, 5e-4, 0.5),
    "pulleys at the platform": (
        undamped(200.0, robot=robot_of(robot_content())), "elastic", True, 2.5e-4, 0.25
    ),
    "catenary": (SOFT, "catenary", False, 5e-4, 0.5),
    "heavy catenary": (HEAVY, "catenary", False, 5e-4, 0.5),
}  # fmt: skip


@pytest.mark.parametrize("swing", SWINGS)
def test_undamped_cables_keep_the_energy(swing):
    robot, model, pulleys, step, duration = SWINGS[swing]
    how = settings_of(model=model, pulleys=pulleys)
    block, simulator, context = started(CableRobot, robot, how, X_WP=POSE)
    integrate(block, simulator, step, "runge_kutta5")
    rest = energy(block, context)
    put(block, context, moved(POSE, SWING))
    start = energy(block, context)
    for time in np.linspace(0.0, duration, 21)[1:]:
        simulator.AdvanceTo(time)
        assert abs(energy(block, context) - start) < ENERGY_DRIFT * (start - rest)
        assert model == "catenary" or not np.any(read(block, context, "slack"))


MOTOR_ENERGY = 1e-5
"""Change of the energy with motors, relative to what the motors put in."""


def test_platform_cables_and_motors_hold_what_the_torques_put_in():
    """Stretched cable takes power t e / 2 per length onto the drum with it: dV/dl0 of an elastic
    cable is -t (1 + e / 2), and the drum feels t."""
    robot = undamped(softer=100.0)
    robot.winch.friction = None
    block, simulator, context = started(CableRobot, robot, settings_of("torque"), 2e-4)
    rho = robot.winch_law().drum.length_per_angle(np.zeros(8))
    torques = -rho * read(block, context, "drum_tensions")
    torques *= np.array([1.3, 1.0, 0.9, 1.2, 1.0, 1.1, 0.8, 1.2])
    block.GetInputPort("motor_torques").FixValue(context, torques)

    def whole():
        speeds = read(block, context, "motor_speeds")
        total = energy(block, context) + 0.5 * robot.winch.inertia * np.sum(speeds**2)
        return total - torques @ read(block, context, "motor_angles")

    def wound_power():
        strain = read(block, context, "lengths") / read(block, context, "unstrained_lengths") - 1.0
        rates = read(block, context, "unstrained_length_rates")
        return np.sum(0.5 * robot.stiffness() * np.maximum(strain, 0.0) ** 2 * rates)

    start, angles, powers = whole(), read(block, context, "motor_angles"), [0.0]
    for time in np.arange(1, 201) * 1e-3:
        simulator.AdvanceTo(time)
        powers.append(wound_power())
    put_in = np.abs(torques) @ np.abs(read(block, context, "motor_angles") - angles)
    assert put_in > 0.03
    wound = np.trapezoid(powers, dx=1e-3)
    assert abs(whole() + wound - start) < MOTOR_ENERGY * put_in


# Derivatives by AutoDiffXd are those of differences, frequencies those of the stiffness.

DERIVATIVES = 1e-6
"""Central differences against AutoDiff, relative to the largest derivative."""

ELASTIC = settings_of(model="elastic", pulleys=True)
CATENARY = settings_of(model="catenary", pulleys=True)


def creeping():
    return behaving(load_robot("acrobot_small"), **ALL_BEHAVIOUR)


def over_platform_pulleys():
    return robot_of(robot_content())


CASES = {
    "straight": ("acrobot_small", settings_of(), POSE),
    "elastic": ("acrobot_small", ELASTIC, POSE),
    "catenary": ("acrobot_small", CATENARY, POSE),
    "pulleys at the platform": (over_platform_pulleys, settings_of(pulleys=True), POSE),
    "planar": ("planar", settings_of(), None),
    "planar, elastic": ("planar", ELASTIC, None),
    "planar, catenary": ("planar", CATENARY, None),
    "behaving": (creeping, settings_of(pulleys=True), POSE),
    "torque": ("acrobot_small", settings_of("torque"), None),
    "velocity": ("acrobot_small", settings_of("velocity"), None),
    "position": ("acrobot_small", settings_of("position"), None),
    "motors and catenaries": ("acrobot_small", settings_of("velocity", "catenary", True), POSE),
}


@pytest.mark.parametrize("case", CASES)
def test_linearisation_is_the_derivative_of_differences(case):
    name, how, X_WP = CASES[case]
    robot = name() if callable(name) else load_robot(name)
    block, _, context = started(CableRobot, robot, how, X_WP=X_WP)
    x0 = context.get_continuous_state_vector().CopyToVector()
    m, motors = len(robot.cables), how.winches.kind == "motor"
    if motors:  # turning, so that friction is that of sliding
        x0[13 + m : 13 + 2 * m] = np.linspace(-0.1, 0.12, m)
        context.SetContinuousState(x0)
    linear = linearized(block, context)
    A, step = np.empty((len(x0), len(x0))), 1e-8
    for j, e in enumerate(np.eye(len(x0))):
        ends = []
        for sign in (1.0, -1.0):
            context.SetContinuousState(x0 + sign * step * e)
            ends.append(block.EvalTimeDerivatives(context).CopyToVector())
        A[:, j] = (ends[0] - ends[1]) / (2.0 * step)
    np.testing.assert_allclose(linear.A(), A, rtol=0.0, atol=DERIVATIVES * np.max(np.abs(A)))
    if not motors and case != "behaving":
        # A winch that pays out changes its length at once, and the damping of its cable.
        np.testing.assert_array_equal(linear.B()[-m:], np.eye(m))


def test_a_robot_at_rest_on_motors_is_stable():
    robot = load_robot("acrobot_small")
    block, _, context = started(CableRobot, robot, CASES["motors and catenaries"][1], X_WP=POSE)
    assert np.max(np.linalg.eigvals(linearized(block, context).A()).real) < 1e-3


def test_frequencies_are_those_of_the_stiffness_matrix():
    """Undamped: eigenvalues of the Diagram against stiffness and mass by their own formulas."""
    robot = load_robot("acrobot_small")
    block, _, context = started(CableRobot, robot, ELASTIC, X_WP=POSE)
    values = np.linalg.eigvals(linearized(block, context).A())
    platform, l0 = rigid_platform(robot), read(block, context, "unstrained_lengths")
    K = platform_stiffness(robot.cable_set(), "elastic", platform, POSE, l0).total
    expected = 2 * np.pi * natural_modes(K, platform, POSE).frequencies
    np.testing.assert_allclose(np.sort(values.imag[values.imag > 1.0]), expected, rtol=1e-6)


def test_forces_of_broken_cables_are_the_same_on_autodiff():
    robot = load_robot("planar")
    block, found, m = CableForces(CableRobot(robot).in_plant, breakable=True), [], 4
    inputs = {
        "platform_state": [0.01, 0.02, 0.03, 0.1, -0.2, 0.3],
        "unstrained_lengths": np.full(m, 0.5),
        "unstrained_length_rates": np.zeros(m),
        "broken": (np.arange(m) == 1).astype(float),
    }
    for system in (block, block.ToAutoDiffXd()):
        context = system.CreateDefaultContext()
        for name, values in inputs.items():
            system.GetInputPort(name).FixValue(context, np.array(values))
        numbers = read(system, context, "generalized_force", "tensions")
        found.append(np.array([getattr(x, "value", lambda x=x: x)() for x in numbers], float))
    np.testing.assert_allclose(found[1], found[0], rtol=1e-12)
    assert found[0][-m + 1] == 0.0
    assert np.all(np.delete(found[0][-m:], 1) > 0.0)

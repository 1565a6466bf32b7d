"""Cables on a platform: equilibrium, slackness, conservation of energy and momentum."""

import numpy as np
import pytest
import scipy.linalg
from pydrake.math import RigidTransform
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator

from cdpr_drake.cables.elastic_law import cable_stiffness_matrix, elastic_energy
from cdpr_drake.geometry.poses import pose_error, rotation_from_vector
from cdpr_drake.geometry.straight_cables import length_jacobian
from cdpr_drake.models.robot_in_plant import platform_inertia
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.robots.cable_forces import CableForces
from cdpr_drake.systems.robots.cable_robot import CableRobot
from tests.models.representative_robots import REPRESENTATIVE_ROBOTS

BALANCE = 1e-6
"""Force [N] and moment [N m] left at equilibrium; round-off of lengths (1e-16 m) times the
stiffness of the cables (up to 3 MN/m) stays a thousand times below."""

ENERGY_DRIFT = 1e-6
"""Change of the total energy during 5 s without damping, relative to the energy of the motion: what
the motion has above the equilibrium that it swings about."""

MOTION_DURATION = 5.0
"""Simulated time of the energy tests [s]."""

FALL_SPEED = 1e-9
"""Round-off of a velocity after 0.1 s of free fall [m/s]; the integrators are exact on it."""

INTEGRATOR_SHARE = 2e-3
"""Difference of two integrators' platform positions, relative to the vibration's amplitude; their
step of 0.1 ms is 1/40 of the period of the fastest vibration, 1.5e3 rad/s."""

WINDING = 1e-5
"""Distance [m] and angle [rad] after 2 mm of winding: the Jacobian changes on the way (2 um) and
the cables, stretched by 7 um, stretch a little differently."""

POSE = RigidTransform([0.05, -0.08, 0.3])
"""A pose of ACROBOT's small platform off all symmetries, where all cables are taut."""


def hanging(robot, X_WP):
    """The robot's block, a simulator whose context holds it at rest at X_WP, and the tensions."""
    block = CableRobot(robot)
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    tensions = block.set_at_equilibrium(context, X_WP)
    block.GetInputPort("cable_velocities").FixValue(context, np.zeros(len(robot.cables)))
    return block, simulator, tensions


def undamped(softer=1.0):
    """ACROBOT with the small platform, without damping, Young's modulus divided by `softer`."""
    robot = load_robot("acrobot_small")
    robot.cable.retardation_time = 0.0
    robot.cable.youngs_modulus /= softer
    return robot


def total_energy(block, context):
    """Kinetic, potential and elastic energy [J]."""
    plant_context = block.plant.GetMyContextFromRoot(context)
    lengths, l0 = (
        block.GetOutputPort(name).Eval(context) for name in ("lengths", "unstrained_lengths")
    )
    return (
        block.plant.CalcKineticEnergy(plant_context)
        + block.plant.CalcPotentialEnergy(plant_context)
        + elastic_energy(lengths, l0, block.robot.stiffness())
    )


def put(block, context, X_WP):
    """Moves the platform, at rest, and leaves the cables' unstrained lengths as they are."""
    block.in_plant.set_pose(block.plant.GetMyMutableContextFromRoot(context), X_WP)


def moved(X_WP, displacement):
    """X_WP after a small displacement (rotation vector, translation) in W, shape (6,)."""
    turn = rotation_from_vector(displacement[:3])
    return RigidTransform(turn @ X_WP.rotation(), X_WP.translation() + displacement[3:])


def swing(robot, displacement, integrator, step):
    """Lets a hanging robot go from a displacement; fixed steps.

    Returns:
        Largest change of the total energy relative to the energy of the motion, and the largest
        number of cables that were slack at one of the looks, every 10 ms.
    """
    block, simulator, _ = hanging(robot, POSE)
    context = simulator.get_mutable_context()
    at_equilibrium = total_energy(block, context)
    put(block, context, moved(POSE, displacement))
    start = total_energy(block, context)
    ResetIntegratorFromFlags(simulator, integrator, step)
    simulator.get_mutable_integrator().set_fixed_step_mode(True)
    changes, slack = [], []
    for time in np.linspace(0.0, MOTION_DURATION, 501)[1:]:
        simulator.AdvanceTo(time)
        changes.append(abs(total_energy(block, context) - start))
        slack.append(np.sum(block.GetOutputPort("slack").Eval(context)))
    return max(changes) / (start - at_equilibrium), max(slack)


def test_ports_are_these():
    robot = load_robot("planar")
    cables = CableForces(CableRobot(robot).in_plant)
    inputs = [cables.get_input_port(i) for i in range(cables.num_input_ports())]
    outputs = [cables.get_output_port(i) for i in range(cables.num_output_ports())]
    assert {port.get_name(): port.size() for port in inputs} == {
        "platform_state": 6,
        "unstrained_lengths": 4,
        "unstrained_length_rates": 4,
    }
    assert {port.get_name(): port.size() for port in outputs} == {
        "generalized_force": 3,
        "tensions": 4,
        "force_and_drums": 7,
        "drum_tensions": 4,
        "lengths": 4,
        "slack": 4,
        "surplus_lengths": 4,
        "sags": 4,
    }


def test_ports_of_the_whole_robot_are_these():
    block = CableRobot(load_robot("acrobot_small"))
    assert [block.get_input_port(i).get_name() for i in range(block.num_input_ports())] == [
        "cable_velocities",
        "applied_wrench",
    ]
    assert {block.get_output_port(i).get_name() for i in range(block.num_output_ports())} == {
        "platform_state",
        "X_WP",
        "tensions",
        "drum_tensions",
        "lengths",
        "slack",
        "surplus_lengths",
        "sags",
        "unstrained_lengths",
        "unstrained_length_rates",
        "body_poses",
        "body_accelerations",
        "body_velocities",
        "query_object",
    }
    assert block.GetOutputPort("platform_state").size() == 13
    for name in ("plant", "scene_graph", "cables", "winches", "platform_pose"):
        assert block.GetSubsystemByName(name).get_name() == name


@pytest.mark.parametrize("name", REPRESENTATIVE_ROBOTS)
def test_hanging_tensions_balance_gravity(name):
    """By the sums of forces and moments, written out, and by the plant's accelerations."""
    robot = load_robot(name)
    robot.cable_model = None  # the sums are those of straight cables
    X_WP = robot.home.transform()
    block, simulator, tensions = hanging(robot, X_WP)
    context = simulator.get_context()

    anchors = X_WP.multiply(robot.anchor_points())
    pulls = robot.exit_points() - anchors
    forces = tensions * pulls / np.linalg.norm(pulls, axis=0)
    middle = X_WP.multiply(robot.center_of_mass())
    weight = np.array([0.0, 0.0, -robot.platform.mass * robot.gravity])
    force = np.sum(forces, axis=1) + weight
    moment = np.sum(np.cross((anchors.T - middle), forces.T), axis=0)
    if robot.is_planar():  # the joint carries what leaves the plane
        force, moment = force[:2], moment[2:]
    assert np.all(np.abs(force) < BALANCE)
    assert np.all(np.abs(moment) < BALANCE)

    derivatives = block.EvalTimeDerivatives(context).CopyToVector()
    nv = block.plant.num_velocities()
    accelerations = derivatives[block.plant.num_positions() :][:nv]
    M = block.plant.CalcMassMatrix(block.plant.GetMyContextFromRoot(context))
    assert np.all(np.abs(M @ accelerations) < BALANCE)


@pytest.mark.parametrize("name", REPRESENTATIVE_ROBOTS)
def test_tensions_on_the_port_are_those_that_hold_the_platform(name):
    robot = load_robot(name)
    block, simulator, tensions = hanging(robot, robot.home.transform())
    found = block.GetOutputPort("tensions").Eval(simulator.get_context())
    np.testing.assert_allclose(found, tensions, atol=BALANCE)


@pytest.mark.parametrize("name", ["acrobot_small", "planar"])
def test_generalized_force_does_the_work_of_the_tensions(name):
    """Virtual work: the force on the plant's velocities is -J' t, also away from equilibrium."""
    robot = load_robot(name)
    X_WP = robot.home.transform()
    block, simulator, _ = hanging(robot, X_WP)
    context = simulator.get_mutable_context()
    turned = np.array([0.0, 0.0, 0.002, 0.001, -0.002, 0.0])
    put(block, context, moved(X_WP, turned))
    cables = block.GetSubsystemByName("cables")
    own = cables.GetMyContextFromRoot(context)
    force = cables.GetOutputPort("generalized_force").Eval(own)
    tensions = cables.GetOutputPort("tensions").Eval(own)
    J = length_jacobian(moved(X_WP, turned), robot.exit_points(), robot.anchor_points())
    expected = -J.T @ tensions
    if robot.is_planar():
        expected = expected[[3, 4, 2]]  # the joint's velocities are (x, y, theta)
    np.testing.assert_allclose(force, expected, rtol=1e-9, atol=BALANCE)


def test_a_cable_that_is_too_long_transmits_exactly_nothing():
    robot = load_robot("acrobot_small")
    block, simulator, tensions = hanging(robot, POSE)
    context = simulator.get_mutable_context()
    l0 = block.GetOutputPort("unstrained_lengths").Eval(context).copy()
    l0[3] += 0.01
    winches = block.GetSubsystemByName("winches")
    winches.set_unstrained_lengths(winches.GetMyMutableContextFromRoot(context), l0)
    found = block.GetOutputPort("tensions").Eval(context)
    slack = block.GetOutputPort("slack").Eval(context)
    assert found[3] == 0.0
    np.testing.assert_array_equal(slack, np.arange(8) == 3)
    np.testing.assert_allclose(np.delete(found, 3), np.delete(tensions, 3), atol=BALANCE)


def test_a_taut_cable_that_shortens_fast_does_not_push():
    """Damping alone would make the tension negative; a cable cannot push."""
    robot = load_robot("acrobot_small")
    robot.cable.retardation_time = 0.1
    block, simulator, _ = hanging(robot, POSE)
    context = simulator.get_mutable_context()
    plant_context = block.plant.GetMyMutableContextFromRoot(context)
    block.plant.SetVelocities(plant_context, np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.5]))
    np.testing.assert_array_equal(block.GetOutputPort("tensions").Eval(context), np.zeros(8))
    np.testing.assert_array_equal(block.GetOutputPort("slack").Eval(context), np.ones(8))


@pytest.mark.parametrize("retardation_time", [0.0, 1e-3])
def test_damping_follows_the_length_rates(retardation_time):
    """t = E S (strain + T strain rate), the rate from finite differences of the lengths."""
    robot = load_robot("acrobot_small")
    robot.cable.retardation_time = retardation_time
    block, simulator, _ = hanging(robot, POSE)
    context = simulator.get_mutable_context()
    V = np.array([0.01, -0.02, 0.015, 1e-3, 2e-3, -1e-3])
    lengths = []
    step = 1e-5
    for share in (-step, step, 0.0):
        put(block, context, moved(POSE, share * V))
        lengths.append(block.GetOutputPort("lengths").Eval(context).copy())
    block.plant.SetVelocities(block.plant.GetMyMutableContextFromRoot(context), V)
    l0 = block.GetOutputPort("unstrained_lengths").Eval(context)
    rates = (lengths[1] - lengths[0]) / (2.0 * step)
    strain, strain_rate = lengths[2] / l0 - 1.0, rates / l0
    expected = robot.stiffness() * (strain + retardation_time * strain_rate)
    expected = np.where(strain > 0.0, np.maximum(expected, 0.0), 0.0)
    np.testing.assert_allclose(
        block.GetOutputPort("tensions").Eval(context), expected, rtol=1e-6, atol=1e-5
    )


def test_undamped_taut_cables_keep_the_energy():
    """Cables a thousand times softer; the tensions swing by nearly what they are at rest."""
    displacement = np.array([0.02, -0.015, 0.03, 0.002, 0.003, -0.003])
    drift, slack = swing(undamped(softer=1e3), displacement, "runge_kutta5", 5e-4)
    assert slack == 0
    assert drift < ENERGY_DRIFT


def test_undamped_taut_cables_of_acrobot_keep_the_energy():
    """The real stiffness, along the slowest vibration, which takes half of the stiff steps."""
    robot = undamped()
    J = length_jacobian(POSE, robot.exit_points(), robot.anchor_points())
    lengths = np.linalg.norm(robot.exit_points() - POSE.multiply(robot.anchor_points()), axis=0)
    K = cable_stiffness_matrix(J, robot.stiffness(), lengths)
    M = platform_inertia(robot).CopyToFullMatrix6()
    shape = scipy.linalg.eigh(K, M)[1][:, 0]
    displacement = 3e-6 * shape / np.max(np.abs(shape))
    drift, slack = swing(robot, displacement, "runge_kutta5", 8e-5)
    assert slack == 0
    assert drift < ENERGY_DRIFT


def test_undamped_cables_that_go_slack_and_catch_keep_the_energy():
    displacement = np.array([0.2, -0.1, 0.3, 0.01, 0.05, 0.15])
    # A step across the moment of a catch costs accuracy: hence the smaller steps.
    drift, slack = swing(undamped(softer=1e4), displacement, "runge_kutta5", 2.5e-4)
    assert slack == 8
    assert drift < ENERGY_DRIFT


def test_damping_only_takes_energy():
    robot = load_robot("acrobot_small")
    block, simulator, _ = hanging(robot, POSE)
    context = simulator.get_mutable_context()
    put(block, context, moved(POSE, np.array([0.0, 0.0, 0.0, 0.0, 0.0, 5e-3])))
    ResetIntegratorFromFlags(simulator, "runge_kutta3", 2e-4)
    simulator.get_mutable_integrator().set_fixed_step_mode(True)
    energies = [total_energy(block, context)]
    for time in np.linspace(0.0, 0.3, 31)[1:]:
        simulator.AdvanceTo(time)
        energies.append(total_energy(block, context))
    lost = energies[0] - energies[-1]
    assert lost > 0.0
    assert np.all(np.diff(energies) < ENERGY_DRIFT * lost)


def test_with_slack_cables_the_platform_falls_freely():
    """Momentum grows by m g t, and the turn stays as it is."""
    robot = load_robot("acrobot_large")
    block, simulator, _ = hanging(robot, robot.home.transform())
    context = simulator.get_mutable_context()
    winches = block.GetSubsystemByName("winches")
    l0 = block.GetOutputPort("unstrained_lengths").Eval(context)
    winches.set_unstrained_lengths(winches.GetMyMutableContextFromRoot(context), l0 + 0.5)
    plant_context = block.plant.GetMyMutableContextFromRoot(context)
    block.plant.SetVelocities(plant_context, np.array([0.0, 0.0, 0.0, 0.1, -0.2, 0.3]))
    ResetIntegratorFromFlags(simulator, "runge_kutta3", 1e-3)
    simulator.get_mutable_integrator().set_fixed_step_mode(True)
    simulator.AdvanceTo(0.1)
    momentum = block.plant.CalcSpatialMomentumInWorldAboutPoint(plant_context, np.zeros(3))
    expected = 3.5 * np.array([0.1, -0.2, 0.3 - 9.81 * 0.1])
    np.testing.assert_allclose(momentum.translational(), expected, atol=3.5 * FALL_SPEED)
    velocity = block.in_plant.body.EvalSpatialVelocityInWorld(plant_context)
    np.testing.assert_allclose(velocity.rotational(), np.zeros(3), atol=FALL_SPEED)
    np.testing.assert_array_equal(block.GetOutputPort("tensions").Eval(context), np.zeros(8))
    np.testing.assert_array_equal(block.GetOutputPort("slack").Eval(context), np.ones(8))


def test_an_explicit_and_an_implicit_integrator_agree():
    """A damped vibration of taut cables for 0.2 s, by Runge-Kutta 3 and by Radau 3."""
    ends = []
    amplitude = 3e-6
    for integrator in ("runge_kutta3", "radau3"):
        block, simulator, _ = hanging(load_robot("acrobot_small"), POSE)
        context = simulator.get_mutable_context()
        put(block, context, moved(POSE, np.array([0.0, 0.0, 0.0, amplitude, 0.0, amplitude])))
        ResetIntegratorFromFlags(simulator, integrator, 1e-4)
        simulator.get_mutable_integrator().set_fixed_step_mode(True)
        path = []
        for time in np.linspace(0.0, 0.2, 21)[1:]:
            simulator.AdvanceTo(time)
            path.append(block.GetOutputPort("X_WP").Eval(context).translation().copy())
        assert np.all(block.GetOutputPort("slack").Eval(context) == 0.0)
        ends.append(np.array(path))
    moved_by = np.max(np.abs(ends[0] - POSE.translation()))
    assert moved_by > 0.1 * amplitude
    assert np.max(np.abs(ends[0] - ends[1])) < INTEGRATOR_SHARE * amplitude


def test_winding_up_lifts_the_platform_as_far_as_kinematics_say():
    """Cable velocities J V move the platform by V t, up to the change of the cables' stretch."""
    robot = load_robot("acrobot_small")
    block, simulator, _ = hanging(robot, POSE)
    context = simulator.get_mutable_context()
    V = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.02])
    J = length_jacobian(POSE, robot.exit_points(), robot.anchor_points())
    block.GetInputPort("cable_velocities").FixValue(context, J @ V)
    ResetIntegratorFromFlags(simulator, "runge_kutta3", 1e-3)
    simulator.get_mutable_integrator().set_fixed_step_mode(True)
    simulator.AdvanceTo(0.1)
    wanted = moved(POSE, 0.1 * V)
    distance, angle = pose_error(wanted, block.GetOutputPort("X_WP").Eval(context))
    assert distance < WINDING
    assert angle < WINDING

"""Energy and momentum: kept where nothing takes them, else what dampers, contacts, winches take."""

import numpy as np
import pytest
import scipy.linalg
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput
from scipy.integrate import simpson
from scipy.spatial.transform import Rotation

from cdpr_drake.cables.catenary_kernel import free_part, stored_energy
from cdpr_drake.cables.elastic_law import cable_stiffness_matrix, elastic_energy
from cdpr_drake.cables.hanging_kernel import solve_catenary
from cdpr_drake.geometry.straight_cables import length_jacobian
from cdpr_drake.models.robot_in_plant import platform_inertia
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.disturbances import Disturbances, DisturbanceSettings, Push
from cdpr_drake.systems.robots.settings import CableRobotSettings, CableSettings, DampingSettings
from tests.systems.robots.engines import (
    POSE,
    integrate,
    made,
    moved,
    pose,
    put,
    read,
    settings_of,
    started,
)

ENERGY_DRIFT = 1e-6
"""Change of the total energy without damping, relative to the energy of the motion: what the motion
has above the equilibrium that it swings about. Steps are 1/200 of the fastest period."""

SWING = np.array([0.02, -0.015, 0.03, 0.002, 0.003, -0.003])
"""Cables a thousand times softer stay taut; tensions swing by nearly what they are at rest."""

BOUNCE = np.array([0.2, -0.1, 0.3, 0.01, 0.05, 0.15])


def undamped(softer=1.0, heavier=1.0):
    """ACROBOT with the small platform, without damping, on softer cables, or heavier ones."""
    robot = load_robot("acrobot_small")
    robot.cable.retardation_time = 0.0
    robot.cable.youngs_modulus /= softer
    robot.cable.linear_density *= heavier
    return robot


def slowest_vibration(robot):
    J = length_jacobian(POSE, robot.exit_points(), robot.anchor_points())
    lengths = np.linalg.norm(robot.exit_points() - POSE.multiply(robot.anchor_points()), axis=0)
    K = cable_stiffness_matrix(J, robot.stiffness(), lengths)
    M = platform_inertia(robot).CopyToFullMatrix6()
    shape = scipy.linalg.eigh(K, M)[1][:, 0]
    return 3e-6 * shape / np.max(np.abs(shape))


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
    "straight": (SOFT, CableSettings(model="elastic"), SWING, 5e-4, 0.5, 0),
    "pulleys": (SOFT, CableSettings(model="elastic", pulleys=True), SWING, 5e-4, 0.5, 0),
    "catenary": (SOFT, CableSettings(model="catenary"), SWING, 5e-4, 0.5, 0),
    "heavy catenary": (HEAVY, CableSettings(model="catenary"), SWING, 5e-4, 0.5, 0),
    # The real stiffness, along the slowest vibration, which takes half of the stiff steps.
    "stiff": (
        undamped(), CableSettings(), slowest_vibration(undamped()), 8e-5, 0.1, 0
    ),
    # A step across the moment of a catch costs accuracy: hence the smaller steps.
    "slack": (undamped(softer=1e4), CableSettings(), BOUNCE, 2.5e-4, 1.2, 8),
}  # fmt: skip


@pytest.mark.parametrize("swing", SWINGS)
def test_undamped_cables_keep_the_energy(swing):
    robot, cables, displacement, step, duration, most_slack = SWINGS[swing]
    block, simulator, context = started(
        CableRobot, robot, CableRobotSettings(cables=cables), X_WP=POSE
    )
    integrate(block, simulator, step, "runge_kutta5")
    rest = energy(block, context)
    put(block, context, moved(POSE, displacement))
    start = energy(block, context)
    slack = []
    for time in np.linspace(0.0, duration, 41)[1:]:
        simulator.AdvanceTo(time)
        assert abs(energy(block, context) - start) < ENERGY_DRIFT * (start - rest)
        slack.append(np.sum(read(block, context, "slack")))
    if cables.model != "catenary":
        assert max(slack) == most_slack


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


ROBOT = load_robot("acrobot_large")
HOW = CableRobotSettings(
    cables=CableSettings(stiffness_ratio=0.01, retardation_time=2e-3),
    damping=DampingSettings(translation=8.0, rotation=0.05),
)

STEP, ROW, HOLD, LASTS = 1e-4, 2.5e-4, 5e-3, 0.1
"""Integration step, rows of the log, time for which a wrench is held, and one push [s]."""

OF_LAW = 1e-8
"""Tensions by the law written once more [N]: lengths are rounded to 1e-16 m of cables of kN."""

CLOSED = 1e-6
"""What is left of the balance of a push, per energy that went through the port, the dampers, or the
storage in it, whichever is most: Simpson's rule over twenty rows of modes below 40 Hz, and the
integration's steps of 0.1 ms, each err by the fourth power of the step or less."""

SLACK = 1e-3
"""The same for pushes in which a cable goes slack or taut: its damping begins and ends with a jump
there, at which Simpson's rule errs by the power that jumps times a row."""


def pushes(count, seed):
    """One after the other, each held constant from one look to the next: half sines."""
    draws, found = np.random.default_rng(seed), []
    for k in range(count):
        force, moment = draws.uniform(-6.0, 6.0, 3), draws.uniform(-0.2, 0.2, 3)
        found.append(
            Push(kind="push", force=force, moment=moment, start=k * LASTS, end=(k + 0.8) * LASTS)
        )
    return found


def pushed(kind, count, seed):
    """Rows of a run of so many pushes: times, state, tensions, lengths, wrenches before."""
    builder = DiagramBuilder()
    block = builder.AddSystem(made(kind, ROBOT, HOW))
    settings = DisturbanceSettings(pushes=pushes(count, seed), rate=1.0 / HOLD)
    source = builder.AddSystem(Disturbances(settings, ROBOT.gravity_vector()))
    builder.Connect(source.GetOutputPort("wrench"), block.GetInputPort("applied_wrench"))
    builder.Connect(block.GetOutputPort("X_WP"), source.GetInputPort("X_WP"))
    builder.ExportInput(block.GetInputPort("cable_velocities"), "cable_velocities")
    names = ("platform_state", "tensions", "unstrained_lengths")
    logs = [LogVectorOutput(block.GetOutputPort(name), builder, ROW) for name in names]
    logs.append(LogVectorOutput(source.GetOutputPort("wrench"), builder, ROW))
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    diagram.get_input_port().FixValue(context, np.zeros(len(ROBOT.cables)))
    block.set_at_equilibrium(block.GetMyMutableContextFromRoot(context), ROBOT.home.transform())
    integrate(block, simulator, STEP)
    simulator.AdvanceTo(count * LASTS)
    found = [log.FindLog(context) for log in logs]
    return found[0].sample_times(), *(np.array(log.data().T) for log in found)


def straight(state):
    """Lengths of straight cables and their rates, shape (n, m) each [m, m/s]."""
    cables = HOW.cables.cable_set(ROBOT)
    R = Rotation.from_quat(state[:, [1, 2, 3, 0]])
    arms = np.array([R.apply(point) for point in cables.p_PB.T])  # (m, n, 3)
    ways = arms + state[:, 4:7] - cables.p_WA.T[:, np.newaxis]
    lengths = np.linalg.norm(ways, axis=2)
    velocities = state[:, 10:13] + np.cross(state[:, 7:10], arms)
    return lengths.T, (np.sum(ways * velocities, axis=2) / lengths).T


def stored(state, lengths, unstrained, stiffness):
    """Kinetic energy, potential energy and strain energy, shape (n,) [J]."""
    p, w, v = state[:, 4:7], state[:, 7:10], state[:, 10:13]
    R = Rotation.from_quat(state[:, [1, 2, 3, 0]])
    arm, own = R.apply(ROBOT.center_of_mass()), R.inv().apply(w)
    about = platform_inertia(ROBOT)
    inertia = about.Shift(about.get_com()).CalcRotationalInertia().CopyToFullMatrix3()
    centre = v + np.cross(w, arm)
    kinetic = 0.5 * ROBOT.platform.mass * np.sum(centre**2, axis=1)
    kinetic += 0.5 * np.sum((own @ inertia) * own, axis=1)
    potential = -ROBOT.platform.mass * (p + arm) @ ROBOT.gravity_vector()
    stretch = np.maximum(lengths / unstrained - 1.0, 0.0)
    return kinetic + potential + 0.5 * np.sum(stiffness * stretch**2 * unstrained, axis=1)


@pytest.mark.parametrize(("kind", "count"), [(CompiledCableRobot, 12), (CableRobot, 1)])
def test_what_a_push_gives_is_what_is_stored_and_what_dampers_take(kind, count):
    """By a law of Kelvin and Voigt of the test's own, as long as a cable pulls."""
    times, state, tensions, unstrained, wrenches = pushed(kind, count, seed=35)
    stiffness = HOW.cables.cable_set(ROBOT).stiffness
    lengths, rates = straight(state)
    w, v = state[:, 7:10], state[:, 10:13]
    elastic = stiffness * np.maximum(lengths / unstrained - 1.0, 0.0)
    damping = stiffness * HOW.cables.retardation_time * rates / unstrained
    pulls = np.where(elastic > 0.0, np.maximum(elastic + damping, 0.0), 0.0)
    np.testing.assert_allclose(tensions, pulls, atol=OF_LAW)
    lost = np.sum((pulls - elastic) * rates, axis=1)
    lost += HOW.damping.translation * np.sum(v**2, axis=1)
    lost += HOW.damping.rotation * np.sum(w**2, axis=1)
    energies, per = stored(state, lengths, unstrained, stiffness), round(HOLD / ROW)
    given, taken = [], []
    for k in range(0, len(times) - 1, per):
        rows = slice(k, k + per + 1)
        # A row at an instant holds what stood there before.
        power = np.concatenate([w[rows], v[rows]], axis=1) @ wrenches[k + 1]
        given.append(simpson(power, x=times[rows]))
        taken.append(simpson(lost[rows], x=times[rows]))
    given, taken = np.array([given, taken]).reshape(2, count, -1).sum(axis=2)
    each = round(LASTS / ROW)
    parts = [slice(k * each, (k + 1) * each + 1) for k in range(count)]
    slack = np.array([np.any(elastic[part] == 0.0) for part in parts])
    ups = np.array([np.ptp(energies[part]) for part in parts])
    most = np.max([np.abs(given), np.abs(taken), ups], axis=0)
    share = np.abs(given - taken - np.diff(energies[::each])) / most
    assert np.all(most > 1e-4)
    assert np.all(taken > 0.0)
    assert np.all(share[~slack] < CLOSED)
    assert np.all(share[slack] < SLACK)
    assert np.sum(~slack) >= 0.5 * count

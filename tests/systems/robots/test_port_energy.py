"""What the wrench port gives is what the robot stores and its dampers take, push by push."""

import numpy as np
import pytest
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput
from scipy.integrate import simpson
from scipy.spatial.transform import Rotation

from cdpr_drake.models.robot_in_plant import platform_inertia
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.disturbances import Disturbances, DisturbanceSettings, Push
from cdpr_drake.systems.robots.settings import CableRobotSettings, CableSettings, DampingSettings
from tests.systems.robots.engines import made

ROBOT = load_robot("acrobot_large")
HOW = CableRobotSettings(
    cables=CableSettings(stiffness_ratio=0.01, retardation_time=2e-3),
    damping=DampingSettings(translation=8.0, rotation=0.05),
)

STEP, ROW, HELD, LASTS = 1e-4, 2.5e-4, 5e-3, 0.1
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
    """Rows of a run of so many pushes: times, wrenches that held before, and the robot's state."""
    builder = DiagramBuilder()
    block = builder.AddSystem(made(kind, ROBOT, HOW))
    settings = DisturbanceSettings(pushes=pushes(count, seed), rate=1.0 / HELD)
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
    if kind is CableRobot:
        ResetIntegratorFromFlags(simulator, "runge_kutta3", STEP).set_fixed_step_mode(True)
    else:
        block.integrate_by(StepRule(max_step=STEP))
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


def stored(state, lengths, unstrained):
    """Kinetic energy, potential energy and strain energy, shape (n,) [J]."""
    turn, p, w, v = state[:, :4], state[:, 4:7], state[:, 7:10], state[:, 10:13]
    R = Rotation.from_quat(turn[:, [1, 2, 3, 0]])
    arm = R.apply(ROBOT.center_of_mass())
    mass, inertia = ROBOT.platform.mass, rotational_inertia()
    own = R.inv().apply(w)
    centre = v + np.cross(w, arm)
    kinetic = 0.5 * mass * np.sum(centre**2, axis=1)
    kinetic += 0.5 * np.sum((own @ inertia) * own, axis=1)
    potential = -mass * (p + arm) @ ROBOT.gravity_vector()
    stretch = np.maximum(lengths / unstrained - 1.0, 0.0)
    return kinetic + potential + 0.5 * np.sum(stiffness() * stretch**2 * unstrained, axis=1)


def rotational_inertia():
    """About the centre of mass, in axes of P, shape (3, 3) [kg m^2]."""
    about = platform_inertia(ROBOT)
    shifted = about.Shift(about.get_com())
    return shifted.CalcRotationalInertia().CopyToFullMatrix3()


def stiffness():
    """E S as mounted, shape (m,) [N]."""
    return HOW.cables.cable_set(ROBOT).stiffness


def balances(kind, count, seed):
    """Of each push what is left of its balance, its largest part [J], and whether a cable was slack
    at any row of it."""
    times, state, tensions, unstrained, wrenches = pushed(kind, count, seed)
    lengths, rates = straight(state)
    w, v = state[:, 7:10], state[:, 10:13]
    elastic = stiffness() * np.maximum(lengths / unstrained - 1.0, 0.0)
    # Kelvin and Voigt, as long as the cable pulls; by the law, so that it is not what is left.
    damping = stiffness() * HOW.cables.retardation_time * rates / unstrained
    pulls = np.where(elastic > 0.0, np.maximum(elastic + damping, 0.0), 0.0)
    np.testing.assert_allclose(tensions, pulls, atol=OF_LAW)
    lost = np.sum((pulls - elastic) * rates, axis=1)
    lost += HOW.damping.translation * np.sum(v**2, axis=1)
    lost += HOW.damping.rotation * np.sum(w**2, axis=1)
    energy, per = stored(state, lengths, unstrained), round(HELD / ROW)
    given, taken = [], []
    for k in range(0, len(times) - 1, per):
        rows = slice(k, k + per + 1)
        # A row at an instant holds what stood there before.
        power = np.concatenate([w[rows], v[rows]], axis=1) @ wrenches[k + 1]
        given.append(simpson(power, x=times[rows]))
        taken.append(simpson(lost[rows], x=times[rows]))
    parts = np.array([given, taken]).reshape(2, count, -1).sum(axis=2)
    each = round(LASTS / ROW)
    gained = np.diff(energy[::each])
    ups = np.array([np.ptp(energy[k * each : (k + 1) * each + 1]) for k in range(count)])
    slack = np.array([np.any(elastic[k * each : (k + 1) * each + 1] == 0.0) for k in range(count)])
    most = np.max([np.abs(parts[0]), np.abs(parts[1]), ups], axis=0)
    return parts[0] - parts[1] - gained, most, slack, parts


@pytest.mark.parametrize(("kind", "count"), [(CompiledCableRobot, 100), (CableRobot, 3)])
def test_the_balance_of_every_push_closes(kind, count):
    left, most, slack, parts = balances(kind, count, seed=35)
    assert np.all(most > 1e-4)
    assert np.all(parts[1] > 0.0)
    share = np.abs(left) / most
    assert np.all(share[~slack] < CLOSED)
    assert np.all(share[slack] < SLACK)
    assert np.sum(~slack) >= 0.5 * count

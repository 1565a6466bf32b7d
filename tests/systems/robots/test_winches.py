"""Winches: closed forms, rest, layers, AutoDiff, own contexts, several cables on one of them."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator

from cdpr_drake.formats.robot_exports import export_omissions
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.models.robot_holding import check_bundles
from cdpr_drake.models.sensor_catalogue import load_encoder
from cdpr_drake.systems.robots.cable_robot import automatic_step
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.motor_winch import COMMAND_PORTS, MotorWinch
from cdpr_drake.systems.robots.winches import VelocityWinch
from cdpr_drake.systems.sensors.sensor_kinds import SENSORS
from cdpr_drake.winches.drum import Drum
from cdpr_drake.winches.friction import FrictionLaw
from cdpr_drake.winches.groups import WinchGroups
from cdpr_drake.winches.motor import MODES, WinchLaw
from cdpr_drake.winches.motor_kernel import pack_winch, winch_rates
from tests.models.robots import robot_of
from tests.systems.robots.engines import (
    bundled,
    integrate,
    parallelograms,
    pose,
    read,
    settings_of,
    started,
)

FRICTION = FrictionLaw(coulomb=0.02, static=0.03, viscous=1e-4, stribeck_speed=5.0)
LAW = WinchLaw(
    drum=Drum(radius=0.04, gear_ratio=10.0),
    inertia=3e-5,
    rated_speed=314.0,
    rated_torque=0.64,
    friction=FRICTION,
)
FREE = replace(LAW, friction=FrictionLaw())
LAYERED = replace(
    LAW, drum=Drum(radius=0.04, gear_ratio=10.0, layer_turns=4.0, layer_height=0.002, wound=1.2)
)
HOME = np.array([1.0, 1.5])
PAID_OUT = np.array([0.4, -0.5])
RHO = 0.004

ROUND_OFF = 1e-12
"""Of an integral of constants over half a second [m]."""

RATED_SPEED = 0.5
START = np.array([1.0, 2.0, 3.0])


def ideal(velocities, lengths=START):
    """An ideal winch of three cables that holds these lengths."""
    winch = VelocityWinch(np.zeros(3), RATED_SPEED)
    simulator = Simulator(winch)
    context = simulator.get_mutable_context()
    winch.set_unstrained_lengths(context, lengths)
    winch.GetInputPort("cable_velocities").FixValue(context, velocities)
    return winch, simulator, context


def test_an_ideal_winch_integrates_velocities_up_to_its_rated_speed():
    winch, simulator, context = ideal([0.1, -7.0, RATED_SPEED])
    limited = np.array([0.1, -RATED_SPEED, RATED_SPEED])
    np.testing.assert_array_equal(read(winch, context, "unstrained_length_rates"), limited)
    simulator.AdvanceTo(0.5)
    found = read(winch, context, "unstrained_lengths")
    np.testing.assert_allclose(found, START + 0.5 * limited, atol=ROUND_OFF)


def test_contexts_of_one_ideal_winch_are_independent_and_hold_any_tension():
    winch, simulator, context = ideal(np.full(3, 0.1))
    other = Simulator(winch)
    winch.GetInputPort("cable_velocities").FixValue(other.get_mutable_context(), np.zeros(3))
    winch.hold(other.get_mutable_context(), 2.0 * START, np.array([1.0, 50.0, 1e4]))
    simulator.AdvanceTo(0.5)
    other.AdvanceTo(0.25)
    found = read(winch, context, "unstrained_lengths")
    np.testing.assert_allclose(found, START + 0.05, atol=ROUND_OFF)
    np.testing.assert_array_equal(read(winch, other.get_context(), "unstrained_lengths"), 2 * START)


def winch(mode, law=LAW, command=0.0, tension=0.0, step=1e-3):
    """Two winches with motors and fixed inputs, held at home."""
    block = MotorWinch(law, mode, HOME)
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    block.GetInputPort(COMMAND_PORTS[mode]).FixValue(context, np.zeros(2) + command)
    block.GetInputPort("tensions").FixValue(context, np.full(2, tension))
    block.hold(context, HOME, np.full(2, tension))
    integrate(block, simulator, step)
    return block, simulator, context


@pytest.mark.parametrize("mode", COMMAND_PORTS)
def test_cables_may_pull_on_what_pulls_on_them(mode):
    """No output that a cable reads depends on an input at the same instant."""
    block = MotorWinch(LAW, mode, HOME)
    for name in ("unstrained_lengths", "unstrained_length_rates", "motor_angles", "motor_speeds"):
        output = block.GetOutputPort(name).get_index()
        assert not any(block.HasDirectFeedthrough(i, output) for i in range(2)), name


def test_a_free_drum_pays_out_with_constant_acceleration():
    block, simulator, context = winch("torque", FREE, tension=0.5)
    simulator.AdvanceTo(0.2)
    a = RHO**2 * 0.5 / FREE.inertia
    lengths, rates = np.split(
        read(block, context, "unstrained_lengths", "unstrained_length_rates"), 2
    )
    np.testing.assert_allclose(lengths, HOME + 0.5 * a * 0.2**2, rtol=1e-12)
    np.testing.assert_allclose(rates, a * 0.2, rtol=1e-12)


@pytest.mark.parametrize("speed", [0.02, 0.1, 0.5])
def test_steady_speeds_lie_on_the_stribeck_curve(speed):
    block, simulator, context = winch("velocity", command=speed)
    simulator.AdvanceTo(0.6)
    w = read(block, context, "motor_speeds")
    np.testing.assert_allclose(w, speed / RHO, rtol=1e-9)
    np.testing.assert_allclose(read(block, context, "applied_torques"), FRICTION.sliding(w))
    np.testing.assert_allclose(read(block, context, "friction_torques"), FRICTION.sliding(w))


F_s = FRICTION.static


@pytest.mark.parametrize(
    ("command", "tension", "moves"),
    [(-0.999 * F_s, 0.0, False), (0.999 * F_s, 0.0, False), (1.001 * F_s, 0.0, True),
     (0.0, 7.4, False), (0.0, 7.6, True)],
)  # fmt: skip
def test_static_friction_holds_torques_and_cables_up_to_its_size(command, tension, moves):
    """F_s / rho = 7.5 N; below, the length is exactly what it was."""
    block, simulator, context = winch("torque", command=command, tension=tension)
    simulator.AdvanceTo(0.5)
    if moves:
        assert np.all(read(block, context, "motor_angles") > 0.01)
    else:
        np.testing.assert_array_equal(read(block, context, "unstrained_lengths"), HOME)
        held = read(block, context, "friction_torques")
        np.testing.assert_allclose(held, command + RHO * tension, rtol=1e-14)


@pytest.mark.parametrize(("mode", "command"), [("velocity", 0.0), ("position", HOME)])
def test_held_winches_stay_at_rest(mode, command):
    block, simulator, context = winch(mode, command=command, tension=30.0)
    simulator.AdvanceTo(0.2)
    np.testing.assert_array_equal(read(block, context, "unstrained_lengths"), HOME)
    np.testing.assert_allclose(read(block, context, "applied_torques"), -RHO * 30.0)


def test_a_position_loop_arrives():
    target = HOME + np.array([0.05, -0.03])
    block, simulator, context = winch("position", command=target, tension=10.0)
    simulator.AdvanceTo(2.0)
    np.testing.assert_allclose(read(block, context, "unstrained_lengths"), target, atol=1e-5)


def test_brakes_are_an_input_of_their_own():
    block, simulator, context = winch("torque", replace(LAW, brake_torque=0.5), command=0.2)
    block.GetInputPort("brakes").FixValue(context, [1.0, 0.0])
    simulator.AdvanceTo(0.1)
    angles = read(block, context, "motor_angles")
    assert angles[0] == 0.0
    assert angles[1] > 1.0


def length_per_angle(paid_out):
    """dl/dq of the layered drum where this much is paid out, by central differences [m/rad]."""
    q, step = LAYERED.drum.motor_angles(paid_out), 1e-4
    ahead, behind = (LAYERED.drum.paid_out(q + sign * step) for sign in (1.0, -1.0))
    return (ahead - behind) / (2.0 * step)


@pytest.mark.parametrize("mode", ["velocity", "position"])
def test_what_holds_a_cable_depends_on_the_layer_that_it_leaves(mode):
    """Counted from home: more is wound than there on one drum, and less on the other."""
    lengths, tensions = HOME + PAID_OUT, np.array([20.0, 30.0])
    block, _, context = winch(mode, LAYERED, np.zeros(2) if mode == "velocity" else lengths)
    block.GetInputPort("tensions").FixValue(context, tensions)
    block.hold(context, lengths, tensions)
    np.testing.assert_allclose(read(block, context, "unstrained_lengths"), lengths, rtol=1e-14)
    angles = LAYERED.drum.motor_angles(PAID_OUT)
    np.testing.assert_allclose(read(block, context, "motor_angles"), angles)
    rho = length_per_angle(PAID_OUT)
    assert rho[1] > rho[0] * 1.02
    torques = read(block, context, "applied_torques")
    np.testing.assert_allclose(torques, -rho * tensions, rtol=1e-8)
    np.testing.assert_array_equal(read(block, context, "motor_speeds"), 0.0)
    np.testing.assert_allclose(block.EvalTimeDerivatives(context).CopyToVector(), 0.0, atol=1e-9)
    block.set_unstrained_lengths(context, HOME)
    np.testing.assert_array_equal(read(block, context, "unstrained_lengths"), HOME)
    np.testing.assert_array_equal(read(block, context, "motor_angles"), 0.0)
    integrals = context.get_continuous_state_vector().CopyToVector()[4:]
    np.testing.assert_array_equal(integrals, 0.0)


def test_speeds_of_motors_depend_on_the_layer():
    block, _, context = winch("velocity", LAYERED)
    rates = np.array([0.2, -0.3])
    context.SetContinuousState(np.concatenate([HOME + PAID_OUT, rates, np.zeros(2)]))
    speeds = read(block, context, "motor_speeds")
    np.testing.assert_allclose(speeds * length_per_angle(PAID_OUT), rates, rtol=1e-8)
    np.testing.assert_array_equal(read(block, context, "unstrained_length_rates"), rates)


@pytest.mark.parametrize("law", [LAW, LAYERED], ids=["flat", "layered"])
@pytest.mark.parametrize("mode", COMMAND_PORTS)
def test_it_is_the_same_on_autodiff(mode, law):
    block, _, context = winch(mode, law, command=0.2, tension=5.0)
    state = np.random.default_rng(1).uniform(0.3, 1.0, context.num_continuous_states())
    context.SetContinuousState(state)
    twin = block.ToAutoDiffXd()
    twin_context = twin.CreateDefaultContext()
    twin_context.SetTimeStateAndParametersFrom(context)
    twin.FixInputPortsFrom(block, context, twin_context)
    names = [block.get_output_port(i).get_name() for i in range(block.num_output_ports())]
    found = [*twin.EvalTimeDerivatives(twin_context).CopyToVector()]
    found += [*read(twin, twin_context, *names)]
    expected = [*block.EvalTimeDerivatives(context).CopyToVector(), *read(block, context, *names)]
    np.testing.assert_allclose([x.value() for x in found], expected, rtol=1e-12, atol=1e-12)


# Several cables on one winch: a platform on three parallelograms.

STRETCH = 3e-4
"""How far stretches of cables of 350 kN move a platform of 5 kg [m, rad]."""

BUNDLED = bundled()
X_WP = BUNDLED.home.transform()


def test_winches_are_counted_in_the_order_of_their_first_cables():
    groups = WinchGroups.of_names(["b", None, "b", "a", None])
    assert groups.of_cable == (0, 1, 0, 2, 3)
    assert groups.count == 4
    assert groups.first_cables() == (0, 1, 3, 4)
    assert groups.leaders() == (0, 1, 0, 3, 4)
    np.testing.assert_array_equal(groups.sizes(), [2, 1, 2, 1, 1])
    np.testing.assert_array_equal(groups.means()[0], [0.5, 0, 0.5, 0, 0])
    np.testing.assert_array_equal(groups.to_cables().sum(axis=0), [2, 1, 1, 1])
    assert not WinchGroups.of_names([None] * 4).are_shared()


def test_one_velocity_pays_out_all_cables_of_a_winch():
    winch = VelocityWinch(np.arange(6.0), 0.5, BUNDLED.winch_groups())
    simulator = Simulator(winch)
    context = simulator.get_mutable_context()
    winch.GetInputPort("cable_velocities").FixValue(context, [0.1, -0.2, 9.0])
    simulator.AdvanceTo(1.0)
    rates = read(winch, context, "unstrained_length_rates")
    np.testing.assert_allclose(rates, [0.1, 0.1, -0.2, -0.2, 0.5, 0.5])
    lengths = read(winch, context, "unstrained_lengths")
    np.testing.assert_allclose(lengths, np.arange(6.0) + rates, atol=1e-12)


def test_the_platform_moves_without_turning():
    there = RigidTransform(X_WP.rotation(), X_WP.translation() + np.array([0.02, -0.03, 0.02]))
    cables = BUNDLED.cable_set().without_pulleys()
    change = cable_paths(there, cables).lengths - cable_paths(X_WP, cables).lengths
    np.testing.assert_allclose(change[::2], change[1::2], atol=1e-15)
    block, simulator, context = started(
        CompiledCableRobot, BUNDLED, settings_of(damping=60.0), 1e-4, command=change[::2] / 0.5
    )
    simulator.AdvanceTo(0.5)
    found = pose(block, context)
    assert np.linalg.norm(found.translation() - there.translation()) < 10 * STRETCH
    assert found.rotation().ToAngleAxis().angle() < 10 * STRETCH
    l0 = read(block, context, "unstrained_lengths")
    np.testing.assert_allclose(l0[::2] - l0[1::2], 0.0, atol=1e-4)


def test_a_motor_holds_all_cables_on_its_winch():
    block, simulator, context = started(CompiledCableRobot, BUNDLED, settings_of("velocity"))
    tensions, radius = read(block, context, "tensions"), BUNDLED.drum().radii(6)[0]
    torques = read(block, context, "applied_torques")
    np.testing.assert_allclose(torques[::2], -radius * (tensions[::2] + tensions[1::2]), rtol=1e-9)
    simulator.AdvanceTo(0.01)
    assert np.max(np.abs(read(block, context, "unstrained_length_rates"))) < 1e-9


def test_the_sum_of_tensions_turns_the_drum():
    content = parallelograms()
    content["winch"]["friction"] = None
    law, out = robot_of(content).winch_law(), np.empty(12)
    tensions, tau = np.array([5.0, 9.0, 4.0, 4.0, 1.0, 2.0]), np.repeat([-0.05, -0.02, 0.01], 2)
    winch_rates(
        np.r_[np.ones(6), np.zeros(6)], tensions, tau, np.zeros(6), np.ones(6), MODES["torque"],
        pack_winch(law), out,
    )  # fmt: skip
    rho = law.drum.radii(6)[0]
    sums = np.repeat(tensions[::2] + tensions[1::2], 2)
    np.testing.assert_allclose(out[6:], rho * (tau + rho * sums) / law.inertia, rtol=1e-12)


def test_one_encoder_tells_of_all_cables_on_a_winch():
    sensor = SENSORS["encoder"]
    encoders = sensor.make(load_encoder(sensor.types()[0]), BUNDLED, 0, 100.0)
    home = cable_paths(X_WP, BUNDLED.cable_set().without_pulleys()).lengths
    paid = np.array([0.1, 0.104, -0.2, -0.2, 0.3, 0.31])  # trimmed by a few millimetres
    angles, lengths = np.split(encoders.measure(home + paid, 0), 2)
    np.testing.assert_array_equal(angles[::2], angles[1::2])
    np.testing.assert_allclose(lengths - home, np.repeat(paid[::2], 2), atol=1e-4)


def test_steps_are_those_of_these_motors():
    doubled = automatic_step(BUNDLED, X_WP, "runge_kutta3", settings_of("torque"))
    content = parallelograms()
    for cable in content["cables"]:
        cable.pop("winch")
    single = automatic_step(robot_of(content), X_WP, "runge_kutta3", settings_of("torque"))
    assert 0.5 * single < doubled < single  # twice the stiffness on each motor


def test_a_translated_pose_is_within_reach_exports_tell_and_commands_are_by_winch():
    there = RigidTransform(X_WP.rotation(), [0.1, -0.05, 0.5])
    check_bundles(BUNDLED, BUNDLED.cable_set(), there)
    assert "a winch of its own" in export_omissions(BUNDLED, "wcrfx")["cables[].winch"]
    winches = MotorWinch(BUNDLED.winch_law(), "torque", np.ones(6))
    assert winches.GetInputPort("motor_torques").size() == 3

"""The block of winches with motors: ports, time responses, rest, energy, differentiation."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.primitives import Linearize

from cdpr_drake.systems.robots.motor_winch import COMMAND_PORTS, MotorWinch
from cdpr_drake.winches.drum import Drum
from cdpr_drake.winches.friction import FrictionLaw
from cdpr_drake.winches.motor import WinchLaw

FRICTION = FrictionLaw(coulomb=0.02, static=0.03, viscous=1e-4, stribeck_speed=5.0)
LAW = WinchLaw(
    drum=Drum(radius=0.04, gear_ratio=10.0),
    inertia=3e-5,
    rated_speed=314.0,
    rated_torque=0.64,
    friction=FRICTION,
)
LAYERED = replace(
    LAW, drum=Drum(radius=0.04, gear_ratio=10.0, layer_turns=4.0, layer_height=0.002, wound=1.2)
)
HOME = np.array([1.0, 1.5])
RHO = 0.004
STEP = 1e-3


def winch(mode, law=LAW, command=0.0, tension=0.0, step=STEP):
    """A simulator of two winches with fixed inputs, held at home."""
    block = MotorWinch(law, mode, HOME)
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    block.GetInputPort(COMMAND_PORTS[mode]).FixValue(context, np.full(2, command) + np.zeros(2))
    block.GetInputPort("tensions").FixValue(context, np.full(2, tension))
    block.hold(context, HOME, np.full(2, tension))
    ResetIntegratorFromFlags(simulator, "runge_kutta3", step).set_fixed_step_mode(True)
    return block, simulator, context


def port(block, context, name):
    return block.GetOutputPort(name).Eval(context).copy()


@pytest.mark.parametrize("mode", COMMAND_PORTS)
def test_ports_are_these(mode):
    block = MotorWinch(LAW, mode, HOME)
    inputs = [block.get_input_port(i).get_name() for i in range(block.num_input_ports())]
    outputs = [block.get_output_port(i).get_name() for i in range(block.num_output_ports())]
    assert inputs == [COMMAND_PORTS[mode], "tensions"]
    assert outputs == [
        "unstrained_lengths", "unstrained_length_rates", "motor_angles", "motor_speeds",
        "applied_torques", "friction_torques",
    ]  # fmt: skip


@pytest.mark.parametrize("mode", COMMAND_PORTS)
def test_cables_may_pull_on_what_pulls_on_them(mode):
    """No output that a cable reads depends on an input at the same instant."""
    block = MotorWinch(LAW, mode, HOME)
    for name in ("unstrained_lengths", "unstrained_length_rates", "motor_angles", "motor_speeds"):
        output = block.GetOutputPort(name).get_index()
        assert not any(block.HasDirectFeedthrough(i, output) for i in range(2))


def test_a_free_drum_pays_out_with_constant_acceleration():
    law = replace(LAW, friction=FrictionLaw())
    block, simulator, context = winch("torque", law, tension=0.5)
    simulator.AdvanceTo(0.2)
    a = RHO**2 * 0.5 / law.inertia
    np.testing.assert_allclose(
        port(block, context, "unstrained_lengths"), HOME + 0.5 * a * 0.2**2, rtol=1e-12
    )
    np.testing.assert_allclose(port(block, context, "unstrained_length_rates"), a * 0.2, rtol=1e-12)


def test_a_motor_reaches_the_speed_at_which_viscous_friction_balances_it():
    """w(t) = tau / F_v (1 - exp(-F_v t / J))."""
    law = replace(LAW, friction=FrictionLaw(viscous=3e-4))
    block, simulator, context = winch("torque", law, command=0.03)
    simulator.AdvanceTo(0.3)
    expected = 100.0 * (1.0 - np.exp(-3e-4 * 0.3 / 3e-5))
    np.testing.assert_allclose(port(block, context, "motor_speeds"), expected, rtol=1e-8)


def test_steady_speeds_lie_on_the_stribeck_curve():
    for speed in (0.02, 0.1, 0.5):
        block, simulator, context = winch("velocity", command=speed)
        simulator.AdvanceTo(0.6)
        w = port(block, context, "motor_speeds")
        np.testing.assert_allclose(w, speed / RHO, rtol=1e-9)
        np.testing.assert_allclose(port(block, context, "applied_torques"), FRICTION.sliding(w))
        np.testing.assert_allclose(port(block, context, "friction_torques"), FRICTION.sliding(w))


@pytest.mark.parametrize("share", [-0.999, 0.999])
def test_a_torque_below_static_friction_does_not_move_a_winch(share):
    """Not at all: the length is exactly what it was."""
    block, simulator, context = winch("torque", command=share * FRICTION.static)
    simulator.AdvanceTo(1.0)
    np.testing.assert_array_equal(port(block, context, "unstrained_lengths"), HOME)
    held = port(block, context, "friction_torques")
    np.testing.assert_allclose(held, share * FRICTION.static, rtol=1e-14)


def test_a_torque_above_static_friction_does():
    block, simulator, context = winch("torque", command=1.001 * FRICTION.static)
    simulator.AdvanceTo(1.0)
    assert np.all(port(block, context, "motor_angles") > 1.0)


def test_static_friction_holds_a_cable_that_the_motor_leaves_to_it():
    """Up to F_s / rho = 7.5 N."""
    for tension, moves in ((7.4, False), (7.6, True)):
        block, simulator, context = winch("torque", tension=tension)
        simulator.AdvanceTo(0.5)
        assert np.all((port(block, context, "motor_angles") != 0.0) == moves)


def test_held_winches_stay_at_rest():
    for mode, command in (("velocity", 0.0), ("position", HOME)):
        block, simulator, context = winch(mode, command=command, tension=30.0)
        simulator.AdvanceTo(0.3)
        np.testing.assert_array_equal(port(block, context, "unstrained_lengths"), HOME)
        np.testing.assert_allclose(port(block, context, "applied_torques"), -RHO * 30.0)


def test_a_position_loop_arrives():
    target = HOME + np.array([0.05, -0.03])
    block, simulator, context = winch("position", command=target, tension=10.0)
    simulator.AdvanceTo(2.0)
    np.testing.assert_allclose(port(block, context, "unstrained_lengths"), target, atol=1e-5)


def test_energy_balances():
    """Work of motor and cable is kinetic energy and what friction takes, to the integrator."""
    block, simulator, context = winch("velocity", command=0.3, tension=5.0, step=1e-4)
    work, lost, before = 0.0, 0.0, None
    for time in np.arange(1, 2001) * 1e-4:
        simulator.AdvanceTo(time)
        w = port(block, context, "motor_speeds")
        driven = (port(block, context, "applied_torques") + RHO * 5.0) * w
        taken = port(block, context, "friction_torques") * w
        if before is not None:
            work = work + 0.5e-4 * (driven + before[0])
            lost = lost + 0.5e-4 * (taken + before[1])
        before = driven, taken
    kinetic = 0.5 * LAW.inertia * port(block, context, "motor_speeds") ** 2
    # Trapezoids over 0.1 ms of torques that jump at the start.
    np.testing.assert_allclose(work - lost, kinetic, rtol=2e-3)


def test_brakes_are_an_input_of_their_own():
    law = replace(LAW, brake_torque=0.5)
    block, simulator, context = winch("torque", law, command=0.2)
    block.GetInputPort("brakes").FixValue(context, [1.0, 0.0])
    simulator.AdvanceTo(0.1)
    angles = port(block, context, "motor_angles")
    assert angles[0] == 0.0
    assert angles[1] > 1.0


def test_layers_change_what_a_turn_pays_out():
    drum = LAYERED.drum
    block = MotorWinch(LAYERED, "velocity", HOME)
    context = block.CreateDefaultContext()
    lengths = HOME + np.array([0.4, -0.5])
    block.hold(context, lengths, np.zeros(2))
    np.testing.assert_allclose(port(block, context, "unstrained_lengths"), lengths, rtol=1e-14)
    np.testing.assert_allclose(
        port(block, context, "motor_angles"), drum.motor_angles(np.array([0.4, -0.5]))
    )


def length_per_angle(paid_out):
    """dl/dq of the layered drum where this much is paid out, by central differences [m/rad]."""
    q, step = LAYERED.drum.motor_angles(paid_out), 1e-4
    ahead, behind = (LAYERED.drum.paid_out(q + sign * step) for sign in (1.0, -1.0))
    return (ahead - behind) / (2.0 * step)


@pytest.mark.parametrize("mode", ["velocity", "position"])
def test_what_holds_a_cable_depends_on_the_layer_that_it_leaves(mode):
    """Counted from home: more is wound than there on one drum, and less on the other."""
    lengths, tensions = HOME + np.array([0.4, -0.5]), np.array([20.0, 30.0])
    block = MotorWinch(LAYERED, mode, HOME)
    context = block.CreateDefaultContext()
    command = np.zeros(2) if mode == "velocity" else lengths
    block.GetInputPort(COMMAND_PORTS[mode]).FixValue(context, command)
    block.GetInputPort("tensions").FixValue(context, tensions)
    block.hold(context, lengths, tensions)
    rho = length_per_angle(lengths - HOME)
    assert rho[1] > rho[0] * 1.02
    np.testing.assert_allclose(port(block, context, "applied_torques"), -rho * tensions, rtol=1e-8)
    np.testing.assert_array_equal(port(block, context, "motor_speeds"), 0.0)
    np.testing.assert_allclose(block.EvalTimeDerivatives(context).CopyToVector(), 0.0, atol=1e-9)
    block.set_unstrained_lengths(context, HOME)
    np.testing.assert_array_equal(port(block, context, "unstrained_lengths"), HOME)
    np.testing.assert_array_equal(port(block, context, "motor_angles"), 0.0)
    integrals = context.get_continuous_state_vector().CopyToVector()[4:]
    np.testing.assert_array_equal(integrals, 0.0)


def test_speeds_of_motors_depend_on_the_layer():
    block = MotorWinch(LAYERED, "velocity", HOME)
    context = block.CreateDefaultContext()
    rates, paid_out = np.array([0.2, -0.3]), np.array([0.4, -0.5])
    context.SetContinuousState(np.concatenate([HOME + paid_out, rates, np.zeros(2)]))
    speeds = port(block, context, "motor_speeds")
    np.testing.assert_allclose(speeds * length_per_angle(paid_out), rates, rtol=1e-8)
    np.testing.assert_array_equal(port(block, context, "unstrained_length_rates"), rates)


@pytest.mark.parametrize("law", [LAW, LAYERED], ids=["flat", "layered"])
@pytest.mark.parametrize("mode", COMMAND_PORTS)
def test_it_converts_to_autodiff_with_the_same_derivatives(mode, law):
    block, _, context = winch(mode, law, command=0.2, tension=5.0)
    state = np.random.default_rng(1).uniform(0.3, 1.0, context.num_continuous_states())
    context.SetContinuousState(state)
    twin = block.ToAutoDiffXd()
    twin_context = twin.CreateDefaultContext()
    twin_context.SetTimeStateAndParametersFrom(context)
    twin.FixInputPortsFrom(block, context, twin_context)
    rates = twin.EvalTimeDerivatives(twin_context).CopyToVector()
    expected = block.EvalTimeDerivatives(context).CopyToVector()
    np.testing.assert_allclose([r.value() for r in rates], expected, rtol=1e-12, atol=1e-12)
    for index in range(block.num_output_ports()):
        name = block.get_output_port(index).get_name()
        found = [x.value() for x in twin.GetOutputPort(name).Eval(twin_context)]
        np.testing.assert_allclose(found, port(block, context, name), rtol=1e-12, atol=1e-12)


def test_linearization_has_the_poles_of_the_loop():
    """About a steady speed, without dry friction."""
    law = replace(LAW, friction=FrictionLaw())
    block, simulator, context = winch("velocity", law, command=0.1)
    simulator.AdvanceTo(1.0)
    linear = Linearize(
        block,
        context,
        block.GetInputPort("cable_velocities").get_index(),
        block.GetOutputPort("unstrained_length_rates").get_index(),
        equilibrium_check_tolerance=np.inf,
    )
    found = np.sort(np.linalg.eigvals(linear.A()).real)
    np.testing.assert_allclose(found, [-100.0] * 4 + [0.0] * 2, atol=1e-3)

"""The ideal winch: integrates what it is told, within its rated speed."""

import numpy as np
from pydrake.systems.analysis import Simulator

from cdpr_drake.systems.robots.winches import VelocityWinch

ROUND_OFF = 1e-12
"""Of an integral of constants over half a second [m]."""

RATED_SPEED = 0.5
START = np.array([1.0, 2.0, 3.0])


def winch_at(lengths):
    """A winch of three cables and a simulator whose context holds these lengths."""
    winch = VelocityWinch(np.zeros(3), RATED_SPEED)
    simulator = Simulator(winch)
    winch.set_unstrained_lengths(simulator.get_mutable_context(), lengths)
    return winch, simulator


def test_ports_are_these():
    winch = VelocityWinch(np.zeros(3), RATED_SPEED)
    assert winch.num_input_ports() == 1
    assert winch.GetInputPort("cable_velocities").size() == 3
    assert winch.num_output_ports() == 2
    for name in ("unstrained_lengths", "unstrained_length_rates"):
        assert winch.GetOutputPort(name).size() == 3


def test_lengths_integrate_the_velocities():
    winch, simulator = winch_at(START)
    context = simulator.get_mutable_context()
    velocities = np.array([0.1, -0.2, 0.0])
    winch.GetInputPort("cable_velocities").FixValue(context, velocities)
    simulator.AdvanceTo(0.5)
    np.testing.assert_allclose(
        winch.GetOutputPort("unstrained_lengths").Eval(context),
        START + 0.5 * velocities,
        atol=ROUND_OFF,
    )
    rates = winch.GetOutputPort("unstrained_length_rates").Eval(context)
    np.testing.assert_array_equal(rates, velocities)


def test_a_motor_turns_no_faster_than_its_rated_speed():
    winch, simulator = winch_at(START)
    context = simulator.get_mutable_context()
    winch.GetInputPort("cable_velocities").FixValue(context, [7.0, -7.0, RATED_SPEED])
    limited = RATED_SPEED * np.array([1.0, -1.0, 1.0])
    rates = winch.GetOutputPort("unstrained_length_rates").Eval(context)
    np.testing.assert_array_equal(rates, limited)
    simulator.AdvanceTo(0.5)
    lengths = winch.GetOutputPort("unstrained_lengths").Eval(context)
    np.testing.assert_allclose(lengths, START + 0.5 * limited, atol=ROUND_OFF)


def test_contexts_of_one_winch_are_independent():
    winch = VelocityWinch(np.zeros(3), RATED_SPEED)
    simulators = [Simulator(winch), Simulator(winch)]
    for simulator, speed in zip(simulators, (0.1, -0.1), strict=True):
        context = simulator.get_mutable_context()
        winch.set_unstrained_lengths(context, START + speed)
        winch.GetInputPort("cable_velocities").FixValue(context, np.full(3, speed))
    simulators[0].AdvanceTo(0.5)
    simulators[1].AdvanceTo(0.25)
    for simulator, expected in zip(simulators, (START + 0.15, START - 0.125), strict=True):
        lengths = winch.GetOutputPort("unstrained_lengths").Eval(simulator.get_context())
        np.testing.assert_allclose(lengths, expected, atol=ROUND_OFF)


def test_it_holds_any_tension_where_it_is_put():
    winch, simulator = winch_at(START)
    context = simulator.get_mutable_context()
    winch.GetInputPort("cable_velocities").FixValue(context, np.zeros(3))
    winch.hold(context, 2.0 * START, np.array([1.0, 50.0, 1e4]))
    simulator.AdvanceTo(0.1)
    lengths = winch.GetOutputPort("unstrained_lengths").Eval(context)
    np.testing.assert_array_equal(lengths, 2.0 * START)

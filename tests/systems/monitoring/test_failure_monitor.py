"""Names of failures of winches: a drum that was told jammed and then turns is not blocked."""

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator

from cdpr_drake.estimation.failure_detection import AlarmRule
from cdpr_drake.estimation.failure_watch import EncoderWatch, MotorWatch
from cdpr_drake.systems.monitoring.failure_monitor import FailureMonitor, WatchRules
from cdpr_drake.winches.friction import FrictionLaw

PERIOD, IN_A_ROW = 0.002, 5


@pytest.fixture
def watched():
    """A monitor of two motors, and its simulator, with everything at rest."""
    friction = FrictionLaw(coulomb=0.01, static=0.02)
    motor = MotorWatch(np.full(2, 0.01), friction, 1e-4, 2.0 * np.pi * 10.0, PERIOD)
    monitor = FailureMonitor(
        WatchRules(
            motor, AlarmRule(0.05, IN_A_ROW), 10**6, EncoderWatch(PERIOD, 1.0),
            AlarmRule(1e3, IN_A_ROW), 1e3, 1e3,
        )
    )  # fmt: skip
    simulator = Simulator(monitor)
    context = simulator.get_mutable_context()
    for name in ("torques", "tensions", "lengths", "length_rates"):
        monitor.GetInputPort(name).FixValue(context, np.zeros(2))
    monitor.GetInputPort("found").FixValue(context, [1.0])
    monitor.GetInputPort("X_CO").FixValue(context, Value(RigidTransform()))
    return monitor, simulator, context


def told(monitor, context):
    return [
        monitor.GetOutputPort(name).Eval(context).tolist()
        for name in ("found_jammed", "found_powerless")
    ]


def test_a_drum_that_turns_after_all_had_no_power(watched):
    monitor, simulator, context = watched
    simulator.AdvanceTo(0.1)
    assert told(monitor, context) == [[0.0, 0.0], [0.0, 0.0]]
    monitor.GetInputPort("torques").FixValue(context, [0.2, 0.2])  # and nothing moves
    simulator.AdvanceTo(0.3)
    assert told(monitor, context) == [[1.0, 1.0], [0.0, 0.0]]
    monitor.GetInputPort("length_rates").FixValue(context, [0.0, 0.1])
    simulator.AdvanceTo(0.3 + (IN_A_ROW - 2) * PERIOD)
    assert told(monitor, context) == [[1.0, 1.0], [0.0, 0.0]]
    simulator.AdvanceTo(0.3 + (IN_A_ROW + 2) * PERIOD)
    assert told(monitor, context) == [[1.0, 0.0], [0.0, 1.0]]
    monitor.GetInputPort("length_rates").FixValue(context, np.zeros(2))
    simulator.AdvanceTo(0.5)
    assert told(monitor, context) == [[1.0, 0.0], [0.0, 1.0]]  # for good

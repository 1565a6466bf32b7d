"""Estimator 1: exact where the platform does what it is told, without lag."""

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from cdpr_drake.geometry.poses import exponential, pose_error, pose_from_angles
from cdpr_drake.systems.estimators.basic_estimators import ControlIntegration

ROUND_OFF = 1e-12
"""Products of some ten poses with entries of order one."""

RATE = 25.0
PERIOD = 1.0 / RATE
START = pose_from_angles(np.array([0.1, -0.2, 0.3]), np.array([0.2, -0.3, 0.5]))
TWIST = np.array([0.7, -0.4, 1.1, 0.2, -0.1, 0.3])


class Source(LeafSystem):
    """Holds a new twist from each update to the next, as a servo does."""

    def __init__(self, twists):
        super().__init__()
        self._twists = twists
        index = self.DeclareDiscreteState(6)
        self.DeclarePeriodicDiscreteUpdateEvent(PERIOD, 0.0, self._update)
        self.DeclareStateOutputPort("platform_velocity", index)

    def _update(self, context, state):
        state.set_value(self._twists[round(context.get_time() * RATE)])


def test_ports_are_these():
    estimator = ControlIntegration(START, RATE)
    assert estimator.num_input_ports() == estimator.num_output_ports() == 1
    assert estimator.GetInputPort("platform_velocity").size() == 6
    assert isinstance(estimator.GetOutputPort("X_WP").Allocate().get_value(), RigidTransform)


def test_it_begins_at_the_given_pose():
    estimator = ControlIntegration(START, RATE)
    context = estimator.CreateDefaultContext()
    estimator.GetInputPort("platform_velocity").FixValue(context, TWIST)
    found = estimator.GetOutputPort("X_WP").Eval(context)
    assert max(pose_error(START, found)) < ROUND_OFF


@pytest.mark.parametrize("time", [0.3 * PERIOD, PERIOD, 1.7 * PERIOD, 10.0 * PERIOD, 12.9 * PERIOD])
def test_a_constant_twist_is_integrated_exactly(time):
    """At updates and between them, X_WP(t) = X_WP(0) exp(V t)."""
    estimator = ControlIntegration(START, RATE)
    simulator = Simulator(estimator)
    context = simulator.get_mutable_context()
    estimator.GetInputPort("platform_velocity").FixValue(context, TWIST)
    simulator.AdvanceTo(time)
    expected = START @ exponential(TWIST * time)
    assert max(pose_error(expected, estimator.GetOutputPort("X_WP").Eval(context))) < ROUND_OFF


@pytest.mark.parametrize("source_first", [True, False])
def test_it_does_not_lag_behind_a_controller_that_updates_at_the_same_times(source_first):
    """Whichever of the two was added first, and between updates too."""
    twists = np.random.default_rng(2).standard_normal((12, 6))
    builder = DiagramBuilder()
    source, estimator = Source(twists), ControlIntegration(START, RATE)
    for system in (source, estimator) if source_first else (estimator, source):
        builder.AddSystem(system)
    builder.Connect(source.get_output_port(), estimator.get_input_port())
    diagram = builder.Build()
    simulator = Simulator(diagram)
    X_WP = START
    for twist in twists:
        since = simulator.get_context().get_time()
        for share in (0.25, 0.8, 1.0):
            simulator.AdvanceTo(since + share * PERIOD)
            found = estimator.GetOutputPort("X_WP").Eval(
                estimator.GetMyContextFromRoot(simulator.get_context())
            )
            expected = X_WP @ exponential(twist * share * PERIOD)
            assert max(pose_error(expected, found)) < ROUND_OFF
        X_WP = X_WP @ exponential(twist * PERIOD)


def test_the_rotation_stays_a_rotation():
    """After thousands of products, which would each add their round-off."""
    estimator = ControlIntegration(START, 1e4)
    simulator = Simulator(estimator)
    context = simulator.get_mutable_context()
    estimator.GetInputPort("platform_velocity").FixValue(context, TWIST)
    simulator.AdvanceTo(0.5)
    found = estimator.GetOutputPort("X_WP").Eval(context)
    R = found.rotation().matrix()
    np.testing.assert_allclose(R.T @ R, np.eye(3), atol=ROUND_OFF)
    distance, angle = pose_error(START @ exponential(TWIST * 0.5), found)
    assert distance < 1e3 * ROUND_OFF
    assert angle < 1e3 * ROUND_OFF

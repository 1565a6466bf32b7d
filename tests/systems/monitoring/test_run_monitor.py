"""The monitor of a run: each outcome, its time, and that the simulator stops."""

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator, SimulatorStatus

from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.systems.monitoring.run_monitor import Outcome, RunMonitor, StopRules

RATE = 25.0
PERIOD = 1.0 / RATE

LATE = 2.0 * PERIOD
"""A condition is seen at the next update, the simulator told at the publish event after it [s]."""

RULES = StopRules(
    position=0.01,
    rotation=np.radians(1.0),
    hold=0.5,
    lost=1.0,
    lower=np.array([-1.0, -1.0, 0.0]),
    upper=np.array([1.0, 1.0, 2.0]),
)

X_CdO = pose_from_angles(np.array([0.0, 0.0, 0.3]), np.array([np.pi, 0.0, 0.0]))
INSIDE = RigidTransform([0.0, 0.0, 0.5])


def away(distance, angle):
    """A pose at this distance [m] and angle [rad] from the desired one."""
    return (
        RigidTransform([0.0, distance, 0.0])
        @ X_CdO
        @ pose_from_angles(np.zeros(3), np.array([0.0, 0.0, angle]))
    )


class Run:
    """A monitor before inputs that a test sets."""

    def __init__(self):
        self.monitor = RunMonitor(RULES, X_CdO, RATE)
        self.simulator = Simulator(self.monitor)
        self.show()

    def show(self, X_CO=X_CdO, found=1.0, X_WP=INSIDE):
        """Sets the inputs from now on."""
        context = self.simulator.get_mutable_context()
        for name, value in (("X_CO", Value(X_CO)), ("X_WP", Value(X_WP)), ("found", [found])):
            self.monitor.GetInputPort(name).FixValue(context, value)

    def until(self, time):
        """Advances; returns the outcome and the time at which the simulator stopped."""
        self.status = self.simulator.AdvanceTo(time)
        context = self.simulator.get_context()
        outcome = self.monitor.outcome(context)
        assert self.monitor.GetOutputPort("outcome").Eval(context) == float(outcome)
        return outcome, context.get_time()

    def was_stopped(self, word):
        """Whether the monitor ended the simulation and said this word."""
        reason = SimulatorStatus.ReturnReason.kReachedTerminationCondition
        return self.status.reason() == reason and word in self.status.message()


def test_ports_are_these():
    monitor = Run().monitor
    inputs = [monitor.get_input_port(i) for i in range(monitor.num_input_ports())]
    assert [(port.get_name(), port.size()) for port in inputs] == [
        ("X_CO", 0),
        ("found", 1),
        ("X_WP", 0),
    ]
    assert monitor.num_output_ports() == 1
    assert monitor.GetOutputPort("outcome").size() == 1


def test_outcomes_have_the_names_that_summaries_print():
    assert [outcome.name.lower() for outcome in Outcome] == [
        "running",
        "converged",
        "target_lost",
        "timeout",
        "diverged",
        "interrupted",
        "completed",
        "cable_broken",
        "client_ended",
        "contact",
        "failed",
    ]


def test_it_converges_when_the_pose_was_held():
    run = Run()
    assert run.until(RULES.hold - PERIOD) == (Outcome.RUNNING, RULES.hold - PERIOD)
    outcome, time = run.until(5.0)
    assert outcome == Outcome.CONVERGED
    assert RULES.hold <= time <= RULES.hold + LATE
    assert run.was_stopped("converged")


def test_the_time_of_holding_begins_anew_when_the_pose_is_left():
    run = Run()
    run.until(0.4)
    run.show(X_CO=away(0.02, 0.0))
    run.until(0.5)
    run.show()
    outcome, time = run.until(5.0)
    assert outcome == Outcome.CONVERGED
    assert 0.5 + RULES.hold <= time <= 0.5 + PERIOD + RULES.hold + LATE


@pytest.mark.parametrize(
    ("distance", "angle_deg", "outcome"),
    [
        (0.0099, 0.99, Outcome.CONVERGED),
        (0.0101, 0.0, Outcome.RUNNING),
        (0.0, 1.01, Outcome.RUNNING),
    ],
)
def test_distance_and_angle_both_count(distance, angle_deg, outcome):
    run = Run()
    run.show(X_CO=away(distance, np.radians(angle_deg)))
    assert run.until(2.0)[0] == outcome


def test_it_ends_when_the_target_was_lost_for_long():
    run = Run()
    run.show(X_CO=RigidTransform(), found=0.0)
    assert run.until(RULES.lost - PERIOD)[0] == Outcome.RUNNING
    outcome, time = run.until(5.0)
    assert outcome == Outcome.TARGET_LOST
    assert RULES.lost <= time <= RULES.lost + LATE
    assert run.was_stopped("target_lost")


def test_a_target_that_comes_back_was_not_lost():
    run = Run()
    run.show(X_CO=X_CdO, found=0.0)
    run.until(0.9)
    run.show(X_CO=away(0.1, 0.0))
    run.until(1.0)
    run.show(found=0.0)
    assert run.until(1.8)[0] == Outcome.RUNNING
    assert run.until(3.0)[0] == Outcome.TARGET_LOST


def test_a_pose_of_a_lost_target_is_not_reached():
    """The ports keep a pose when nothing is found; it says nothing."""
    run = Run()
    run.show(X_CO=X_CdO, found=0.0)
    assert run.until(RULES.hold + LATE)[0] == Outcome.RUNNING


@pytest.mark.parametrize(
    "position", [[1.1, 0.0, 0.5], [0.0, -1.1, 0.5], [0.0, 0.0, -0.01], [0.0, 0.0, 2.1]]
)
def test_it_ends_at_once_when_the_platform_leaves_the_frame(position):
    run = Run()
    run.show(X_CO=away(0.1, 0.0))
    run.until(0.3)
    run.show(X_CO=away(0.1, 0.0), X_WP=RigidTransform(position))
    outcome, time = run.until(5.0)
    assert outcome == Outcome.DIVERGED
    assert time <= 0.3 + PERIOD + LATE
    assert run.was_stopped("diverged")


def test_a_run_that_goes_on_is_not_stopped():
    run = Run()
    run.show(X_CO=away(0.1, 0.0))
    assert run.until(3.0) == (Outcome.RUNNING, 3.0)
    assert run.status.reason() == SimulatorStatus.ReturnReason.kReachedBoundaryTime

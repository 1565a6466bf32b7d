"""Blocks that watch a run: outcomes and their times, broken cables, failures, rows of the log."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator, SimulatorStatus
from pydrake.systems.framework import LeafSystem

from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.errors import ScenarioError
from cdpr_drake.estimation.failure_detection import AlarmRule
from cdpr_drake.estimation.failure_watch import EncoderWatch, MotorWatch
from cdpr_drake.geometry.poses import pose_error, pose_from_angles, pose_from_row, pose_row
from cdpr_drake.models.robot_loader import robot_file
from cdpr_drake.sections.emergency.failure_monitor import FailureMonitor, WatchRules
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.monitoring.log_row import POSE_SIZE, LogRow
from cdpr_drake.systems.monitoring.run_monitor import Outcome, RunMonitor, StopRules
from cdpr_drake.systems.monitoring.tension_watch import BreakingLoadWatch
from cdpr_drake.winches.friction import FrictionLaw


def ports(block):
    """Names and sizes of inputs and of outputs."""
    inputs = [block.get_input_port(i) for i in range(block.num_input_ports())]
    outputs = [block.get_output_port(i) for i in range(block.num_output_ports())]
    return [{port.get_name(): port.size() for port in side} for side in (inputs, outputs)]


def fix(block, context, **inputs):
    for name, value in inputs.items():
        value = Value(value) if isinstance(value, RigidTransform) else value
        block.GetInputPort(name).FixValue(context, value)


# Outcomes.

PERIOD = 0.04
LATE = 2.0 * PERIOD  # a condition is seen at the next update, the simulator told after it [s]
RULES = StopRules(
    position=0.01, rotation=np.radians(1.0), hold=0.5, lost=1.0,
    lower=np.array([-1.0, -1.0, 0.0]), upper=np.array([1.0, 1.0, 2.0]),
)  # fmt: skip
X_CdO = pose_from_angles(np.array([0.0, 0.0, 0.3]), np.array([np.pi, 0.0, 0.0]))
INSIDE = RigidTransform([0.0, 0.0, 0.5])


def away(distance, degrees=0.0):
    """A pose at this distance [m] and angle from the desired one."""
    turn = pose_from_angles(np.zeros(3), np.array([0.0, 0.0, np.radians(degrees)]))
    return RigidTransform([0.0, distance, 0.0]) @ X_CdO @ turn


class Run:
    """A monitor before inputs that a test sets."""

    def __init__(self, **inputs):
        self.monitor = RunMonitor(RULES, X_CdO, 1.0 / PERIOD)
        self.simulator = Simulator(self.monitor)
        self.show(**inputs)

    def show(self, X_CO=X_CdO, found=1.0, X_WP=INSIDE):
        """Sets the inputs from now on."""
        context = self.simulator.get_mutable_context()
        fix(self.monitor, context, X_CO=X_CO, X_WP=X_WP, found=[found])

    def until(self, time):
        """Advances; returns the outcome and the time at which the simulator stopped."""
        status = self.simulator.AdvanceTo(time)
        context = self.simulator.get_context()
        outcome = self.monitor.outcome(context)
        assert self.monitor.GetOutputPort("outcome").Eval(context) == float(outcome)
        ended = status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition
        assert ended == (outcome != Outcome.RUNNING)
        if ended:
            assert outcome.name.lower() in status.message()
        return outcome, context.get_time()


def test_ports_and_outcomes_have_the_names_that_logs_and_summaries_have():
    assert ports(Run().monitor) == [{"X_CO": 0, "found": 1, "X_WP": 0}, {"outcome": 1}]
    watch = ports(BreakingLoadWatch(np.full(3, 10.0), False))
    assert (watch[0]["tensions"], watch[1]["broken"]) == (3, 3)
    assert [outcome.name.lower() for outcome in Outcome] == [
        "running", "converged", "target_lost", "timeout", "diverged", "interrupted", "completed",
        "cable_broken", "client_ended", "contact", "failed",
    ]  # fmt: skip


def test_it_converges_when_the_pose_was_held():
    """The time of holding begins anew when the pose is left."""
    for left in (None, 0.4):
        run, began = Run(), 0.0
        if left is not None:
            run.until(left)
            run.show(X_CO=away(0.02))
            run.until(0.5)
            run.show()
            began = 0.5
        early = began + RULES.hold - PERIOD
        assert run.until(early) == (Outcome.RUNNING, early)
        outcome, time = run.until(5.0)
        assert outcome == Outcome.CONVERGED
        assert began + RULES.hold <= time <= began + PERIOD + RULES.hold + LATE


@pytest.mark.parametrize(
    ("distance", "degrees", "outcome"),
    [
        (0.0099, 0.99, Outcome.CONVERGED), (0.0101, 0.0, Outcome.RUNNING),
        (0.0, 1.01, Outcome.RUNNING), (0.1, 0.0, Outcome.RUNNING),
    ],
)  # fmt: skip
def test_distance_and_angle_both_count(distance, degrees, outcome):
    assert Run(X_CO=away(distance, degrees)).until(2.0)[0] == outcome


def test_it_ends_when_the_target_was_lost_for_long():
    """The ports keep a pose when nothing is found; it says nothing. A target that comes back was
    not lost."""
    run = Run(found=0.0)
    run.until(0.9)
    run.show(X_CO=away(0.1))
    run.until(1.0)
    run.show(found=0.0)
    assert run.until(1.0 + RULES.lost - PERIOD)[0] == Outcome.RUNNING
    outcome, time = run.until(5.0)
    assert outcome == Outcome.TARGET_LOST
    assert 1.0 + RULES.lost <= time <= 1.0 + PERIOD + RULES.lost + LATE


@pytest.mark.parametrize(
    "position", [[1.1, 0.0, 0.5], [0.0, -1.1, 0.5], [0.0, 0.0, -0.01], [0.0, 0.0, 2.1]]
)
def test_it_ends_at_once_when_the_platform_leaves_the_frame(position):
    run = Run(X_CO=away(0.1))
    run.until(0.3)
    run.show(X_CO=away(0.1), X_WP=RigidTransform(position))
    outcome, time = run.until(5.0)
    assert outcome == Outcome.DIVERGED
    assert time <= 0.3 + PERIOD + LATE


# Breaking loads.

PROJECTED = ["camera.kind=projected", "duration=0.4"]


@pytest.fixture
def run_with(tmp_path):
    """Runs ACROBOT with cables of a breaking load; at the start the tautest pulls 3.6 N."""

    def run(load, *more):
        text = robot_file("acrobot_small").read_text()
        path = tmp_path / "acrobot_small.yaml"
        path.write_text(text.replace("cable:\n", f"cable:\n  breaking_load: {load}\n"))
        return ServoRun(
            load_scenario("acrobot_pbvs", [*PROJECTED, f"robot={path}", *more])
        ).simulate()

    return run


def test_a_break_is_reported_and_the_run_goes_on_or_ends(run_with):
    result = run_with(4)
    assert result.outcome == Outcome.TIMEOUT
    broken = result.as_dict()["broken_cables"]
    assert len(broken) >= 1
    assert all(0.0 < entry["time_s"] <= 0.4 and entry["cable"].startswith("C") for entry in broken)
    # Found before or when the log shows it.
    log = result.log
    for i in np.where(np.max(log["tensions"], axis=0) > 4.0)[0]:
        first = log["time"][np.argmax(log["tensions"][:, i] > 4.0)]
        assert 0.0 <= result.broken[i] <= first + 2 * result.built.max_step
    for engine in ("plant", "compiled"):
        ended = run_with(4, "stop.broken_cable=true", f"integration.engine={engine}")
        assert ended.outcome == Outcome.CABLE_BROKEN
        assert ended.sim_time < 0.4
        (entry, *_) = ended.as_dict()["broken_cables"]
        assert entry["time_s"] == pytest.approx(ended.sim_time, abs=3 * ended.built.max_step)
    strong = run_with(1000, "stop.broken_cable=true", "duration=0.04")
    assert strong.outcome == Outcome.TIMEOUT
    assert strong.as_dict()["broken_cables"] == []
    with pytest.raises(ScenarioError, match=r"stop\.broken_cable: found true; accepted: false"):
        load_scenario("acrobot_pbvs", ["stop.broken_cable=true"])  # without a breaking load


# Failures of winches.


def test_a_drum_that_was_told_jammed_and_turns_after_all_had_no_power():
    period, in_a_row = 0.002, 5
    friction = FrictionLaw(coulomb=0.01, static=0.02)
    motor = MotorWatch(np.full(2, 0.01), friction, 1e-4, 2.0 * np.pi * 10.0, period)
    monitor = FailureMonitor(
        WatchRules(
            motor, AlarmRule(0.05, in_a_row), 10**6, EncoderWatch(period, 1.0),
            AlarmRule(1e3, in_a_row), 1e3, 1e3,
        )
    )  # fmt: skip
    simulator = Simulator(monitor)
    context = simulator.get_mutable_context()
    zeros = {name: np.zeros(2) for name in ("torques", "tensions", "lengths", "length_rates")}
    fix(monitor, context, found=[1.0], X_CO=RigidTransform(), **zeros)
    none, both, other = [[0, 0], [0, 0]], [[1, 1], [0, 0]], [[1, 0], [0, 1]]
    for time, told, after in (
        (0.1, none, {"torques": [0.2, 0.2]}),  # and nothing moves
        (0.3, both, {"length_rates": [0.0, 0.1]}),
        (0.3 + (in_a_row - 2) * period, both, {}),
        (0.3 + (in_a_row + 2) * period, other, {"length_rates": [0.0, 0.0]}),
        (0.5, other, {}),  # for good
    ):
        simulator.AdvanceTo(time)
        names = "found_jammed", "found_powerless"
        assert [monitor.GetOutputPort(n).Eval(context).tolist() for n in names] == told, time
        fix(monitor, context, **after)


# Rows of the log.


class Sources(LeafSystem):
    """Ports of both kinds, to be logged."""

    def __init__(self):
        super().__init__()
        self.DeclareVectorOutputPort("pair", 2, lambda context, output: None)
        pose = Value(RigidTransform())
        self.DeclareAbstractOutputPort("pose", lambda: pose, lambda context, output: None)
        self.DeclareVectorOutputPort("one", 1, lambda context, output: None)


def test_a_row_holds_what_stands_on_the_ports_in_their_order():
    sources = Sources()
    row = LogRow({name: sources.GetOutputPort(name) for name in ("pair", "pose", "one")})
    assert ports(row) == [{"pair": 2, "pose": 0, "one": 1}, {"log_row": 10}]
    assert row.columns == {"pair": slice(0, 2), "pose": slice(2, 9), "one": slice(9, 10)}
    X = pose_from_angles(np.array([1.0, 2.0, 3.0]), np.array([0.1, -0.2, 0.3]))
    for pair in ([4.0, 5.0], [-1.0, 0.5]):  # a second context, a second row
        context = row.CreateDefaultContext()
        fix(row, context, pair=pair, pose=X, one=[6.0])
        logged = row.GetOutputPort("log_row").Eval(context)
        np.testing.assert_array_equal(logged, [*pair, *pose_row(X), 6.0])


vectors = st.tuples(*[st.floats(-10.0, 10.0)] * 3), st.tuples(*[st.floats(-np.pi, np.pi)] * 3)


@given(*vectors)
def test_a_pose_is_its_quaternion_and_position_and_comes_back(position, angles):
    quarter = pose_from_angles(np.array([1.0, 2.0, 3.0]), np.array([0.0, 0.0, np.pi / 2.0]))
    half = np.sqrt(0.5)
    np.testing.assert_allclose(pose_row(quarter), [half, 0, 0, half, 1, 2, 3], atol=1e-12)
    X = pose_from_angles(np.array(position), np.array(angles))
    row = pose_row(X)
    assert row.shape == (POSE_SIZE,)
    assert row[0] >= 0.0
    assert max(pose_error(X, pose_from_row(row))) < 1e-12

"""The state of a loop as arrays, its log, clocks and motion, and what runs over seeds share."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.errors import DivergedError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.servo_models import servo_model
from cdpr_drake.systems.loops.basis import loop_basis
from cdpr_drake.systems.loops.loop_choice import check_loop
from cdpr_drake.systems.loops.loop_log import FIRST_ROWS, LoopLog, RowOf
from cdpr_drake.systems.loops.loop_state import (
    Clock,
    arrays_of,
    entry,
    first_time,
    held,
    next_time,
    restore_arrays,
)
from cdpr_drake.systems.loops.robot_motion import RobotMotion
from cdpr_drake.systems.loops.servo_loop import ServoLoop
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.settings import CableRobotSettings


def test_parts_are_copied_and_put_back():
    where, kept = {"a": np.arange(2.0)}, np.zeros(3)
    parts = [entry("a", where), held("b", kept)]
    arrays = arrays_of(parts)
    where["a"], kept[:] = np.ones(2), 7.0
    assert arrays["b"].tolist() == [0.0, 0.0, 0.0]
    restore_arrays(parts, arrays)
    assert where["a"].tolist() == [0.0, 1.0]
    assert kept.tolist() == [0.0, 0.0, 0.0]
    with pytest.raises(ValueError, match="another loop"):
        restore_arrays(parts, {"a": arrays["a"]})
    state = loop_of("acrobot_pbvs", "camera.latency_frames=1").state_arrays()
    with pytest.raises(ValueError, match="another loop"):
        loop_of("acrobot_pbvs").restore_state(state)


def loop_of(name, *changes):
    options = ("camera.kind=projected", "integration.loop=compiled", *changes)
    return ServoLoop(check_loop(load_scenario(name, options)))


def test_speeds_that_no_step_can_follow_diverge():
    loop = loop_of("acrobot_pbvs")
    loop.start()
    loop.advance_to(0.2)
    state = loop.state_arrays()
    state["motion"][10] = 1e200
    loop.restore_state(state)
    with pytest.raises(DivergedError), np.errstate(all="ignore"):
        loop.advance_to(1.0)


# Clocks.


def test_clocks_strike_at_drake_s_times_and_the_first_is_found_but_not_after_the_end():
    """Multiples of a period, not sums of it."""
    clock, now, struck = Clock(0.1), 0.0, []
    for _ in range(8):
        assert clock.strikes(now)
        struck.append(now)
        now = clock.next
    assert struck == [k * 0.1 for k in range(8)]
    assert next_time(0.25, 0.1) == 3 * 0.1
    assert not clock.strikes(0.75)
    clocks = [Clock(0.3), Clock(0.2)]
    assert first_time(clocks, 1.0) == 0.0
    assert all(clock.strikes(0.0) for clock in clocks)
    assert first_time(clocks, 1.0) == 0.2
    assert first_time(clocks, 0.1) == 0.1


# Its log.


def test_rows_are_what_stood_there_when_they_were_written():
    """Also beyond the room of the start, and after the log was emptied."""
    now = {}

    def stand(k):
        now["slow"] = now["slow"] if k % 3 else np.array([float(k), -k])
        now["pose"] = now["pose"] if k % 2 else RigidTransform([float(k), 0.0, 1.0])
        now["table"] = np.array([[k, k + 0.25], [k + 0.5, k + 0.75]])

    def table():
        return now["table"]

    stand(0)
    log = LoopLog(
        {
            "second": RowOf(table, 1),
            "slow": lambda: now["slow"],
            "pose": lambda: now["pose"],
            "first": RowOf(table, 0),
        }
    )
    count = FIRST_ROWS + 5
    for start in (0, 600):
        stand(start)
        for k in range(start, start + count):
            stand(k)
            log.append(0.1 * k)
        values, k = log.read(), np.arange(start, start + count)
        assert list(values) == ["time", "second", "slow", "pose", "first"]
        np.testing.assert_array_equal(values["time"], 0.1 * k)
        np.testing.assert_array_equal(values["slow"], np.transpose([k - k % 3, -(k - k % 3)]))
        np.testing.assert_array_equal(values["pose"][:, 4], k - k % 2)
        np.testing.assert_array_equal(values["pose"][:, :4], np.tile([1.0, 0, 0, 0], (count, 1)))
        np.testing.assert_array_equal(values["first"], np.transpose([k, k + 0.25]))
        np.testing.assert_array_equal(values["second"], np.transpose([k + 0.5, k + 0.75]))
        log.clear()
        assert log.rows() == 0


# Motion.


@pytest.fixture(params=["elastic", "catenary"])
def make_motion(request):
    def make():
        settings = CableRobotSettings()
        settings.cables.model = request.param
        return RobotMotion(load_robot("acrobot_small"), settings, StepRule(max_step=1e-3))

    return make


def begun(motion):
    motion.begin(motion.resting(motion.robot.home.transform()))
    motion.command(np.full(8, 0.02))


def test_a_run_that_begins_again_follows_its_own_command(make_motion):
    motion, reached = make_motion(), []
    rest = motion.resting(motion.robot.home.transform())
    for speed in (0.02, -0.02, 0.02):
        motion.begin(rest)
        motion.command(np.full(8, speed))
        motion.advance(0.01)
        reached.append(motion.pose().translation())
    assert np.linalg.norm(reached[1] - reached[0]) > 1e-5
    assert np.array_equal(reached[2], reached[0])


def test_what_is_kept_continues_to_the_last_bit(make_motion):
    """With cables that sag, whose search begins where it ended last."""
    motion, other = make_motion(), make_motion()
    begun(motion)
    motion.advance(0.05)
    begun(other)
    restore_arrays(other.kept(), arrays_of(motion.kept()))
    other.forget()
    for one in (motion, other):
        one.advance(0.25)
    assert motion.report.tobytes() == other.report.tobytes()
    assert motion.pose().GetAsMatrix4().tobytes() == other.pose().GetAsMatrix4().tobytes()


# What runs over seeds have in common is made once, and only where no seed changes it.


def scenario_with(*options):
    return check_loop(load_scenario("acrobot_pbvs", ["camera.kind=projected", *options]))


def test_seeds_that_change_no_belief_share_the_model():
    scenario = scenario_with()
    basis = loop_basis(scenario)
    other = replace(scenario, seed=7)
    assert loop_basis(other) is basis
    assert servo_model(other, basis.robot, basis.model) is basis.model


@pytest.mark.parametrize(
    "wrong", ["perturbations.exit_points=0.01", "perturbations.camera_pose_shift.distance=0.01"]
)
def test_a_seed_that_changes_what_is_believed_gets_a_model_of_its_own(wrong):
    scenario = replace(scenario_with(wrong), seed=7)
    basis = loop_basis(scenario)
    found = servo_model(scenario, basis.robot, basis.model)
    alone = servo_model(scenario, basis.robot)
    assert found is not basis.model
    np.testing.assert_array_equal(found.believed.cables.p_WA, alone.believed.cables.p_WA)
    np.testing.assert_array_equal(
        found.believed.X_PC.GetAsMatrix4(), alone.believed.X_PC.GetAsMatrix4()
    )


def test_a_motion_like_another_moves_as_it_and_leaves_it_alone():
    scenario = scenario_with()
    basis = loop_basis(scenario)
    rule = StepRule(max_step=1e-3)
    alone = RobotMotion(basis.robot, scenario, rule)
    like = RobotMotion(basis.robot, scenario, rule, alone)
    pulled = np.linspace(-0.02, 0.02, len(basis.robot.cables))
    alone.begin(basis.resting)
    before = alone.pose().GetAsMatrix4()
    for motion in (like, alone):
        motion.begin(basis.resting)
        motion.command(pulled)
        motion.advance(0.05)
        if motion is like:
            np.testing.assert_array_equal(alone.pose().GetAsMatrix4(), before)
    np.testing.assert_array_equal(like.pose().GetAsMatrix4(), alone.pose().GetAsMatrix4())
    np.testing.assert_array_equal(like.cables(), alone.cables())

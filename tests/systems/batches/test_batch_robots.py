"""Robots of a batch move as each does alone, to the last bit, by any number of threads; alone they
move as MuJoCo's. They may be reset, copied, exchanged and broken one by one."""

import copy
import pickle
from dataclasses import replace

import numpy as np
import pytest
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform

from cdpr_drake.analyses.environments import environment_names, make_environment
from cdpr_drake.errors import CdprError, TensionProblemError
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.batches.batch_member import BatchMember
from cdpr_drake.systems.batches.batch_robots import BatchRobots
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.loops.robot_motion import RobotMotion
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.failures import Failure, FailureSettings
from cdpr_drake.systems.robots.settings import CableRobotSettings
from tests.benchmarks.mujoco import TendonRollout
from tests.systems.batches.batch_cases import (
    DAMPED,
    ELASTIC,
    PERIOD,
    ROBOT,
    STILL,
    alone,
    alone_by_tensions,
    behaving,
    settings,
    varied,
)

HELD = 1e-7
"""How far a platform of 350 kN cables moves in 50 ms that is held at rest [m]: rounding of lengths,
about 1e-16 m times the stiffness, is some 1e-10 N."""
TENDONS = 1e-6
"""How far MuJoCo's platforms may be off in 0.2 s [m and -]. Found: 2e-9 m and 4e-8, and 100 times
as much by steps five times as long, as methods of third order do."""
REST = 1e-9  # of poses at which a search for rest ends [m]
HOME = ROBOT.home.transform()


def speeds(steps, count, m=8):
    return np.random.default_rng(3).normal(0.0, 0.02, (steps, count, m))


def go(batch, commands):
    for command in commands:
        batch.step(command, PERIOD)
    return batch


def bits(batch):
    return batch.states.tobytes() + batch.tensions.tobytes()


# As alone.

LONG_STEPS = StepRule(method="semi_implicit", max_step=5e-3)
CASES = {
    "elastic": (ROBOT, ELASTIC, None),
    "damped, pulleys": (ROBOT, settings(model="kelvin_voigt", pulleys=True), None),
    "planar": (load_robot("planar"), DAMPED, None),
    "catenary": (ROBOT, settings(model="catenary"), None),
    "several cables a winch": (load_robot("caroca"), DAMPED, None),
    "stiffen and rub": (behaving(stiffening=2e-3, sheave_friction=0.03), ELASTIC, None),
    "semi-implicit": (ROBOT, DAMPED, LONG_STEPS),
    **{mode: (ROBOT, settings(mode, "kelvin_voigt"), None)
       for mode in ("torque", "velocity", "position")},
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_each_moves_as_alone_by_commands_and_wrenches(case):
    robot, how, rule = CASES[case]
    robots = varied(robot, 3)
    batch = BatchRobots(robots[0], 3, settings=how, parameters=robots, rule=rule, threads=2)
    commands = speeds(3, 3, batch.commands_per_robot)
    if case == "position":
        commands = batch.lengths + commands * PERIOD
    wrenches = np.random.default_rng(4).normal(0.0, 1.0, (3, 3, 6))
    for command, wrench in zip(commands, wrenches, strict=True):
        assert batch.step(command, PERIOD, wrenches=wrench).all()
    for k, each in enumerate(robots):
        state, tensions = alone(each, how, commands[:, k], wrenches[:, k], rule=batch.rule)
        assert np.array_equal(batch.states[k], state)
        assert np.array_equal(batch.tensions[k], tensions)
    assert len(np.unique(batch.states[:, 0])) == 3 or not robot.joint().is_floating


def test_each_moves_as_alone_by_tensions():
    robots = varied(ROBOT, 3)
    batch = BatchRobots(ROBOT, 3, parameters=robots, by_tensions=True)
    starts = batch.states
    commands = batch.tensions * (1.0 + 2.5 * speeds(4, 3))
    go(batch, commands)
    for k, robot in enumerate(robots):
        state, tensions = alone_by_tensions(robot, starts[k], commands[:, k])
        assert np.array_equal(batch.states[k], state)
        assert np.array_equal(batch.tensions[k], tensions)


def test_many_robots_are_as_many_single_ones_on_any_number_of_threads_also_in_a_rollout():
    count, commands = 200, speeds(3, 200)
    robots = varied(ROBOT, count)
    batches = [
        go(BatchRobots(ROBOT, count, settings=ELASTIC, parameters=robots, threads=n), commands)
        for n in (1, 2, 3)
    ]
    rolled_on = BatchRobots(ROBOT, count, settings=ELASTIC, parameters=robots)
    starts = rolled_on.states
    rolled = rolled_on.rollout(commands, PERIOD)
    assert {bits(batch) for batch in batches} == {bits(rolled_on)}
    assert np.array_equal(rolled.states[-1], rolled_on.states)
    assert rolled.running.all()
    assert np.array_equal(rolled.times[:, 0], np.cumsum([PERIOD] * 3))
    different = []
    for k, robot in enumerate(robots):
        single = RobotMotion(robot, ELASTIC, rolled_on.rule)
        single.begin(starts[k])
        for way, command in enumerate(commands):
            single.command(command[k])
            single.advance(PERIOD * (way + 1))
        same = np.array_equal(rolled_on.states[k, :13], single.platform_state())
        if not (same and np.array_equal(rolled_on.tensions[k], single.cables()[0])):
            different.append(k)
    assert different == []
    # One robot of them, and one command for all:
    one = BatchRobots(ROBOT, 1, settings=ELASTIC, parameters=robots[7:8])
    assert np.array_equal(one.rollout(commands[:, 7], PERIOD).states[:, 0], rolled.states[:, 7])


def test_mujoco_s_tendons_move_alike():
    """An independent engine, with cables a thousand times softer, that go slack and catch."""
    soft = load_robot("acrobot_small")
    soft.cable.youngs_modulus /= 1e3
    moments = np.random.default_rng(0).normal(0.0, 0.5, (3, 3))
    batch = BatchRobots(soft, 3, settings=ELASTIC, rule=StepRule(max_step=2e-4))
    ours = batch.rollout(np.zeros((20, 8)), PERIOD, wrenches=np.hstack([moments, 0.0 * moments]))
    theirs = TendonRollout(soft, moments, "RK4", 2e-4).roll(20)[:, 49::50].swapaxes(0, 1)
    assert np.abs(theirs[:, :, 1:4] - ours.states[:, :, 4:7]).max() < TENDONS
    assert np.abs(theirs[:, :, 4:8] - ours.states[:, :, :4]).max() < TENDONS
    assert np.linalg.norm(batch.poses[:, 4:] - soft.home.position, axis=1).max() > 0.05
    assert np.sum(batch.tensions == 0.0) >= 4


def test_a_broken_cable_is_the_engine_s():
    breaks = FailureSettings(events=[Failure(kind="cable_breaks", time=PERIOD, cable=2)])
    batch = go(BatchRobots(ROBOT, 2, settings=ELASTIC), [STILL])
    batch.break_cable(1, 2)
    go(batch, [STILL] * 3)
    for k, how in enumerate((ELASTIC, replace(ELASTIC, failures=breaks))):
        state, tensions = alone(ROBOT, how, np.zeros((4, 8)))
        assert np.array_equal(batch.states[k], state)
        assert np.array_equal(batch.tensions[k], tensions)
    assert batch.tensions[1, 2] == 0.0
    assert batch.broken.tolist() == [[False] * 8, [k == 2 for k in range(8)]]
    batch.reset()
    assert not batch.broken.any()


# What is read of them.


def test_poses_twists_and_lowest_points():
    batch = go(
        BatchRobots(ROBOT, 2, settings=ELASTIC), [np.array([[0.05] * 8, [-0.03] * 4 + [0.03] * 4])]
    )
    before = batch.poses
    batch.step(STILL, 1e-4)
    rates = (batch.poses - before)[:, 4:] / 1e-4
    assert np.allclose(rates, batch.twists[:, 3:], atol=5e-3)
    signs = np.stack(np.meshgrid(*[[-1, 1]] * 3)).reshape(3, -1).T
    corners = ROBOT.box_center() + 0.5 * ROBOT.platform.size * signs
    tilted = batch.save_state()  # both turned by 0.9 rad about an axis askew
    axis = np.array([0.3, -0.5, 0.8])
    tilted.arrays[0][:, :4] = [np.cos(0.45), *(np.sin(0.45) * axis / np.linalg.norm(axis))]
    batch.load_state(tilted)
    for k, row in enumerate(batch.poses):
        turned = RigidTransform(Quaternion(row[:4]), row[4:]) @ corners.T
        assert batch.lowest_points[k] == pytest.approx(turned[2].min(), abs=1e-12)


@pytest.mark.parametrize("name", ["acrobot_small", "planar", "hangprinter_4", "gt_graffiti"])
def test_a_blow_is_what_is_read(name):
    batch = BatchRobots(name, 3, threads=1)
    basis = batch.robot.motion_type().basis(batch.robot.home.transform().rotation().matrix())
    twist = basis @ np.linspace(0.01, 0.02, basis.shape[1])
    batch.set_twists([0, 2], twist)
    assert batch.twists[[0, 2]] == pytest.approx(np.tile(twist, (2, 1)))
    assert not batch.twists[1].any()


# Resets, saved states and copies.


def test_reset_puts_robots_at_rest_where_they_are_wanted():
    batch = BatchRobots(ROBOT, 3, settings=ELASTIC)
    home, X_WP = batch.states[0], RigidTransform([0.05, -0.08, 0.3])
    go(batch, speeds(1, 3))
    held = batch.reset([1], pose_row(X_WP)[None])
    assert held.shape == (1, 8)
    assert batch.times.tolist() == [PERIOD, 0.0, PERIOD]
    assert np.allclose(batch.tensions[1], held[0], rtol=1e-6)
    batch.reset(np.array([True, False, False]))
    assert np.array_equal(batch.states[0], home)
    go(batch, [STILL] * 5)
    assert np.abs(batch.poses[1, 4:] - X_WP.translation()).max() < HELD
    # More tension in all cables lifts: it is no equilibrium any more, but starts there.
    more = batch.reset([2], X_WP.GetAsMatrix4(), tensions=held[0] + 5.0)
    assert np.allclose(batch.tensions[2], more[0], rtol=1e-6)


def test_a_saved_state_goes_on_to_the_bit_where_it_was():
    batch = BatchRobots(ROBOT, 4, settings=ELASTIC, parameters=varied(ROBOT, 4))
    commands = speeds(4, 4)
    batch.break_cable(3, 0)
    batch.step(commands[0], PERIOD, wrenches=np.ones(6))
    saved = batch.save_state()
    first = bits(go(batch, commands[1:]))
    batch.reset()
    batch.load_state(saved)
    assert bits(go(batch, commands[1:])) == first
    later = batch.states
    batch.load_state(saved, [0, 2])
    assert np.array_equal(batch.states[[1, 3]], later[[1, 3]])
    assert batch.times.tolist() == pytest.approx([PERIOD, 4 * PERIOD] * 2)


def test_a_robot_that_fails_stops_and_the_others_go_on():
    batch = BatchRobots(ROBOT, 2, settings=settings(pulleys=True))
    push = np.zeros((2, 6))
    push[1, 5] = 1e12  # away, beyond all numbers that a platform has
    assert batch.step(STILL, PERIOD, wrenches=push).tolist() == [True, False]
    assert batch.failed.tolist() == [False, True]
    assert batch.problem(0) is None
    assert "before" in str(batch.problem(1))
    last = batch.states[1]
    assert np.isfinite(last).all()
    go(batch, [STILL])
    assert np.array_equal(batch.states[1], last)
    assert batch.times[0] == 2 * PERIOD
    batch.reset([1])
    assert not batch.failed.any()
    assert batch.step(STILL, PERIOD).all()


copied = pytest.mark.parametrize(
    "copied", [copy.deepcopy, lambda thing: pickle.loads(pickle.dumps(thing))]
)


@copied
@pytest.mark.parametrize("how", [{}, {"settings": settings("torque")}, {"by_tensions": True}])
def test_a_copied_batch_goes_on_as_the_original_on_arrays_of_its_own(how, copied):
    batch = BatchRobots(ROBOT, 3, parameters=varied(ROBOT, 3), threads=1, **how)
    go(batch, [np.full(8, 0.01)] * 2)
    before, other = bits(batch), copied(batch)
    assert bits(other) == before
    go(other, [np.full(8, -0.01)] * 2)
    assert bits(batch) == before
    assert bits(go(batch, [np.full(8, -0.01)] * 2)) == bits(other)


def numbers(step):
    observation, reward, *_ = step
    parts = observation.values() if isinstance(observation, dict) else [observation]
    return np.concatenate([np.ravel(part) for part in parts] + [[reward]])


@copied
@pytest.mark.parametrize("name", environment_names())
def test_a_copied_environment_goes_on_as_the_original(name, copied):
    environment = make_environment(name)
    environment.reset(seed=3)
    environment.action_space.seed(3)
    actions = [environment.action_space.sample() for _ in range(4)]
    environment.step(actions[0])
    ahead = copied(environment)
    for action in actions[3:0:-1]:
        ahead.step(action)
    other = copied(environment)
    for action in actions:
        steps = other.step(action), environment.step(action)
        np.testing.assert_array_equal(*map(numbers, steps))


# Robots that are exchanged.


def heavier(share=1.3):
    return replace(ROBOT, platform=replace(ROBOT.platform, mass=share * ROBOT.platform.mass))


def test_an_exchanged_robot_moves_as_if_it_had_been_in_the_batch_from_the_start():
    other, commands = heavier(), speeds(5, 3)
    exchanged = go(BatchRobots(ROBOT, 3, threads=1), commands)
    exchanged.exchange(1, other)
    exchanged.reset()
    made = BatchRobots(ROBOT, 3, parameters=[ROBOT, other, ROBOT], threads=1)
    assert bits(go(exchanged, commands)) == bits(go(made, commands))
    assert exchanged.robots[1] is other


def test_a_load_that_is_taken_up_pulls_the_platform_down():
    """Newton: with the tensions of before, the weight that was added is all that accelerates."""
    batch = BatchRobots(ROBOT, 3, by_tensions=True, threads=1)
    held = batch.tensions
    batch.exchange(2, heavier(2.0))
    batch.step(held, 1e-3)
    assert batch.twists[:2, 5] == pytest.approx(0.0, abs=1e-6)
    assert batch.twists[2, 5] == pytest.approx(-0.5 * 9.81 * 1e-3, rel=1e-3)


def test_what_was_made_of_a_robot_serves_several_rows_at_several_places():
    """Its rest is sought once for each place, and is that of a robot made anew."""
    other, commands = heavier(), speeds(5, 3)
    member = BatchMember.of(other, CableRobotSettings(), False)
    batch = BatchRobots(ROBOT, 3, threads=1)
    for row in (0, 2):
        batch.exchange(row, member)
    made = BatchRobots(ROBOT, 3, parameters=[other, ROBOT, heavier()], threads=1)
    above = RigidTransform(HOME.rotation(), HOME.translation() + np.array([0.0, 0.0, 0.05]))
    for X in ([HOME, HOME, above], [above, HOME, HOME], None):
        assert batch.reset(None, X).tobytes() == made.reset(None, X).tobytes()
        expected = [pose_row(each) for each in X or [HOME] * 3]
        np.testing.assert_allclose(batch.poses, expected, atol=REST)
        assert bits(go(batch, commands)) == bits(go(made, commands))
    assert batch.robots[0] is batch.robots[2] is other


# Refusals.


def batch(count=2, **more):
    return BatchRobots(ROBOT, count, **more)


def braked(**inputs):
    """A step of two robots by torque, of which only the first has brakes."""
    first, bare = load_robot("caroca"), load_robot("caroca")
    first.winch.brake_torque = 20.0
    robots = BatchRobots(first, 2, settings=settings("torque"), parameters=[first, bare])
    return robots.step(STILL, PERIOD, **inputs)


REFUSALS = {
    "no robots": (lambda: batch(0), "count: found 0; accepted: 1 or more"),
    "one of two": (lambda: batch(parameters=[ROBOT]), "parameters: found 1 robots"),
    "cables": (
        lambda: batch(parameters=[ROBOT, load_robot("planar")]),
        "parameters: found robot 1 with another number of cables",
    ),
    "failures": (
        lambda: batch(settings=settings(failures=FailureSettings())),
        "failures: found a section; accepted in a batch: null",
    ),
    "pushes": (
        lambda: batch(settings=load_scenario("acrobot_pushed")),
        "disturbances: found a section; accepted in a batch: null, with wrenches",
    ),
    "world": (
        lambda: batch(settings=load_scenario("acrobot_table_edge")),
        "world: found a section; accepted in a batch: null, since the compiled engine has no "
        "contact",
    ),
    "motors by tensions": (
        lambda: batch(settings=settings("torque"), by_tensions=True),
        "winches.kind: found motor for robots by tensions",
    ),
    "creep": (lambda: BatchRobots(behaving(creep_stiffness=2.0), 1), "creep_stiffness: found 2"),
    "commands": (
        lambda: batch().step(np.zeros((3, 8)), PERIOD),
        r"commands: found shape \(3, 8\); accepted: \(8,\) or \(2, 8\)",
    ),
    "NaN": (
        lambda: batch().step(STILL * np.nan, PERIOD), "commands: found numbers that are not finite"
    ),
    "duration": (lambda: batch().step(STILL, -1.0), "duration: found -1 s"),
    "rollout": (lambda: batch().rollout(STILL, PERIOD), r"found shape \(8,\)"),
    "brakes": (
        lambda: batch().step(STILL, PERIOD, brakes=np.ones(8)),
        "brakes: found winches without motors; accepted: motors with winch.brake_torque",
    ),
    "no brake": (
        lambda: braked(brakes=np.ones(8)),
        "brakes: found no winch.brake_torque in the file of robot 1; accepted",
    ),
    "rates by torque": (
        lambda: braked(rates=np.ones(8)),
        "rates: found winches by torque; accepted: winches with motors, by position",
    ),
    "rates": (
        lambda: batch().step(STILL, PERIOD, rates=np.ones(8)), "rates: found winches without motors"
    ),
    "quaternion": (lambda: batch().reset(poses=np.ones((2, 7))), "a quaternion of norm 2"),
    "mask": (lambda: batch(3).reset(3), "robots: found 3; accepted: a mask of 3"),
    "lengths": (lambda: batch(by_tensions=True).lengths, "lengths: found robots by tensions"),
    "cable": (lambda: batch().break_cable(0, 8), "cable: found 8; accepted: 0 to 7"),
    "saved state": (lambda: batch().load_state(batch(4).save_state()), "one of 4 robots"),
    "structure": (
        lambda: batch().exchange(0, load_robot("planar")), "accepted: robots of one structure"
    ),
    "row": (lambda: batch().exchange(2, ROBOT), "robots: found"),
    "outside": (lambda: batch().reset([0], RigidTransform([0.0, 0.0, 5.0])), "outside the frame"),
}  # fmt: skip


@pytest.mark.parametrize(("call", "words"), REFUSALS.values(), ids=REFUSALS)
def test_refusal(call, words):
    error = TensionProblemError if words == "outside the frame" else CdprError
    with pytest.raises(error, match=words):
        call()

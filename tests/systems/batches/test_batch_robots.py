"""Robots of a batch move as each does alone, to the last bit, by any number of threads."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform

from cdpr_drake.analyses.benchmarks.batches import TendonRollout
from cdpr_drake.errors import CdprError, TensionProblemError
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.batches.batch_robots import BatchRobots
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.loops.robot_motion import RobotMotion
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.failures import Failure, FailureSettings
from tests.systems.batches.varied import (
    PERIOD,
    alone,
    alone_by_tensions,
    behaving,
    settings,
    varied,
)

ROBOT = load_robot("acrobot_small")
ELASTIC = settings()
RANDOM = np.random.default_rng(3)

HELD = 1e-7
"""How far a platform of 350 kN cables moves in 50 ms that is held at rest [m]: rounding of lengths,
about 1e-16 m times the stiffness, is some 1e-10 N."""

TENDONS = 1e-6
"""How far MuJoCo's platforms may be off in 0.2 s [m and -]. Found: 2e-9 m and 4e-8, and 100 times
as much by steps five times as long, as methods of third order do."""


def speeds(count, ways, m=8):
    return RANDOM.normal(0.0, 0.02, (ways, count, m))


CASES = {
    "elastic": ("acrobot_small", ELASTIC),
    "damped, pulleys": ("acrobot_small", settings(model="kelvin_voigt", pulleys=True)),
    "planar": ("planar", settings(model="kelvin_voigt")),
    "catenary": ("acrobot_small", settings(model="catenary")),
    "several cables a winch": ("caroca", settings(model="kelvin_voigt")),
}


@pytest.mark.parametrize("case", CASES)
def test_each_moves_as_alone_by_velocities_and_wrenches(case):
    name, how = CASES[case]
    robots = varied(load_robot(name), 5)
    batch = BatchRobots(name, 5, settings=how, parameters=robots, threads=2)
    commands = speeds(5, 3, batch.commands_per_robot)
    wrenches = RANDOM.normal(0.0, 1.0, (3, 5, 6))
    for command, wrench in zip(commands, wrenches, strict=True):
        assert batch.step(command, PERIOD, wrenches=wrench).all()
    for k, robot in enumerate(robots):
        state, tensions = alone(robot, how, commands[:, k], wrenches[:, k], rule=batch.rule)
        assert np.array_equal(batch.states[k], state)
        assert np.array_equal(batch.tensions[k], tensions)
    assert len(np.unique(batch.states[:, 0])) == 5 or not robots[0].joint().is_floating


def test_each_moves_as_alone_on_cables_that_stiffen_and_rub():
    robots = varied(behaving(stiffening=2e-3, sheave_friction=0.03), 3)
    batch, commands = BatchRobots(robots[0], 3, settings=ELASTIC, parameters=robots), speeds(3, 3)
    for command in commands:
        batch.step(command, PERIOD)
    for k, robot in enumerate(robots):
        state, tensions = alone(robot, ELASTIC, commands[:, k], rule=batch.rule)
        assert np.array_equal(batch.states[k], state)
        assert np.array_equal(batch.tensions[k], tensions)


def test_each_moves_as_alone_by_the_semi_implicit_method_in_long_steps():
    rule = StepRule(method="semi_implicit", max_step=5e-3)
    how = settings(model="kelvin_voigt")
    robots, commands = varied(ROBOT, 3), speeds(3, 3)
    batch = BatchRobots(ROBOT, 3, settings=how, parameters=robots, rule=rule)
    for command in commands:
        batch.step(command, PERIOD)
    for k, robot in enumerate(robots):
        found, _ = alone(robot, how, commands[:, k], rule=rule)
        assert np.array_equal(batch.states[k], found)


@pytest.mark.parametrize("mode", ["torque", "velocity", "position"])
def test_each_moves_as_alone_by_motors(mode):
    how = settings(mode, "kelvin_voigt")
    robots = varied(ROBOT, 3)
    batch = BatchRobots(ROBOT, 3, settings=how, parameters=robots)
    commands = speeds(3, 3)
    if mode == "position":
        commands = batch.lengths + commands * PERIOD
    for command in commands:
        batch.step(command, PERIOD)
    for k, robot in enumerate(robots):
        assert np.array_equal(
            batch.states[k], alone(robot, how, commands[:, k], rule=batch.rule)[0]
        )


def test_each_moves_as_alone_by_tensions():
    robots = varied(ROBOT, 3)
    batch = BatchRobots(ROBOT, 3, parameters=robots, by_tensions=True)
    starts, held = batch.states, batch.tensions
    commands = held * (1.0 + RANDOM.normal(0.0, 0.05, (4, 3, 8)))
    for command in commands:
        batch.step(command, PERIOD)
    for k, robot in enumerate(robots):
        found = alone_by_tensions(robot, settings(), starts[k], commands[:, k])
        assert np.array_equal(batch.states[k], found)
    assert np.array_equal(batch.tensions, commands[-1])
    with pytest.raises(CdprError, match="lengths: found robots by tensions"):
        _ = batch.lengths


def test_a_thousand_robots_are_a_thousand_single_ones():
    count = 1000
    robots = varied(ROBOT, count)
    batch = BatchRobots(ROBOT, count, settings=ELASTIC, parameters=robots)
    starts, commands = batch.states, speeds(count, 2)
    for command in commands:
        batch.step(command, PERIOD)
    different = []
    for k, robot in enumerate(robots):
        one = RobotMotion(robot, ELASTIC, batch.rule)
        one.begin(starts[k])
        for way, command in enumerate(commands):
            one.command(command[k])
            one.advance(PERIOD * (way + 1))
        same = np.array_equal(batch.states[k, :13], one.platform_state())
        if not (same and np.array_equal(batch.tensions[k], one.cables()[0])):
            different.append(k)
    assert different == []


def test_any_number_of_threads_gives_the_same_bytes_and_so_does_a_rollout():
    robots, commands = varied(ROBOT, 20), speeds(20, 3)
    found = []
    for threads in (1, 2, 3):
        batch = BatchRobots(ROBOT, 20, settings=ELASTIC, parameters=robots, threads=threads)
        for command in commands:
            batch.step(command, PERIOD)
        found.append(batch.states.tobytes() + batch.tensions.tobytes())
    assert len(set(found)) == 1
    batch = BatchRobots(ROBOT, 20, settings=ELASTIC, parameters=robots)
    rolled = batch.rollout(commands, PERIOD)
    assert rolled.states[-1].tobytes() + batch.tensions.tobytes() == found[0]
    assert rolled.running.all()
    assert np.array_equal(rolled.times[:, 0], np.cumsum([PERIOD] * 3))
    # One robot of them, and one command for all:
    single = BatchRobots(ROBOT, 1, settings=ELASTIC, parameters=robots[7:8])
    assert np.array_equal(single.rollout(commands[:, 7], PERIOD).states[:, 0], rolled.states[:, 7])


def test_a_broken_cable_is_the_engine_s():
    breaks = FailureSettings(events=[Failure(kind="cable_breaks", time=PERIOD, cable=2)])
    batch = BatchRobots(ROBOT, 2, settings=ELASTIC)
    still = np.zeros(8)
    batch.step(still, PERIOD)
    batch.break_cable(1, 2)
    for _ in range(3):
        batch.step(still, PERIOD)
    for k, how in enumerate((ELASTIC, replace(ELASTIC, failures=breaks))):
        state, tensions = alone(ROBOT, how, np.zeros((4, 8)))
        assert np.array_equal(batch.states[k], state)
        assert np.array_equal(batch.tensions[k], tensions)
    assert batch.tensions[1, 2] == 0.0
    assert batch.broken.tolist() == [[False] * 8, [k == 2 for k in range(8)]]
    batch.reset()
    assert not batch.broken.any()
    with pytest.raises(CdprError, match="cable: found 8; accepted: 0 to 7"):
        batch.break_cable(0, 8)


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
    travel = np.linalg.norm(batch.poses[:, 4:] - soft.home.position, axis=1)
    assert travel.max() > 0.05
    assert np.sum(batch.tensions == 0.0) >= 4


def test_reset_puts_robots_at_rest_where_they_are_wanted():
    batch = BatchRobots(ROBOT, 3, settings=ELASTIC)
    home = batch.states[0]
    batch.step(speeds(3, 1)[0], PERIOD)
    X_WP = RigidTransform([0.05, -0.08, 0.3])
    held = batch.reset([1], pose_row(X_WP)[None])
    assert held.shape == (1, 8)
    assert batch.times.tolist() == [PERIOD, 0.0, PERIOD]
    assert np.allclose(batch.tensions[1], held[0], rtol=1e-6)
    batch.reset(np.array([True, False, False]))
    assert np.array_equal(batch.states[0], home)
    for _ in range(5):
        batch.step(np.zeros(8), PERIOD)
    moved = np.abs(batch.poses[1, 4:] - X_WP.translation())
    assert moved.max() < HELD
    # More tension in all cables lifts: it is no equilibrium any more, but starts there.
    more = batch.reset([2], X_WP.GetAsMatrix4(), tensions=held[0] + 5.0)
    assert np.allclose(batch.tensions[2], more[0], rtol=1e-6)
    with pytest.raises(TensionProblemError, match="outside the frame"):
        batch.reset([0], RigidTransform([0.0, 0.0, 5.0]))
    with pytest.raises(CdprError, match="robots: found 3; accepted: a mask of 3"):
        batch.reset(3)


def test_a_saved_state_goes_on_to_the_bit_where_it_was():
    batch = BatchRobots(ROBOT, 4, settings=ELASTIC, parameters=varied(ROBOT, 4))
    commands = speeds(4, 4)
    batch.break_cable(3, 0)
    batch.step(commands[0], PERIOD, wrenches=np.ones(6))
    kept = batch.save_state()

    def go_on():
        for command in commands[1:]:
            batch.step(command, PERIOD)
        return batch.states.tobytes()

    first = go_on()
    batch.reset()
    batch.load_state(kept)
    assert go_on() == first
    later = batch.states
    batch.load_state(kept, [0, 2])
    assert np.array_equal(batch.states[[1, 3]], later[[1, 3]])
    assert batch.times.tolist() == pytest.approx([PERIOD, 4 * PERIOD] * 2)
    with pytest.raises(CdprError, match="one of 4 robots"):
        BatchRobots(ROBOT, 2, settings=ELASTIC).load_state(kept)


def test_poses_twists_and_lowest_points():
    batch = BatchRobots(ROBOT, 2, settings=ELASTIC)
    batch.step(np.array([[0.05] * 8, [-0.03] * 4 + [0.03] * 4]), PERIOD)
    before = batch.poses
    batch.step(np.zeros(8), 1e-4)
    rates = (batch.poses - before)[:, 4:] / 1e-4
    assert np.allclose(rates, batch.twists[:, 3:], atol=5e-3)
    corners = ROBOT.box_center() + 0.5 * ROBOT.platform.size * np.array(
        [[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    )
    batch.load_state(tilted(batch.save_state()))
    for k, row in enumerate(batch.poses):
        turned = RigidTransform(Quaternion(row[:4]), row[4:]) @ corners.T
        assert batch.lowest_points[k] == pytest.approx(turned[2].min(), abs=1e-12)


def tilted(state):
    """A state with both platforms turned by 0.9 rad about an axis askew."""
    turn = np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8]) * np.sin(0.45)
    state.arrays[0][:, :4] = [np.cos(0.45), *turn]
    return state


def test_a_robot_that_fails_stops_and_the_others_go_on():
    how = settings(model="elastic", pulleys=True)
    batch = BatchRobots(ROBOT, 2, settings=how)
    push = np.zeros((2, 6))
    push[1, 5] = 1e12  # away, beyond all numbers that a platform has
    assert batch.step(np.zeros(8), PERIOD, wrenches=push).tolist() == [True, False]
    assert batch.failed.tolist() == [False, True]
    assert batch.problem(0) is None
    assert "before" in str(batch.problem(1))
    last = batch.states[1]
    assert np.isfinite(last).all()
    batch.step(np.zeros(8), PERIOD)
    assert np.array_equal(batch.states[1], last)
    assert batch.times[0] == 2 * PERIOD
    batch.reset([1])
    assert not batch.failed.any()
    assert batch.step(np.zeros(8), PERIOD).all()


def motors(mode):
    """Two robots with motors, of which only the first has brakes."""
    braked, bare = load_robot("caroca"), load_robot("caroca")
    braked.winch.brake_torque = 20.0
    how = settings(mode, model="elastic")
    return BatchRobots(braked, 2, settings=how, parameters=[braked, bare])


@pytest.mark.parametrize(
    ("how", "words"),
    [
        (lambda: BatchRobots(ROBOT, 0), "count: found 0; accepted: 1 or more"),
        (lambda: BatchRobots(ROBOT, 2, parameters=[ROBOT]), "parameters: found 1 robots"),
        (
            lambda: BatchRobots(ROBOT, 2, parameters=[ROBOT, load_robot("planar")]),
            "parameters: found robot 1 with another number of cables",
        ),
        (
            lambda: BatchRobots(ROBOT, 1, settings=settings(failures=FailureSettings())),
            "failures: found a section; accepted in a batch: null",
        ),
        (
            lambda: BatchRobots(ROBOT, 1, settings=load_scenario("acrobot_table_edge")),
            "world: found a section; accepted in a batch: null, since the compiled engine has no "
            "contact",
        ),
        (
            lambda: BatchRobots(ROBOT, 1, settings=settings("torque"), by_tensions=True),
            "winches.kind: found motor for robots by tensions",
        ),
        (
            lambda: BatchRobots(ROBOT, 2).step(np.zeros((3, 8)), PERIOD),
            r"commands: found shape \(3, 8\); accepted: \(8,\) or \(2, 8\)",
        ),
        (
            lambda: BatchRobots(ROBOT, 2).step(np.full(8, np.nan), PERIOD),
            "commands: found numbers that are not finite",
        ),
        (lambda: BatchRobots(behaving(creep_stiffness=2.0), 1), "creep_stiffness: found 2"),
        (lambda: BatchRobots(ROBOT, 2).step(np.zeros(8), -1.0), "duration: found -1 s"),
        (lambda: BatchRobots(ROBOT, 2).rollout(np.zeros(8), PERIOD), r"found shape \(8,\)"),
        (
            lambda: BatchRobots(ROBOT, 2).step(np.zeros(8), PERIOD, brakes=np.ones(8)),
            "brakes: found winches without motors; accepted: motors with winch.brake_torque",
        ),
        (
            lambda: motors("torque").step(np.zeros(8), PERIOD, brakes=np.ones(8)),
            "brakes: found no winch.brake_torque in the file of robot 1; accepted",
        ),
        (
            lambda: motors("torque").step(np.zeros(8), PERIOD, rates=np.ones(8)),
            "rates: found winches by torque; accepted: winches with motors, by position",
        ),
        (
            lambda: BatchRobots(ROBOT, 1).step(np.zeros(8), PERIOD, rates=np.ones(8)),
            "rates: found winches without motors",
        ),
        (lambda: BatchRobots(ROBOT, 2).reset(poses=np.ones((2, 7))), "a quaternion of norm 2"),
    ],
)
def test_what_is_refused(how, words):
    with pytest.raises(CdprError, match=words):
        how()

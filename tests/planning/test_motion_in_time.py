"""Motions in sets of poses and time: they wait, keep their limits, and only go forward."""

import numpy as np
import pytest

from cdpr_drake.analyses.planning.robot_path_task import LimitSettings, path_task
from cdpr_drake.errors import PlanningError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.planning.timed_curve import RateLimits, TimedBoxes, keeps, timed_curve
from cdpr_drake.planning.timed_motion import hop_times, motion_in_time, straight_time
from cdpr_drake.planning.timed_sequences import TimedGraph
from cdpr_drake.workspaces.timed_sets import TimedSets

START, GOAL = np.array([-0.2, 0.0, 0.3, 0, 0, 0.0]), np.array([0.2, 0.0, 0.3, 0, 0, 0.0])
BOX = np.full(3, 0.5)
OPENS = 9.0  # when the gate between left and right opens [s]
HORIZON = 20.0
ROUNDING = 1e-9
SOLVER = 1e-3  # what of the length a curve of least bending beside it gives away


def gate(detour=False, opens=OPENS):
    """Left and right, and between them a gate that opens late; perhaps a detour that is free."""
    rows = [
        ([-0.3, -0.1, 0.2], [0.0, 0.1, 0.4], [0.0, HORIZON]),
        ([-0.3, -0.1, 0.2], [0.3, 0.1, 0.4], [opens, HORIZON]),
        ([0.0, -0.1, 0.2], [0.3, 0.1, 0.4], [0.0, HORIZON]),
    ]
    if detour:
        rows.append(([-0.3, 0.05, 0.2], [-0.1, 0.5, 0.4], [0.0, HORIZON]))
        rows.append(([-0.3, 0.4, 0.2], [0.3, 0.5, 0.4], [0.0, HORIZON]))
        rows.append(([0.1, 0.05, 0.2], [0.3, 0.5, 0.4], [0.0, HORIZON]))
    low, high, times = (np.array([row[k] for row in rows], float) for k in range(3))
    about = {"accelerations_m_s2": BOX.tolist()}
    return TimedSets(low, high, times, np.arange(3), np.zeros(6), HORIZON, about)


@pytest.fixture(scope="module")
def task():
    return path_task(load_robot("acrobot_large"), LimitSettings(reserve=0.0))


def check(found):
    """Control points aside: samples of the motion lie in sets at their time, within limits."""
    motion = found.plan.trajectory
    times = np.linspace(0.0, motion.end_time, 20_000)
    rows = np.array([motion.motion(t) for t in times])
    sets = found.sets
    held = np.zeros(len(times), bool)
    for low, high, (a, b) in zip(sets.lower, sets.upper, sets.times, strict=True):
        place = rows[:, 4:7]
        inside = np.all((low - ROUNDING <= place) & (place <= high + ROUNDING), axis=1)
        held |= inside & (a <= times) & (times <= b)
    assert np.all(held)
    assert np.max(np.linalg.norm(rows[:, 10:13], axis=1)) <= found.speed + ROUNDING
    assert np.all(np.max(np.abs(rows[:, 16:]), axis=0) <= found.accelerations + ROUNDING)
    assert np.all(found.accelerations <= BOX + ROUNDING)
    np.testing.assert_allclose(rows[[0, -1], 4:7], [START[:3], GOAL[:3]], atol=1e-12)
    np.testing.assert_allclose(rows[[0, -1], 7:], 0.0, atol=1e-6)
    assert found.curve.breaks[0] == 0.0
    assert np.all(np.diff(found.curve.breaks) > 0.0)
    return times, rows


def test_it_waits_until_the_gate_opens(task):
    found = motion_in_time(gate(), START, GOAL, task, BOX)
    times, rows = check(found)
    crossing = times[np.argmax(rows[:, 4] > 0.0)]
    assert crossing >= OPENS - ROUNDING
    assert found.length == pytest.approx(0.4, rel=0.021)  # straight, and waiting
    assert found.plan.duration <= OPENS + 0.5 * straight_time(task, START, GOAL, BOX)


def test_least_time_takes_a_detour_that_is_quicker_than_waiting(task):
    shortest = motion_in_time(gate(True), START, GOAL, task, BOX)
    quickest = motion_in_time(gate(True), START, GOAL, task, BOX, cost="time")
    check(shortest)
    check(quickest)
    assert shortest.length == pytest.approx(0.4, rel=0.021)
    assert quickest.plan.duration < OPENS < shortest.plan.duration
    assert quickest.length > 0.8  # up, over and down


def test_a_gate_that_is_shut_too_early_is_no_way(task):
    sets = gate()
    # Two rooms 0.1 m apart, with a passage for 0.3 s: no motion gets through in that.
    shut = TimedSets(
        sets.lower + np.array([[0, 0, 0], [0, 0, 0], [0.05, 0, 0]]),
        sets.upper - np.array([[0.05, 0, 0], [0, 0, 0], [0, 0, 0]]),
        np.array([[0.0, HORIZON], [OPENS, OPENS + 0.3], [0.0, HORIZON]]), sets.axes, sets.fixed,
        HORIZON, sets.about,
    )  # fmt: skip
    with pytest.raises(PlanningError, match=r"no motion within the limits|no way in time"):
        motion_in_time(shut, START, GOAL, task, BOX)


def test_a_start_or_goal_in_no_set_is_named(task):
    with pytest.raises(PlanningError, match="from, to: found a pose in no proven set"):
        motion_in_time(gate(), START + np.array([0, 0.5, 0, 0, 0, 0]), GOAL, task, BOX)
    with pytest.raises(PlanningError, match="to: found the pose of the start"):
        motion_in_time(gate(), START, START, task, BOX)
    with pytest.raises(PlanningError, match="cost: found 'speed'"):
        motion_in_time(gate(), START, GOAL, task, BOX, cost="speed")


def test_the_goal_is_entered_when_it_is_clear_until_the_end(task):
    sets = gate()
    sets.times[2] = [0.0, 12.0]
    late = TimedSets(
        np.vstack([sets.lower, sets.lower[2:]]), np.vstack([sets.upper, sets.upper[2:]]),
        np.vstack([[0, HORIZON], [OPENS, 13.0], [0.0, 12.0], [12.5, HORIZON]]), sets.axes,
        sets.fixed, HORIZON, sets.about,
    )  # fmt: skip
    assert late.clear_from(GOAL) == 0.0  # sets 2, 1 and 3 hold it one after the other
    gap = TimedSets(late.lower, late.upper, np.where(late.times == 13.0, 12.2, late.times),
                    sets.axes, sets.fixed, HORIZON, sets.about)  # fmt: skip
    assert gap.clear_from(GOAL) == 12.5
    assert gate().clear_from(np.array([0.0, 0.9, 0.3, 0, 0, 0])) == np.inf
    found = motion_in_time(late, START, GOAL, task, BOX)
    check(found)


@pytest.mark.parametrize("seed", range(4))
def test_motions_through_random_sets_stay_in_them(task, seed):
    random = np.random.default_rng(seed)
    count = 8
    middles = np.linspace(START[:3], GOAL[:3], count) + random.uniform(-0.03, 0.03, (count, 3))
    halves = random.uniform(0.08, 0.14, (count, 3))
    opens = np.sort(random.uniform(0.0, 10.0, count))
    opens[0] = 0.0
    halves[[0, -1]] += 0.05
    times = np.column_stack([opens, np.minimum(opens + random.uniform(6.0, 9.0, count), 20.0)])
    times[-1, 1] = HORIZON
    sets = TimedSets(
        middles - halves, middles + halves, times, np.arange(3), np.zeros(6), HORIZON,
        {"accelerations_m_s2": BOX.tolist()},
    )  # fmt: skip
    for cost in ("length", "time"):
        found = motion_in_time(sets, START, GOAL, task, BOX, cost=cost)
        check(found)
        assert found.length >= 0.4 - ROUNDING
        assert found.plan.duration >= sets.clear_from(GOAL)


def test_labels_only_go_forward_and_rest_to_rest_sequences_are_motions():
    sets = gate(True)
    graph = TimedGraph(sets, START[:3], GOAL[:3], 0.0)
    limits = RateLimits(0.4, BOX)
    for by_time in (False, True):
        for found in graph.sequences(hop_times(graph, limits, 1.0), by_time):
            assert np.all(np.diff(found.times) >= 0.0)
            assert found.times[-1] <= HORIZON
            for k, number in enumerate(found.sets):
                a, b = sets.times[number]
                assert a - ROUNDING <= found.times[k] <= found.times[k + 1] <= b + ROUNDING
                for corner in found.points[k : k + 2]:
                    assert sets.holding(corner)[number]


def test_a_motion_that_leaves_its_box_or_limits_is_not_kept():
    boxes = TimedBoxes(
        np.array([[-0.3, -0.1, 0.2]]), np.array([[0.3, 0.1, 0.4]]), np.array([0.0, 6.0]), (0,)
    )
    limits = RateLimits(0.4, BOX)
    found = timed_curve(boxes, START[:3], GOAL[:3], limits)
    assert found is not None
    assert keeps(found, boxes, limits)
    assert not keeps(found, boxes, RateLimits(0.1, BOX))
    assert not keeps(found, boxes, RateLimits(0.4, 0.05 * BOX))
    narrow = TimedBoxes(boxes.lower, boxes.upper - [0.2, 0, 0], boxes.breaks, (0,))
    assert not keeps(found, narrow, limits)
    quick = TimedBoxes(boxes.lower, boxes.upper, np.array([0.0, 1.0]), (0,))
    assert timed_curve(quick, START[:3], GOAL[:3], limits) is None

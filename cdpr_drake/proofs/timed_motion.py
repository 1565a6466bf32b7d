"""Motions among what moves, proven at every instant: in sets of poses and time.

Sequences of sets with times of arrival come first, from those that go as fast as a straight motion
to those that rest at every corner. The latter are motions within the limits for sure, so that one
is found where any sequence is. In the sequence a cone program finds the motion; its pieces then
choose their sets anew as long as it gets better, and the time of arrival is made as early as can be
by halving.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError
from cdpr_drake.geometry.poses import pose_from_angles, pose_row
from cdpr_drake.planning.path_task import PathTask
from cdpr_drake.planning.path_timing import PathPlan
from cdpr_drake.proofs.path_in_sets import COSTS
from cdpr_drake.proofs.set_curve import LONGER, SetCurve
from cdpr_drake.proofs.timed_curve import RateLimits, TimedBoxes, largest_rates, timed_curve
from cdpr_drake.proofs.timed_sequences import TimedGraph, TimedSequence
from cdpr_drake.proofs.timed_sets import TimedSets
from cdpr_drake.trajectories.pose_path import (
    DEGREE,
    PIECE_NUMBERS,
    POSE_NUMBERS,
    PosePath,
)
from cdpr_drake.trajectories.timed_path import TimedPath

CARE = (0.0, 0.05, 0.1, 0.2, 0.35, 0.6, 1.0)
"""Between the time of a straight motion and that with a rest at every corner: what is tried."""

QUICK = 0.45
"""What the fastest motion takes of the time of one polynomial whose control points keep limits."""

PIECES = 16
"""Pieces of a motion, about, so that it can wait and go within one set."""

ROUNDS = 4
"""Times that pieces choose their sets anew."""

BETTER = 0.005
"""Share by which a motion must get better to go on."""

HALVINGS = 7
"""Steps of the search for the earliest arrival."""

SLOWER, MOST_SLOWER = 0.9, 12
"""By which the limits of the motion are lowered until samples keep those of the winches."""

ROUNDING = 1e-9
"""Limits that are missed by less, relative to them, are kept."""


@dataclass(frozen=True, eq=False)
class MotionInTime:
    """A motion in sets of poses and time.

    Attributes:
        sets: The sets.
        curve: The motion of the numbers that vary, its parameter is time.
        plan: The same as a motion of the robot.
        sequence: What it came from.
        speed: Bound of the speed of Po at any instant [m/s].
        accelerations: Bound of each component of the acceleration at any instant, shape (3,).
        goal_from: From when on the goal may be held [s].
        cost: One of `COSTS`.
        seconds: Time that the search took [s].
    """

    sets: TimedSets
    curve: SetCurve
    plan: PathPlan
    sequence: TimedSequence
    speed: float
    accelerations: Array
    goal_from: float
    cost: str
    seconds: float

    @property
    def length(self) -> float:
        """Of the control polygon, which the way of Po is not above [m]."""
        return self.curve.polygon

    def stretches(self) -> list[tuple[float, float, int]]:
        """When it is in which set: from, to [s], and the set's number."""
        found: list[tuple[float, float, int]] = []
        for (a, b), number in zip(pairwise(self.curve.breaks.tolist()), self.curve.sets,
                                  strict=True):  # fmt: skip
            if found and found[-1][2] == number:
                found[-1] = (found[-1][0], b, number)
            else:
                found.append((a, b, number))
        return found


def motion_in_time(
    sets: TimedSets,
    start: Array,
    goal: Array,
    task: PathTask,
    box: Array,
    *,
    cost: str = "length",
    say: Callable[[str], None] = lambda words: None,
) -> MotionInTime:
    """A motion from rest at time 0 to rest at the goal, where it can stay until the horizon.

    Args:
        sets: The sets, of positions.
        start: Position and angles, shape (6,) [m, rad].
        goal: Likewise.
        task: The robot and its limits.
        box: Half widths of the accelerations that its sets are proven for, shape (3,) [m/s^2].
        cost: One of `COSTS`: the shortest way, or the earliest arrival.
        say: Told what is done now.

    Raises:
        PlanningError: An end is in no set, no way in time leads to the goal, or the winches cannot
            do it.
    """
    if cost not in COSTS:
        raise PlanningError(f"cost: found {cost!r}; accepted: {', '.join(COSTS)}")
    begin = time.perf_counter()
    ends = np.asarray(start, float)[sets.axes], np.asarray(goal, float)[sets.axes]
    if np.linalg.norm(ends[1] - ends[0]) < 1e-9:
        raise PlanningError("to: found the pose of the start; accepted: another one")
    goal_from = sets.clear_from(goal)
    if not np.isfinite(goal_from) or not sets.covers(start, 0.0):
        raise PlanningError(
            "from, to: found a pose in no proven set, at time 0 or at the end; accepted: others"
        )
    graph = TimedGraph(sets, *ends, goal_from)
    lim, scale = task.limits, 1.0
    for _ in range(MOST_SLOWER):
        limits = RateLimits(
            scale * min(lim.speed, lim.cable_speed), scale**2 * np.asarray(box, float)[sets.axes]
        )
        say("Looking for a motion in time")
        sequence, curve = _best(graph, limits, cost)
        plan = _plan(task, sets, curve)
        if float(np.max(plan.samples().uses)) <= 1.0 + ROUNDING:
            break
        scale *= SLOWER
    else:
        raise PlanningError(
            "from, to: the winches' limits are missed at any speed at which what moves is kept off;"
            " accepted: other poses, or obstacles that move otherwise"
        )
    speed, accelerations = largest_rates(curve)
    full = np.zeros(3)
    full[sets.axes] = accelerations
    return MotionInTime(
        sets, curve, plan, sequence, speed, full, goal_from, cost, time.perf_counter() - begin
    )


def _best(graph: TimedGraph, limits: RateLimits, cost: str) -> tuple[TimedSequence, SetCurve]:
    """The best motion of the sequences that are found.

    Raises:
        PlanningError: There is none.
    """
    found: list[tuple[TimedSequence, SetCurve]] = []
    seen: set[tuple[int, ...]] = set()
    reached = False
    for care in CARE:
        hops, before = hop_times(graph, limits, care), len(found)
        sequences = graph.sequences(hops, False)
        if cost == "time":  # the earliest sequence may be a worse start than a short one
            sequences += graph.sequences(hops, True)
        for sequence in sequences:
            reached = True
            key = (*sequence.sets, *np.round(1e3 * sequence.times).astype(int).tolist())
            if key in seen:
                continue
            seen.add(key)
            curve = _motion(graph, sequence, limits, cost)
            if curve is not None:
                found.append((sequence, curve))
        if before:  # the next slower ones were looked at, too
            break
    if not found:
        why = "no motion within the limits" if reached else "no way in time"
        raise PlanningError(
            f"from, to: found {why} in {len(graph.sets)} proven sets until "
            f"{graph.sets.horizon:.4g} s; accepted: poses that one joins, or more cells"
        )
    if cost == "length":  # of those that are about as short, the first to arrive
        most = (1.0 + LONGER) * min(curve.polygon for _, curve in found)
        found = [one for one in found if one[1].polygon <= most]
    return min(found, key=lambda one: float(one[1].breaks[-1]))


def hop_times(
    graph: TimedGraph, limits: RateLimits, care: float
) -> Callable[[Array, Array], Array]:
    """Times for straight ways: from those of a long motion on the fly to those from rest to rest.

    The latter are such that control points of a polynomial of degree 5 keep the limits.
    """
    way = np.abs(graph.goal - graph.start)
    whole = _rest_to_rest(way[np.newaxis], limits)[0]
    pace = QUICK * whole / float(np.linalg.norm(way))

    def hops(point: Array, others: Array) -> Array:
        ways = np.abs(others - point)
        quick = pace * np.linalg.norm(ways, axis=1)
        return np.asarray((1.0 - care) * quick + care * _rest_to_rest(ways, limits), float)

    return hops


def _rest_to_rest(ways: Array, limits: RateLimits) -> Array:
    """Times from rest to rest by one polynomial whose control points keep the limits, shape (k,).

    Its control points are three times the start and three times the end.
    """
    n = DEGREE * (DEGREE - 1)
    held = np.isfinite(limits.acceleration)
    slow = np.sqrt(np.max(n * ways[:, held] / limits.acceleration[held], axis=1, initial=0.0))
    fast = DEGREE * np.linalg.norm(ways, axis=1) / limits.speed
    return np.asarray(np.maximum(slow, fast) * (1.0 + 1e-3), float)


def _motion(
    graph: TimedGraph, sequence: TimedSequence, limits: RateLimits, cost: str
) -> SetCurve | None:
    """The motion in a sequence; None where there is none within the limits."""
    boxes = _boxes(graph.sets, sequence)
    curve = timed_curve(boxes, graph.start, graph.goal, limits)
    if curve is None:
        return None
    value = np.inf
    for _ in range(ROUNDS):
        if cost == "length":
            if curve.polygon >= value * (1.0 - BETTER):
                break
            value = curve.polygon
            found = timed_curve(_chosen(graph.sets, curve), graph.start, graph.goal, limits)
        else:
            if curve.breaks[-1] >= value * (1.0 - BETTER):
                break
            value = float(curve.breaks[-1])
            found = _earliest(graph, _chosen(graph.sets, curve), limits, np.inf)
        if found is None:
            break
        curve = found
    boxes = _chosen(graph.sets, curve)
    if cost == "length":
        found = _earliest(graph, boxes, limits, (1.0 + LONGER) * curve.polygon)
    else:  # as early, and no longer than it must be
        found = timed_curve(boxes, graph.start, graph.goal, limits)
    return curve if found is None else found


def _earliest(
    graph: TimedGraph, boxes: TimedBoxes, limits: RateLimits, longest: float
) -> SetCurve | None:
    """The motion that arrives first, within a length, in boxes cut off at its arrival."""
    held = [graph.holds(graph.goal, number) for number in boxes.sets]
    first = len(held) - 1
    while first > 0 and held[first - 1]:
        first -= 1
    low = max(graph.goal_from, float(boxes.breaks[first]) + 1e-3)
    high, best = float(boxes.breaks[-1]), None
    longest = min(longest, 1e3 * float(np.linalg.norm(graph.goal - graph.start)))
    for k in range(HALVINGS + 1):
        arrival = high if k == 0 else 0.5 * (low + high)
        found = timed_curve(boxes.until(arrival), graph.start, graph.goal, limits, longest)
        if found is None:
            if k == 0:
                return None
            low = arrival
        else:
            best, high = found, arrival
    return best


def _boxes(sets: TimedSets, sequence: TimedSequence) -> TimedBoxes:
    """Pieces of a sequence: in each set as many as its time asks for."""
    longest = max(float(sequence.times[-1]) / PIECES, 1e-3)
    breaks, numbers = [0.0], []
    for (a, b), number in zip(pairwise(sequence.times.tolist()), sequence.sets, strict=True):
        if b - a < 1e-6:
            continue
        count = int(np.ceil((b - a) / longest - 1e-9))
        breaks += np.linspace(a, b, count + 1)[1:].tolist()
        numbers += [number] * count
    return TimedBoxes(sets.lower[numbers], sets.upper[numbers], np.array(breaks), tuple(numbers))


def _chosen(sets: TimedSets, curve: SetCurve) -> TimedBoxes:
    """For each piece of a motion the largest set that holds it."""
    sizes = np.prod(sets.upper - sets.lower, axis=1)
    numbers = []
    for (a, b), points, now in zip(pairwise(curve.breaks.tolist()), curve.controls, curve.sets,
                                   strict=True):  # fmt: skip
        held = (sets.times[:, 0] <= a) & (b <= sets.times[:, 1])
        held &= sets.holding(np.min(points, axis=0)) & sets.holding(np.max(points, axis=0))
        numbers.append(int(np.argmax(np.where(held, sizes, -1.0))) if np.any(held) else now)
    return TimedBoxes(sets.lower[numbers], sets.upper[numbers], curve.breaks, tuple(numbers))


def _plan(task: PathTask, sets: TimedSets, curve: SetCurve) -> PathPlan:
    """The motion of the robot; the parameter of its path is time."""
    pieces = np.zeros((len(curve.sets), DEGREE + 1, POSE_NUMBERS))
    pieces[:, 0] = pose_row(pose_from_angles(sets.fixed[:3], sets.fixed[3:]))
    pieces[:, :, 4 + sets.axes] = curve.powers()
    path = PosePath(curve.breaks, pieces.reshape(-1, PIECE_NUMBERS))
    n = len(curve.breaks)
    motion = TimedPath.make(path, curve.breaks, np.ones(n))
    return PathPlan(task, path, motion, np.full((n, 2), np.nan), np.full(n, np.nan))


def straight_time(task: PathTask, start: Array, goal: Array, box: Array) -> float:
    """About how long a straight motion takes, from rest to rest, without anything in its way [s].

    Args:
        task: The robot and its limits.
        start: Position and angles, shape (6,) [m, rad].
        goal: Likewise.
        box: Half widths of accelerations, shape (3,) [m/s^2].
    """
    limits = RateLimits(min(task.limits.speed, task.limits.cable_speed), np.asarray(box, float))
    return float(_rest_to_rest(np.abs(goal - start)[np.newaxis, :3], limits)[0])

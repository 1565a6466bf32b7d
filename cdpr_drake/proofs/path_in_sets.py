"""Paths of which every pose is proven: from one pose to another within convex sets of poses.

Sets come from proofs over boxes of poses, so that what is in them holds for all time and not for
samples. A path is found by short sequences of sets, each a convex program, and is then a curve
whose control points lie in the sets. `method="gcs"` asks Drake's graph of convex sets instead.

Source: Marcucci, Umenberger, Parrilo and Tedrake, Shortest paths in graphs of convex sets, 2024;
Yen, Finding the k shortest loopless paths in a network, 1971.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from pydrake.geometry.optimization import GraphOfConvexSetsOptions, HPolyhedron, Point
from pydrake.planning import GcsTrajectoryOptimization
from pydrake.solvers import ClarabelSolver

from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError, accepted_names
from cdpr_drake.geometry.poses import pose_from_angles, pose_row
from cdpr_drake.planning.path_task import PathTask
from cdpr_drake.planning.path_timing import STATIONS, PathPlan, plan_along_path
from cdpr_drake.proofs.box_timing import BoxTiming, mass_centres, time_within_box
from cdpr_drake.proofs.proven_sets import NUMBER_NAMES, PoseSets
from cdpr_drake.proofs.set_curve import SetCurve, fast_curve, floored, shares_of, smooth_curve
from cdpr_drake.proofs.set_sequences import OverlapGraph, SetSequence
from cdpr_drake.trajectories.pose_path import (
    DEGREE,
    PIECE_NUMBERS,
    POSE_NUMBERS,
    PosePath,
    hermite,
)

METHODS = ("sequences", "gcs")
"""How sets are chosen: by short sequences, or by a graph of convex sets."""

COSTS = ("length", "time")
"""What a path has least of."""

SEQUENCES = 12
"""Sequences that are looked at."""

TIMED = 4
"""Of these, the shortest that are timed where the time shall be least."""

RESHAPED = 3
"""Times that a curve gets new shares of time from its own law of time."""

ROUNDED_PATHS = 10
"""Paths that the graph of convex sets rounds its relaxation to."""

TURN_PIECE = 0.05
"""Pieces of a path turn by no more than this, so that polynomials of quaternions leave the angles
of the curve by less than 1e-12 [rad]."""

NOMINAL = 1.0
"""Acceleration for the shape of fast curves where no box says one [m/s^2]."""


@dataclass(frozen=True, eq=False)
class ProvenPath:
    """A path in sets.

    Attributes:
        sets: The sets.
        sequence: The shortest polyline through its sets, in scaled numbers.
        curve: The smooth curve through the same sets, in scaled numbers.
        path: The same as poses.
        lower_bound: No path in these sets is shorter; a turn counts by the length scale [m].
        straight: Length of the straight line [m].
        looked_at: Lengths of all sequences that were solved, with their sets.
        method: One of `METHODS`.
        seconds: Time that the search took [s].
    """

    sets: PoseSets
    sequence: SetSequence
    curve: SetCurve
    path: PosePath
    lower_bound: float
    straight: float
    looked_at: tuple[tuple[float, tuple[int, ...]], ...]
    method: str
    seconds: float

    @property
    def length(self) -> float:
        """Of the shortest polyline [m]."""
        return self.sequence.length

    def stretches(self) -> list[tuple[float, float, int]]:
        """Where on the path it is in which set: from s, to s [m], and the set's number."""
        ends = self.curve.breaks.tolist()
        return [(a, b, n) for (a, b), n in zip(pairwise(ends), self.curve.sets, strict=True)]


@dataclass(frozen=True, eq=False)
class ProvenMotion:
    """A motion along a path in sets.

    Attributes:
        path: The path.
        plan: The motion.
        box: What holds of its acceleration at any instant; None: it keeps limits at stations only.
        cost: One of `COSTS`.
    """

    path: ProvenPath
    plan: PathPlan
    box: BoxTiming | None
    cost: str

    def time_bound(self) -> float:
        """No motion in these sets within these limits is faster [s].

        From rest to rest over the distance along each axis with the acceleration of the box, of Po
        or where it turns of the centre of mass, and over the shortest path with the largest speed.
        """
        lim, bound = self.plan.task.limits, 0.0
        speed = min(lim.speed, lim.cable_speed) if self.box is not None else lim.speed
        if np.isfinite(speed) and not self.turns:
            bound = self.path.lower_bound / speed
        if self.box is not None:
            ends = self.path.path.points(np.array([0.0, self.path.path.length]))
            ends = ends[:, 4:7] if self.box.moments is None else mass_centres(self.plan.task, ends)
            box = np.array(self.path.sets.about["accelerations_m_s2"], float)
            bound = max(bound, float(np.max(2.0 * np.sqrt(np.abs(ends[1] - ends[0]) / box))))
        return bound

    @property
    def turns(self) -> bool:
        """Whether angles may vary in the sets."""
        return bool(np.any(self.path.sets.axes >= 3))


def proven_path(
    sets: PoseSets,
    start: Array,
    goal: Array,
    length_scale: float,
    method: str = "sequences",
    count: int = SEQUENCES,
) -> ProvenPath:
    """The shortest path that is found in sets, as a smooth curve.

    Args:
        sets: The sets.
        start: Position and angles, shape (6,) [m, rad].
        goal: Likewise.
        length_scale: By which turns count as lengths [m].
        method: One of `METHODS`.
        count: Sequences that are looked at.

    Raises:
        PlanningError: An end is in no set, the sets do not connect them, or the ends are the same.
    """
    begin = time.perf_counter()
    graph, scale = _graph(sets, start, goal, length_scale, method)
    found = _sequences(graph, method, count)
    best = min(found, key=lambda one: one.length)
    curve = smooth_curve(graph.lower, graph.upper, best.sets, best.points)
    took = time.perf_counter() - begin
    return _result(sets, graph, (best, curve), found, scale, method=method, took=took)


def proven_motion(
    sets: PoseSets,
    start: Array,
    goal: Array,
    task: PathTask,
    length_scale: float,
    *,
    cost: str = "length",
    method: str = "sequences",
    count: int = SEQUENCES,
    stations: int = STATIONS,
    say: Callable[[str], None] = lambda words: None,
) -> ProvenMotion:
    """A motion along a path in sets: of the shortest path, or the fastest of several.

    Where the sets prove a box of accelerations (`about`), and where angles vary one of moments, the
    motion stays in it at every instant, so that tensions within their limits always exist.

    Args:
        sets: The sets.
        start: Position and angles, shape (6,) [m, rad].
        goal: Likewise.
        task: The robot and its limits.
        length_scale: By which turns count as lengths [m].
        cost: One of `COSTS`.
        method: One of `METHODS`.
        count: Sequences that are looked at.
        stations: As of `plan_along_path`.
        say: Told what is done now.

    Raises:
        PlanningError: As `proven_path`; or the path cannot be timed.
    """
    if cost not in COSTS:
        raise PlanningError(f"cost: found {cost!r}; {accepted_names(cost, COSTS)}")
    given = sets.about.get("accelerations_m_s2")
    turning = sets.about.get("moments_n_m") if np.any(sets.axes >= 3) else None
    still = given is None or (np.any(sets.axes >= 3) and turning is None)
    box = None if still else np.array(given, float)
    moments = None if turning is None else np.array(turning, float)

    def timed(path: PosePath) -> tuple[PathPlan, BoxTiming | None]:
        if box is None:
            return plan_along_path(task, path, stations), None
        found = time_within_box(task, path, box, stations, moments)
        return found.plan, found

    say("Looking for sets that lead to the goal")
    if cost == "length":
        path = proven_path(sets, start, goal, length_scale, method, count)
        return ProvenMotion(path, *timed(path.path), cost)
    begin = time.perf_counter()
    graph, scale = _graph(sets, start, goal, length_scale, method)
    found = sorted(_sequences(graph, method, count), key=lambda one: one.length)
    lim = task.limits
    speed = min(lim.speed, lim.cable_speed)
    limits = np.full(6, NOMINAL)
    if box is not None:
        limits[:3] = box
    if moments is not None:
        limits[3:] = length_scale * np.array(sets.about["angular_accelerations_rad_s2"], float)
    best: tuple[SetSequence, SetCurve, PathPlan, BoxTiming | None] | None = None
    for number, sequence in enumerate(found[:TIMED], 1):
        say(f"Timing way {number} of {min(len(found), TIMED)}")
        curves = [smooth_curve(graph.lower, graph.upper, sequence.sets, sequence.points)]
        shares = shares_of(sequence.points)
        for _ in range(RESHAPED + 1):
            plan, within = timed(_pose_path(sets, curves[-1], scale))
            if best is not None and plan.duration >= best[2].duration and len(curves) > 1:
                break
            if best is None or plan.duration < best[2].duration:
                best = sequence, curves[-1], plan, within
            if len(curves) > 1:
                shares = _time_shares(plan, curves[-1])
            boxes = graph.lower, graph.upper, sequence.sets, sequence.points
            curves.append(fast_curve(*boxes, shares, acceleration=limits[sets.axes], speed=speed))
    assert best is not None
    took = time.perf_counter() - begin
    path = _result(sets, graph, best[:2], found, scale, method=method, took=took)
    return ProvenMotion(path, best[2], best[3], cost)


def _graph(
    sets: PoseSets, start: Array, goal: Array, length_scale: float, method: str
) -> tuple[OverlapGraph, Array]:
    if method not in METHODS:
        raise PlanningError(f"method: found {method!r}; {accepted_names(method, METHODS)}")
    for where, pose in (("from", start), ("to", goal)):
        if not sets.covers(pose):
            raise PlanningError(
                f"{where}: found a pose in none of {len(sets)} proven sets; accepted: one in a set"
            )
    axes = sets.axes
    scale = np.where(axes < 3, 1.0, length_scale)
    ends = np.asarray(start, float)[axes] * scale, np.asarray(goal, float)[axes] * scale
    if np.linalg.norm(ends[1] - ends[0]) < 1e-9:
        raise PlanningError("to: found the pose of the start; accepted: another one")
    graph = OverlapGraph(
        sets.lower[:, axes] * scale, sets.upper[:, axes] * scale, sets.graph, *ends
    )
    return graph, np.asarray(scale, float)


def _sequences(graph: OverlapGraph, method: str, count: int) -> list[SetSequence]:
    found = list(graph.all_short(count)) if method == "sequences" else _by_gcs(graph)
    if not found:
        raise PlanningError(
            f"from, to: found two poses that {len(graph.lower)} proven sets do not connect; "
            "accepted: sets of more boxes or cells, other angles, or smaller accelerations"
        )
    return found


def _by_gcs(graph: OverlapGraph) -> list[SetSequence]:
    """The path of Drake's graph of convex sets, as a polyline in the sets that it goes through."""
    d = len(graph.start)
    gcs = GcsTrajectoryOptimization(d)
    pairs = [tuple(int(k) for k in pair) for pair in graph.pairs]
    regions = [HPolyhedron.MakeBox(a, b) for a, b in zip(graph.lower, graph.upper, strict=True)]
    both = pairs + [(b, a) for a, b in pairs]
    inner = gcs.AddRegions(regions, both, 1, 0.0, 1e3, "sets")
    source = gcs.AddRegions([Point(graph.start)], 0, name="start")
    target = gcs.AddRegions([Point(graph.goal)], 0, name="goal")
    gcs.AddEdges(source, inner)
    gcs.AddEdges(inner, target)
    gcs.AddPathLengthCost(1.0)
    options = GraphOfConvexSetsOptions()
    options.convex_relaxation = True
    options.max_rounded_paths = ROUNDED_PATHS
    options.solver = ClarabelSolver()
    way, result = gcs.SolvePath(source, target, options)
    if not result.is_success():
        return []
    corners = [way.value(way.get_segment_times()[0]).ravel()]
    corners += [way.value(t).ravel() for t in way.get_segment_times()[1:]]
    sets: list[int] = []
    for a, b in pairwise(corners):
        held = np.flatnonzero(_near(graph, a) & _near(graph, b))
        if not len(held):
            continue
        number = sets[-1] if sets and sets[-1] in held else int(held[0])
        if not sets or sets[-1] != number:
            sets.append(number)
    return [graph.shortest(sets)]


def _near(graph: OverlapGraph, point: Array) -> np.ndarray:
    """Boxes that hold a point up to what a solver misses."""
    slack = 1e-5 * graph.straight
    held = (graph.lower - slack <= point) & (point <= graph.upper + slack)
    return np.asarray(np.all(held, axis=1))


def _result(
    sets: PoseSets, graph: OverlapGraph, best: tuple[SetSequence, SetCurve],
    found: list[SetSequence], scale: Array, *, method: str, took: float,
) -> ProvenPath:  # fmt: skip
    looked = sorted((one.length, one.sets) for one in found)
    return ProvenPath(
        sets, best[0], best[1], _pose_path(sets, best[1], scale), graph.bound(), graph.straight,
        tuple(looked), method, took,
    )  # fmt: skip


def _time_shares(plan: PathPlan, curve: SetCurve) -> Array:
    """Shares of the time that a motion takes for the pieces of its curve."""
    motion = plan.trajectory
    at = np.interp(curve.breaks, motion.stations, motion.times() - motion.start_time)
    return floored(np.diff(at) / plan.duration)


def _pose_path(sets: PoseSets, curve: SetCurve, scale: Array) -> PosePath:
    """A curve as poses: without turns the same polynomials, else pieces that turn little."""
    axes, fixed = sets.axes, sets.lower[0]
    if not np.any(axes >= 3):
        pieces = np.zeros((len(curve.sets), DEGREE + 1, POSE_NUMBERS))
        pieces[:, 0] = pose_row(pose_from_angles(fixed[:3], fixed[3:]))
        pieces[:, :, 4 + axes] = curve.powers()
        return PosePath(curve.breaks, pieces.reshape(-1, PIECE_NUMBERS))
    breaks, found = [0.0], []
    turning = np.flatnonzero(axes >= 3)
    for k, (a, b) in enumerate(pairwise(curve.breaks.tolist())):
        steps = np.diff(curve.controls[k][:, turning] / scale[turning], axis=0)
        parts = int(np.ceil(np.sum(np.abs(steps)) / TURN_PIECE)) or 1
        knots = np.linspace(0.0, b - a, parts + 1)
        rows = [_turned(row / scale, axes, fixed) for row in curve.at(k, knots)]
        for (p, q), (s, t) in zip(pairwise(rows), pairwise(knots.tolist()), strict=True):
            found.append(hermite(t - s, p, q))
            breaks.append(a + t)
    return PosePath(np.array(breaks), np.array(found))


def _turned(row: Array, axes: np.ndarray, fixed: Array) -> tuple[Array, Array, Array]:
    """Pose row and two derivatives from numbers of a pose and two derivatives, shape (3, d)."""
    numbers = np.zeros((3, 6))
    numbers[0] = fixed
    numbers[:, axes] = row
    turn = np.zeros((3, 4))
    turn[0, 0] = 1.0
    for axis in range(3):  # R = Rx(phi) Ry(theta) Rz(psi), each a quaternion of half its angle
        half, rate, bend = 0.5 * numbers[:, 3 + axis]
        c, s = np.cos(half), np.sin(half)
        scalar = np.array([c, -s * rate, -c * rate**2 - s * bend])
        vector = np.zeros((3, 3))
        vector[:, axis] = s, c * rate, -s * rate**2 + c * bend
        other = np.column_stack([scalar, vector])
        turn = np.array(
            [
                _times(turn[0], other[0]),
                _times(turn[1], other[0]) + _times(turn[0], other[1]),
                _times(turn[2], other[0]) + 2 * _times(turn[1], other[1])
                + _times(turn[0], other[2]),
            ]
        )  # fmt: skip
    joined = np.hstack([turn, numbers[:, :3]])
    return joined[0], joined[1], joined[2]


def _times(a: Array, b: Array) -> Array:
    """Product of quaternions wxyz."""
    vector = a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])
    return np.array([a[0] * b[0] - a[1:] @ b[1:], *vector])


def axes_words(sets: PoseSets) -> str:
    """Numbers that vary, in words."""
    return ", ".join(NUMBER_NAMES[axis] for axis in sets.axes)

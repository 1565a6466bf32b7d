"""All starts of a calibration beside each other: the best minimum, and what fits as well.

A robot that measures nothing but itself has several minima: of the start as a whole, and of the
pose of a row. Starts are compared by one cost: squares over sigma, in which an outlier costs 16
(`OUTLIER` squared), so that to drop a row is no way to fit. A start that comes near a minimum that
is known already goes no further; of its poses, those that lie elsewhere are tried there. Whole
lengths of a point mass tell a start without any frame; it counts where it ends lower than the rest.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from pydrake.math import RigidTransform

from cdpr_drake.analyses.fits.setup import Setup, StartPoint
from cdpr_drake.analyses.logs.measurements import on_motion
from cdpr_drake.arrays import Array
from cdpr_drake.calibration.elimination import MOST_STEPS
from cdpr_drake.calibration.fit_groups import GroupFault, group_faults
from cdpr_drake.calibration.guesses import unfolded_points
from cdpr_drake.calibration.parameters import parameter_layout
from cdpr_drake.calibration.pose_search import (
    HUBER,
    FoundPoses,
    robust_costs,
    robust_poses,
    turned_starts,
)
from cdpr_drake.calibration.program import CalibrationProgram
from cdpr_drake.calibration.result import CalibrationResult
from cdpr_drake.calibration.stations import Point, Stations
from cdpr_drake.errors import CalibrationError
from cdpr_drake.geometry.poses import pose_error, pose_from_angles

OTHER_STARTS = 6
"""First poses, drawn at random, that are tried beside the believed one."""

TIE = 9.0
"""Two fits whose costs differ by less are as good as each other: noise of three sigmas in a single
reading would decide."""

MOST_REFINEMENTS = 8
"""Times that poses are sought anew with the fitted robot, while that is better."""

GAIN = 1e-2
"""A cost that falls by more is better."""

TRIAL_GAIN = 0.1
"""Share by which a cost falls at least, for a trial of a single start to go on with refinements."""

NEAR_PLACE, NEAR_TURN = 0.02, 0.1
"""Places this near in parts of the frame's size, and turns [rad], are on their way to one
minimum."""

CHUNK, CHUNKS = 5, 6
"""Steps of a start before it is compared with known minima, and how many times."""

GIVEN_UP = 5.0
"""A start that costs so many times what a known minimum does, after all these steps, goes no
further; costs with linear loss for outliers."""

APART = 5.0
"""Poses that are more of their standard deviations apart are two."""


class Tie(NamedTuple):
    """Another pose that fits as well.

    Attributes:
        pose: Number of the pose, from 0.
        X_WP: The other pose [m].
        distance: Its distance from the fitted pose [m].
        angle: Its turn against the fitted pose [rad].
        more: Its cost beyond that of the fitted pose [-]; below `TIE`.
    """

    pose: int
    X_WP: RigidTransform
    distance: float
    angle: float
    more: float


class Minimum(NamedTuple):
    """Where a start ended."""

    program: CalibrationProgram
    result: CalibrationResult
    cost: float


@dataclass(frozen=True, eq=False)
class BestFit:
    """The best of all starts.

    Attributes:
        result: Its result.
        ties: Poses of other minima that fit as well, by rows.
        minima: Number of minima in which starts ended.
        groups: Groups of measurements that do not agree with the others.
        flipped_costs_less: By how much the best minimum with the platform upside down costs less
            than this one [-]; 0 if none does.
    """

    result: CalibrationResult
    ties: tuple[Tie, ...]
    minima: int
    groups: tuple[GroupFault, ...]
    flipped_costs_less: float = 0.0


def best_of_starts(setup: Setup, say: Callable[[str], None], others: bool = True) -> BestFit:
    """The best minimum of all starts.

    Args:
        setup: The problem.
        say: Hears what is done.
        others: True to try further first poses beside the believed one.

    Raises:
        CalibrationError: No start leads anywhere; says why the last one does not.
    """
    firsts = [setup.first, *(_other_firsts(setup) if others else ())]
    starts = setup.start_points(firsts)
    programs = [setup.program(start) for start in starts]
    minima: list[Minimum] = []
    pool: list[Stations] = []
    failure: CalibrationError | None = None
    for number, program in enumerate(programs):
        say(f"Calibrating, start {number + 1} of {len(programs)}")
        try:
            at = None
            if minima:
                at, end = _on_its_way(setup, program, minima)
                pool.append(end)
                if at is None:
                    continue
            minimum = _solved(setup, program, at, straight=False)
            minima.append(_improved(setup, minimum, [], 0.0 if others else TRIAL_GAIN))
        except CalibrationError as refusal:
            failure = refusal
            if number == 0:
                together = _from_one_pose(setup, starts[0])
                minima += [] if together is None else [together]
    say("Comparing starts")
    unfolded = _unfolded(setup)
    if unfolded is not None and all(unfolded.cost < minimum.cost - TIE for minimum in minima):
        minima, pool = [unfolded], []
    if not minima:
        assert failure is not None
        raise failure
    best = min(upright_minima(setup, minima), key=lambda minimum: minimum.cost)
    if len(programs) > 1:
        pool += [minimum.result.stations for minimum in minima if minimum is not best]
        best = _improved(setup, best, pool)
    ties = _ties(setup, best, pool) if len(programs) > 1 else []
    for minimum in minima:
        if minimum.cost < best.cost + TIE:
            for k, Y in enumerate(minimum.result.stations.poses()):
                _add_tie(ties, best.result, k, Y, minimum.cost - best.cost)
    ties.sort(key=lambda tie: (tie.pose, tie.more))
    less = max(0.0, best.cost - min(minimum.cost for minimum in minima))
    problem = best.program.SolvedProblem(best.result, setup.task.outliers)
    groups = group_faults(problem, best.result)
    return BestFit(best.result, tuple(ties), len(minima), groups, less)


def _from_one_pose(setup: Setup, start: StartPoint) -> Minimum | None:
    """The minimum from all poses at the first one, far from parallel cables; None: no minimum."""
    alike = StartPoint(start.model, [setup.first] * setup.task.log.count)
    try:
        end = setup.program(alike).Approach(MOST_STEPS).at
        there = StartPoint(start.model, end.stations.poses())
        minimum = _solved(setup, setup.program(there), end, straight=False)
        return _improved(setup, minimum, [])
    except CalibrationError:
        return None


def _unfolded(setup: Setup) -> Minimum | None:
    """The minimum from exit points and places that whole lengths of a point mass tell alone; None:
    they do not, or something is known of these points."""
    task, model, motion = setup.task, setup.model, setup.freedom.motion
    if not (motion.is_point and task.blind) or setup.lengths is None or setup.zeroed:
        return None
    free, slices = setup.free((*task.priors, *task.bounds)), parameter_layout(model).slices
    known = setup.first.rotation().matrix()
    basis, home = motion.basis(known)[3:], setup.first.translation()
    points = free[slices["exit_points"]].reshape(-1, 3)[:, np.any(basis != 0.0, axis=1)]
    counted = any(setup.free()[slices[key]].any() for key in ("length_offsets", "length_scales"))
    whole = np.isfinite(setup.lengths).all(axis=1)
    if counted or not (points.all() and whole.any()):
        return None
    believed = (model.cables.p_WA - known @ model.cables.p_PB).T - home
    inside = believed @ basis
    across = np.sum(believed**2, axis=1) - np.sum(inside**2, axis=1)
    flat = np.sqrt(np.maximum(setup.lengths[whole] ** 2 - across, 0.0))
    unfolded = unfolded_points(flat, basis.shape[1])
    if unfolded is None:
        return None
    anchors, places = (x - unfolded[0].mean(axis=0) for x in unfolded)
    middle = inside.mean(axis=0)
    U, _, Vt = np.linalg.svd(anchors.T @ (inside - middle))  # a mirror image may be nearer
    anchors, places = (x @ U @ Vt + middle for x in (anchors, places))
    p_WA = model.cables.p_WA + basis @ (anchors - inside).T
    rows = np.arange(task.log.count)
    places = np.array([np.interp(rows, rows[whole], column) for column in places.T]).T
    poses = [RigidTransform(setup.first.rotation(), home + basis @ place) for place in places]
    try:
        program = setup.program(StartPoint(model, poses))
        start = replace(model, cables=replace(model.cables, p_WA=p_WA))
        at = Point(start, program.stations, program.layout)
        return _improved(setup, _solved(setup, program, at, straight=False), [])
    except CalibrationError:
        return None


def upside_down(result: CalibrationResult, up: Array) -> npt.NDArray[np.bool_]:
    """Flags of poses with the platform's z axis against that of a pose known upright, (k,)."""
    return np.asarray(result.stations.R[:, :, 2] @ up < 0.0)


def upright_minima(setup: Setup, minima: Sequence[Minimum]) -> Sequence[Minimum]:
    """Minima in which the platform is not upside down against the first pose; all, if each is."""
    up = setup.first.rotation().matrix()[:, 2]
    upright = [minimum for minimum in minima if not upside_down(minimum.result, up).any()]
    return upright or minima


def _solved(
    setup: Setup, program: CalibrationProgram, at: Point | None, *, straight: bool
) -> Minimum:
    result = program.Solve(setup.task.outliers, at, straight=straight)
    cost = result.robust_cost if setup.task.outliers else result.chi_square
    return Minimum(program, result, cost)


def _on_its_way(
    setup: Setup, program: CalibrationProgram, minima: Sequence[Minimum]
) -> tuple[Point | None, Stations]:
    """Where some steps lead; no point if that is near a known minimum, or far above all of them."""
    at = program.at()
    problem = program.least_squares(HUBER)
    least = min(
        problem.cost(Point(minimum.result.model, minimum.result.stations, program.layout))
        for minimum in minima
    )
    for _ in range(CHUNKS):
        end = program.Approach(CHUNK, at)
        at = end.at
        here = at.stations
        for minimum in minima:
            there = minimum.result.stations
            if np.mean(_close(setup, here.R, here.p, there.R, there.p)) > 0.5:
                return None, here
        if end.settled:
            break
    return None if end.cost > GIVEN_UP * least else at, at.stations


def _close(setup: Setup, R: Array, p: Array, S: Array, q: Array) -> npt.NDArray[np.bool_]:
    """Flags of poses that are near each other, shape (k,)."""
    frame = setup.task.robot.frame
    size = float(np.linalg.norm(np.asarray(frame.upper) - np.asarray(frame.lower)))
    trace = np.einsum("...ij,...ij->...", R, S)
    turned = np.arccos(np.clip(0.5 * (trace - 1.0), -1.0, 1.0))
    apart = np.linalg.norm(p - q, axis=-1)
    return np.asarray((apart < NEAR_PLACE * size) & (turned < NEAR_TURN))


def _improved(
    setup: Setup, minimum: Minimum, pool: Sequence[Stations], least: float = 0.0
) -> Minimum:
    """The same from poses that are sought anew, as some first end in wrong minima; while better, by
    a share at least."""
    for _ in range(MOST_REFINEMENTS):
        rows, ends, here = _elsewhere(setup, minimum, pool, every=False)
        better = ends.costs < here[rows] - GAIN
        if not better.any():
            break
        best: dict[int, int] = {}
        for n in np.flatnonzero(better).tolist():
            row = int(rows[n])
            if row not in best or ends.costs[n] < ends.costs[best[row]]:
                best[row] = n
        chosen = np.array(list(best.values()))
        stations = minimum.result.stations.put(rows[chosen], ends.only(chosen).stations)
        start = Point(minimum.result.model, stations, minimum.program.layout)
        try:
            again = _solved(setup, minimum.program, start, straight=True)
        except CalibrationError:  # poses that are better alone leave something untold
            break
        gain = minimum.cost - again.cost
        if gain <= GAIN:
            break
        minimum = again
        if gain < least * minimum.cost:
            break
    return minimum


def _elsewhere(
    setup: Setup, minimum: Minimum, pool: Sequence[Stations], *, every: bool
) -> tuple[npt.NDArray[np.intp], FoundPoses, Array]:
    """Rows of searches from other poses, (s,), their ends, and the costs of the fit, (k,)."""
    result, program, outliers = minimum.result, minimum.program, setup.task.outliers
    here, count = result.stations, result.stations.count
    at = Point(result.model, here, program.layout)
    if outliers:
        costs = robust_costs(program.terms, at)
    else:
        costs = np.sum([np.sum(t.evaluate(at)[0] ** 2, axis=1) for t in program.terms], axis=0)
    badly = {o.pose for o in result.outliers} | {o.pose for o in result.largest[:1]}
    home = Stations.at([setup.first])
    measured = np.concatenate([term.measured() for term in program.terms], axis=1)
    nothing = np.zeros(measured.shape[1], dtype=bool)
    searches: list[tuple[int, Array, Array, npt.NDArray[np.bool_]]] = []  # row, start, left out
    for k in range(count) if setup.task.blind else sorted(badly):
        others = [j for j in (k - 1, k + 1, 0, int(np.argmin(costs))) if 0 <= j < count]
        turns = np.concatenate([here.R[others], home.R, *(s.R[k : k + 1] for s in pool)])
        places = np.concatenate([here.p[others], home.p, *(s.p[k : k + 1] for s in pool)])
        if every or k in badly:
            turned = turned_starts(here.R[k], freedom=setup.freedom)
            turns = np.concatenate([turns, turned])
            places = np.concatenate([places, np.tile(here.p[k], (len(turned), 1))])
        tried = [(here.R[k], here.p[k])]
        for R, p in zip(turns, places, strict=True):
            S, q = (np.array([pose[i] for pose in tried]) for i in (0, 1))
            if not _close(setup, S, q, R, p).any():
                tried.append((R, p))
        searches += [(k, R, p, nothing) for R, p in tried[1:]]
        if k in badly and outliers:  # from its own pose, each measurement left out once
            for j in np.flatnonzero(measured[k]):
                searches.append((k, here.R[k], here.p[k], np.arange(len(nothing)) == j))
    rows = np.array([row for row, *_ in searches], dtype=np.intp)
    if not searches:
        return rows, FoundPoses(here.only(rows), np.zeros(0)), costs
    R, p, without = (np.array([search[i] for search in searches]) for i in (1, 2, 3))
    starts = Stations(R, p, None if here.tensions is None else here.tensions[rows])
    ends = robust_poses(
        [term.only(rows) for term in program.terms],
        Point(result.model, starts, program.layout),
        freedom=setup.freedom, outliers=outliers, without=without,
    )  # fmt: skip
    return rows, ends, costs


def _ties(setup: Setup, best: Minimum, pool: Sequence[Stations]) -> list[Tie]:
    """Poses that fit as well elsewhere while all else stays, those that cost least first."""
    rows, ends, here = _elsewhere(setup, best, pool, every=True)
    poses = ends.stations.poses()
    ties: list[Tie] = []
    for n in np.argsort(ends.costs):
        more = float(ends.costs[n] - here[rows[n]])
        if more < TIE:
            _add_tie(ties, best.result, int(rows[n]), poses[n], more)
    return ties


def _add_tie(
    ties: list[Tie], result: CalibrationResult, k: int, Y: RigidTransform, more: float
) -> None:
    """Adds a row's other pose, if it is neither the fitted one nor a known tie."""
    (X,) = result.stations.only(np.array([k])).poses()
    turn, place = result.pose_std[k]
    for Z in (X, *(tie.X_WP for tie in ties if tie.pose == k)):
        distance, angle = pose_error(Z, Y)
        if not (distance > APART * place or angle > APART * turn):
            return
    ties.append(Tie(k, Y, *pose_error(X, Y), more))


def _other_firsts(setup: Setup) -> list[RigidTransform]:
    """Further first poses, if nothing but winches tells where the platform is."""
    if not setup.task.blind:
        return []
    robot, X = setup.task.robot, setup.first
    frame, random = robot.frame, np.random.default_rng(0)
    size = 0.25 * (np.asarray(frame.upper) - np.asarray(frame.lower))
    firsts = []
    for _ in range(OTHER_STARTS):
        turn, step = random.uniform(-0.3, 0.3, 3), size * random.uniform(-1, 1, 3)
        if robot.is_planar():
            turn[:2], step[2] = 0.0, 0.0
        R = X.rotation() @ pose_from_angles(np.zeros(3), turn).rotation()
        place = np.clip(X.translation() + step, frame.lower, frame.upper)
        if robot.is_planar():
            place[2] = X.translation()[2]
        Y = on_motion(robot, RigidTransform(R, place))
        if pose_error(X, Y)[0] > 0.0:
            firsts.append(Y)
    return firsts

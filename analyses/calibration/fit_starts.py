"""All starts of a calibration beside each other: the best minimum, and what fits as well.

A robot that measures nothing but itself has several minima: of the start as a whole, and of the
pose of a row. Starts are compared by one cost: squares over sigma, in which an outlier costs 16
(`OUTLIER` squared), so that to drop a row is no way to fit. A start that comes near a minimum that
is known already goes no further; of its poses, those that lie elsewhere are tried there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from pydrake.math import RigidTransform

from cdpr_drake.analyses.calibration.calibration_request import Prepared
from cdpr_drake.analyses.calibration.fit_programs import (
    StartPoint,
    program_from,
    start_points,
)
from cdpr_drake.analyses.calibration.turned_sensors import upside_down
from cdpr_drake.analyses.logs.measurements import on_motion
from cdpr_drake.arrays import Array
from cdpr_drake.calibration.elimination import MOST_STEPS, LeastSquares
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
"""Times that poses are sought anew with what was found of the robot, while that is better."""

GAIN = 1e-2
"""By how much a cost has to fall to be called better."""

NEAR_PLACE, NEAR_TURN = 0.02, 0.1
"""Places this near in parts of the frame's size, and turns [rad], are on their way to one
minimum."""

CHUNK, CHUNKS = 5, 6
"""Steps of a start before it is compared with the minima that are known, and how many times."""

GIVEN_UP = 5.0
"""A start that costs so many times what a known minimum does, after all these steps, goes no
further; costs with linear loss for outliers."""

APART = 5.0
"""Poses that are more of their standard deviations apart are two."""


class Tie(NamedTuple):
    """Another pose that fits as well.

    Attributes:
        pose: Number of the pose, from 0.
        X_WP: Where the platform might as well have been [m].
        distance: From where it was found [m].
        angle: And by how much it is turned [rad].
        more: Cost beyond that of what was found [-]; below `TIE`.
    """

    pose: int
    X_WP: RigidTransform
    distance: float
    angle: float
    more: float


@dataclass(frozen=True, eq=False)
class MultiStartFit:
    """The best of all starts.

    Attributes:
        result: What it found.
        ties: Poses of other minima that fit as well, by rows.
        starts: How many starts were tried.
        minima: How many minima they ended in.
        problem: What was solved for it.
        flipped_costs_less: By how much the best minimum with the platform upside down costs less
            than this one [-]; 0 where there is none that does.
    """

    result: CalibrationResult
    ties: tuple[Tie, ...]
    starts: int
    minima: int
    problem: LeastSquares
    flipped_costs_less: float = 0.0


class _Minimum(NamedTuple):
    program: CalibrationProgram
    result: CalibrationResult
    cost: float


def best_of_starts(
    prepared: Prepared, say: Callable[[str], None], others: bool = True
) -> MultiStartFit:
    """The best minimum of all starts.

    Args:
        prepared: The log.
        say: Told what is done now.
        others: Whether further first poses are tried beside the believed one.

    Raises:
        CalibrationError: No start leads anywhere; says why the last one does not.
    """
    firsts = [prepared.first, *(_other_starts(prepared) if others else ())]
    begun = start_points(prepared, firsts)
    programs = [program_from(prepared, one) for one in begun]
    known: list[_Minimum] = []
    pool: list[Stations] = []
    failure: CalibrationError | None = None
    for number, program in enumerate(programs):
        say(f"Calibrating, start {number + 1} of {len(programs)}")
        try:
            at = None
            if known:
                at, end = _on_its_way(prepared, program, known)
                pool.append(end)
                if at is None:
                    continue
            one = _solved(prepared, program, at, straight=False)
            known.append(_improved(prepared, one, []))
        except CalibrationError as why:
            failure = why
            if number == 0:
                together = _from_one_pose(prepared, begun[0])
                known += [] if together is None else [together]
    if not known:
        assert failure is not None
        raise failure
    say("Comparing starts")
    best = min(upright_minima(prepared, known), key=lambda one: one.cost)
    if len(programs) > 1:
        pool += [one.result.stations for one in known if one is not best]
        best = _improved(prepared, best, pool)
    ties = _ties(prepared, best, pool) if len(programs) > 1 else []
    for one in known:
        if one.cost < best.cost + TIE:
            for k, Y in enumerate(one.result.stations.poses()):
                _add_tie(ties, best.result, (k, Y), one.cost - best.cost)
    ties.sort(key=lambda tie: (tie.pose, tie.more))
    less = max(0.0, best.cost - min(one.cost for one in known))
    problem = best.program.SolvedProblem(best.result, prepared.task.outliers)
    return MultiStartFit(best.result, tuple(ties), len(programs), len(known), problem, less)


def _from_one_pose(prepared: Prepared, begun: StartPoint) -> _Minimum | None:
    """The minimum from all poses where the first one is; None where that leads nowhere.

    By a robot that is far off, poses that are sought one by one may end where cables are parallel,
    which no step with the others leaves.
    """
    alike = StartPoint(begun.model, [prepared.first] * prepared.log.count)
    try:
        end = program_from(prepared, alike).Approach(MOST_STEPS).at
        there = StartPoint(begun.model, end.stations.poses())
        found = _solved(prepared, program_from(prepared, there), end, straight=False)
        return _improved(prepared, found, [])
    except CalibrationError:
        return None


def upright_minima(prepared: Prepared, known: Sequence[_Minimum]) -> Sequence[_Minimum]:
    """Minima in which the platform is not upside down against the first pose; all, if each is."""
    up = prepared.first.rotation().matrix()[:, 2]
    upright = [one for one in known if not upside_down(one.result, up).any()]
    return upright or known


def _solved(
    prepared: Prepared, program: CalibrationProgram, at: Point | None, *, straight: bool
) -> _Minimum:
    result = program.Solve(prepared.task.outliers, at, straight=straight)
    cost = result.robust_cost if prepared.task.outliers else result.chi_square
    return _Minimum(program, result, cost)


def _on_its_way(
    prepared: Prepared, program: CalibrationProgram, known: Sequence[_Minimum]
) -> tuple[Point | None, Stations]:
    """Where some steps lead; no point where that is no start of its own.

    It is none where most poses come near those of a minimum that is known, or where steps run out
    far above all of them.
    """
    at = program.at()
    problem = program.least_squares(HUBER)
    least = min(
        problem.cost(Point(one.result.model, one.result.stations, program.layout)) for one in known
    )
    for _ in range(CHUNKS):
        end = program.Approach(CHUNK, at)
        at = end.at
        if any(_near(prepared, at.stations, one.result.stations) for one in known):
            return None, at.stations
        if end.settled:
            break
    return None if end.cost > GIVEN_UP * least else at, at.stations


def _near(prepared: Prepared, here: Stations, there: Stations) -> bool:
    """Whether most poses are near each other."""
    return bool(np.mean(_close(prepared, here.R, here.p, there.R, there.p)) > 0.5)


def _close(prepared: Prepared, R: Array, p: Array, S: Array, q: Array) -> npt.NDArray[np.bool_]:
    """Which poses are near each other, shape (k,)."""
    frame = prepared.task.robot.frame
    size = float(np.linalg.norm(np.asarray(frame.upper) - np.asarray(frame.lower)))
    trace = np.einsum("...ij,...ij->...", R, S)
    turned = np.arccos(np.clip(0.5 * (trace - 1.0), -1.0, 1.0))
    apart = np.linalg.norm(p - q, axis=-1)
    return np.asarray((apart < NEAR_PLACE * size) & (turned < NEAR_TURN))


def _improved(prepared: Prepared, one: _Minimum, pool: Sequence[Stations]) -> _Minimum:
    """The same from poses that are sought anew with what was found of the robot, while better.

    What was counted from an unknown start puts some poses into wrong minima at first.
    """
    for _ in range(MOST_REFINEMENTS):
        rows, ends, here = _elsewhere(prepared, one, pool, every=False)
        better = ends.costs < here[rows] - GAIN
        if not better.any():
            break
        best: dict[int, int] = {}
        for n in np.flatnonzero(better).tolist():
            row = int(rows[n])
            if row not in best or ends.costs[n] < ends.costs[best[row]]:
                best[row] = n
        chosen = np.array(list(best.values()))
        stations = one.result.stations.put(rows[chosen], ends.only(chosen).stations)
        start = Point(one.result.model, stations, one.program.layout)
        try:
            again = _solved(prepared, one.program, start, straight=True)
        except CalibrationError:  # poses that are better alone leave something untold
            break
        if again.cost >= one.cost - GAIN:
            break
        one = again
    return one


def _elsewhere(
    prepared: Prepared, one: _Minimum, pool: Sequence[Stations], *, every: bool
) -> tuple[npt.NDArray[np.intp], FoundPoses, Array]:
    """Minima of single rows from other poses, the model as it was found.

    Args:
        prepared: The log.
        one: What was found.
        pool: Poses of other starts.
        every: Whether turned poses of every row are tried, not of those alone that fit badly.

    Returns:
        Row of each search, shape (s,), where they ended, and the costs of what was found, (k,).
    """
    result, freedom = one.result, prepared.freedom
    at = Point(result.model, result.stations, one.program.layout)
    here, count = result.stations, result.stations.count
    costs = _row_costs(prepared, one, at)
    badly = {o.pose for o in result.outliers} | {o.pose for o in result.largest[:1]}
    looked = range(count) if blind(prepared) else sorted(badly)
    home = Stations.at([prepared.first])
    total = sum(term.measured().shape[1] for term in one.program.terms)
    measured = np.concatenate([term.measured() for term in one.program.terms], axis=1)
    batch = _Batch(total)
    for k in looked:
        others = [j for j in (k - 1, k + 1, 0, int(np.argmin(costs))) if 0 <= j < count]
        turns = np.concatenate([here.R[others], home.R, *(s.R[k : k + 1] for s in pool)])
        places = np.concatenate([here.p[others], home.p, *(s.p[k : k + 1] for s in pool)])
        if every or k in badly:
            mine = turned_starts(here.R[k], freedom=freedom)
            turns = np.concatenate([turns, mine])
            places = np.concatenate([places, np.tile(here.p[k], (len(mine), 1))])
        kept = [(here.R[k], here.p[k])]
        for R, p in zip(turns, places, strict=True):
            known = [np.array([row[i] for row in kept]) for i in (0, 1)]
            if not _close(prepared, known[0], known[1], R, p).any():
                kept.append((R, p))
        batch.add(k, kept[1:])
        if k in badly and prepared.task.outliers:
            batch.add_without(k, here, np.flatnonzero(measured[k]))
    rows = np.array(batch.rows, dtype=np.intp)
    if not batch.rows:
        return rows, FoundPoses(here.only(rows), np.zeros(0)), costs
    t = None if here.tensions is None else here.tensions[rows]
    begins = Stations(np.array(batch.R), np.array(batch.p), t)
    ends = robust_poses(
        [term.only(rows) for term in one.program.terms],
        Point(result.model, begins, one.program.layout),
        freedom=freedom, outliers=prepared.task.outliers, without=np.array(batch.without),
    )  # fmt: skip
    return rows, ends, costs


class _Batch:
    """Searches of poses that are made at once: row, start, and what does not count on the way."""

    def __init__(self, width: int) -> None:
        self.rows: list[int] = []
        self.R: list[Array] = []
        self.p: list[Array] = []
        self.without: list[npt.NDArray[np.bool_]] = []
        self._width = width

    def add(self, row: int, starts: Sequence[tuple[Array, Array]]) -> None:
        """From these poses, with everything that was measured."""
        for R, p in starts:
            self._put(row, R, p, None)

    def add_without(self, row: int, at: Stations, measured: npt.NDArray[np.intp]) -> None:
        """From a row's own pose, each measurement left out once."""
        for j in measured:
            self._put(row, at.R[row], at.p[row], int(j))

    def _put(self, row: int, R: Array, p: Array, left_out: int | None) -> None:
        gone = np.zeros(self._width, dtype=bool)
        if left_out is not None:
            gone[left_out] = True
        self.rows.append(row)
        self.R.append(R)
        self.p.append(p)
        self.without.append(gone)


def _row_costs(prepared: Prepared, one: _Minimum, at: Point) -> Array:
    """What measurements at each pose cost where it was found, shape (k,)."""
    if prepared.task.outliers:
        return robust_costs(one.program.terms, at)
    return np.sum([np.sum(t.evaluate(at)[0] ** 2, axis=1) for t in one.program.terms], axis=0)


def _ties(prepared: Prepared, best: _Minimum, pool: Sequence[Stations]) -> list[Tie]:
    """Poses that fit as well elsewhere while all else stays, those that cost least first."""
    rows, ends, here = _elsewhere(prepared, best, pool, every=True)
    poses = ends.stations.poses()
    ties: list[Tie] = []
    for n in np.argsort(ends.costs):
        more = float(ends.costs[n] - here[rows[n]])
        if more < TIE:
            _add_tie(ties, best.result, (int(rows[n]), poses[n]), more)
    return ties


def _add_tie(
    ties: list[Tie], result: CalibrationResult, other: tuple[int, RigidTransform], more: float
) -> None:
    """Adds a row's other pose, if it is neither that which was found nor one that is known."""
    k, Y = other
    X = result.stations.poses()[k]
    if all(_apart(result, k, Z, Y) for Z in (X, *(tie.X_WP for tie in ties if tie.pose == k))):
        ties.append(Tie(k, Y, *pose_error(X, Y), more))


def _apart(result: CalibrationResult, k: int, X: RigidTransform, Y: RigidTransform) -> bool:
    """Whether two poses of a row are two, by its standard deviations."""
    distance, angle = pose_error(X, Y)
    turn, place = result.pose_std[k]
    return bool(distance > APART * place or angle > APART * turn)


def blind(prepared: Prepared) -> bool:
    """Whether nothing but the robot itself tells where the platform is."""
    if prepared.points is not None and prepared.freedom.motion.is_point:
        return False
    return prepared.log.poses is None and not prepared.targets


def _other_starts(prepared: Prepared) -> list[RigidTransform]:
    """Further first poses, where nothing but winches tells where the platform is."""
    if not blind(prepared):
        return []
    robot, X = prepared.task.robot, prepared.first
    frame, random = robot.frame, np.random.default_rng(0)
    size = 0.25 * (np.asarray(frame.upper) - np.asarray(frame.lower))
    starts = []
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
            starts.append(Y)
    return starts

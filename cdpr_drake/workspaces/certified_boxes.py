"""Branch and prune: boxes of poses that are proven inside, proven outside, or still open."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import WorkspaceError
from cdpr_drake.numerics.kernel_calls import over_rows
from cdpr_drake.workspaces.box_expansion_kernel import INSIDE, NUMBERS, OPEN, OUTSIDE
from cdpr_drake.workspaces.box_verdicts_kernel import judge_boxes, judge_clearances
from cdpr_drake.workspaces.cable_distance_kernel import BOX_COLUMNS
from cdpr_drake.workspaces.cable_interference import Surroundings
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet
from cdpr_drake.workspaces.static_feasibility import StaticCase
from cdpr_drake.workspaces.wrench_facets_kernel import wedge_terms

CLOSURE_SHARE = 1e-4
"""Wrench closure is proven by tensions that balance nothing, the least at least this share of the
largest."""

CHUNK = 2048
"""Boxes between two looks at a request to stop."""


class CertifiedKind(StrEnum):
    """Kinds of workspaces of which boxes can be proven."""

    STATIC = "static"
    WRENCH_FEASIBLE = "wrench-feasible"
    WRENCH_CLOSURE = "wrench-closure"
    INTERFERENCE_FREE = "interference-free"


@dataclass(frozen=True, eq=False)
class PoseBox:
    """Poses: positions and angles (phi, theta, psi) within a box.

    Attributes:
        lower: Least position [m] and angles [rad], shape (6,).
        upper: Largest, shape (6,); where both are the same, that number does not vary.

    Raises:
        WorkspaceError: A number is not finite, lower is above upper, or nothing varies.
    """

    lower: Array
    upper: Array

    def __post_init__(self) -> None:
        """Copies the arrays and checks them."""
        low, high = np.array(self.lower, float), np.array(self.upper, float)
        if low.shape != (NUMBERS,) or high.shape != (NUMBERS,):
            raise WorkspaceError(
                f"box: found shapes {low.shape}, {high.shape}; accepted: position and angles, (6,)"
            )
        if not np.all(np.isfinite(low) & np.isfinite(high) & (low <= high)) or np.all(low == high):
            raise WorkspaceError(
                "box: accepted: finite numbers, lower <= upper, and one that varies [m, rad]"
            )
        object.__setattr__(self, "lower", low)
        object.__setattr__(self, "upper", high)


@dataclass(frozen=True, eq=False)
class CertifyTask:
    """What is to be proven.

    Attributes:
        kind: The kind of workspace.
        case: Platform, load and tension bounds.
        required: Wrenches to resist beside the load, a polytope, for `WRENCH_FEASIBLE`.
        around: What cables may meet, for `INTERFERENCE_FREE`.
        clearance: How far they must stay from it [m].
        exit_error: How far exit points may be from where they are believed to be [m].
        anchor_error: The same of anchor points [m].

    Raises:
        WorkspaceError: Something is missing or not accepted.
    """

    kind: CertifiedKind
    case: StaticCase
    required: SpatialSet = field(default_factory=SpatialSet)
    around: Surroundings | None = None
    clearance: float = 0.0
    exit_error: float = 0.0
    anchor_error: float = 0.0

    def __post_init__(self) -> None:
        """Checks what the kind needs."""
        for name in ("clearance", "exit_error", "anchor_error"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0.0):
                raise WorkspaceError(f"{name}: found {value:g}; accepted: >= 0 [m]")
        self.case.check_bounds()
        if np.any(self.case.lower >= self.case.upper):
            raise WorkspaceError("lower: found a tension that cannot change; accepted: < upper [N]")
        if self.kind == CertifiedKind.INTERFERENCE_FREE and self.around is None:
            raise WorkspaceError("around: found nothing; accepted: what cables may meet")
        self.corners()  # refused before anything is computed

    def corners(self) -> Array:
        """External wrenches, all of which must be resisted, shape (c, rows) [N m, N]."""
        given = self.case.wrench[list(self.case.rows)]
        if self.kind == CertifiedKind.WRENCH_FEASIBLE:
            return self.required.corners(self.case.rows) + given
        return np.asarray(given[np.newaxis], float)


class BoxJournal:
    """What was found of boxes, in the order in which they were judged: enough to go on from it.

    Which boxes these are follows from the first one and from what was found of those before.
    """

    def __init__(self, verdicts: np.ndarray | None = None, axes: np.ndarray | None = None) -> None:
        """Takes what was found before, both of shape (k,); None: nothing."""
        self._parts = [] if verdicts is None or axes is None else [(verdicts, axes)]
        self.count = sum(len(part[0]) for part in self._parts)

    def arrays(self) -> tuple[np.ndarray, np.ndarray]:
        """Verdicts, and the number of a pose across which each would be cut, shape (k,) int8."""
        if len(self._parts) != 1:
            empty = np.zeros(0, np.int8), np.zeros(0, np.int8)
            joined = zip(*(self._parts or [empty]), strict=True)
            verdicts, axes = (np.concatenate(part).astype(np.int8) for part in joined)
            self._parts = [(verdicts, axes)]
        return self._parts[0]

    def add(self, verdicts: np.ndarray, axes: np.ndarray) -> None:
        """Adds boxes."""
        self._parts.append((verdicts.astype(np.int8), axes.astype(np.int8)))
        self.count += len(verdicts)


@dataclass(frozen=True, eq=False)
class CertifiedBoxes:
    """Boxes that fill a box of poses.

    Attributes:
        poses: Middles, shape (k, 6) [m, rad].
        halves: Half widths, shape (k, 6) [m, rad].
        verdicts: `INSIDE`, `OPEN` or `OUTSIDE`, shape (k,).
        curve: Boxes judged so far, and the shares proven inside, proven outside and open then,
            shape (g, 4), one row a generation.
        finished: Whether the boxes were exhausted, rather than somebody asked to stop.
    """

    poses: Array
    halves: Array
    verdicts: np.ndarray
    curve: Array
    finished: bool

    @property
    def inside(self) -> float:
        """Share of the box that is proven inside."""
        return float(self.curve[-1, 1])

    @property
    def outside(self) -> float:
        """Share of the box that is proven outside."""
        return float(self.curve[-1, 2])

    @property
    def open(self) -> float:
        """Share of the box of which nothing is proven."""
        return float(self.curve[-1, 3])

    def at(self, poses: Array) -> np.ndarray:
        """Verdicts on poses, shape (n, 6) [m, rad], shape (n,); open outside all boxes.

        A pose on a border takes the verdict of one of the boxes that share it.
        """
        poses = np.asarray(poses, float).reshape(-1, NUMBERS)
        found = np.full(len(poses), OPEN)
        for k, pose in enumerate(poses):
            hit = np.flatnonzero(np.all(np.abs(self.poses - pose) <= self.halves, axis=1))
            if len(hit):
                found[k] = self.verdicts[hit[0]]
        return found


def certify(
    task: CertifyTask,
    box: PoseBox,
    most_boxes: int = 500_000,
    *,
    open_share: float = 0.0,
    on_progress: Callable[[int, float], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
    known: BoxJournal | None = None,
    on_journal: Callable[[BoxJournal], None] | None = None,
) -> CertifiedBoxes:
    """Cuts a box of poses until little of it is open; the largest boxes first.

    Args:
        task: What is to be proven.
        box: The poses.
        most_boxes: How many boxes are judged, at most.
        open_share: Share of the box that may stay open.
        on_progress: Called now and then with the number of boxes judged and the open share.
        should_stop: Asked as often; True ends the search.
        known: Of an earlier search for the same, which is continued: what comes out is the same as
            if it had not ended.
        on_journal: Called as often with what is known by then, for the next search.

    Raises:
        WorkspaceError: most_boxes < 1.
    """
    if most_boxes < 1:
        raise WorkspaceError(f"most_boxes: found {most_boxes}; accepted: at least 1")
    poses = 0.5 * (box.lower + box.upper)[np.newaxis]
    halves = 0.5 * (box.upper - box.lower)[np.newaxis]
    volume = 1.0  # of a box of this generation, as a share
    done: list[tuple[Array, Array, np.ndarray]] = []
    shares, judged, stopped = {INSIDE: 0.0, OUTSIDE: 0.0}, 0, False
    journal, before = BoxJournal(), (known or BoxJournal()).arrays()
    curve = []
    while len(poses):
        count = min(len(poses), most_boxes - judged)
        verdicts = np.full(len(poses), OPEN)
        axes = np.zeros(len(poses), np.int64)
        for first in range(0, count, CHUNK):
            if should_stop is not None and should_stop():
                stopped = True
                break
            part = slice(first, min(first + CHUNK, count))
            past = judged + part.stop - part.start
            if past <= len(before[0]):
                verdicts[part], axes[part] = (found[judged:past] for found in before)
            else:
                verdicts[part], stretch = _judge(task, poses[part], halves[part])
                axes[part] = np.argmax(np.where(halves[part] > 0.0, stretch, -1.0), axis=1)
            journal.add(verdicts[part], axes[part])
            if past > len(before[0]) and on_journal is not None:
                on_journal(journal)
            judged = past
            if on_progress is not None:
                proven = np.count_nonzero(verdicts) * volume + sum(shares.values())
                on_progress(judged, 1.0 - proven)
        for verdict in shares:
            shares[verdict] += volume * int(np.count_nonzero(verdicts == verdict))
        unproven = max(1.0 - sum(shares.values()), 0.0)
        curve.append((judged, shares[INSIDE], shares[OUTSIDE], unproven))
        ending = stopped or judged >= most_boxes or unproven <= open_share
        closed = verdicts != OPEN
        keep = np.ones(len(poses), bool) if ending else closed
        done.append((poses[keep], halves[keep], verdicts[keep]))
        if ending:
            break
        poses, halves = _cut(poses[~closed], halves[~closed], axes[~closed])
        volume *= 0.5
    all_poses, all_halves, all_verdicts = (
        np.concatenate(parts) for parts in zip(*done, strict=True)
    )
    return CertifiedBoxes(all_poses, all_halves, all_verdicts, np.array(curve), not stopped)


def _cut(poses: Array, halves: Array, axes: np.ndarray) -> tuple[Array, Array]:
    """Each box in two, across one of its half widths."""
    index = np.arange(len(poses))
    halves = halves.copy()
    halves[index, axes] *= 0.5
    low, high = poses.copy(), poses.copy()
    low[index, axes] -= halves[index, axes]
    high[index, axes] += halves[index, axes]
    return np.concatenate([low, high]), np.concatenate([halves, halves])


def _judge(task: CertifyTask, poses: Array, halves: Array) -> tuple[np.ndarray, Array]:
    case = task.case
    if task.kind == CertifiedKind.INTERFERENCE_FREE:
        return _judge_clearances(task, poses, halves)
    closure = task.kind == CertifiedKind.WRENCH_CLOSURE
    m, n = case.cables.count, len(case.rows)
    scale = case.row_scale()
    load, corners, (lower, upper) = (
        case.load(),
        np.ascontiguousarray(task.corners() / scale),
        case.bounds(),
    )
    if closure:
        load, corners = np.zeros(6), np.zeros((1, n))
        lower, upper = np.full(m, CLOSURE_SHARE), np.ones(m)
    verdicts, stretch = np.empty(len(poses), np.int64), np.empty((len(poses), NUMBERS))
    over_rows(
        judge_boxes, len(poses), None, closure, np.ascontiguousarray(poses),
        np.ascontiguousarray(halves), case.cables.packed(), np.array(case.rows), scale, load,
        corners, lower, upper, np.array([task.exit_error, task.anchor_error]), *wedge_terms(n),
        verdicts, stretch,
    )  # fmt: skip
    return verdicts, stretch


def _judge_clearances(task: CertifyTask, poses: Array, halves: Array) -> tuple[np.ndarray, Array]:
    around = task.around
    assert around is not None
    limits = (
        task.clearance, around.exit_free, around.anchor_free, task.exit_error, task.anchor_error
    )  # fmt: skip
    boxes = [
        np.ascontiguousarray(each, float).reshape(-1, BOX_COLUMNS)
        for each in (around.bodies, around.fixtures, around.obstacles)
    ]
    verdicts, stretch = np.empty(len(poses), np.int64), np.empty((len(poses), NUMBERS))
    over_rows(
        judge_clearances, len(poses), None, np.ascontiguousarray(poses),
        np.ascontiguousarray(halves), around.cables.packed(), np.array(around.radius, float),
        around.pairs(), *boxes, np.array(limits), verdicts, stretch,
    )  # fmt: skip
    return verdicts, stretch

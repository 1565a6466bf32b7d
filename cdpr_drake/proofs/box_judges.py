"""What is to be proven of boxes of poses, and the judges that try it: one kind, or several."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import WorkspaceError
from cdpr_drake.geometry.convex_distance_kernel import convex_work
from cdpr_drake.geometry.convex_shapes import packed
from cdpr_drake.numerics.kernel_calls import over_rows
from cdpr_drake.proofs.box_collision_kernel import judge_cables, judge_collisions
from cdpr_drake.proofs.box_expansion_kernel import INSIDE, NUMBERS, OPEN, OUTSIDE
from cdpr_drake.proofs.box_verdicts_kernel import judge_boxes, judge_clearances
from cdpr_drake.workspaces.cable_distance_kernel import BOX_COLUMNS
from cdpr_drake.workspaces.cable_interference import Surroundings
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet
from cdpr_drake.workspaces.single_failure import cases_after_breaks
from cdpr_drake.workspaces.static_feasibility import StaticCase
from cdpr_drake.workspaces.wrench_facets_kernel import wedge_terms

CLOSURE_SHARE = 1e-4
"""Wrench closure is proven by tensions that balance nothing, the least at least this share of the
largest."""

LEVER = 1.0
"""Half widths of positions and of angles are compared by this length [m/rad]; open shares of robots
of a metre hardly change from one to seven times it."""

MOST_KINDS = 7
"""So many kinds fit into the bits that say which are proven."""


class CertifiedKind(StrEnum):
    """Kinds of workspaces of which boxes can be proven."""

    STATIC = "static"
    WRENCH_FEASIBLE = "wrench-feasible"
    WRENCH_CLOSURE = "wrench-closure"
    SINGLE_FAILURE = "single-failure"
    INTERFERENCE_FREE = "interference-free"
    COLLISION_FREE = "collision-free"


MEETING = (CertifiedKind.INTERFERENCE_FREE, CertifiedKind.COLLISION_FREE)
"""Kinds that ask what cables and platform may meet."""


@dataclass(frozen=True, eq=False)
class CertifyTask:
    """What is to be proven.

    Attributes:
        kind: The kind of workspace.
        case: Platform, load and tension bounds.
        required: Wrenches to resist beside the load, a polytope, for `WRENCH_FEASIBLE` and
            `SINGLE_FAILURE`.
        around: What cables and platform may meet, for `INTERFERENCE_FREE` and `COLLISION_FREE`.
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
        if self.kind in MEETING and self.around is None:
            raise WorkspaceError("around: found nothing; accepted: what cables may meet")
        if self.kind == CertifiedKind.SINGLE_FAILURE:
            cases_after_breaks(self.case)
        self.corners()  # refused before anything is computed

    def corners(self) -> Array:
        """External wrenches, all of which must be resisted, shape (c, rows) [N m, N]."""
        given = self.case.wrench[list(self.case.rows)]
        if self.kind in (CertifiedKind.WRENCH_FEASIBLE, CertifiedKind.SINGLE_FAILURE):
            return self.required.corners(self.case.rows) + given
        return np.asarray(given[np.newaxis], float)


def several(task: CertifyTask | Sequence[CertifyTask]) -> tuple[CertifyTask, ...]:
    """One task, or several, in a row.

    Raises:
        WorkspaceError: There is none, or more than `MOST_KINDS`.
    """
    tasks = (task,) if isinstance(task, CertifyTask) else tuple(task)
    if not 1 <= len(tasks) <= MOST_KINDS:
        raise WorkspaceError(f"certify: found {len(tasks)} kinds; accepted: 1 to {MOST_KINDS}")
    return tasks


def judge_all(
    tasks: Sequence[CertifyTask], poses: Array, halves: Array, proven: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Verdicts on boxes by all tasks.

    Args:
        tasks: What is to be proven.
        poses: Middles, shape (k, 6) [m, rad].
        halves: Half widths, shape (k, 6) [m, rad].
        proven: Which tasks are proven of what the boxes were cut from, bits, shape (k,).

    Returns:
        Verdicts, the number of a pose across which a box should be cut, and which tasks are proven
        of it, bits of several tasks, shape (k,) each.
    """
    if len(tasks) == 1:
        verdicts, stretch = _judge(tasks[0], poses, halves)
        return verdicts, _longest(halves, stretch), proven
    proven = proven.copy()
    outside, blame = np.zeros(len(poses), bool), np.zeros((len(poses), NUMBERS))
    for k in sorted(range(len(tasks)), key=lambda k: _COSTS.index(tasks[k].kind)):
        asked = np.flatnonzero(~outside & (proven & (1 << k) == 0))
        if not len(asked):
            continue
        found, stretch = _judge(tasks[k], poses[asked], halves[asked])
        outside[asked] = found == OUTSIDE
        proven[asked[found == INSIDE]] |= 1 << k
        # Of kinds that are open each has a say of the same weight in where to cut.
        blame[asked[found == OPEN]] += _shares(halves[asked], stretch)[found == OPEN]
    every = (1 << len(tasks)) - 1
    verdicts = np.where(outside, OUTSIDE, np.where(proven == every, INSIDE, OPEN))
    return verdicts, _longest(halves, blame), proven


_COSTS = (
    CertifiedKind.COLLISION_FREE, CertifiedKind.INTERFERENCE_FREE, CertifiedKind.STATIC,
    CertifiedKind.WRENCH_CLOSURE, CertifiedKind.WRENCH_FEASIBLE, CertifiedKind.SINGLE_FAILURE,
)  # fmt: skip
"""Kinds, those first that take least time: a box that one proves outside is asked for no other."""


def _longest(halves: Array, stretch: Array) -> np.ndarray:
    """Across which number to cut, shape (k,): the one that is most in the way.

    Where orientations vary, that times its size: what is in the way now can be far from what is
    after some cuts, and boxes that have become plates are hard to prove.
    """
    turned = np.any(halves[:, 3:] > 0.0, axis=1, keepdims=True)
    sizes = halves * np.repeat([1.0, LEVER], 3)
    wanted = np.where(turned, stretch * sizes, stretch)
    return np.asarray(np.argmax(np.where(halves > 0.0, wanted, -1.0), axis=1))


def _judge(task: CertifyTask, poses: Array, halves: Array) -> tuple[np.ndarray, Array]:
    case = task.case
    if task.kind == CertifiedKind.INTERFERENCE_FREE:
        return _judge_clearances(task, poses, halves)
    if task.kind == CertifiedKind.COLLISION_FREE:
        return _judge_collisions(task, poses, halves)
    if task.kind == CertifiedKind.SINGLE_FAILURE:
        return _judge_breaks(task, poses, halves)
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


def _judge_breaks(task: CertifyTask, poses: Array, halves: Array) -> tuple[np.ndarray, Array]:
    """All m + 1 cases must be proven inside; one that is outside is enough."""
    verdicts, stretch = np.full(len(poses), INSIDE), np.zeros((len(poses), NUMBERS))
    for case in cases_after_breaks(task.case):
        one = replace(task, kind=CertifiedKind.WRENCH_FEASIBLE, case=case)
        asked = np.flatnonzero(verdicts != OUTSIDE)
        found, wide = _judge(one, poses[asked], halves[asked])
        opened = asked[found == OPEN]
        stretch[opened] += _shares(halves[opened], wide[found == OPEN])
        verdicts[opened] = OPEN
        verdicts[asked[found == OUTSIDE]] = OUTSIDE
    return verdicts, stretch


def _shares(halves: Array, stretch: Array) -> Array:
    """Stretch as shares of its largest, so that each of several proofs has a say of one weight."""
    stretch = np.where(halves > 0.0, stretch, 0.0)
    largest = np.max(stretch, axis=1, keepdims=True)
    return np.divide(stretch, largest, out=np.zeros_like(stretch), where=largest > 0.0)


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
    if around.solids:
        _judge_convex(task, poses, halves, verdicts, stretch)
    return verdicts, stretch


def _judge_convex(
    task: CertifyTask, poses: Array, halves: Array, verdicts: np.ndarray, stretch: Array
) -> None:
    """Changes verdicts on cables where convex shapes stand around, too."""
    around = task.around
    assert around is not None
    rest = np.flatnonzero(verdicts != OUTSIDE)
    solids = packed(around.solids)
    found, cut = np.empty(len(rest), np.int64), np.empty((len(rest), NUMBERS))
    over_rows(
        judge_cables, len(rest), None, np.ascontiguousarray(poses[rest]),
        np.ascontiguousarray(halves[rest]), around.cables.packed(), np.array(around.radius, float),
        *solids, np.array([task.clearance, task.exit_error, task.anchor_error]),
        convex_work(9, max(np.diff(solids[1]))), found, cut,
    )  # fmt: skip
    other = (found == OUTSIDE) | ((found == OPEN) & (verdicts[rest] == INSIDE))
    verdicts[rest[other]], stretch[rest[other]] = found[other], cut[other]


def _judge_collisions(task: CertifyTask, poses: Array, halves: Array) -> tuple[np.ndarray, Array]:
    around = task.around
    assert around is not None
    bodies, still = packed(around.platform_shapes()), packed(around.still_shapes())
    largest = [max([*np.diff(each[1]), 1]) for each in (bodies, still)]
    verdicts, stretch = np.empty(len(poses), np.int64), np.empty((len(poses), NUMBERS))
    over_rows(
        judge_collisions, len(poses), None, np.ascontiguousarray(poses),
        np.ascontiguousarray(halves), *bodies, *still, task.clearance,
        convex_work(8 * largest[0], largest[1]), verdicts, stretch,
    )  # fmt: skip
    return verdicts, stretch

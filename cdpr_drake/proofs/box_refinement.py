"""Certified boxes made smaller where somebody needs it: in a box of poses, or about a path."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import WorkspaceError
from cdpr_drake.proofs.box_expansion_kernel import INSIDE, NUMBERS, OPEN, OUTSIDE
from cdpr_drake.proofs.box_judges import CertifyTask, judge_all, several
from cdpr_drake.proofs.certified_boxes import (
    CHUNK,
    BoxJournal,
    CertifiedBoxes,
    cut_boxes,
)

SAME_SIZE = 1e-9
"""Boxes are cut together whose shares of the whole differ by less than this share of them."""


class Region(Protocol):
    """Poses that matter."""

    def meets(self, poses: Array, halves: Array) -> np.ndarray:
        """Which boxes have a pose in common with it, shape (k,)."""


@dataclass(frozen=True, eq=False)
class PathTube:
    """All poses within a reach, number by number, of the straight lines between poses in turn.

    Attributes:
        poses: Position [m] and angles [rad], shape (n, 6), n > 0.
        reach: How far each number may be off, shape (6,), at least 0 [m, rad].

    Raises:
        WorkspaceError: A shape or a number is not accepted.
    """

    poses: Array
    reach: Array

    def __post_init__(self) -> None:
        """Copies the arrays and checks them."""
        poses, reach = np.array(self.poses, float), np.array(self.reach, float)
        if poses.ndim != 2 or poses.shape[1:] != (NUMBERS,) or not len(poses):
            raise WorkspaceError(f"poses: found shape {poses.shape}; accepted: (n, 6), n > 0")
        if reach.shape != (NUMBERS,) or not np.all(np.isfinite(reach) & (reach >= 0.0)):
            raise WorkspaceError("reach: accepted: six numbers >= 0 [m, rad]")
        if not np.all(np.isfinite(poses)):
            raise WorkspaceError("poses: accepted: finite numbers [m, rad]")
        object.__setattr__(self, "poses", poses)
        object.__setattr__(self, "reach", reach)

    def meets(self, poses: Array, halves: Array) -> np.ndarray:
        """Which boxes have a pose in common with it, shape (k,)."""
        wide, found = halves + self.reach, np.zeros(len(poses), bool)
        ends = self.poses if len(self.poses) > 1 else np.repeat(self.poses, 2, axis=0)
        for start, end in pairwise(ends):
            # Where the line is within the box along each number: a span of its shares, 0 to 1.
            along, apart = end - start, poses - start
            with np.errstate(divide="ignore", invalid="ignore"):
                low, high = (apart - wide) / along, (apart + wide) / along
            first, last = np.minimum(low, high), np.maximum(low, high)
            still = along == 0.0
            within = np.abs(apart[:, still]) <= wide[:, still]
            first[:, still] = np.where(within, -np.inf, np.inf)
            last[:, still] = -first[:, still]
            first, last = np.max(first, axis=1), np.min(last, axis=1)
            found |= np.maximum(first, 0.0) <= np.minimum(last, 1.0)
        return found


def refine(
    found: CertifiedBoxes,
    task: CertifyTask | Sequence[CertifyTask],
    region: Region,
    most_boxes: int = 100_000,
    *,
    smallest: Array | None = None,
    on_progress: Callable[[int, float], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
    known: BoxJournal | None = None,
    on_journal: Callable[[BoxJournal], None] | None = None,
) -> CertifiedBoxes:
    """Goes on cutting boxes that are open and meet a region; the largest first.

    Args:
        found: What was found of the whole.
        task: What `found` was asked for.
        region: Where it matters, such as a `PoseBox` or a `PathTube`.
        most_boxes: How many more boxes are judged, at most.
        smallest: Half widths below which a box is not cut, shape (6,) [m, rad]; None: no limit.
        on_progress: Called now and then with the number of boxes judged and the open share.
        should_stop: Asked as often; True ends it.
        known: Of an earlier call for the same, for as many boxes or fewer, which is continued: what
            comes out is the same as if it had not ended.
        on_journal: Called as often with what is known by then, for the next call.

    Returns:
        Boxes of the whole: those that were not cut as they were, in their order, then the others.

    Raises:
        WorkspaceError: most_boxes < 1, or `found` is of several kinds and the task of one, or the
            other way round.
    """
    if most_boxes < 1:
        raise WorkspaceError(f"most_boxes: found {most_boxes}; accepted: at least 1")
    tasks = several(task)
    if (found.proven is not None) != (len(tasks) > 1):
        raise WorkspaceError(
            f"task: found {len(tasks)} kinds; accepted: those that the boxes were asked for"
        )
    poses, halves, verdicts = found.poses, found.halves, found.verdicts
    proven = np.zeros(len(poses), np.int8) if found.proven is None else found.proven
    least = np.zeros(NUMBERS) if smallest is None else np.asarray(smallest, float)
    volumes = np.prod(np.where(halves > 0.0, 2.0 * halves, 1.0), axis=1)
    shares = volumes / np.sum(volumes)
    judged, stopped, curve = 0, False, [tuple(found.curve[-1])]
    journal, before = BoxJournal(), (known or BoxJournal()).arrays()
    while not stopped and judged < most_boxes:
        wanted = np.flatnonzero((verdicts == OPEN) & np.any(halves > least, axis=1))
        wanted = wanted[region.meets(poses[wanted], halves[wanted])]
        if not len(wanted):
            break
        largest = np.max(shares[wanted])
        wanted = wanted[shares[wanted] >= largest * (1.0 - SAME_SIZE)]
        # Two boxes are judged of each that is cut; where, its own judge says once more.
        wanted = wanted[: max((most_boxes - judged) // 2, 1)]
        parts = []
        for first in range(0, len(wanted), CHUNK // 2):
            if should_stop is not None and should_stop():
                stopped = True
                wanted = wanted[:first]
                break
            some = wanted[first : first + CHUNK // 2]
            # Of each box that is cut the journal has two rows, of its halves.
            rows = slice(journal.count, journal.count + 2 * len(some))
            told_before = before[0][rows], before[1][rows], before[2][rows]
            new = _cut_and_judge(tasks, poses[some], halves[some], proven[some], told_before)
            journal.add(*new[2:])
            if on_journal is not None and rows.stop > len(before[0]):
                on_journal(journal)
            parts.append((new[0], new[1], new[2], new[4], np.repeat(0.5 * shares[some], 2)))
        if not parts:
            break
        rest = np.ones(len(poses), bool)
        rest[wanted] = False
        more = [np.concatenate(part) for part in zip(*parts, strict=True)]
        poses, halves, verdicts, proven = (
            np.concatenate([old[rest], new])
            for old, new in zip((poses, halves, verdicts, proven), more[:4], strict=True)
        )
        shares = np.concatenate([shares[rest], more[4]])
        judged += len(more[0])
        told = [float(np.sum(shares[verdicts == verdict])) for verdict in (INSIDE, OUTSIDE, OPEN)]
        curve.append((found.curve[-1, 0] + judged, *told))
        if on_progress is not None:
            on_progress(judged, told[2])
    return CertifiedBoxes(
        poses, halves, verdicts, np.concatenate([found.curve, np.array(curve[1:]).reshape(-1, 4)]),
        not stopped, None if found.proven is None else proven,
    )  # fmt: skip


def _cut_and_judge(
    tasks: Sequence[CertifyTask], poses: Array, halves: Array, proven: np.ndarray,
    known: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> tuple[Array, Array, np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
    """Both halves of each box, one after the other: poses, half widths, verdicts, and the rest.

    Args:
        tasks: What is to be proven.
        poses: Middles, shape (k, 6) [m, rad].
        halves: Half widths, shape (k, 6) [m, rad].
        proven: Which tasks are proven of them, bits, shape (k,).
        known: Verdicts, axes and bits of the halves of the first of them, as they are returned.

    Returns:
        Poses and half widths, shape (2 k, 6); verdicts, the number that each was cut across, and
        bits, shape (2 k,).
    """
    have = len(known[0]) // 2
    axes = np.zeros(len(poses), np.int64)
    axes[:have] = known[1][: 2 * have : 2]
    if have < len(poses):
        axes[have:] = judge_all(tasks, poses[have:], halves[have:], proven[have:])[1]
    low_high = np.arange(2 * len(poses)).reshape(2, -1).T.ravel()
    new_poses, new_halves = (one[low_high] for one in cut_boxes(poses, halves, axes))
    verdicts, bits = np.zeros(2 * len(poses), np.int64), np.repeat(proven, 2)
    verdicts[: 2 * have], bits[: 2 * have] = known[0][: 2 * have], known[2][: 2 * have]
    if have < len(poses):
        rest = slice(2 * have, None)
        verdicts[rest], _, bits[rest] = judge_all(
            tasks, new_poses[rest], new_halves[rest], bits[rest]
        )
    return new_poses, new_halves, verdicts, np.repeat(axes, 2), bits

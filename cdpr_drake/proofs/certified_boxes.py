"""Branch and prune: boxes of poses that are proven inside, proven outside, or still open."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import WorkspaceError
from cdpr_drake.proofs.box_expansion_kernel import INSIDE, NUMBERS, OPEN, OUTSIDE
from cdpr_drake.proofs.box_judges import CertifyTask, judge_all, several

CHUNK = 2048
"""Boxes between two looks at a request to stop."""


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

    def meets(self, poses: Array, halves: Array) -> np.ndarray:
        """Which boxes, middles and half widths of shape (k, 6), have a pose in common with it."""
        below = poses - halves <= self.upper
        return np.asarray(np.all(below & (poses + halves >= self.lower), axis=1))


class BoxJournal:
    """What was found of boxes, in the order in which they were judged: enough to go on from it.

    Which boxes these are follows from the first one and from what was found of those before.
    """

    def __init__(
        self,
        verdicts: np.ndarray | None = None,
        axes: np.ndarray | None = None,
        proven: np.ndarray | None = None,
    ) -> None:
        """Takes what was found before, all of shape (k,); None: nothing; proven: of no kind."""
        self._parts: list[tuple[np.ndarray, ...]] = []
        self.count = 0
        if verdicts is not None and axes is not None:
            self.add(verdicts, axes, np.zeros(len(axes)) if proven is None else proven)

    def arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Verdicts, the number of a pose across which each would be cut, and what kinds are proven
        of it, as bits, shape (k,) int8 each."""
        if len(self._parts) != 1:
            empty = (np.zeros(0, np.int8),) * 3
            joined = zip(*(self._parts or [empty]), strict=True)
            self._parts = [tuple(np.concatenate(part) for part in joined)]
        verdicts, axes, proven = self._parts[0]
        return verdicts, axes, proven

    def add(self, *found: np.ndarray) -> None:
        """Adds verdicts, axes and proven kinds of boxes."""
        self._parts.append(tuple(one.astype(np.int8) for one in found))
        self.count += len(found[0])


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
        proven: Which of several kinds are proven of each, bit k of the k-th, shape (k,); of a
            single kind, nothing.
    """

    poses: Array
    halves: Array
    verdicts: np.ndarray
    curve: Array
    finished: bool
    proven: np.ndarray | None = None

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
    task: CertifyTask | Sequence[CertifyTask],
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

    Of several kinds a box is inside where all are proven, and outside where one is proven not to
    hold. What is proven of a box holds for what is cut of it, and is not asked again.

    Args:
        task: What is to be proven: of one kind, or of up to `MOST_KINDS`.
        box: The poses.
        most_boxes: How many boxes are judged, at most.
        open_share: Share of the box that may stay open.
        on_progress: Called now and then with the number of boxes judged and the open share.
        should_stop: Asked as often; True ends the search.
        known: Of an earlier search for the same, which is continued: what comes out is the same as
            if it had not ended.
        on_journal: Called as often with what is known by then, for the next search.

    Raises:
        WorkspaceError: most_boxes < 1, or there is no kind, or too many.
    """
    if most_boxes < 1:
        raise WorkspaceError(f"most_boxes: found {most_boxes}; accepted: at least 1")
    tasks = several(task)
    poses = 0.5 * (box.lower + box.upper)[np.newaxis]
    halves = 0.5 * (box.upper - box.lower)[np.newaxis]
    proven = np.zeros(1, np.int8)
    volume = 1.0  # of a box of this generation, as a share
    done: list[tuple[Array, Array, np.ndarray, np.ndarray]] = []
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
                verdicts[part], axes[part], proven[part] = (one[judged:past] for one in before)
            else:
                verdicts[part], axes[part], proven[part] = judge_all(
                    tasks, poses[part], halves[part], proven[part]
                )
            journal.add(verdicts[part], axes[part], proven[part])
            if past > len(before[0]) and on_journal is not None:
                on_journal(journal)
            judged = past
            if on_progress is not None:
                closed_share = np.count_nonzero(verdicts) * volume + sum(shares.values())
                on_progress(judged, 1.0 - closed_share)
        for verdict in shares:
            shares[verdict] += volume * int(np.count_nonzero(verdicts == verdict))
        unproven = max(1.0 - sum(shares.values()), 0.0)
        curve.append((judged, shares[INSIDE], shares[OUTSIDE], unproven))
        ending = stopped or judged >= most_boxes or unproven <= open_share
        closed = verdicts != OPEN
        keep = np.ones(len(poses), bool) if ending else closed
        done.append((poses[keep], halves[keep], verdicts[keep], proven[keep]))
        if ending:
            break
        poses, halves = cut_boxes(poses[~closed], halves[~closed], axes[~closed])
        proven = np.tile(proven[~closed], 2)
        volume *= 0.5
    all_poses, all_halves, all_verdicts, all_proven = (
        np.concatenate(parts) for parts in zip(*done, strict=True)
    )
    return CertifiedBoxes(
        all_poses, all_halves, all_verdicts, np.array(curve), not stopped,
        all_proven if len(tasks) > 1 else None,
    )  # fmt: skip


def cut_boxes(poses: Array, halves: Array, axes: np.ndarray) -> tuple[Array, Array]:
    """Each box in two, across one of its half widths."""
    index = np.arange(len(poses))
    halves = halves.copy()
    halves[index, axes] *= 0.5
    low, high = poses.copy(), poses.copy()
    low[index, axes] -= halves[index, axes]
    high[index, axes] += halves[index, axes]
    return np.concatenate([low, high]), np.concatenate([halves, halves])

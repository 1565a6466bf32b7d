"""Boxes of poses that are proven inside or outside: found, kept, compared with grid and hull."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.frame.folder import Folder, load_arrays
from cdpr_drake.analyses.reporting.provenance import code_version
from cdpr_drake.analyses.workspaces.conditions import PoseConditions
from cdpr_drake.analyses.workspaces.pose_grid import plain
from cdpr_drake.arrays import Array
from cdpr_drake.errors import DataFileError, WorkspaceError
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.workspaces.box_expansion_kernel import OPEN
from cdpr_drake.workspaces.box_grid_agreement import BoxAgreement
from cdpr_drake.workspaces.box_judges import MEETING, CertifiedKind, CertifyTask
from cdpr_drake.workspaces.box_refinement import PathTube, refine
from cdpr_drake.workspaces.certified_boxes import BoxJournal, CertifiedBoxes, PoseBox, certify
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet
from cdpr_drake.workspaces.mesh_files import write_cells

BOX_ARRAYS, JOURNAL, REFINED_JOURNAL = "boxes.npz", "boxes_journal.npz", "refined_journal.npz"
"""Files of the boxes, and of what a search, or one along a way, that is continued begins with."""

SAVE_SECONDS = 5.0
"""Between two times that the journal is written."""

NAMED = 5
"""So many poses at which boxes are wrong are written out."""


@dataclass(frozen=True, eq=False)
class BoxSearch:
    """What is to be proven, and where.

    Attributes:
        tasks: What is to be proven, of one kind each.
        box: The poses.
    """

    tasks: tuple[CertifyTask, ...]
    box: PoseBox

    @property
    def task(self) -> CertifyTask:
        """What is to be proven; of several the first."""
        return self.tasks[0]

    def words(self) -> dict[str, Any]:
        """Of which cables and which poses verdicts are, for JSON."""
        task = self.task
        cables = task.case.cables
        if task.kind in MEETING and task.around is not None:
            cables = task.around.cables
        return {
            "cables": "over pulleys" if cables.has_pulleys() else "from fixed exit points",
            "lower_m_rad": self.box.lower.tolist(),
            "upper_m_rad": self.box.upper.tolist(),
        }

    def arguments(self) -> dict[str, Any]:
        """All that verdicts depend on, for JSON."""
        tasks = self.task if len(self.tasks) == 1 else self.tasks
        arguments = {"cdpr_drake": code_version(), "task": tasks, "box": self.box}
        result: dict[str, Any] = plain(arguments)
        return result


def box_search(
    robot: Robot, about: PoseConditions, kinds: Sequence[str], angles: Array,
    errors: tuple[float, float] = (0.0, 0.0), region: tuple[Array, Array] | None = None,
) -> BoxSearch:  # fmt: skip
    """A region of positions, to be cut into boxes inside or outside all of some kinds.

    Args:
        robot: The robot, for its frame and motion.
        about: What the kinds know of it.
        kinds: Names of `CertifiedKind`.
        angles: Orientations from whose least to whose largest angles all are proven, shape (k, 3)
            [rad].
        errors: How far exit points and anchor points may be off [m].
        region: Corners of the region, shape (3,) each [m]; None: the robot's frame. It counts as
            far as the motion type lets Po go.

    Raises:
        WorkspaceError: A kind cannot be proven, or the conditions have a method of tensions, of
            which a proof says nothing.
    """
    provable = [kind.value for kind in CertifiedKind]
    if not set(kinds) <= set(provable):
        raise WorkspaceError(
            f"certify: found kinds {','.join(kinds)}; accepted: {', '.join(provable)}"
        )
    if np.any(about.case.cables.arm > 0.0):
        raise WorkspaceError(
            f"certify: found {robot.name} with arms, pulley.arm {robot.pulley.arm:g}; accepted: "
            "cables from points or over pulleys"
        )
    if about.method is not None:
        raise WorkspaceError(
            f"certify: found method {about.method}; accepted: no method, for it is proven that "
            "there are tensions, not that a method finds them"
        )
    tasks = tuple(
        CertifyTask(
            CertifiedKind(kind), about.case, about.required or SpatialSet(), about.around,
            about.clearance, *errors,
        )
        for kind in kinds
    )  # fmt: skip
    lower, upper = robot.reach()
    if region is not None:
        free = lower < upper
        lower, upper = np.where(free, region[0], lower), np.where(free, region[1], upper)
    box = PoseBox(
        np.concatenate([lower, angles.min(axis=0)]), np.concatenate([upper, angles.max(axis=0)])
    )
    return BoxSearch(tasks, box)


def certified_boxes(
    search: BoxSearch,
    most_boxes: int = 200_000,
    folder: Folder | None = None,
    *,
    on_progress: Callable[[int, float], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> CertifiedBoxes:
    """Boxes proven inside or outside; with a folder it goes on where it was stopped or killed.

    Args:
        search: What is to be proven, and where.
        most_boxes: How many boxes are judged, at most; more of them continue a search for fewer.
        folder: Where `JOURNAL` is kept; None: nowhere.
        on_progress: As `workspaces.certify`.
        should_stop: As `workspaces.certify`.

    Raises:
        WorkspaceError: most_boxes < 1.
        OutputFolderError: The folder cannot be written.
    """
    with _journal(folder, JOURNAL, search, search.arguments()) as (earlier, keep):
        return certify(
            search.tasks, search.box, most_boxes, on_progress=on_progress,
            should_stop=should_stop, known=earlier, on_journal=keep,
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class RefinedBoxes:
    """Boxes that were cut further along a way.

    Attributes:
        boxes: All boxes, of the whole.
        tube: Where they were cut further.
        before: Open share of the boxes that had a pose in common with it.
        after: Of those that have one in common now.
        judged: How many boxes were judged for it.
    """

    boxes: CertifiedBoxes
    tube: PathTube
    before: float
    after: float
    judged: int

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "way_m": self.tube.poses[:, :3].tolist(),
            "reach_m": float(self.tube.reach[0]),
            "boxes_judged": self.judged,
            "open_share_before": self.before,
            "open_share_after": self.after,
        }


def refined_boxes(
    boxes: CertifiedBoxes,
    search: BoxSearch,
    way: Array,
    reach: float,
    most_boxes: int,
    folder: Folder | None = None,
    *,
    on_progress: Callable[[int, float], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> RefinedBoxes:
    """Open boxes cut further about a way of Po, at all orientations of the search.

    Args:
        boxes: Boxes of the whole region.
        search: What is to be proven, and where.
        way: Corners of the way, shape (n, 3) [m].
        reach: How far Po may be off it along each axis [m].
        most_boxes: How many more boxes are judged, at most.
        folder: Where `REFINED_JOURNAL` is kept; None: nowhere.
        on_progress: As `workspaces.refine`.
        should_stop: As `workspaces.refine`.

    Raises:
        WorkspaceError: A number is not accepted, or the way meets no box.
        OutputFolderError: The folder cannot be written.
    """
    middle = 0.5 * (search.box.lower + search.box.upper)[3:]
    turns = 0.5 * (search.box.upper - search.box.lower)[3:]
    tube = PathTube(
        np.hstack([way, np.repeat(middle[np.newaxis], len(way), axis=0)]),
        np.concatenate([np.full(3, reach), turns]),
    )
    if not np.any(tube.meets(boxes.poses, boxes.halves)):
        raise WorkspaceError(
            f"refine: found a way that is nowhere within {reach:g} m of the boxes; accepted: one "
            f"in x, y, z from {search.box.lower[:3]} to {search.box.upper[:3]} m"
        )
    arguments = search.arguments() | plain({"tube": tube, "boxes": int(boxes.curve[-1, 0])})
    with _journal(folder, REFINED_JOURNAL, search, arguments) as (earlier, keep):
        finer = refine(
            boxes, search.tasks, tube, most_boxes, on_progress=on_progress,
            should_stop=should_stop, known=earlier, on_journal=keep,
        )  # fmt: skip
    judged = int(finer.curve[-1, 0] - boxes.curve[-1, 0])
    return RefinedBoxes(finer, tube, _open_share(boxes, tube), _open_share(finer, tube), judged)


def _open_share(boxes: CertifiedBoxes, tube: PathTube) -> float:
    met = tube.meets(boxes.poses, boxes.halves)
    sizes = np.prod(np.where(boxes.halves > 0.0, boxes.halves, 1.0), axis=1)[met]
    return float(np.sum(sizes[boxes.verdicts[met] == OPEN]) / np.sum(sizes)) if len(sizes) else 0.0


@contextmanager
def _journal(
    folder: Folder | None, name: str, search: BoxSearch, arguments: Mapping[str, Any]
) -> Iterator[tuple[BoxJournal | None, Callable[[BoxJournal], None]]]:
    """What an earlier search of the same had judged, and what keeps a journal now and then."""
    words = json.dumps(arguments, sort_keys=True)
    earlier, last, saved = None, None, time.monotonic()
    stored = None if folder is None else load_arrays(folder.path / name)
    if stored is not None and str(stored["about"]) == words:
        earlier = BoxJournal(stored["verdicts"], stored["axes"], stored.get("proven"))

    def save() -> None:
        if last is not None and folder is not None:
            verdicts, axes, proven = last.arrays()
            arrays = {"about": np.array(words), "verdicts": verdicts, "axes": axes}
            several = {"proven": proven} if len(search.tasks) > 1 else {}
            folder.write_arrays(name, arrays | several)

    def keep(journal: BoxJournal) -> None:
        nonlocal last, saved
        last = journal
        if time.monotonic() - saved > SAVE_SECONDS:
            save()
            saved = time.monotonic()

    yield earlier, keep
    save()


def box_numbers(boxes: CertifiedBoxes, search: BoxSearch) -> dict[str, Any]:
    """What was cut into boxes, shares and the curve for JSON."""
    return {
        **search.words(),
        "boxes_judged": int(boxes.curve[-1, 0]), "inside_share": boxes.inside,
        "outside_share": boxes.outside, "open_share": boxes.open, "finished": boxes.finished,
        "curve": [
            {"boxes": int(n), "inside": a, "outside": b, "open": c}
            for n, a, b, c in boxes.curve.tolist()
        ],
    }  # fmt: skip


def save_boxes(boxes: CertifiedBoxes, folder: Folder) -> None:
    """Writes `BOX_ARRAYS`.

    Of several kinds the bits that say which are proven of each box are there, too, so that boxes
    that are read again can be refined.
    """
    arrays = {name: getattr(boxes, name) for name in ("poses", "halves", "verdicts", "curve")}
    if boxes.proven is not None:
        arrays["proven"] = boxes.proven
    folder.write_arrays(BOX_ARRAYS, arrays)


def load_boxes(folder: Path, finished: bool) -> CertifiedBoxes:
    """Reads what `save_boxes` wrote.

    Args:
        folder: Its folder.
        finished: What `box_numbers` says of that.

    Raises:
        DataFileError: There is no such file, or it is damaged.
    """
    arrays, names = load_arrays(folder / BOX_ARRAYS), ("poses", "halves", "verdicts", "curve")
    if arrays is None or not set(names) <= set(arrays):
        raise DataFileError(f"{folder / BOX_ARRAYS}: found no boxes; accepted: a whole file")
    poses, halves, verdicts, curve = (arrays[name] for name in names)
    return CertifiedBoxes(poses, halves, verdicts, curve, finished, arrays.get("proven"))


def write_boxes(boxes: CertifiedBoxes, path: Path) -> Path:
    """Writes the positions of the boxes as cells of VTK, with verdict and half angles.

    Raises:
        WorkspaceError: The file's ending is none of `mesh_files.GRID_ENDINGS`, or meshio is not
            installed.
    """
    numbers: dict[str, np.ndarray] = {"verdict": boxes.verdicts.astype(np.int32)}
    if np.any(boxes.halves[:, 3:]):
        for k, name in enumerate(("phi", "theta", "psi"), 3):
            numbers[name], numbers[f"half_{name}"] = boxes.poses[:, k], boxes.halves[:, k]
    return write_cells(path, boxes.poses[:, :3], boxes.halves[:, :3], numbers)


def agreement_numbers(agreement: Mapping[str, BoxAgreement]) -> dict[str, Any]:
    """Counts, and the first poses at which boxes are wrong, for JSON."""
    return {
        name: {
            "poses": part.poses,
            "in_boxes_proven_inside": part.inside,
            "in_boxes_proven_outside": part.outside,
            "in_open_boxes_or_none": part.poses - part.inside - part.outside,
            "contradictions": len(part.broken),
            "first_contradictions_m_rad": part.broken[:NAMED].tolist(),
        }
        for name, part in agreement.items()
    }

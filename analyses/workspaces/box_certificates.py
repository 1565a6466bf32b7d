"""Boxes of a question that are proven inside or outside: found, kept, compared with the rest."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.reporting.provenance import code_version
from cdpr_drake.analyses.sweeps.folder import load_arrays, store_arrays
from cdpr_drake.analyses.workspaces.pose_grid import plain
from cdpr_drake.analyses.workspaces.workspace_question import WorkspaceQuestion
from cdpr_drake.analyses.workspaces.workspace_results import ALL, RobotWorkspace
from cdpr_drake.arrays import Array
from cdpr_drake.errors import DataFileError, OutputFolderError, WorkspaceError
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.workspaces.box_expansion_kernel import OPEN
from cdpr_drake.workspaces.box_grid_agreement import BoxAgreement, grid_agreement, hull_agreement
from cdpr_drake.workspaces.box_judges import MEETING, CertifiedKind, CertifyTask
from cdpr_drake.workspaces.box_refinement import PathTube, refine
from cdpr_drake.workspaces.certified_boxes import BoxJournal, CertifiedBoxes, PoseBox, certify
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet
from cdpr_drake.workspaces.hull import WorkspaceHull
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
        asked = self.task if len(self.tasks) == 1 else self.tasks
        found: dict[str, Any] = plain(
            {"cdpr_drake": code_version(), "task": asked, "box": self.box}
        )
        return found


def box_search(
    question: WorkspaceQuestion,
    robot: Robot,
    errors: tuple[float, float] = (0.0, 0.0),
    region: tuple[Array, Array] | None = None,
) -> BoxSearch:
    """A region of positions, to be cut into boxes inside or outside the workspace of a question.

    Args:
        question: The question; the orientations of its grid are a range, from the least to the
            largest of each angle, all of which are proven.
        robot: The robot, for its frame and motion.
        errors: How far exit points and anchor points may be off [m].
        region: Corners of the region, shape (3,) each [m]; None: the robot's frame. As far as the
            motion type lets Po go.

    Raises:
        WorkspaceError: A kind cannot be proven, or there is a method of tensions, of which a proof
            says nothing.
    """
    known = [kind.value for kind in CertifiedKind]
    if not set(question.kinds) <= set(known):
        raise WorkspaceError(
            f"certify: found kinds {','.join(question.kinds)}; accepted: {', '.join(known)}"
        )
    if question.rule != "all":
        raise WorkspaceError(f"certify: found orientations {question.rule}; accepted: all")
    about = question.about
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
        for kind in question.kinds
    )  # fmt: skip
    lower, upper = robot.reach()
    if region is not None:
        free = lower < upper
        lower, upper = np.where(free, region[0], lower), np.where(free, region[1], upper)
    angles = question.grid.angles
    box = PoseBox(
        np.concatenate([lower, angles.min(axis=0)]), np.concatenate([upper, angles.max(axis=0)])
    )
    return BoxSearch(tasks, box)


def certified_boxes(
    search: BoxSearch,
    most_boxes: int = 200_000,
    folder: Path | None = None,
    *,
    on_progress: Callable[[int, float], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> CertifiedBoxes:
    """Boxes proven inside or outside; with a folder it continues where it was stopped or killed.

    Args:
        search: What is to be proven, and where.
        most_boxes: How many boxes are judged, at most; more of them continue a search for fewer.
        folder: A folder that exists, for `JOURNAL`; None: nothing is kept.
        on_progress: As `workspaces.certify`.
        should_stop: As `workspaces.certify`.

    Raises:
        WorkspaceError: most_boxes < 1.
        OutputFolderError: The folder cannot be written.
    """
    kept = _KeptJournal(folder, JOURNAL, search.arguments(), len(search.tasks) > 1)
    found = certify(
        search.tasks, search.box, most_boxes, on_progress=on_progress, should_stop=should_stop,
        known=kept.known, on_journal=kept.keep,
    )  # fmt: skip
    kept.save()
    return found


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

    def numbers(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "way_m": self.tube.poses[:, :3].tolist(),
            "reach_m": float(self.tube.reach[0]),
            "boxes_judged": self.judged,
            "open_share_before": self.before,
            "open_share_after": self.after,
        }


def refined_boxes(
    found: CertifiedBoxes,
    search: BoxSearch,
    way: Array,
    reach: float,
    most_boxes: int,
    folder: Path | None = None,
    *,
    on_progress: Callable[[int, float], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> RefinedBoxes:
    """Open boxes cut further about a way of Po, at all orientations of the search.

    Args:
        found: What was found of the whole.
        search: What is to be proven, and where.
        way: Corners of the way, shape (n, 3) [m].
        reach: How far Po may be off it along each axis [m].
        most_boxes: How many more boxes are judged, at most.
        folder: As of `certified_boxes`, for `REFINED_JOURNAL`.
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
    if not np.any(tube.meets(found.poses, found.halves)):
        raise WorkspaceError(
            f"refine: found a way that is nowhere within {reach:g} m of the boxes; accepted: one "
            f"in x, y, z from {search.box.lower[:3]} to {search.box.upper[:3]} m"
        )
    asked = search.arguments() | plain({"tube": tube, "boxes": int(found.curve[-1, 0])})
    kept = _KeptJournal(folder, REFINED_JOURNAL, asked, len(search.tasks) > 1)
    finer = refine(
        found, search.tasks, tube, most_boxes, on_progress=on_progress, should_stop=should_stop,
        known=kept.known, on_journal=kept.keep,
    )  # fmt: skip
    kept.save()
    judged = int(finer.curve[-1, 0] - found.curve[-1, 0])
    return RefinedBoxes(finer, tube, _open_share(found, tube), _open_share(finer, tube), judged)


def _open_share(found: CertifiedBoxes, tube: PathTube) -> float:
    met = tube.meets(found.poses, found.halves)
    sizes = np.prod(np.where(found.halves > 0.0, found.halves, 1.0), axis=1)[met]
    return float(np.sum(sizes[found.verdicts[met] == OPEN]) / np.sum(sizes)) if len(sizes) else 0.0


class _KeptJournal:
    """A journal in a folder, written now and then."""

    def __init__(
        self, folder: Path | None, name: str, asked: Mapping[str, Any], several: bool
    ) -> None:
        """With what it is of; a journal of something else is not read.

        Args:
            folder: Where it is; None: nowhere.
            name: Its file.
            asked: All that verdicts depend on, for JSON.
            several: Whether it is of several kinds.
        """
        self._folder, self._name, self._several = folder, name, several
        self._words = json.dumps(asked, sort_keys=True)
        self._last: BoxJournal | None = None
        self._saved = time.monotonic()
        self.known: BoxJournal | None = None
        if folder is not None:
            stored = load_arrays(folder / name)
            if stored is not None and str(stored["about"]) == self._words:
                self.known = BoxJournal(stored["verdicts"], stored["axes"], stored.get("proven"))

    def keep(self, journal: BoxJournal) -> None:
        """Takes what is known by now."""
        self._last = journal
        if time.monotonic() - self._saved > SAVE_SECONDS:
            self.save()

    def save(self) -> None:
        """Writes what is known by now, if anything is new.

        Raises:
            OutputFolderError: The folder cannot be written.
        """
        if self._last is None or self._folder is None:
            return
        verdicts, axes, proven = self._last.arrays()
        arrays = {"about": np.array(self._words), "verdicts": verdicts, "axes": axes}
        if self._several:
            arrays["proven"] = proven
        try:
            store_arrays(self._folder / self._name, arrays)
        except OSError as problem:
            raise OutputFolderError(
                f"{self._folder}: cannot be written: {problem.strerror}"
            ) from problem
        self._saved = time.monotonic()


def box_numbers(found: CertifiedBoxes, search: BoxSearch | None = None) -> dict[str, Any]:
    """What was cut into boxes, shares and the curve for JSON."""
    return {
        **({} if search is None else search.words()),
        "boxes_judged": int(found.curve[-1, 0]),
        "inside_share": found.inside,
        "outside_share": found.outside,
        "open_share": found.open,
        "finished": found.finished,
        "curve": [
            {"boxes": int(n), "inside": a, "outside": b, "open": c}
            for n, a, b, c in found.curve.tolist()
        ],
    }


def save_boxes(found: CertifiedBoxes, folder: Path) -> Path:
    """Writes `boxes.npz` into a folder that exists, and returns its path.

    Of several kinds the bits that say which are proven of each box are there, too, so that boxes
    that are read again can be refined.
    """
    path = folder / BOX_ARRAYS
    arrays = {name: getattr(found, name) for name in ("poses", "halves", "verdicts", "curve")}
    if found.proven is not None:
        arrays["proven"] = found.proven
    store_arrays(path, arrays)
    return path


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


def write_boxes(found: CertifiedBoxes, path: Path) -> Path:
    """Writes the positions of the boxes as cells of VTK, with verdict and half angles.

    Raises:
        WorkspaceError: The file's ending is none of `mesh_files.GRID_ENDINGS`, or meshio is not
            installed.
    """
    numbers: dict[str, np.ndarray] = {"verdict": found.verdicts.astype(np.int32)}
    if np.any(found.halves[:, 3:]):
        for k, name in enumerate(("phi", "theta", "psi"), 3):
            numbers[name], numbers[f"half_{name}"] = found.poses[:, k], found.halves[:, k]
    return write_cells(path, found.poses[:, :3], found.halves[:, :3], numbers)


def agreements(
    workspace: RobotWorkspace, hull: WorkspaceHull | None, boxes: CertifiedBoxes
) -> dict[str, BoxAgreement]:
    """What boxes say of every pose of the grid, and of the ends of a hull's rays.

    Each is inside a proven box only if it belongs to the workspace by itself, and inside one that
    is proven outside only if it does not.
    """
    found = {"grid": grid_agreement(boxes, workspace.grid, workspace.inside(ALL))}
    angles = workspace.grid.angles
    if hull is not None and len(angles) == 1:
        found["hull"] = hull_agreement(boxes, hull, angles[0])
    return found


def agreement_numbers(found: Mapping[str, BoxAgreement]) -> dict[str, Any]:
    """Counts, and the first poses at which boxes are wrong, for JSON."""
    return {
        name: {
            "poses": one.poses,
            "in_boxes_proven_inside": one.inside,
            "in_boxes_proven_outside": one.outside,
            "in_open_boxes_or_none": one.poses - one.inside - one.outside,
            "contradictions": len(one.broken),
            "first_contradictions_m_rad": one.broken[:NAMED].tolist(),
        }
        for name, one in found.items()
    }

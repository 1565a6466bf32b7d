"""Workspaces with boxes of poses proven inside or outside: `certify` of `compute_workspace`."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cdpr_drake.analyses.frame.folder import Folder, load_arrays
from cdpr_drake.analyses.frame.follow import Count, Follow
from cdpr_drake.analyses.reporting.provenance import code_version
from cdpr_drake.analyses.reporting.written_files import whole_file
from cdpr_drake.analyses.workspaces.conditions import PoseConditions
from cdpr_drake.analyses.workspaces.pose_grid import plain
from cdpr_drake.analyses.workspaces.workspace_result import Workspace
from cdpr_drake.arrays import Array
from cdpr_drake.errors import DataFileError, WorkspaceError
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.proofs.box_expansion_kernel import OPEN
from cdpr_drake.proofs.box_grid_agreement import BoxAgreement, grid_agreement, hull_agreement
from cdpr_drake.proofs.box_judges import MEETING, CertifiedKind, CertifyTask
from cdpr_drake.proofs.box_refinement import PathTube, refine
from cdpr_drake.proofs.certified_boxes import BoxJournal, CertifiedBoxes, PoseBox, certify
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet
from cdpr_drake.workspaces.mesh_files import write_cells

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cdpr_drake.analyses.reporting.deferred_figures import Pictures

BOX_ARRAYS, JOURNAL, REFINED_JOURNAL = "boxes.npz", "boxes_journal.npz", "refined_journal.npz"
"""Files of the boxes, and of what a search, or one along a way, that is continued begins with."""

NAMES = ("poses", "halves", "verdicts", "curve")
"""Arrays of the boxes."""

SAVE_SECONDS = 5.0
"""Between two times that the journal is written."""

NAMED = 5
"""So many poses at which boxes are wrong are written out."""

CONTRADICTION = 1
"""Exit code if a proof contradicts the grid or the hull."""

COMPARED = {"grid": "poses of the grid", "hull": "ends of the hull's rays"}
"""What boxes are compared with, in words."""


@dataclass(frozen=True, eq=False)
class BoxSearch:
    """What is to be proven, a task a kind, of which poses."""

    tasks: tuple[CertifyTask, ...]
    box: PoseBox

    def arguments(self) -> dict[str, Any]:
        """All that verdicts depend on, for JSON."""
        tasks = self.tasks[0] if len(self.tasks) == 1 else self.tasks
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
    required = about.required or SpatialSet()
    tasks = [
        CertifyTask(
            CertifiedKind(kind), about.case, required, about.around, about.clearance, *errors
        )
        for kind in kinds
    ]
    lower, upper = robot.reach()
    if region is not None:
        free = lower < upper
        lower, upper = np.where(free, region[0], lower), np.where(free, region[1], upper)
    low, high = angles.min(axis=0), angles.max(axis=0)
    box = PoseBox(np.concatenate([lower, low]), np.concatenate([upper, high]))
    return BoxSearch(tuple(tasks), box)


def certified_boxes(
    search: BoxSearch, most_boxes: int = 200_000, folder: Folder | None = None, **how: Any
) -> CertifiedBoxes:
    """Boxes proven inside or outside; with a folder it goes on where it was stopped or killed.

    At most so many boxes are judged; more of them continue a search for fewer. `how` has
    `on_progress` and `should_stop` of `proofs.certify`.

    Raises:
        WorkspaceError: most_boxes < 1.
        OutputFolderError: The folder cannot be written.
    """
    with _journal(folder, JOURNAL, search, search.arguments()) as journal:
        return certify(search.tasks, search.box, most_boxes, **journal, **how)


def refined_boxes(
    boxes: CertifiedBoxes, search: BoxSearch, way: Array, reach: float, most_boxes: int,
    folder: Folder | None = None, **how: Any,
) -> tuple[CertifiedBoxes, dict[str, Any]]:  # fmt: skip
    """Open boxes cut further about a way of Po, at all orientations of the search.

    All boxes, and for JSON how many were judged for it, and which shares of those within reach of
    the way were open before and are open now.

    Args:
        boxes: Boxes of the whole region, which a search has found.
        search: The search.
        way: Corners of the way, shape (n, 3) [m].
        reach: How far Po may be off it along each axis [m].
        most_boxes: How many more boxes are judged, at most.
        folder: As `certified_boxes`, like how.
        how: As `certified_boxes`.

    Raises:
        WorkspaceError: A number is not accepted, or the way meets no box.
        OutputFolderError: The folder cannot be written.
    """
    low, high = search.box.lower, search.box.upper
    turns = np.broadcast_to(0.5 * (low + high)[3:], (len(way), 3))
    tube = PathTube(
        np.hstack([way, turns]), np.concatenate([np.full(3, reach), 0.5 * (high - low)[3:]])
    )
    if not np.any(tube.meets(boxes.poses, boxes.halves)):
        raise WorkspaceError(
            f"refine: found a way that is nowhere within {reach:g} m of the boxes; accepted: one "
            f"in x, y, z from {low[:3]} to {high[:3]} m"
        )
    arguments = search.arguments() | plain({"tube": tube, "boxes": int(boxes.curve[-1, 0])})
    with _journal(folder, REFINED_JOURNAL, search, arguments) as journal:
        finer = refine(boxes, search.tasks, tube, most_boxes, **journal, **how)
    return finer, {
        "way_m": way.tolist(), "reach_m": float(reach),
        "boxes_judged": int(finer.curve[-1, 0] - boxes.curve[-1, 0]),
        "open_share_before": _open_share(boxes, tube), "open_share_after": _open_share(finer, tube),
    }  # fmt: skip


def _open_share(boxes: CertifiedBoxes, tube: PathTube) -> float:
    met = tube.meets(boxes.poses, boxes.halves)
    sizes = np.prod(np.where(boxes.halves > 0.0, boxes.halves, 1.0), axis=1)[met]
    return float(np.sum(sizes[boxes.verdicts[met] == OPEN]) / np.sum(sizes)) if len(sizes) else 0.0


@contextmanager
def _journal(
    folder: Folder | None, name: str, search: BoxSearch, arguments: Mapping[str, Any]
) -> Iterator[dict[str, Any]]:
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

    yield {"known": earlier, "on_journal": keep}
    save()


def box_numbers(boxes: CertifiedBoxes, search: BoxSearch) -> dict[str, Any]:
    """What was cut into boxes, shares and the curve for JSON."""
    task = search.tasks[0]
    cables = task.case.cables
    if task.kind in MEETING and task.around is not None:
        cables = task.around.cables
    return {
        "cables": "over pulleys" if cables.has_pulleys() else "from fixed exit points",
        "lower_m_rad": search.box.lower.tolist(), "upper_m_rad": search.box.upper.tolist(),
        "boxes_judged": int(boxes.curve[-1, 0]), "inside_share": boxes.inside,
        "outside_share": boxes.outside, "open_share": boxes.open, "finished": boxes.finished,
        "curve": [
            {"boxes": int(n), "inside": a, "outside": b, "open": c}
            for n, a, b, c in boxes.curve.tolist()
        ],
    }  # fmt: skip


def save_boxes(boxes: CertifiedBoxes, folder: Folder) -> None:
    """Writes `BOX_ARRAYS`; of several kinds also which are proven of each box, for `refine`."""
    arrays = {name: getattr(boxes, name) for name in NAMES}
    if boxes.proven is not None:
        arrays["proven"] = boxes.proven
    folder.write_arrays(BOX_ARRAYS, arrays)


def load_boxes(folder: Path, finished: bool) -> CertifiedBoxes:
    """Reads what `save_boxes` wrote; `finished` is what `box_numbers` says of that.

    Raises:
        DataFileError: There is no such file, or it is damaged.
    """
    arrays = load_arrays(folder / BOX_ARRAYS)
    if arrays is None or not set(NAMES) <= set(arrays):
        raise DataFileError(f"{folder / BOX_ARRAYS}: found no boxes; accepted: a whole file")
    poses, halves, verdicts, curve = (arrays[name] for name in NAMES)
    return CertifiedBoxes(poses, halves, verdicts, curve, finished, arrays.get("proven"))


def write_boxes(boxes: CertifiedBoxes, path: Path) -> None:
    """Writes the positions of the boxes as cells of VTK, with verdict and half angles.

    Raises:
        WorkspaceError: The file's ending is none of `mesh_files.GRID_ENDINGS`, or meshio is not
            installed.
    """
    numbers: dict[str, np.ndarray] = {"verdict": boxes.verdicts.astype(np.int32)}
    if np.any(boxes.halves[:, 3:]):
        for k, name in enumerate(("phi", "theta", "psi"), 3):
            numbers[name], numbers[f"half_{name}"] = boxes.poses[:, k], boxes.halves[:, k]
    write_cells(path, boxes.poses[:, :3], boxes.halves[:, :3], numbers)


def agreement_numbers(agreement: BoxAgreement) -> dict[str, Any]:
    """Counts, and the first poses at which boxes are wrong, for JSON."""
    return {
        "poses": agreement.poses, "in_boxes_proven_inside": agreement.inside,
        "in_boxes_proven_outside": agreement.outside,
        "in_open_boxes_or_none": agreement.poses - agreement.inside - agreement.outside,
        "contradictions": len(agreement.broken),
        "first_contradictions_m_rad": agreement.broken[:NAMED].tolist(),
    }  # fmt: skip


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class CertifiedWorkspace(Workspace):
    """A workspace over a grid, with boxes of poses that are proven inside or outside.

    Attributes:
        boxes: Boxes proven inside or outside.
        search: What was cut into boxes.
        refined: How boxes were cut further along a way, as `refined_boxes` says.
    """

    boxes: CertifiedBoxes
    search: BoxSearch
    refined: dict[str, Any] | None = None

    @property
    def exit_code(self) -> int:
        """1 if a proof contradicts the grid or the hull, 130 if the call was stopped."""
        if any(len(part.broken) for part in self.agreement.values()):
            return CONTRADICTION
        return super().exit_code

    @cached_property
    def agreement(self) -> dict[str, BoxAgreement]:
        """What boxes say of every pose of the grid, and of the ends of a hull's rays.

        A pose that is no part of the workspace contradicts a box proven inside around it, and one
        of the workspace contradicts a box proven outside.
        """
        parts = {"grid": grid_agreement(self.boxes, self.grid, self.inside())}
        if self.hull is not None and len(self.grid.angles) == 1:
            parts["hull"] = hull_agreement(self.boxes, self.hull, self.grid.angles[0])
        return parts

    def as_dict(self) -> dict[str, Any]:
        """As a workspace's, with shares of the boxes and what they say of grid and hull."""
        return {
            **super().as_dict(), "certified": box_numbers(self.boxes, self.search),
            **({} if self.refined is None else {"refined": self.refined}),
            "agreement": {name: agreement_numbers(part) for name, part in self.agreement.items()},
        }  # fmt: skip

    def last_lines(self) -> list[str]:
        """Boxes and contradictions, and as a workspace's."""
        return [*self._box_lines(), *super().last_lines()]

    def _box_lines(self) -> list[str]:
        about = box_numbers(self.boxes, self.search)
        lines = [
            f"certified, cables {about['cables']}: all poses in {about['inside_share']:.2%} of the "
            f"box inside, in {about['outside_share']:.2%} outside, {about['open_share']:.2%} open; "
            f"{about['boxes_judged']} boxes"
        ]
        if (finer := self.refined) is not None:
            lines.append(
                f"boxes within {finer['reach_m']:g} m of the way: "
                f"{finer['open_share_before']:.2%} of them were open, "
                f"{finer['open_share_after']:.2%} are; {finer['boxes_judged']} boxes"
            )
        return lines + [
            f"boxes against {COMPARED[name]}: {len(part.broken)} contradictions at {part.poses} of "
            f"them; {part.inside} in boxes proven inside, {part.outside} outside"
            for name, part in self.agreement.items()
        ]

    def notes(self) -> list[str]:
        """As a workspace's, and proofs that are wrong."""
        return super().notes() + [
            f"error: proven boxes contradict {len(part.broken)} of {part.poses} {COMPARED[name]}, "
            f"first at ({', '.join(f'{x:g}' for x in part.broken[0])}) [m, rad]: proof or kernel "
            "is wrong; do not use these results, and report them"
            for name, part in self.agreement.items() if len(part.broken)
        ]  # fmt: skip

    def figures(self) -> dict[str, Callable[[], Figure]]:
        """As a workspace's, and the boxes."""
        from cdpr_drake.proofs import box_figures as draw

        name, kinds = self.arguments["robot"], list(self.arguments["kinds"])
        return super().figures() | {
            "open_share": partial(draw.boxes_figure, self.boxes, name, self.geometry),
            "boxes": partial(draw.box_planes_figure, self.boxes, name, kinds),
        }

    def write(self, folder: Folder, formats: Sequence[str], follow: Follow) -> dict[str, str]:
        """Writes the boxes, too."""
        save_boxes(self.boxes, folder)
        return super().write(folder, formats, follow)

    def page(self, robot: Robot) -> tuple[Pictures, str]:
        """As a workspace's, with the boxes."""
        from cdpr_drake.analyses.workspaces.workspace_scene import workspace_page
        from cdpr_drake.proofs.box_figures import box_layers

        layers = box_layers(self.boxes)
        named = [layer._replace(name=f"boxes/{layer.title}") for layer in layers]
        return workspace_page(self, robot, named)


def certified(
    workspace: Workspace, search: BoxSearch, most_boxes: int, mesh: Path | None,
    way: Array | None, reach: float, more_boxes: int, folder: Folder | None, follow: Follow,
) -> CertifiedWorkspace:  # fmt: skip
    """A workspace with its boxes, cut further along a way of Po if there is one.

    Args:
        workspace: Where kinds hold on a grid.
        search: As `box_search` gives it.
        most_boxes: How many boxes are judged, at most.
        mesh: File for the boxes as cells of VTK.
        way: As `refined_boxes`, like reach.
        reach: How far Po may be off the way along each axis [m].
        more_boxes: How many more boxes are judged along the way, at most.
        folder: Keeps what was judged.
        follow: Who follows.

    Raises:
        WorkspaceError: As `certified_boxes` and `refined_boxes`.
        OutputFolderError: The folder cannot be written.
    """

    def counting(total: int) -> dict[str, Any]:
        counter = Count(follow, total, unit="boxes")
        return {
            "on_progress": lambda judged, share: counter.add(
                judged - counter.done, f"{share:.1%} open"
            ),
            "should_stop": follow.stop,
        }

    boxes, refined = certified_boxes(search, most_boxes, folder, **counting(most_boxes)), None
    if way is not None and boxes.finished:
        boxes, refined = refined_boxes(
            boxes, search, way, reach, more_boxes, folder, **counting(more_boxes)
        )
    if mesh is not None:
        with whole_file(mesh) as part:
            write_boxes(boxes, part)
    parts = {field.name: getattr(workspace, field.name) for field in fields(workspace)}
    parts["stopped"] = not boxes.finished
    return CertifiedWorkspace(**parts, boxes=boxes, search=search, refined=refined)

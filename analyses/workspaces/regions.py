"""Other ways to draw a workspace: its hull, and boxes that are proven inside or outside."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.sweeps import store_arrays
from cdpr_drake.analyses.workspaces.conditions import KINDS, Poses
from cdpr_drake.analyses.workspaces.question import WorkspaceQuestion
from cdpr_drake.arrays import Array
from cdpr_drake.errors import WorkspaceError
from cdpr_drake.models import Robot
from cdpr_drake.spatial import rotation_from_angles
from cdpr_drake.workspaces import (
    CertifiedBoxes,
    CertifiedKind,
    CertifyTask,
    PoseBox,
    SpatialSet,
    WorkspaceHull,
    certify,
    workspace_hull,
)

HULL_ARRAYS, BOX_ARRAYS = "hull.npz", "boxes.npz"
"""Files of a hull's triangles and of certified boxes."""


def question_holds(question: WorkspaceQuestion) -> Callable[[Array], np.ndarray]:
    """Whether all kinds of a question hold at positions, shape (n, 3), as its rule says.

    Raises:
        WorkspaceError: It has a kind that knows the poses of its grid only.
    """
    if "stable" in question.kinds:
        raise WorkspaceError("--hull: found --kind stable; accepted: kinds other than that")
    turns = np.array([rotation_from_angles(a).matrix() for a in question.grid.angles])
    every = question.rule == "all"

    def holds(positions: Array) -> np.ndarray:
        n = len(positions)
        inside = np.full(n, every)
        for turn in turns:
            at = Poses(0, n, positions, np.tile(turn, (n, 1, 1)))
            here = np.ones(n, bool)
            for name in question.kinds:
                here &= KINDS[name].holds(question.about, at)
            inside = inside & here if every else inside | here
        return inside

    return holds


def question_hull(
    question: WorkspaceQuestion,
    robot: Robot,
    center: Array,
    rays: int = 10_000,
    tolerance: float = 1e-3,
) -> WorkspaceHull:
    """The hull of what a question asks for, within the robot's frame.

    Args:
        question: The question; its grid gives the orientations only.
        robot: The robot, for its frame.
        center: Where rays begin, shape (3,) [m].
        rays: How many, at most.
        tolerance: How near to the border of the workspace they end [m].

    Raises:
        WorkspaceError: As `workspaces.workspace_hull`, or the robot is planar.
    """
    if robot.is_planar():
        raise WorkspaceError(
            f"--hull: found the planar {robot.name}; accepted: robots that move in space"
        )
    lower, upper = robot.frame.lower, robot.frame.upper
    holds = question_holds(question)
    return workspace_hull(holds, center, lower, upper, rays=rays, tolerance=tolerance)


def hull_numbers(hull: WorkspaceHull) -> dict[str, Any]:
    """Volume, area and centroid for JSON."""
    return {
        "center_m": hull.center.tolist(),
        "rays": len(hull.vertices),
        "rays_to_the_frame": int(np.count_nonzero(hull.cut)),
        "tolerance_m": hull.tolerance,
        "volume_m3": hull.volume,
        "area_m2": hull.area,
        "centroid_m": hull.centroid.tolist(),
    }


def save_hull(hull: WorkspaceHull, folder: Path) -> Path:
    """Writes `hull.npz` into a folder that exists, and returns its path."""
    path = folder / HULL_ARRAYS
    store_arrays(
        path,
        {
            "center": hull.center,
            "vertices": hull.vertices,
            "faces": hull.faces,
            "cut": hull.cut,
            "tolerance": np.array(hull.tolerance),
        },
    )
    return path


def certified_boxes(
    question: WorkspaceQuestion,
    robot: Robot,
    most_boxes: int = 200_000,
    errors: tuple[float, float] = (0.0, 0.0),
    *,
    on_progress: Callable[[int, float], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> CertifiedBoxes:
    """Boxes of the robot's frame proven inside or outside the workspace of a question.

    Args:
        question: The question, of one kind; the orientations of its grid are a range, from the
            least to the largest of each angle, all of which are proven.
        robot: The robot, for its frame.
        most_boxes: How many boxes are judged, at most.
        errors: How far exit points and anchor points may be off [m].
        on_progress: As `workspaces.certify`.
        should_stop: As `workspaces.certify`.

    Raises:
        WorkspaceError: There are several kinds, or one that cannot be proven.
    """
    known = [kind.value for kind in CertifiedKind]
    if len(question.kinds) != 1 or question.kinds[0] not in known or question.rule != "all":
        raise WorkspaceError(
            f"--certify: found --kind {','.join(question.kinds)}, --orientations {question.rule}; "
            f"accepted: one of {', '.join(known)}, and all"
        )
    about = question.about
    task = CertifyTask(
        CertifiedKind(question.kinds[0]),
        replace(about.case, cables=about.case.cables.without_pulleys()),
        about.required or SpatialSet(),
        about.around,
        about.clearance,
        *errors,
    )
    lower, upper = robot.frame.lower.copy(), robot.frame.upper.copy()
    if robot.plane_height is not None:
        lower[2] = upper[2] = robot.plane_height
    angles = question.grid.angles
    box = PoseBox(
        np.concatenate([lower, angles.min(axis=0)]), np.concatenate([upper, angles.max(axis=0)])
    )
    return certify(task, box, most_boxes, on_progress=on_progress, should_stop=should_stop)


def box_numbers(found: CertifiedBoxes) -> dict[str, Any]:
    """Shares and the curve for JSON."""
    return {
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
    """Writes `boxes.npz` into a folder that exists, and returns its path."""
    path = folder / BOX_ARRAYS
    arrays = {name: getattr(found, name) for name in ("poses", "halves", "verdicts", "curve")}
    store_arrays(path, arrays)
    return path

"""Another way to draw a workspace: its hull, seen from a centre."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.sweeps.folder import load_arrays, store_arrays
from cdpr_drake.analyses.workspaces.conditions import KINDS, Poses
from cdpr_drake.analyses.workspaces.workspace_question import WorkspaceQuestion
from cdpr_drake.arrays import Array
from cdpr_drake.errors import DataFileError, WorkspaceError
from cdpr_drake.geometry.poses import rotation_from_angles
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.workspaces.hull import FIRST_STEPS, WorkspaceHull, workspace_hull

HULL_ARRAYS = "hull.npz"
"""File of a hull's triangles."""


def question_holds(question: WorkspaceQuestion) -> Callable[[Array], np.ndarray]:
    """Whether all kinds of a question hold at positions, shape (n, 3), as its rule says.

    Raises:
        WorkspaceError: It has a kind that knows the poses of its grid only.
    """
    for name in ("stable", "dynamic-single-failure"):
        if name in question.kinds:
            raise WorkspaceError(f"hull: found kinds {name}; accepted: kinds other than that")
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


REACH = 10
"""Where nothing bounds a hull, rays are followed to a box so many times as large as that of the
frame, about the same middle."""

FRAME, BOX, NOTHING = "frame", "box", "nothing"
"""What bounds a hull."""


@dataclass(frozen=True, eq=False)
class HullBound:
    """Where the rays of a hull end at the latest.

    Attributes:
        kind: `FRAME`, `BOX` or `NOTHING`.
        why: In words.
        lower: Lower corner of the box at which they end, shape (3,) [m].
        upper: Upper corner, shape (3,) [m].
    """

    kind: str
    why: str
    lower: Array
    upper: Array

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        corners = {"rays_end_at_lower_m": self.lower.tolist(), "at_upper_m": self.upper.tolist()}
        return {"bounded_by": self.kind, "why": self.why, **corners}


def hull_bound(
    robot: Robot, region: tuple[Array, Array] | None = None, unbounded: bool = False
) -> HullBound:
    """What bounds the hull of a robot: a region that is given, else its frame, unless assumed.

    Args:
        robot: The robot.
        region: Corners of a box, shape (3,) each [m]; None: none was given.
        unbounded: Whether nothing shall bound it.
    """
    lower, upper = np.asarray(robot.frame.lower, float), np.asarray(robot.frame.upper, float)
    if region is not None:
        return HullBound(BOX, "as was asked for", *region)
    if not unbounded and not robot.frame.assumed:
        return HullBound(FRAME, "which the robot's file gives", lower, upper)
    why = "as was asked for" if unbounded else "as the robot's frame was assumed"
    middle, half = 0.5 * (lower + upper), 0.5 * REACH * np.max(upper - lower) * np.ones(3)
    return HullBound(NOTHING, why, middle - half, middle + half)


def question_hull(
    question: WorkspaceQuestion,
    robot: Robot,
    center: Array,
    rays: int = 10_000,
    tolerance: float = 1e-3,
    bound: HullBound | None = None,
) -> WorkspaceHull:
    """The hull of what a question asks for.

    Args:
        question: The question; its grid gives the orientations only.
        robot: The robot, for its frame and motion.
        center: Where rays begin, shape (3,) [m].
        rays: How many, at most.
        tolerance: How near to the border of the workspace they end [m].
        bound: Where rays end at the latest; None: as `hull_bound` says of the robot.

    Raises:
        WorkspaceError: As `workspaces.hull.workspace_hull`, or the robot does not move in space.
    """
    if robot.motion_type().num_moves < 3:
        raise WorkspaceError(
            f"hull: found the planar {robot.name}; accepted: robots that move in space"
        )
    bound = hull_bound(robot) if bound is None else bound
    return workspace_hull(
        question_holds(question), center, bound.lower, bound.upper, rays=rays, tolerance=tolerance,
        steps=FIRST_STEPS * (REACH if bound.kind == NOTHING else 1),
        likely=(robot.frame.lower, robot.frame.upper) if bound.kind == NOTHING else None,
    )  # fmt: skip


def hull_numbers(hull: WorkspaceHull, bound: HullBound | None = None) -> dict[str, Any]:
    """Volume, area, centroid and what bounded it for JSON."""
    return {
        **({} if bound is None else bound.as_dict()),
        "center_m": hull.center.tolist(),
        "rays": len(hull.vertices),
        "rays_to_the_bound": int(np.count_nonzero(hull.cut)),
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


def load_hull(folder: Path) -> WorkspaceHull:
    """Reads what `save_hull` wrote.

    Raises:
        DataFileError: There is no such file, or it is damaged.
    """
    arrays = load_arrays(folder / HULL_ARRAYS)
    names = ("center", "vertices", "faces", "cut", "tolerance")
    if arrays is None or not set(names) <= set(arrays):
        raise DataFileError(f"{folder / HULL_ARRAYS}: found no hull; accepted: a whole file")
    center, vertices, faces, cut, tolerance = (arrays[name] for name in names)
    return WorkspaceHull(center, vertices, faces, cut, float(tolerance))

"""Another way to draw a workspace: its hull, seen from a centre."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.sweeps import load_arrays, store_arrays
from cdpr_drake.analyses.workspaces.conditions import KINDS, Poses
from cdpr_drake.analyses.workspaces.question import WorkspaceQuestion
from cdpr_drake.arrays import Array
from cdpr_drake.errors import DataFileError, WorkspaceError
from cdpr_drake.models import Robot
from cdpr_drake.spatial import rotation_from_angles
from cdpr_drake.workspaces import WorkspaceHull, workspace_hull

HULL_ARRAYS = "hull.npz"
"""File of a hull's triangles."""


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
        WorkspaceError: As `workspaces.workspace_hull`, or the robot does not move in space.
    """
    if robot.motion_type().num_moves < 3:
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

"""The hull of a workspace, seen from a centre."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.frame.folder import Folder, load_arrays
from cdpr_drake.analyses.workspaces.conditions import KINDS, SURVIVES, PoseConditions, Poses
from cdpr_drake.arrays import Array
from cdpr_drake.errors import DataFileError, WorkspaceError
from cdpr_drake.geometry.poses import rotation_from_angles
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.workspaces.hull import FIRST_STEPS, WorkspaceHull, workspace_hull

HULL_ARRAYS = "hull.npz"
"""File of a hull's triangles, with the arrays `NAMES`."""

NAMES = ("center", "vertices", "faces", "cut", "tolerance")

REACH = 10
"""Where nothing bounds a hull, rays are followed to a box so many times as large as that of the
frame, about the same middle."""

FRAME, BOX, NOTHING = "frame", "box", "nothing"
"""What bounds a hull."""


@dataclass(frozen=True, eq=False)
class HullBound:
    """What bounds the rays of a hull, why, and the box at which they end, shape (3,) each [m]."""

    kind: str
    why: str
    lower: Array
    upper: Array


def hull_bound(
    robot: Robot, region: tuple[Array, Array] | None = None, unbounded: bool = False
) -> HullBound:
    """What bounds the hull of a robot: a region, else its frame, unless that was assumed."""
    lower, upper = np.asarray(robot.frame.lower, float), np.asarray(robot.frame.upper, float)
    if region is not None:
        return HullBound(BOX, "as was asked for", *region)
    if not unbounded and not robot.frame.assumed:
        return HullBound(FRAME, "which the robot's file gives", lower, upper)
    why = "as was asked for" if unbounded else "as the robot's frame was assumed"
    middle, half = 0.5 * (lower + upper), 0.5 * REACH * np.max(upper - lower) * np.ones(3)
    return HullBound(NOTHING, why, middle - half, middle + half)


def robot_hull(
    robot: Robot, about: PoseConditions, kinds: Sequence[str], center: Array | Sequence[float],
    bound: HullBound | None = None, *, angles: Array | None = None, rule: str = "all",
    rays: int = 10_000, tolerance: float = 1e-3,
) -> WorkspaceHull:  # fmt: skip
    """The hull of the positions where all of some kinds hold.

    Args:
        robot: The robot, for its frame and motion.
        about: What the kinds know of it.
        kinds: Names of `KINDS`.
        center: Where rays begin, shape (3,) [m].
        bound: Where rays end at the latest; None: as `hull_bound` says of the robot.
        angles: Orientations, shape (k, 3) [rad]; None: unturned.
        rule: "all" or "any" of the orientations.
        rays: How many, at most.
        tolerance: How near to the border of the workspace they end [m].

    Raises:
        WorkspaceError: As `workspaces.hull.workspace_hull`, a kind is known at the poses of its
            grid only, or the robot does not move in space.
    """
    for name in kinds:
        if name in ("stable", SURVIVES):
            raise WorkspaceError(f"hull: found kinds {name}; accepted: kinds other than that")
    if robot.motion_type().num_moves < 3:
        raise WorkspaceError(
            f"hull: found the planar robot {robot.name}; accepted: robots that move in space"
        )
    rows = np.zeros((1, 3)) if angles is None else angles
    turns = [rotation_from_angles(row).matrix() for row in rows]

    def holds(positions: Array) -> np.ndarray:
        n = len(positions)
        each = [
            np.all([KINDS[name].value(about, at) for name in kinds], axis=0)
            for at in (Poses(0, n, positions, np.tile(turn, (n, 1, 1))) for turn in turns)
        ]
        return np.asarray((np.all if rule == "all" else np.any)(each, axis=0))

    bound = hull_bound(robot) if bound is None else bound
    endless = bound.kind == NOTHING
    return workspace_hull(
        holds, np.asarray(center, float), bound.lower, bound.upper, rays=rays,
        tolerance=tolerance, steps=FIRST_STEPS * (REACH if endless else 1),
        likely=(robot.frame.lower, robot.frame.upper) if endless else None,
    )  # fmt: skip


def hull_numbers(hull: WorkspaceHull, bound: HullBound) -> dict[str, Any]:
    """Volume, area, centroid and what bounded it for JSON."""
    return {
        "bounded_by": bound.kind, "why": bound.why,
        "rays_end_at_lower_m": bound.lower.tolist(), "at_upper_m": bound.upper.tolist(),
        "center_m": hull.center.tolist(), "rays": len(hull.vertices),
        "rays_to_the_bound": int(np.count_nonzero(hull.cut)), "tolerance_m": hull.tolerance,
        "volume_m3": hull.volume, "area_m2": hull.area, "centroid_m": hull.centroid.tolist(),
    }  # fmt: skip


def save_hull(hull: WorkspaceHull, folder: Folder) -> None:
    """Writes `HULL_ARRAYS`."""
    folder.write_arrays(HULL_ARRAYS, {name: np.asarray(getattr(hull, name)) for name in NAMES})


def load_hull(folder: Path) -> WorkspaceHull:
    """Reads what `save_hull` wrote.

    Raises:
        DataFileError: There is no such file, or it is damaged.
    """
    arrays = load_arrays(folder / HULL_ARRAYS)
    if arrays is None or not set(NAMES) <= set(arrays):
        raise DataFileError(f"{folder / HULL_ARRAYS}: found no hull; accepted: a whole file")
    center, vertices, faces, cut, tolerance = (arrays[name] for name in NAMES)
    return WorkspaceHull(center, vertices, faces, cut, float(tolerance))

"""Whether boxes that are proven, a grid and a hull of the same workspace say the same."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.proofs.box_expansion_kernel import INSIDE, NUMBERS, OPEN
from cdpr_drake.proofs.certified_boxes import CertifiedBoxes
from cdpr_drake.workspaces.hull import WorkspaceHull
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid


@dataclass(frozen=True, eq=False)
class BoxAgreement:
    """What boxes say of poses that were judged by themselves.

    Attributes:
        poses: How many poses were looked at.
        inside: How many of them lie in a box that is proven inside.
        outside: How many lie in one that is proven outside.
        broken: Poses of which a box says what is not so, shape (k, 6) [m, rad]; there must be none.
    """

    poses: int
    inside: int
    outside: int
    broken: Array


@njit(cache=True)
def _mark_grid(
    poses: Array, halves: Array, verdicts: np.ndarray, x: Array, y: Array, z: Array, angles: Array,
    inside: np.ndarray, outside: np.ndarray,
) -> None:  # fmt: skip
    """Sets the grid points, shape (k, nx, ny, nz), that lie in boxes of each verdict."""
    for box in range(poses.shape[0]):
        if verdicts[box] == OPEN:
            continue
        pose, half = poses[box], halves[box]
        x0, x1 = (
            np.searchsorted(x, pose[0] - half[0]),
            np.searchsorted(x, pose[0] + half[0], "right"),
        )
        y0, y1 = (
            np.searchsorted(y, pose[1] - half[1]),
            np.searchsorted(y, pose[1] + half[1], "right"),
        )
        z0, z1 = (
            np.searchsorted(z, pose[2] - half[2]),
            np.searchsorted(z, pose[2] + half[2], "right"),
        )
        marks = inside if verdicts[box] == INSIDE else outside
        for turn in range(angles.shape[0]):
            within = True
            for k in range(3):
                within = within and abs(angles[turn, k] - pose[3 + k]) <= half[3 + k]
            if within:
                marks[turn, x0:x1, y0:y1, z0:z1] = True


def grid_agreement(found: CertifiedBoxes, grid: WorkspaceGrid, holds: np.ndarray) -> BoxAgreement:
    """Compares every pose of a grid with every box that it lies in, borders included.

    Args:
        found: The boxes.
        grid: The poses.
        holds: Which belong to the workspace, by themselves, shape `grid.shape`.
    """
    inside, outside = np.zeros(grid.shape, bool), np.zeros(grid.shape, bool)
    x, y, z = (np.ascontiguousarray(axis, float) for axis in grid.axes)
    angles = np.ascontiguousarray(grid.angles, float)
    _mark_grid(found.poses, found.halves, found.verdicts, x, y, z, angles, inside, outside)
    wrong = np.argwhere((inside & ~holds) | (outside & holds))
    broken = np.array(
        [[x[i], y[j], z[k], *angles[turn]] for turn, i, j, k in wrong.tolist()]
    ).reshape(-1, NUMBERS)
    return BoxAgreement(
        int(inside.size), int(np.count_nonzero(inside)), int(np.count_nonzero(outside)), broken
    )


@njit(cache=True)
def _mark_segments(
    poses: Array, halves: Array, verdicts: np.ndarray, starts: Array, ends: Array, angles: Array,
    inside: np.ndarray, outside: np.ndarray,
) -> None:  # fmt: skip
    """Sets the segments, starts ascending along x, that lie in one box of each verdict."""
    x = starts[:, 0].copy()
    for box in range(poses.shape[0]):
        if verdicts[box] == OPEN:
            continue
        pose, half = poses[box], halves[box]
        within = True
        for k in range(3):
            within = within and abs(angles[k] - pose[3 + k]) <= half[3 + k]
        if not within:
            continue
        first = np.searchsorted(x, pose[0] - half[0])
        for i in range(first, np.searchsorted(x, pose[0] + half[0], "right")):
            both = True
            for k in range(3):
                both = both and abs(starts[i, k] - pose[k]) <= half[k]
                both = both and abs(ends[i, k] - pose[k]) <= half[k]
            if both:
                if verdicts[box] == INSIDE:
                    inside[i] = True
                else:
                    outside[i] = True


def hull_agreement(found: CertifiedBoxes, hull: WorkspaceHull, angles: Array) -> BoxAgreement:
    """Compares the ends of a hull's rays with the boxes.

    Somewhere within the tolerance about the end of a ray that does not end at the border of the
    frame the workspace ends: no box that is proven holds all of that.

    Args:
        found: The boxes.
        hull: Its rays.
        angles: Orientation that the hull was found for, shape (3,) [rad].
    """
    ends = hull.vertices[~hull.cut]
    rays = ends - hull.center
    step = 0.5 * hull.tolerance * rays / np.linalg.norm(rays, axis=1, keepdims=True)
    order = np.argsort((ends - step)[:, 0], kind="stable")
    ends, step = ends[order], step[order]
    inside, outside = np.zeros(len(ends), bool), np.zeros(len(ends), bool)
    angles = np.ascontiguousarray(angles, float)
    _mark_segments(
        found.poses, found.halves, found.verdicts, ends - step, ends + step, angles, inside, outside
    )
    wrong = ends[inside | outside]
    broken = np.column_stack([wrong, np.tile(angles, (len(wrong), 1))])
    return BoxAgreement(
        len(ends), int(np.count_nonzero(inside)), int(np.count_nonzero(outside)), broken
    )

"""How much clearances can change within a box of poses; see the room's docstring."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.workspaces.certificate.expansion_kernel import INSIDE, OPEN, OUTSIDE, ROUNDING
from cdpr_drake.workspaces.interference import Surroundings, clearances

LEAST_PART = 0.01
"""The first part of a cable that is looked at by itself reaches at least so far [m]."""


def clearance_verdicts(
    around: Surroundings,
    clearance: float,
    point_error: float,
    poses: Array,
    halves: Array,
    rotations: Array,
) -> tuple[np.ndarray, Array]:
    """Verdicts on boxes, and which half width should be cut.

    Seen from the platform a cable turns about its anchor point: where it begins to be compared, it
    moves by little. So it is compared from `anchor_free` on, from twice as far on, and so on; what
    lies between two of these moves by at most the farther one's share of what the exit point does.

    The end of a part of a cable that is left out by its length f moves along the cable too, as the
    length l changes: at most by f / (l - shift) of the shift more. Where a cable could be shorter
    than that part, nothing is said.

    Args:
        around: What there is; cables without pulleys.
        clearance: How far cables must stay from it, more than this [m].
        point_error: How far exit and anchor points may be off together [m].
        poses: Middles, shape (k, 6) [m, rad].
        halves: Half widths, shape (k, 6) [m, rad].
        rotations: R_WP at the middles, shape (k, 3, 3).

    Returns:
        Shape (k,), and shape (k, 6).
    """
    cables = around.cables
    arm = float(np.max(np.linalg.norm(cables.p_PB, axis=0)))
    body = np.linalg.norm(around.bodies[:, 9:12], axis=1) + np.linalg.norm(
        around.bodies[:, 12:15], axis=1
    )
    reach = max(arm, float(np.max(body, initial=0.0)))
    s = halves[:, 3:].sum(axis=1)
    size = np.linalg.norm(halves[:, :3], axis=1)
    shift = size + 2.0 * s * reach + 2.0 * point_error
    anchors = poses[:, np.newaxis, :3] + np.einsum("kij,jm->kmi", rotations, cables.p_PB)
    lengths = np.linalg.norm(anchors - cables.p_WA.T, axis=2)
    shortest, longest = lengths.min(axis=1) - shift, lengths.max(axis=1)
    extent = np.linalg.norm(anchors, axis=2).max(axis=1) + np.abs(cables.p_WA).max()
    slip = ROUNDING * extent
    free = max(around.exit_free, around.anchor_free)
    gaps = clearances(around, poses[:, :3], rotations)[:, :4]
    rest = np.delete(gaps, 1, axis=1).min(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        change = shift * (1.0 + free / shortest) + slip
        swing = size + s * (longest + arm) + point_error  # of exit points seen from the platform
        near = swing / (lengths.min(axis=1) - np.maximum(shift, swing))
    sure = (shortest > free) & np.all(np.isfinite(gaps) | (gaps == np.inf), axis=1)
    inside = sure & (rest - change > clearance)
    outside = sure & (gaps.min(axis=1) + change <= clearance)
    inside &= (gaps[:, 1] - change > clearance) | _platform_clear(
        around, poses, rotations, near, clearance + point_error + slip
    )
    verdicts = np.full(len(poses), OPEN)
    verdicts[inside], verdicts[outside] = INSIDE, OUTSIDE
    stretch = halves.copy()
    stretch[:, 3:] *= reach
    return verdicts, stretch


def _platform_clear(
    around: Surroundings, poses: Array, rotations: Array, near: Array, clearance: Array
) -> np.ndarray:
    """Whether cables stay clear of the platform in the whole of each box, shape (k,).

    A point of a cable f from its anchor point moves by at most f `near`, seen from the platform. If
    the cable gets longer, what lies beyond its old length is compared with the point that has the
    same share of it, which moves by less than the exit point does, and that by less than `near`
    times the farther end of the part that it lies in.

    Args:
        around: What there is.
        poses: Middles, shape (k, 6).
        rotations: R_WP there, shape (k, 3, 3).
        near: By how much the direction of a cable can change, shape (k,); of no meaning where it is
            not positive.
        clearance: How far cables must stay from the platform there, shape (k,) [m].
    """
    if not len(around.bodies):
        return np.ones(len(poses), bool)
    A, B = (np.linalg.norm(p, axis=0).max() for p in (around.cables.p_WA, around.cables.p_PB))
    longest = A + B + np.linalg.norm(poses[:, :3], axis=1).max()
    ends = [around.anchor_free, max(2.0 * around.anchor_free, LEAST_PART)]
    while ends[-1] < longest:
        ends.append(2.0 * ends[-1])
    clear = near > 0.0
    for end, next_end in pairwise(ends):
        part = Surroundings(around.cables, around.radius, around.bodies, anchor_free=end)
        gaps = clearances(part, poses[:, :3], rotations)[:, 1]
        clear &= gaps - next_end * near > clearance
    return clear

"""How much clearances can change within a box of poses; see the room's docstring."""

from __future__ import annotations

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.workspaces.certificate.expansion_kernel import INSIDE, OPEN, OUTSIDE, ROUNDING
from cdpr_drake.workspaces.interference import Surroundings, clearances


def clearance_verdicts(
    around: Surroundings,
    clearance: float,
    point_error: float,
    poses: Array,
    halves: Array,
    rotations: Array,
) -> tuple[np.ndarray, Array]:
    """Verdicts on boxes, and which half width should be cut.

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
    shift = np.linalg.norm(halves[:, :3], axis=1) + 2.0 * s * reach + 2.0 * point_error
    anchors = poses[:, np.newaxis, :3] + np.einsum("kij,jm->kmi", rotations, cables.p_PB)
    lengths = np.linalg.norm(anchors - cables.p_WA.T, axis=2).min(axis=1) - shift
    free = max(around.exit_free, around.anchor_free)
    gaps = clearances(around, poses[:, :3], rotations)[:, :4].min(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        change = shift * (1.0 + free / lengths)
    extent = np.linalg.norm(anchors, axis=2).max(axis=1) + np.abs(cables.p_WA).max()
    change = change + ROUNDING * extent
    sure = (lengths > free) & np.isfinite(gaps)
    verdicts = np.full(len(poses), OPEN)
    verdicts[sure & (gaps - change > clearance)] = INSIDE
    verdicts[sure & (gaps + change <= clearance)] = OUTSIDE
    stretch = halves.copy()
    stretch[:, 3:] *= reach
    return verdicts, stretch

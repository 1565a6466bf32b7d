"""Platforms that do not turn as point masses, and beams."""

from __future__ import annotations

import numpy as np

from cdpr_drake.formats.draft import RobotDraft

_SAME_POINT = 1e-9
"""Anchor points nearer to each other [m] are one."""


def to_a_point(draft: RobotDraft, remarks: list[str]) -> None:
    """Puts Po of a point mass where its cables hold it.

    A platform that does not turn is held alike by cables whose two ends are shifted together.
    """
    R = np.eye(3) if draft.R_WP is None else draft.R_WP
    anchors = draft.anchor_points()
    p_PQ = anchors[:, 0].copy()
    if np.ptp(anchors, axis=1).max() > _SAME_POINT:
        p_PQ = np.zeros(3)
        remarks.append(
            f"Its cables hold a platform that does not turn, {draft.motion}, in several points; a "
            "point mass here has one, and got exit points that are shifted as much."
        )
        for cable in draft.cables:
            cable.exit_point = cable.exit_point - R @ cable.anchor_point
    for cable in draft.cables:
        cable.anchor_point = np.zeros(3)
    if np.any(p_PQ):
        remarks.append("Po was put into the point that holds the cables.")
        if draft.home_position is not None:
            draft.home_position = draft.home_position + R @ p_PQ
        if draft.plane_height is not None:
            draft.plane_height += float((R @ p_PQ)[2])
        if draft.box_center is not None:
            draft.box_center = draft.box_center - p_PQ
    if draft.center_of_mass is not None and np.any(draft.center_of_mass != p_PQ):
        remarks.append("The centre of mass of a point mass is the point that holds the cables.")
    draft.center_of_mass = np.zeros(3)


def find_beam(draft: RobotDraft) -> None:
    """Gives a beam whose file does not name its axis that of the farthest anchor point from Po."""
    anchors = draft.anchor_points()
    reach = np.linalg.norm(anchors, axis=0)
    if draft.axis is None and np.max(reach) > 0.0:
        far = int(np.argmax(reach))
        draft.axis = anchors[:, far] / reach[far]

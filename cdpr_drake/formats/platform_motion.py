"""Motion type of a platform from the joints that carry it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import RobotFileError
from cdpr_drake.formats.draft import RobotDraft

ACROSS = 1e-6
"""How far axes of joints may be off each other, or off an axis of W."""

ACCEPTED = (
    "a free body, slides across each other, or two of them and a hinge about what is across both; "
    "a mechanism file takes bodies on other joints, with their plant beside it"
)
"""Joints of a platform that robots here can have."""


def set_motion(
    path: Path, draft: RobotDraft, joints: str, along: list[Array], about: list[Array], p: Array
) -> None:
    """Gives a draft the motion type that its platform's joints leave.

    Args:
        path: The file.
        draft: The draft.
        joints: What the joints are, in words, for the refusal.
        along: Axes of slides in W, unit vectors of shape (3,).
        about: Axes of hinges in W.
        p: A point of the plane or line, shape (3,) [m].

    Raises:
        RobotFileError: No motion type has these joints; names them.
    """
    motion = _motion_of(along, about)
    if motion is None:
        raise RobotFileError(
            f"{path}: joints of the platform: found {joints}; accepted: {ACCEPTED}"
        )
    draft.motion, draft.axis = motion
    draft.origin = np.array(p, float)
    if draft.is_level():
        draft.plane_height = float(p[2])


def moved_by_joints(path: Path, what: str, joints: str) -> RobotFileError:
    """The refusal of a point of the frame that moves, or of one of the platform that turns in it.

    Args:
        path: The file.
        what: The point or tendon.
        joints: Where it was found, in words.
    """
    return RobotFileError(
        f"{path}: {what}: found {joints}; accepted: points of the world, and points of one "
        "platform; a mechanism file takes cables between other bodies, with their plant beside it"
    )


def _motion_of(along: list[Array], about: list[Array]) -> tuple[str, Array | None] | None:
    """Motion type and its axis from axes of slides and hinges in W; None where there is none."""
    if len(about) > 1 or not along:
        return None
    A = np.array(along)
    if len(along) > 3 or np.max(np.abs(A @ A.T - np.eye(len(along)))) > ACROSS:
        return None
    if len(along) == 3:
        return None if about else ("3T", None)
    if len(along) == 1:
        return None if about else ("1T", _positive(A[0]))
    normal = _positive(np.cross(A[0], A[1]))
    if not about:
        return "2T", normal
    return ("2T1R", normal) if abs(abs(normal @ about[0]) - 1.0) < ACROSS else None


def _positive(axis: Array) -> Array:
    """An axis or its opposite, the largest component above 0, exact where it is one of W."""
    axis = axis * np.sign(axis[np.argmax(np.abs(axis))])
    near = np.round(axis)
    return near if np.allclose(axis, near, atol=ACROSS) else axis

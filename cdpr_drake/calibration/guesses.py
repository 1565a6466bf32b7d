"""Where a search begins: tags from images, a tracker's frame from poses, anchors from lengths."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.calibration.parameters import CalibrationModel
from cdpr_drake.errors import CalibrationError
from cdpr_drake.geometry.poses import pose_error
from cdpr_drake.vision.mark_reading import read_corners
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import PointTarget

FAR, FAR_TURNED = 0.08, 0.4
"""Poses by lengths and by images differ by less, in places [m] and turns [rad] together, where
points of the robot are off by centimetres."""


def guessed_tags(
    model: CalibrationModel,
    poses: Sequence[RigidTransform],
    targets: dict[int, PointTarget],
    uv: Array,
    pinhole: Pinhole,
) -> dict[int, RigidTransform]:
    """Where tags are, X_WT [m], from images at poses X_WP: the middle of what each image tells.

    Args:
        model: The robot, its camera's pose as believed.
        poses: Where the platform is believed to have been [m].
        targets: The tags by their numbers.
        uv: Images of their corners, shape (k, tags, 4, 2) [px]; NaN where there are none.
        pinhole: The camera.

    Raises:
        CalibrationError: A tag is in no image.
    """
    tags, uv, pinhole = {}, read_corners(uv, pinhole), pinhole.ideal
    for t, (tag, target) in enumerate(targets.items()):
        seen = []
        for X_WP, corners in zip(poses, uv[:, t], strict=True):
            if np.isfinite(corners).all():
                X_CT = target.solve(corners.ravel(), pinhole)
                if X_CT is not None:
                    seen.append(X_WP @ model.X_PC @ X_CT)
        if not seen:
            raise CalibrationError(f"tag {tag}: found in no image; accepted: at least in one")
        tags[tag] = _middle(seen)
    return tags


def poses_by_tags(
    model: CalibrationModel,
    poses: Sequence[RigidTransform],
    targets: dict[int, PointTarget],
    uv: Array,
    pinhole: Pinhole,
) -> list[RigidTransform]:
    """Poses X_WP, those that images contradict replaced by what images tell.

    Lengths of cables have several poses each, and a search from afar may end in a wrong one; tags
    that are in most images tell which. Arguments as for `guessed_tags`, with a model that has tags.
    """
    agreed, uv, pinhole = [], read_corners(uv, pinhole), pinhole.ideal
    for X_WP, corners in zip(poses, uv, strict=True):
        told = []
        for (tag, target), one in zip(targets.items(), corners, strict=True):
            X_CT = target.solve(one.ravel(), pinhole) if np.isfinite(one).all() else None
            if X_CT is not None:
                told.append(model.tags[tag] @ (model.X_PC @ X_CT).inverse())
        errors = [pose_error(X_WP, X) for X in told]
        if told and min(d / FAR + a / FAR_TURNED for d, a in errors) > 1.0:
            X_WP = _middle(told)
        agreed.append(X_WP)
    return agreed


def guessed_tracker(
    model: CalibrationModel,
    poses: Sequence[RigidTransform],
    tracked: Sequence[RigidTransform | None],
    unknown: Sequence[str],
) -> CalibrationModel:
    """A model with guesses of a tracker's frame X_WK and marker X_PM [m].

    Args:
        model: The robot; what is not unknown is as it says.
        poses: Where the platform is believed to have been, X_WP [m].
        tracked: What the tracker told there, X_KM [m]; None where it did not.
        unknown: "tracker", "marker" or both.

    Raises:
        CalibrationError: Nothing was tracked.

    Source: Shah, Solving the robot-world/hand-eye calibration problem using the Kronecker product,
    2013, for both.
    """
    pairs = [(X, Y) for X, Y in zip(poses, tracked, strict=True) if Y is not None]
    if not pairs:
        raise CalibrationError("tracked poses: found none; accepted: at least one")
    if len(unknown) == 2:
        X_WK, X_PM = _both_frames(pairs)
        return replace(model, X_WK=X_WK, X_PM=X_PM)
    if "tracker" in unknown:
        X_MP = model.X_PM.inverse()
        return replace(model, X_WK=_middle([X @ (Y @ X_MP).inverse() for X, Y in pairs]))
    return replace(model, X_PM=_middle([X.inverse() @ model.X_WK @ Y for X, Y in pairs]))


def _both_frames(
    pairs: Sequence[tuple[RigidTransform, RigidTransform]],
) -> tuple[RigidTransform, RigidTransform]:
    """The least-squares X_WK and X_PM of X_WP X_PM = X_WK X_KM."""
    K = np.zeros((9, 9))
    for X_WP, X_KM in pairs:
        K += np.kron(X_KM.rotation().matrix().T, X_WP.rotation().matrix().T)
    U, _, Vt = np.linalg.svd(K)
    turns = []
    for v in (Vt[0], U[:, 0]):
        R = v.reshape(3, 3).T  # columns one after the other
        turns.append(RotationMatrix.ProjectToRotationMatrix(R * np.sign(np.linalg.det(R))))
    R_WK, R_PM = turns
    rows = np.vstack([np.hstack([X.rotation().matrix(), -np.eye(3)]) for X, _ in pairs])
    right = np.concatenate([R_WK @ Y.translation() - X.translation() for X, Y in pairs])
    p = np.linalg.lstsq(rows, right, rcond=None)[0]
    return RigidTransform(R_WK, p[3:]), RigidTransform(R_PM, p[:3])


def unfolded_points(lengths: Array, dimension: int) -> tuple[Array, Array] | None:
    """Anchors and places of a point mass from whole cable lengths alone, in some frame, mirrored or
    not; None: the lengths do not tell them.

    Differences of squared lengths against the first cable are bilinear in places and anchors, so
    their centred table has the rank of the space, and its factors are both but for an affine map.
    The map follows from the squared lengths themselves, which are linear in its square.

    Args:
        lengths: Shape (k, m) [m].
        dimension: Of the space in which the mass moves, d.

    Returns:
        Anchors, shape (m, d), and places, shape (k, d) [m].

    Source: Pollefeys and Nister, Direct computation of sound and microphone locations from
    time-difference-of-arrival data, 2008.
    """
    d, squared = dimension, lengths**2
    one, two = np.triu_indices(d)
    if lengths.shape[1] <= d or len(lengths) <= len(one) + d + 1:
        return None
    table = squared[:, 1:] - squared[:, :1]
    U, s, Vt = np.linalg.svd(table - table.mean(axis=0), full_matrices=False)
    Y = U[:, :d] * s[:d]
    twice = np.where(one == two, 1.0, 2.0)
    rows = np.column_stack([twice * Y[:, one] * Y[:, two], 2.0 * Y, np.ones(len(Y))])
    size = np.linalg.norm(rows, axis=0)
    if np.min(size) == 0.0:
        return None
    found = np.linalg.lstsq(rows / size, squared[:, 0], rcond=None)[0] / size
    S = np.empty((d, d))
    S[one, two] = S[two, one] = found[: len(one)]
    try:
        T = np.linalg.cholesky(S)
    except np.linalg.LinAlgError:
        return None
    anchors = np.zeros((lengths.shape[1], d))
    anchors[1:] = -0.5 * np.linalg.solve(T, Vt[:d]).T
    return anchors, Y @ T + np.linalg.solve(T, found[len(one) : len(one) + d])


def _middle(poses: Sequence[RigidTransform]) -> RigidTransform:
    """Median of places and of rotations [m]."""
    place = np.median([X.translation() for X in poses], axis=0)
    turn = np.median([X.rotation().matrix() for X in poses], axis=0)
    return RigidTransform(RotationMatrix.ProjectToRotationMatrix(turn), place)


def with_tags(model: CalibrationModel, tags: dict[int, RigidTransform]) -> CalibrationModel:
    """A model with these tags beside, or in the place of, those that it has."""
    return replace(model, tags=model.tags | tags)

"""Where a search begins: poses from lengths, tags from images."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.calibration.elimination import LeastSquares, Minimum, Prior, minimize
from cdpr_drake.calibration.parameters import CalibrationModel, parameter_layout
from cdpr_drake.calibration.stations import Point, Stations
from cdpr_drake.calibration.terms import Term
from cdpr_drake.errors import CalibrationError
from cdpr_drake.spatial import pose_error, rotation_from_vector
from cdpr_drake.vision import Pinhole, PointTarget

UNUSUAL = 10.0
"""A pose whose squares are this many times the median's is sought again from turned starts."""

TURNS = (-0.6, -0.25, 0.25, 0.6)
"""By these angles [rad]."""

FAR, FAR_TURNED = 0.08, 0.4
"""Poses by lengths and by images differ by less, in places [m] and turns [rad] together, where
points of the robot are off by centimetres."""


def guessed_stations(
    model: CalibrationModel,
    terms: Sequence[Term],
    count: int,
    first: RigidTransform,
    *,
    tensions: Array | None = None,
    planar: bool = False,
    sure: bool = True,
) -> Stations:
    """Poses that fit what was measured, each found from the one before.

    Args:
        model: The robot as it is believed.
        terms: What was measured: lengths, and whatever else tells poses.
        count: Number of poses k.
        first: Where the search for the first one begins, X_WP [m].
        tensions: Guesses of the tensions, shape (k, m) [N], if a term needs them.
        planar: Whether the platform slides in a plane.
        sure: Whether the model is nearly right: poses that fit worse than others are then sought
            from further starts. Else each stays near the one before, as whatever is off shifts all
            of them alike.

    Raises:
        CalibrationError: What was measured at a pose does not determine it.
    """
    layout = parameter_layout(model)
    free = np.zeros(layout.size, dtype=bool)
    prior = Prior(model, np.full(layout.size, np.inf))

    def fitted(k: int, starts: Sequence[RigidTransform]) -> Minimum:
        mine = tuple(term.only(slice(k, k + 1)) for term in terms)
        problem = LeastSquares(mine, free, prior, planar)
        t = None if tensions is None else tensions[k : k + 1]
        ends = [minimize(problem, Point(model, Stations.at([X], t), layout)) for X in starts]
        return min(ends, key=lambda one: one.cost)

    found, X_WP = [], first
    for k in range(count):
        found.append(fitted(k, [X_WP] if X_WP is first or not sure else [X_WP, first]))
        X_WP = _pose(found[-1])
    usual = float(np.median([one.cost for one in found]))
    for k, one in enumerate(found):
        if sure and one.cost > UNUSUAL * usual:  # perhaps a wrong minimum
            starts = [_pose(one), *(X for Y in (first, _pose(one)) for X in _turned(Y, planar))]
            found[k] = fitted(k, starts)
    at = [one.at.stations for one in found]
    t = None
    if tensions is not None:
        t = np.concatenate([one.tensions for one in at if one.tensions is not None])
    return Stations(np.concatenate([one.R for one in at]), np.concatenate([one.p for one in at]), t)


def _pose(found: Minimum) -> RigidTransform:
    return found.at.stations.poses()[0]


def _turned(X: RigidTransform, planar: bool) -> list[RigidTransform]:
    """A pose turned to both sides about each axis in which the platform turns."""
    axes = np.eye(3)[2:] if planar else np.eye(3)
    return [
        RigidTransform(rotation_from_vector(angle * axis) @ X.rotation(), X.translation())
        for axis in axes
        for angle in TURNS
    ]


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
    tags = {}
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
    agreed = []
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


def _middle(poses: Sequence[RigidTransform]) -> RigidTransform:
    """Median of places and of rotations [m]."""
    place = np.median([X.translation() for X in poses], axis=0)
    turn = np.median([X.rotation().matrix() for X in poses], axis=0)
    return RigidTransform(RotationMatrix.ProjectToRotationMatrix(turn), place)


def with_tags(model: CalibrationModel, tags: dict[int, RigidTransform]) -> CalibrationModel:
    """A model with these tags beside, or in the place of, those that it has."""
    return replace(model, tags=model.tags | tags)

"""Where a search begins: poses from lengths, tags from images."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.calibration.elimination import LeastSquares, Prior, minimize
from cdpr_drake.calibration.parameters import CalibrationModel, parameter_layout
from cdpr_drake.calibration.stations import Point, Stations
from cdpr_drake.calibration.terms import Term
from cdpr_drake.errors import CalibrationError
from cdpr_drake.vision import Pinhole, PointTarget


def guessed_stations(
    model: CalibrationModel,
    terms: Sequence[Term],
    count: int,
    first: RigidTransform,
    *,
    tensions: Array | None = None,
    planar: bool = False,
) -> Stations:
    """Poses that fit what was measured, each found from the one before.

    Args:
        model: The robot as it is believed.
        terms: What was measured: lengths, and whatever else tells poses.
        count: Number of poses k.
        first: Where the search for the first one begins, X_WP [m].
        tensions: Guesses of the tensions, shape (k, m) [N], if a term needs them.
        planar: Whether the platform slides in a plane.

    Raises:
        CalibrationError: What was measured at a pose does not determine it.
    """
    layout = parameter_layout(model)
    free = np.zeros(layout.size, dtype=bool)
    prior = Prior(model, np.full(layout.size, np.inf))
    found, X_WP = [], first
    for k in range(count):
        mine = tuple(term.only(slice(k, k + 1)) for term in terms)
        start = Stations.at([X_WP], None if tensions is None else tensions[k : k + 1])
        problem = LeastSquares(mine, free, prior, planar)
        best = minimize(problem, Point(model, start, layout))
        X_WP = best.at.stations.poses()[0]
        found.append(best.at.stations)
    t = (
        None
        if tensions is None
        else np.concatenate([s.tensions for s in found if s.tensions is not None])
    )
    return Stations(np.concatenate([s.R for s in found]), np.concatenate([s.p for s in found]), t)


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
        place = np.median([X.translation() for X in seen], axis=0)
        turn = np.median([X.rotation().matrix() for X in seen], axis=0)
        tags[tag] = RigidTransform(RotationMatrix.ProjectToRotationMatrix(turn), place)
    return tags


def with_tags(model: CalibrationModel, tags: dict[int, RigidTransform]) -> CalibrationModel:
    """A model with these tags beside, or in the place of, those that it has."""
    return replace(model, tags=model.tags | tags)

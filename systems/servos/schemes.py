"""The visual servoing schemes that a scenario can name; a new one is one entry of `SCHEMES`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.errors import VisualFeatureError
from cdpr_drake.features import (
    CameraPoseFeatures,
    CircleFeatures,
    DepthRule,
    HybridFeatures,
    ObjectPoseFeatures,
    PointFeatures,
    Sighting,
    VisualFeatures,
    WithoutFeature,
    sighting,
)
from cdpr_drake.vision import CircleTarget, PointTarget, Target


class FeatureSettings(Protocol):
    """What schemes make features from; `ControllerSettings` is one."""

    scheme: str
    depth: str
    depth_estimate: float
    points: Array | None
    free_rotation: bool


SchemeFactory = Callable[[FeatureSettings, Target, RigidTransform], VisualFeatures]
"""Makes the features of a scheme for a target and its desired pose in the camera.

Raises VisualFeatureError where the target does not have what the scheme needs.
"""


def _depth(settings: FeatureSettings) -> DepthRule:
    return DepthRule(settings.depth, settings.depth_estimate)


def _with_pose(target: Target, scheme: str) -> None:
    if isinstance(target, CircleTarget):
        raise VisualFeatureError(
            f"controller.scheme: found {scheme} on circles, whose rotation about their middle is "
            "not seen; accepted: circles, or a target of another kind"
        )


def _pbvs(c: FeatureSettings, target: Target, X_CdO: RigidTransform) -> VisualFeatures:
    _with_pose(target, c.scheme)
    return ObjectPoseFeatures(X_CdO)


def _pbvs_line(c: FeatureSettings, target: Target, X_CdO: RigidTransform) -> VisualFeatures:
    _with_pose(target, c.scheme)
    return CameraPoseFeatures(X_CdO)


def _hybrid(c: FeatureSettings, target: Target, X_CdO: RigidTransform) -> VisualFeatures:
    _with_pose(target, c.scheme)
    return HybridFeatures(X_CdO, _depth(c))


def _ibvs(c: FeatureSettings, target: Target, X_CdO: RigidTransform) -> VisualFeatures:
    if not isinstance(target, PointTarget):
        raise VisualFeatureError(
            "controller.scheme: found ibvs on circles; accepted: circles, or a target with points"
        )
    chosen = None
    count = target.points.shape[1]
    if c.points is not None:
        chosen = tuple(int(number) for number in c.points)
        if np.any(c.points != np.round(c.points)) or np.any(c.points >= count):
            raise VisualFeatureError(
                f"controller.points: found {c.points.tolist()}; accepted: whole numbers below "
                f"{count}, the target's points"
            )
        if len(set(chosen)) != len(chosen):
            raise VisualFeatureError(
                f"controller.points: found {list(chosen)}; accepted: each point once"
            )
    try:
        return PointFeatures(target.points, X_CdO, _depth(c), chosen)
    except VisualFeatureError as problem:
        raise VisualFeatureError(f"controller.points: {problem}") from problem


def _circles(c: FeatureSettings, target: Target, X_CdO: RigidTransform) -> VisualFeatures:
    if not isinstance(target, CircleTarget):
        raise VisualFeatureError(
            "controller.scheme: found circles on a target without; accepted: target.kind=circles"
        )
    axis, p = X_CdO.rotation().matrix()[:, 2], X_CdO.translation()
    if np.hypot(axis[0], axis[1]) > 1e-9 or np.hypot(p[0], p[1]) > 1e-9:
        raise VisualFeatureError(
            "desired: found circles beside or tilted to the optical axis, where a rotation about "
            "it would be seen; accepted: position (0, 0, z), phi = 180, theta = 0"
        )
    return CircleFeatures(target.radii, X_CdO, _depth(c))


SCHEMES: dict[str, SchemeFactory] = {
    "pbvs": _pbvs,
    "pbvs-line": _pbvs_line,
    "2.5d": _hybrid,
    "ibvs": _ibvs,
    "circles": _circles,
}
"""By the name that a scenario gives as `controller.scheme`."""


def make_features(c: FeatureSettings, target: Target, X_CdO: RigidTransform) -> VisualFeatures:
    """The features that a controller uses.

    Raises:
        VisualFeatureError: The target does not have what they need; names the field.
    """
    features = SCHEMES[c.scheme](c, target, X_CdO)
    if not c.free_rotation:
        return features
    if c.scheme in ("ibvs", "circles"):
        raise VisualFeatureError(
            f"controller.free_rotation: found true with {c.scheme}; accepted with: pbvs, "
            "pbvs-line, 2.5d (circles leave it free anyway)"
        )
    return WithoutFeature(features)


def ideal_sighting(target: Target, X_CO: RigidTransform) -> Sighting:
    """What an endless noiseless image shows of a target at a pose in front of the camera."""
    return sighting(X_CO, target.ideal_marks(X_CO))

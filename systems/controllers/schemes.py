"""The visual servoing schemes that a scenario can name; a new one is one entry of `SCHEMES`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.errors import VisualFeatureError
from cdpr_drake.servoing.combined_features import PartitionedFeatures, SwitchedFeatures
from cdpr_drake.servoing.visual_features import (
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
from cdpr_drake.vision.rings import CircleTarget
from cdpr_drake.vision.target import PointTarget, Target


class PartitionChoice(Protocol):
    """What `partitioned` asks of its settings."""

    @property
    def segment(self) -> Array | None:
        """Numbers of two points, shape (2,); None: the longest segment."""


class SwitchChoice(Protocol):
    """What `switching` asks of its settings."""

    @property
    def pose(self) -> str:
        """The pose-based scheme: "pbvs-line" or "pbvs"."""


class FeatureSettings(Protocol):
    """What schemes make features from; `ControllerSettings` is one."""

    scheme: str
    depth: str
    depth_estimate: float
    points: Array | None
    free_rotation: bool

    @property
    def partition(self) -> PartitionChoice | None:
        """Of `partitioned`; None: its defaults."""

    @property
    def switching(self) -> SwitchChoice | None:
        """Of `switching`; None: its defaults."""


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


def _points(c: FeatureSettings, target: Target) -> tuple[Array, tuple[int, ...] | None]:
    """Points of a target, shape (3, n) [m], and numbers of those that are chosen."""
    if not isinstance(target, PointTarget):
        raise VisualFeatureError(
            f"controller.scheme: found {c.scheme} on circles; accepted: circles, or a target with "
            "points"
        )
    if c.points is None:
        return target.points, None
    count = target.points.shape[1]
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
    return target.points, chosen


def _ibvs(c: FeatureSettings, target: Target, X_CdO: RigidTransform) -> PointFeatures:
    points, chosen = _points(c, target)
    try:
        return PointFeatures(points, X_CdO, _depth(c), chosen)
    except VisualFeatureError as problem:
        raise VisualFeatureError(f"controller.points: {problem}") from problem


def _partitioned(c: FeatureSettings, target: Target, X_CdO: RigidTransform) -> VisualFeatures:
    points = _ibvs(c, target, X_CdO)
    asked = None if c.partition is None else c.partition.segment
    segment = None if asked is None else (int(asked[0]), int(asked[1]))
    if asked is not None and np.any(asked != np.round(asked)):
        raise VisualFeatureError(
            f"controller.partition.segment: found {asked.tolist()}; accepted: whole numbers"
        )
    try:
        return PartitionedFeatures(points, segment)
    except VisualFeatureError as problem:
        at = "partition." if str(problem).startswith("segment") else "points: "
        raise VisualFeatureError(f"controller.{at}{problem}") from problem


def _switching(c: FeatureSettings, target: Target, X_CdO: RigidTransform) -> VisualFeatures:
    of_camera = c.switching is None or c.switching.pose == "pbvs-line"
    return SwitchedFeatures(_ibvs(c, target, X_CdO), of_camera)


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
    "partitioned": _partitioned,
    "switching": _switching,
}
"""By the name that a scenario gives as `controller.scheme`."""


def make_features(c: FeatureSettings, target: Target, X_CdO: RigidTransform) -> VisualFeatures:
    """The features that a controller uses.

    Raises:
        VisualFeatureError: The target does not have what they need; names the field.
    """
    for scheme, section in (("partitioned", "partition"), ("switching", "switching")):
        if c.scheme != scheme and getattr(c, section) is not None:
            raise VisualFeatureError(
                f"controller.{section}: found a section with {c.scheme}; accepted with: {scheme}"
            )
    features = SCHEMES[c.scheme](c, target, X_CdO)
    if not c.free_rotation:
        return features
    if c.scheme in ("ibvs", "circles", "partitioned", "switching"):
        raise VisualFeatureError(
            f"controller.free_rotation: found true with {c.scheme}; accepted with: pbvs, "
            "pbvs-line, 2.5d (circles leave it free anyway)"
        )
    return WithoutFeature(features)


def ideal_sighting(target: Target, X_CO: RigidTransform) -> Sighting:
    """What an endless noiseless image shows of a target at a pose in front of the camera."""
    return sighting(X_CO, target.ideal_marks(X_CO))

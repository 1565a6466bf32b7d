"""The features that a visual servo can control, as objects with one interface."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.servoing.circle_features import plane_of
from cdpr_drake.servoing.packed_features_kernel import (
    CENTER,
    MARKS,
    camera_pose_packed,
    circles_packed,
    hybrid_packed,
    object_pose_packed,
    points_packed,
)
from cdpr_drake.servoing.point_features import check_points
from cdpr_drake.servoing.pose_features import pose_arrays

OPTICAL_AXIS = 2
"""Row of theta u_z in the pose features and in the 2 1/2 D feature."""

POSE_NAMES = ("rx_rad", "ry_rad", "rz_rad", "x_m", "y_m", "z_m")
HYBRID_NAMES = ("xo", "yo", "rz_rad", "x_m", "y_m", "z_m")
ELLIPSE_NAMES = ("x", "y", "n20", "n11", "n02")


@dataclass(frozen=True)
class Sighting:
    """What a camera makes of one image.

    Attributes:
        R_CO: Rotation of the object O in the camera frame C, shape (3, 3).
        p_CO: Its position there, shape (3,) [m].
        center: Image of the object's origin at unit focal length, shape (2,) [-].
        marks: Points, shape (2, n), or ellipses, shape (n, 5), at unit focal length [-]; empty
            where the features need none.
    """

    R_CO: Array
    p_CO: Array
    center: Array
    marks: Array


def sighting(X_CO: RigidTransform, marks: Array) -> Sighting:
    """A sighting whose centre is that of the pose."""
    R, p = pose_arrays(X_CO)
    return Sighting(R, p, p[:2] / p[2], marks)


@dataclass(frozen=True)
class PackedFeatures:
    """Features as a kernel computes them, see `packed_features_kernel`.

    Attributes:
        kernel: What computes.
        numbers: Its first argument.
        size: Features that it writes.
        dropped: Row of them that is left out afterwards; -1: none.
    """

    kernel: Any
    numbers: Array
    size: int
    dropped: int = -1


@dataclass(frozen=True)
class DepthRule:
    """Where the depth in an interaction matrix comes from, which images do not show.

    Attributes:
        kind: "pose" measures it now, "desired" takes that of the desired pose, "constant" a guess.
        value: The guess [m].
    """

    kind: str = "pose"
    value: float = np.nan

    def fixed(self, desired: Array) -> Array:
        """Depths as numbers for a kernel: NaN where they are those of now, shape (n,) [m].

        Args:
            desired: Those of the desired pose, shape (n,) [m].
        """
        if self.kind == "desired":
            return desired
        return np.full(np.shape(desired), np.nan if self.kind == "pose" else self.value)


class VisualFeatures(ABC):
    """Features s of an image, with ds/dt = L @ V_C for an object at rest.

    Attributes:
        names: One name a feature, with its unit; without one, it has none.
        rank: Motions of the camera that they control, 6 or 5.
        uses_center: Whether they look at a sighting's centre; else it may be anything.
        uses_marks: Whether they look at its marks.
    """

    names: tuple[str, ...]
    rank: int = 6
    uses_center: bool = False
    uses_marks: bool = False

    def units(self) -> tuple[str, ...]:
        """ "rad", "m" or "" for each feature."""
        return tuple(name.partition("_")[2] if name in POSE_NAMES else "" for name in self.names)

    @abstractmethod
    def evaluate(self, seen: Sighting) -> tuple[Array, Array]:
        """s, shape (k,), and L, shape (k, 6)."""

    def packed(self) -> PackedFeatures | None:
        """The same as a kernel; None: only `evaluate` can say."""
        return None


class KernelFeatures(VisualFeatures):
    """Features that a kernel computes.

    Attributes:
        formula: The kernel and its numbers.
    """

    def __init__(self, formula: PackedFeatures) -> None:
        """With the kernel and its numbers."""
        self.formula = formula

    def evaluate(self, seen: Sighting) -> tuple[Array, Array]:
        """As the base class says."""
        formula = self.formula
        s, L = np.empty(formula.size), np.empty((formula.size, 6))
        formula.kernel(formula.numbers, packed_sighting(seen), s, L)
        return s, L

    def packed(self) -> PackedFeatures | None:
        """As the base class says."""
        return self.formula


class ObjectPoseFeatures(KernelFeatures):
    """PBVS with (theta u, p_CO): the object's origin moves straight in the image."""

    names = POSE_NAMES

    def __init__(self, X_CdO: RigidTransform) -> None:
        """For a desired pose of the object in the camera."""
        super().__init__(PackedFeatures(object_pose_packed, columns(X_CdO), 6))


class CameraPoseFeatures(KernelFeatures):
    """PBVS with (theta u, p_CdC): the camera moves straight."""

    names = POSE_NAMES

    def __init__(self, X_CdO: RigidTransform) -> None:
        """For a desired pose of the object in the camera."""
        super().__init__(PackedFeatures(camera_pose_packed, columns(X_CdO), 6))


class HybridFeatures(KernelFeatures):
    """2 1/2 D: the camera moves straight, and so does the object's origin in the image."""

    names = HYBRID_NAMES
    uses_center = True

    def __init__(self, X_CdO: RigidTransform, depth: DepthRule | None = None) -> None:
        """For a desired pose of the object in the camera."""
        fixed = (depth or DepthRule()).fixed(X_CdO.translation()[2:])
        numbers = np.concatenate([columns(X_CdO), fixed])
        super().__init__(PackedFeatures(hybrid_packed, numbers, 6))


class PointFeatures(KernelFeatures):
    """IBVS: images of at least three points.

    Attributes:
        X_CdO: Desired pose of the object in the camera [m].
        chosen: Numbers of the object's points that are taken.
        desired: These points in the desired camera, shape (3, n) [m].
    """

    uses_marks = True

    def __init__(
        self,
        p_OK: Array,
        X_CdO: RigidTransform,
        depth: DepthRule | None = None,
        chosen: tuple[int, ...] | None = None,
    ) -> None:
        """For points of the object, shape (3, n) [m]; `chosen` takes some of them only.

        Raises:
            VisualFeatureError: Fewer than three points, or all on one line.
        """
        self.chosen = list(range(p_OK.shape[1]) if chosen is None else chosen)
        points = np.ascontiguousarray(p_OK[:, self.chosen])
        check_points(points)
        self.X_CdO, self.desired = X_CdO, X_CdO @ points
        self.names = tuple(f"{axis}{k}" for k in self.chosen for axis in "xy")
        depths = (depth or DepthRule()).fixed(self.desired[2])
        numbers = np.vstack([np.array(self.chosen, float), points, depths]).T
        super().__init__(PackedFeatures(points_packed, np.ravel(numbers), len(self.names)))


class CircleFeatures(KernelFeatures):
    """Centre and moments of two or more concentric circles; leaves the optical axis free.

    A constant depth means a plane parallel to the image.
    """

    rank = 5
    uses_marks = True

    def __init__(self, radii: Array, X_CdO: RigidTransform, depth: DepthRule | None = None) -> None:
        """For circles of these radii [m]."""
        rule, plane = depth or DepthRule(), np.full(3, np.nan)
        if rule.kind == "desired":
            plane = plane_of(*pose_arrays(X_CdO))
        elif rule.kind != "pose":
            plane = np.array([0.0, 0.0, 1.0 / rule.value])
        self.names = tuple(f"{name}_{k}" for k in range(len(radii)) for name in ELLIPSE_NAMES)
        super().__init__(PackedFeatures(circles_packed, plane, len(self.names)))


class WithoutFeature(VisualFeatures):
    """Features with one left out, so that one motion of the camera stays free."""

    def __init__(self, features: VisualFeatures, row: int = OPTICAL_AXIS) -> None:
        """Leaves out a row; by default theta u_z, which frees the optical axis."""
        self._features, self._row = features, row
        self._kept = [k for k in range(len(features.names)) if k != row]
        self.names = tuple(features.names[k] for k in self._kept)
        self.rank = features.rank - 1
        self.uses_center, self.uses_marks = features.uses_center, features.uses_marks

    def evaluate(self, seen: Sighting) -> tuple[Array, Array]:
        """As the base class says."""
        s, L = self._features.evaluate(seen)
        return s[self._kept], L[self._kept]

    def packed(self) -> PackedFeatures | None:
        """As the base class says."""
        inner = self._features.packed()
        if inner is None or inner.dropped >= 0:
            return None
        return replace(inner, dropped=self._row)


def packed_sighting(seen: Sighting) -> Array:
    """A sighting as kernels of features take it, see `packed_features_kernel`."""
    packed = np.full(MARKS + np.size(seen.marks), np.nan)
    packed[:9].reshape(3, 3)[:] = seen.R_CO.T
    packed[9:12] = seen.p_CO
    if np.size(seen.center):
        packed[CENTER:MARKS] = seen.center
    packed[MARKS:] = np.ravel(seen.marks)
    return packed


def columns(X: RigidTransform) -> Array:
    """The matrix (3, 4) of a pose, column by column, shape (12,) [-, m]; as kernels take it."""
    return np.asarray(X.GetAsMatrix34().ravel("F"))

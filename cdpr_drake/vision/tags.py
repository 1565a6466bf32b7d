"""AprilTags as targets: one, or several as one object."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.vision.apriltag import (
    BORDERED_CELLS,
    TAG_CELLS,
    TagFinder,
    tag_corners,
    tag_png,
)
from cdpr_drake.vision.marks_kernel import crossing_diagonals, crossings_of_diagonals
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.plates import Plate
from cdpr_drake.vision.target import VISIBLE_BORDER, NormalNumbers, PointTarget, faces_camera


class TagTarget(PointTarget):
    """One AprilTag 36h11; its marks are the corners, in the order of `tag_corners`."""

    def __init__(self, tag_id: int, size: float) -> None:
        """For a tag of edge `size` [m]."""
        self.points = self.outline = tag_corners(size)
        self.size = 8
        self._finder = TagFinder([tag_id])
        self._tag_id, self._edge = tag_id, size

    def find(self, rgb: np.ndarray) -> Array | None:
        """As the base class says."""
        corners = self._finder.find(rgb).get(self._tag_id)
        return None if corners is None else corners.T.ravel()

    def center(self, marks: Array, X_CO: RigidTransform, pinhole: Pinhole) -> Array:
        """Where the diagonals meet in the image, at unit focal length, shape (2,) [-]."""
        middle = np.empty(2)
        crossing_diagonals(marks, pinhole.numbers, middle)
        return middle

    def centers(self, marks: Array, places: Array, pinhole: Pinhole) -> Array:
        """As the base class says."""
        middles = np.empty((len(marks), 2))
        crossings_of_diagonals(np.ascontiguousarray(marks), pinhole.numbers, middles)
        return middles

    def plates(self) -> list[Plate]:
        """What it looks like."""
        return [tag_plate(self._tag_id, self._edge, RigidTransform())]


class TagBundle(PointTarget):
    """Several AprilTags 36h11 fixed to one object; its pose is that of all corners in view.

    The marks are the corners tag by tag. One tag in view is enough.
    """

    def __init__(
        self, tag_ids: Sequence[int], sizes: Sequence[float], X_OTs: Sequence[RigidTransform]
    ) -> None:
        """For tags of these identities, edges [m] and poses of their frames T in O."""
        corners = [X @ tag_corners(size) for size, X in zip(sizes, X_OTs, strict=True)]
        self.points = self.outline = np.hstack(corners)
        self.size = 8 * len(corners)
        self._finder = TagFinder(tag_ids)
        self._tag_ids = list(tag_ids)
        self._X_OTs, self._edges = list(X_OTs), list(sizes)

    def find(self, rgb: np.ndarray) -> Array | None:
        """As the base class says."""
        corners = self._finder.find(rgb)
        if not corners:
            return None
        nothing = np.full((2, 4), np.nan)
        return np.concatenate([corners.get(tag, nothing).T.ravel() for tag in self._tag_ids])

    def project(
        self, X_CO: RigidTransform, pinhole: Pinhole, noise: float, random: NormalNumbers
    ) -> Array | None:
        """As the base class says; each tag is seen or not by itself."""
        uv = pinhole.project(X_CO @ self.points)
        if noise > 0.0:
            uv = uv + noise * random.standard_normal(uv.shape)
        for k, X_OT in enumerate(self._X_OTs):
            mine = slice(4 * k, 4 * k + 4)
            if not (faces_camera(X_CO @ X_OT) and pinhole.sees(uv[:, mine], VISIBLE_BORDER)):
                uv[:, mine] = np.nan
        return uv.T.ravel() if np.any(np.isfinite(uv)) else None

    def complete(self, marks: Array, X_CO: RigidTransform, pinhole: Pinhole) -> Array:
        """As the base class says."""
        if np.all(np.isfinite(marks)):
            return marks
        expected = pinhole.project(X_CO @ self.points).T.ravel()
        return np.where(np.isfinite(marks), marks, expected)

    def plates(self) -> list[Plate]:
        """What it looks like."""
        of_each = zip(self._tag_ids, self._edges, self._X_OTs, strict=True)
        return [tag_plate(tag_id, edge, X_OT) for tag_id, edge, X_OT in of_each]

    def in_view(self, X_CO: RigidTransform, pinhole: Pinhole) -> bool:
        """Whether at least one of its tags is in the image, face on."""
        return self.project(X_CO, pinhole, 0.0, np.random.default_rng(0)) is not None


def tag_plate(tag_id: int, size: float, X_OT: RigidTransform) -> Plate:
    """The plate of a tag of edge `size` [m], whose white rim adds a quarter to it."""
    return Plate(X_OT, tag_png(tag_id), size * BORDERED_CELLS / TAG_CELLS)

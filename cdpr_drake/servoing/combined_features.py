"""Features of image points with others beside them: those of partitioned and switching servoing."""

from __future__ import annotations

import numpy as np

from cdpr_drake.errors import VisualFeatureError
from cdpr_drake.servoing.packed_features_kernel import switched_packed
from cdpr_drake.servoing.partitioned_features_kernel import (
    AXIS_FEATURES,
    LEAST_AREA,
    partitioned_packed,
    polygon_size_into,
    segment_angle_into,
)
from cdpr_drake.servoing.visual_features import (
    POSE_NAMES,
    CameraPoseFeatures,
    KernelFeatures,
    ObjectPoseFeatures,
    PackedFeatures,
    PointFeatures,
)


class PartitionedFeatures(KernelFeatures):
    """Image points, and for the optical axis alpha and ln sigma against their desired values.

    The segment is the longest one of the desired image unless it is given; the polygon goes through
    all points, in the order in which they stand about their middle there.

    Source: Corke and Hutchinson, A new partitioned approach to image-based visual servo control,
    2001, which says the longest segment of now; a fixed one has no jumps.
    """

    uses_marks = True

    def __init__(self, points: PointFeatures, segment: tuple[int, int] | None = None) -> None:
        """Beside these points; `segment` has numbers of two of the chosen ones.

        Raises:
            VisualFeatureError: The points enclose no area in the desired image; a segment that is
                not of two chosen points.
        """
        kept, seen = points.chosen, points.desired
        xy = seen[:2] / seen[2]
        if segment is None:
            apart = np.linalg.norm(xy[:, :, None] - xy[:, None, :], axis=0)
            # Of equally long ones the first, whatever the last bit says.
            ends = np.argwhere(apart >= (1.0 - 1e-9) * np.max(apart))[0]
        else:
            if segment[0] == segment[1] or not set(segment) <= set(kept):
                raise VisualFeatureError(
                    f"segment: found {list(segment)}; accepted: two different ones of the points "
                    f"{list(kept)}"
                )
            ends = np.array([kept.index(number) for number in segment])
        around = xy - xy.mean(axis=1, keepdims=True)
        order = np.argsort(np.arctan2(around[1], around[0])).astype(float)
        s, L = np.append(xy.T.ravel(), [0.0, 0.0]), np.zeros((2 * len(kept) + 2, 6))
        segment_angle_into(int(ends[0]), int(ends[1]), s, L, len(s) - 2)
        polygon_size_into(order, 1.0, s, L, len(s) - 1)
        if s[-1] <= 0.5 * np.log(LEAST_AREA):
            raise VisualFeatureError(
                f"found {len(kept)} image points that enclose no area in the desired image; "
                "accepted: points that do"
            )
        # By the angle about their middle, in growing order, the area is positive.
        numbers = [*ends, s[-2], s[-1], 1.0, *order, *points.formula.numbers]
        self.names = (*points.names, "alpha_rad", "ln_sigma")
        super().__init__(PackedFeatures(partitioned_packed, np.array(numbers, float), len(s)))

    def units(self) -> tuple[str, ...]:
        """As the base class says."""
        return (*("" for _ in self.names[:-AXIS_FEATURES]), "rad", "")


class SwitchedFeatures(KernelFeatures):
    """A pose, six features, then image points: what pose-based and image-based servoing need.

    Source: Gans and Hutchinson, Stable visual servoing through hybrid switched-system control,
    2007.
    """

    uses_marks = True

    def __init__(self, points: PointFeatures, of_camera: bool = True) -> None:
        """Before these points, the pose of `CameraPoseFeatures`, or of `ObjectPoseFeatures` if not
        `of_camera`."""
        pose = (CameraPoseFeatures if of_camera else ObjectPoseFeatures)(points.X_CdO)
        numbers = [np.array([float(of_camera)]), pose.formula.numbers, points.formula.numbers]
        self.names, packed = (*POSE_NAMES, *points.names), np.concatenate(numbers)
        super().__init__(PackedFeatures(switched_packed, packed, len(self.names)))

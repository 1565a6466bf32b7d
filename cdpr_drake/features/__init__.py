"""Visual features and their interaction matrices.

A feature vector s has the interaction matrix L with ds/dt = L V_C, V_C = (w, v) the camera's twist
in C against an object at rest. Rows of mixed features come rotation first. Every interaction
matrix has one home, `interaction_kernel`, which control and the analysis of stability both call.

Source: servoing thesis 1.4; Chaumette and Hutchinson, Visual servo control I, 2006, from which the
exact forms are taken where the thesis' differ; ellipses: Chaumette, 2004.
"""

from cdpr_drake.features.circles import ELLIPSE_SIZE, circle_images, ellipses_interaction, plane_of
from cdpr_drake.features.combined_features import PartitionedFeatures, SwitchedFeatures
from cdpr_drake.features.interaction_kernel import (
    camera_pose_into,
    hybrid_into,
    object_pose_into,
    point_into,
    theta_u_into,
)
from cdpr_drake.features.packed_kernel import (
    CENTER,
    MARKS,
    call_features,
    feature_kernel,
    pose_parts,
)
from cdpr_drake.features.points import interaction_rank
from cdpr_drake.features.pose import (
    camera_pose_error,
    camera_pose_interaction,
    pose_feature_error,
    pose_interaction,
    seen_pose_error,
    theta_u_interaction,
)
from cdpr_drake.features.visual_features import (
    CameraPoseFeatures,
    CircleFeatures,
    DepthRule,
    HybridFeatures,
    ObjectPoseFeatures,
    PackedFeatures,
    PointFeatures,
    Sighting,
    VisualFeatures,
    WithoutFeature,
    columns,
    packed_sighting,
    sighting,
)

__all__ = [
    "CENTER", "ELLIPSE_SIZE", "MARKS", "CameraPoseFeatures", "CircleFeatures", "DepthRule",
    "HybridFeatures", "ObjectPoseFeatures", "PackedFeatures", "PartitionedFeatures",
    "PointFeatures", "Sighting", "SwitchedFeatures", "VisualFeatures", "WithoutFeature",
    "call_features", "camera_pose_error", "camera_pose_interaction", "camera_pose_into",
    "circle_images", "columns", "ellipses_interaction", "feature_kernel", "hybrid_into",
    "interaction_rank", "object_pose_into", "packed_sighting", "plane_of", "point_into",
    "pose_feature_error", "pose_interaction", "pose_parts", "seen_pose_error", "sighting",
    "theta_u_interaction", "theta_u_into",
]  # fmt: skip

"""The stability criterion Pi at a pose: what is asked, the matrix, its gradient, closed forms.

Source: servoing thesis (3.1), (3.8), (3.26) and 3.4; `matrix` is the plain form that the kernels
are tested against.
"""

from cdpr_drake.stability.criterion.case import (
    IBVS,
    LEVERS,
    PBVS,
    SCHEMES,
    SPATIAL_SCHEMES,
    StabilityCase,
)
from cdpr_drake.stability.criterion.closed_forms import (
    PlanarVisionLimits,
    planar_margin,
    worst_object_error,
)
from cdpr_drake.stability.criterion.desired_view import (
    FixedObject,
    FixedPlace,
    OppositeCorner,
    ServoTarget,
    TargetRows,
)
from cdpr_drake.stability.criterion.gradient_kernel import gradient, steepest_into
from cdpr_drake.stability.criterion.known_object_kernel import (
    evaluate_any,
    evaluate_quick,
    is_quick,
    pack_quick,
    quick_size,
)
from cdpr_drake.stability.criterion.matrix import ModelAtPose, stability_margin, stability_matrix
from cdpr_drake.stability.criterion.matrix_kernel import OUTSIDE, turn_after
from cdpr_drake.stability.criterion.perturbed_pose_kernel import (
    CaseArrays,
    PoseRows,
    Work,
    evaluate,
    new_work,
    prepare,
)

__all__ = [
    "IBVS", "LEVERS", "OUTSIDE", "PBVS", "SCHEMES", "SPATIAL_SCHEMES", "CaseArrays",
    "FixedObject", "FixedPlace", "ModelAtPose", "OppositeCorner", "PlanarVisionLimits",
    "PoseRows", "ServoTarget", "StabilityCase", "TargetRows", "Work", "evaluate",
    "evaluate_any", "evaluate_quick", "gradient", "is_quick", "new_work", "pack_quick",
    "planar_margin", "prepare", "quick_size", "stability_margin", "stability_matrix",
    "steepest_into", "turn_after", "worst_object_error",
]  # fmt: skip

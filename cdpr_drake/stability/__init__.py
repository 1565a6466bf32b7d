"""Where a visual servo converges although its model is wrong.

The closed loop is de/dt = -lambda Pi e with Pi = L J^+ J_hat L_hat^+ for features e, the true
robot without and the believed robot with a hat. The error falls where the symmetric part of Pi is
positive definite. `perturbations` bounds how wrong the model is, `criterion` computes Pi at a
pose, `certificate` bounds it from below over all perturbations, `verdicts` judges poses.

Source: servoing thesis chapter 3, with e in the lever of PBVS as its analysis has it, or the exact
matrix; see `LEVERS`.
"""

from cdpr_drake.stability.criterion import (
    SCHEMES,
    FixedObject,
    FixedPlace,
    ModelAtPose,
    OppositeCorner,
    PlanarVisionLimits,
    ServoTarget,
    StabilityCase,
    TargetRows,
    planar_margin,
    stability_margin,
    stability_matrix,
    worst_object_error,
)
from cdpr_drake.stability.perturbations import (
    BASELINE,
    DIRECTIONS,
    PLANAR_BASELINE,
    POSE_BLOCKS,
    RADII,
    PerturbationBounds,
    draw_perturbations,
    vector_size,
)
from cdpr_drake.stability.verdicts import (
    VERDICTS,
    StabilityChunk,
    VerdictOptions,
    judge_all_verdicts,
    judge_stability,
    some_target_possible,
    worst_perturbations,
)

__all__ = [
    "BASELINE", "DIRECTIONS", "PLANAR_BASELINE", "POSE_BLOCKS", "RADII", "SCHEMES", "VERDICTS",
    "FixedObject", "FixedPlace", "ModelAtPose", "OppositeCorner", "PerturbationBounds",
    "PlanarVisionLimits", "ServoTarget", "StabilityCase", "StabilityChunk", "TargetRows",
    "VerdictOptions", "draw_perturbations", "judge_all_verdicts", "judge_stability",
    "planar_margin", "some_target_possible", "stability_margin", "stability_matrix",
    "vector_size", "worst_object_error", "worst_perturbations",
]  # fmt: skip

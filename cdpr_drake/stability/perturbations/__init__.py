"""How wrong a servo's model may be: bounds on perturbations, and draws within them.

A perturbation is a vector of 18 + 6 m numbers: platform pose, camera pose, object pose (rotation
vector [rad], translation [m] each), exit points and anchor points [m].

Source: servoing thesis 3.2 and tables A.8 to A.18.
"""

from cdpr_drake.stability.perturbations.bounds import (
    BASELINE,
    DIRECTIONS,
    PLANAR_BASELINE,
    POSE_BLOCKS,
    RADII,
    PerturbationBounds,
    vector_size,
)
from cdpr_drake.stability.perturbations.draws_kernel import (
    COMMON,
    CORNERS,
    SINGLE,
    direction_codes,
    draw_into,
    draw_perturbations,
    draw_room,
    mixed,
    pose_bits,
    pose_key,
)

__all__ = [
    "BASELINE", "COMMON", "CORNERS", "DIRECTIONS", "PLANAR_BASELINE", "POSE_BLOCKS", "RADII",
    "SINGLE", "PerturbationBounds", "direction_codes", "draw_into", "draw_perturbations",
    "draw_room", "mixed", "pose_bits", "pose_key", "vector_size",
]  # fmt: skip

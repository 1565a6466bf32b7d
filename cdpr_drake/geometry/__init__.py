"""How cables run, and what that means for lengths, velocities and wrenches.

`CableSet` holds all constants of a robot's cables, as they are or as somebody believes them to be;
it goes whole to whoever needs it, so that pulleys are known or left out by a choice. The Jacobian
J maps the platform's spatial velocity V_WP = (w, v) to length rates, l_dot = J V_WP; by virtual
work the tensions t load the platform with W t, W = -J'. A = exit point, B = anchor point.
`MotionType` says which twists a platform has, and reduces such matrices to them.

Source: servoing thesis 1.1.2, (1.9) with the sign of the tangent point put right, (1.19); Pott,
Cable-Driven Parallel Robots, 2018, for pulleys.
"""

from cdpr_drake.geometry.cable_rates import (
    base_adjoint,
    cable_rates_from_base_twist,
    cable_rates_from_platform_twist,
)
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.motion_kernel import (
    Motion,
    cable_line,
    floating_motion,
    joint_motion,
    line_motion,
    pack_cables,
    planar_motion,
)
from cdpr_drake.geometry.motion_type import (
    FREE,
    LEVEL,
    MOTION_TYPES,
    MotionType,
    across,
    keep_free,
    write_projection,
)
from cdpr_drake.geometry.paths import (
    SHORTEST,
    CablePaths,
    cable_jacobian,
    cable_paths,
    impossible_cable,
    motion_of,
)
from cdpr_drake.geometry.platform_joint import PlatformJoint
from cdpr_drake.geometry.pulley_kernel import (
    LINEAR_WEIGHT,
    PULLEY_RADIUS,
    pulley_geometry,
    pulley_jacobian,
    pulley_line,
    tangent,
    unit_vector_derivative,
)
from cdpr_drake.geometry.straight_cables import (
    ALL_ROWS,
    PLANAR_ROWS,
    cable_lengths,
    gravity_wrench,
    length_jacobian,
    wrench_matrix,
)
from cdpr_drake.geometry.two_pulleys_kernel import (
    ANCHOR_RADIUS,
    add_platform_turning,
    begin_swivels,
)

__all__ = [
    "ALL_ROWS", "ANCHOR_RADIUS", "FREE", "LEVEL", "LINEAR_WEIGHT", "MOTION_TYPES", "PLANAR_ROWS",
    "PULLEY_RADIUS", "SHORTEST", "CablePaths", "CableSet", "Motion", "MotionType", "PlatformJoint",
    "across", "add_platform_turning", "base_adjoint", "begin_swivels", "cable_jacobian",
    "cable_lengths", "cable_line", "cable_paths", "cable_rates_from_base_twist",
    "cable_rates_from_platform_twist", "floating_motion", "gravity_wrench", "impossible_cable",
    "joint_motion", "keep_free", "length_jacobian", "line_motion", "motion_of", "pack_cables",
    "planar_motion", "pulley_geometry", "pulley_jacobian", "pulley_line", "tangent",
    "unit_vector_derivative", "wrench_matrix", "write_projection",
]  # fmt: skip

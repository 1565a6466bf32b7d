"""Which wrenches cables can give at a pose, and whether these are the ones that are asked for.

At a pose the tensions lower <= t <= upper give the wrenches W t, a zonotope. A pose is feasible
where all wrenches that are demanded of the cables, `demands`, lie in it: to bear the weight
(static), to resist a set of wrenches too (wrench-feasible), or to accelerate the platform
(dynamic). Where tensions without upper limits give every wrench, the pose has wrench closure.

Rows of W are those that the platform can move, six or fewer; moments are divided by a length,
`StaticCase.arm`, where they are compared with forces.

Source: Gazebo thesis 2.6; servoing thesis 1.2.2, (1.25); Bosscher, Riechel and Ebert-Uphoff,
Wrench-feasible workspace generation for cable-driven robots, 2006.
"""

from cdpr_drake.workspaces.wrenches.available import AvailableWrenches, available_wrenches
from cdpr_drake.workspaces.wrenches.capacity import (
    CapacityMargins,
    MarginSlopes,
    capacity_margins,
    closure_margins,
    largest_payloads,
    margin_slopes,
    scaled_matrices,
)
from cdpr_drake.workspaces.wrenches.demands import (
    Demand,
    MotionDemand,
    SpatialSet,
    accelerating,
    resisting,
    spatial_inertias,
    weight_wrenches,
)
from cdpr_drake.workspaces.wrenches.facets_kernel import (
    facet_normals,
    margin_along,
    wedge_terms,
)
from cdpr_drake.workspaces.wrenches.method_feasibility import held_by_method
from cdpr_drake.workspaces.wrenches.static_feasibility import (
    StaticCase,
    statically_feasible,
    wrench_matrices,
)

__all__ = [
    "AvailableWrenches", "CapacityMargins", "Demand", "MarginSlopes", "MotionDemand", "SpatialSet",
    "StaticCase", "accelerating", "available_wrenches", "capacity_margins", "closure_margins",
    "facet_normals", "held_by_method", "largest_payloads", "margin_along", "margin_slopes",
    "resisting", "scaled_matrices", "spatial_inertias", "statically_feasible", "wedge_terms",
    "weight_wrenches", "wrench_matrices",
]  # fmt: skip
